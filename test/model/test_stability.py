"""Bounds of the stiffness; `tradeoff/test_stability_limits.py` has the limits of states."""

import math

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, SPRINGS_ONLY, FixedSteps, crumple, examples, only, scene_of
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model import stability
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.time_step import stability_limit
from cloth_ros.tradeoff.reference_model import spring_forces, tributary_areas

FAR = 1e12  # m; rest lengths do not count where particles are so far apart


def stiffness_matrix(scene: Scene) -> np.ndarray:
    """
    Return the stiffness matrix of the reference model where the springs are far extended.

    Per mass of a particle, in units of the mass of a cell.
    """
    shape = (3, scene.sheet.rows, scene.sheet.columns)
    columns = []
    for n in range(shape[1] * shape[2]):
        positions = np.zeros(shape)
        positions[0].flat[n] = FAR
        columns.append(-spring_forces(scene, positions, np.zeros(shape))[0].ravel() / FAR)
    scale = 1 / np.sqrt(tributary_areas(*shape[1:]).ravel())
    return scale[:, None] * np.array(columns) * scale


@examples(0.2)
@given(
    rows=st.integers(1, 12),
    columns=st.integers(1, 24),
    weights=st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    | st.tuples(*[st.sampled_from([1.0, 30.0, 500.0])] * 3),
)
def test_the_largest_stiffness_is_exactly_that_of_the_reference_model(rows, columns, weights):
    """Of each type of springs alone, and of all."""
    springs = dict(zip(only(None), weights, strict=True))
    scene = scene_of(sheet__rows=rows, sheet__columns=columns, pins=[''], **springs)
    exact = np.linalg.eigvalsh(stiffness_matrix(scene))[-1]
    found = stability.largest_eigenvalue(rows, columns, weights)
    assert found == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_the_phases_of_a_long_side_are_sampled_finely_enough(monkeypatch):
    sheets = [
        (300, 400, weights) for weights in ((1.0, 0.0, 0.0), (5.0, 2.5, 0.5), (1.0, 9.0, 30.0))
    ]
    sampled = [stability.largest_eigenvalue.__wrapped__(*sheet) for sheet in sheets]
    monkeypatch.setattr(stability, '_SAMPLES', 1000)
    exact = [stability.largest_eigenvalue.__wrapped__(*sheet) for sheet in sheets]
    assert sampled == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('damping', [0.0, 0.02])
@pytest.mark.parametrize(
    ('stretch', 'factor', 'least', 'most'),
    # A flat sheet is soft across its plane, so that a deviation drifts.  Far stretched, springs
    # are stiff in every direction, and the bound is nearly reached.
    [(1.0, 0.9, 0, 1e4), (1.5, 0.9, 0, 30), (30.0, 0.9, 0, 30), (30.0, 1.1, 1e6, np.inf)],
)
def test_deviations_from_equilibrium_grow_above_the_limit(
    stretch, factor, least, most, damping, method
):
    """Sheets that are held all around, with negligible bending springs, which end there."""
    scene = scene_of(
        **{**SPRINGS_ONLY, **NEGLIGIBLE_AIR, 'pins': ['0,:', '-1,:', ':,0', ':,-1']},
        **{'sheet__rows': 12, 'sheet__columns': 12, 'springs__bending': 1e-9},
        **{'springs__damping': damping, 'solver__method': method, 'solver__precision': 'double'},
    )
    step = factor * stability_limit(scene)
    cloth = Cloth(scene, step_control=lambda _: FixedSteps(step), energy_monitor=None)
    cloth.positions = equilibrium = cloth.positions * (stretch, stretch, 1)
    start = np.abs(crumple(cloth, 1e-9).positions - equilibrium).max()
    cloth.advance(1000 * step)
    assert least <= np.abs(cloth.positions - equilibrium).max() / start < most


def test_there_is_no_limit_without_springs_and_pins_have_no_effect_on_it():
    assert stability_limit(scene_of(**only(None))) == math.inf
    assert stability_limit(scene_of(pins=[''])) == stability_limit(scene_of(pins=[':,0']))
