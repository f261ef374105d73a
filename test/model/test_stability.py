"""Bounds of the stiffness of a cloth, and steps up to the limit that follows from them."""

import math

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, SPRINGS_ONLY, VACUUM, FixedSteps, crumple, examples, scene_of
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model import stability
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.time_step import stability_limit
from cloth_ros.tradeoff.reference_model import spring_forces

FAR = 1e12  # m; rest lengths do not count where particles are so far apart


def stiffness_matrix(scene: Scene) -> np.ndarray:
    """Return the stiffness matrix of the reference model where the springs are far extended."""
    rows, columns = scene.sheet.rows, scene.sheet.columns
    count = rows * columns
    matrix = np.empty((count, count))
    for n in range(count):
        positions = np.zeros((3, count))
        positions[0, n] = FAR
        shaped = positions.reshape(3, rows, columns)
        matrix[n] = -spring_forces(scene, shaped, np.zeros_like(shaped))[0].ravel() / FAR
    return matrix


@examples(0.4)
@given(
    rows=st.integers(1, 12),
    columns=st.integers(1, 24),
    stiffness=st.sampled_from([*np.eye(3).tolist(), None]),
    values=st.tuples(*[st.sampled_from([1.0, 30.0, 500.0])] * 3),
)
def test_the_eigenvalue_of_the_reference_model_is_bounded_and_not_by_much(
    rows, columns, stiffness, values
):
    """Of each type of springs alone, and of all."""
    weights = tuple(values if stiffness is None else stiffness)
    springs = {f'springs__{name}': k for name, k in zip(SPRING_TYPES, weights, strict=True)}
    scene = scene_of(sheet__rows=rows, sheet__columns=columns, pins=[''], **springs)
    exact = np.linalg.eigvalsh(stiffness_matrix(scene))[-1]
    found = stability.largest_eigenvalue(rows, columns, weights)
    # Below the exact value by less than the safety factor of the step leaves.
    assert exact * stability.SAFETY <= found <= 1.06 * exact + 1e-9
    assert exact <= stability.gershgorin_bound(rows, columns, weights) + 1e-9


def growth(stretch: float, factor: float, **parameters: object) -> float:
    """
    Return by what factor the deviation from an equilibrium grows in 1000 steps.

    The sheet is stretched and held all around, with negligible bending springs: they end at the
    border and would pull there from one side.  Steps have `factor` times the limit.
    """
    scene = scene_of(
        **{**SPRINGS_ONLY, **NEGLIGIBLE_AIR, 'pins': ['0,:', '-1,:', ':,0', ':,-1']},
        **{'sheet__rows': 12, 'sheet__columns': 12, 'springs__bending': 1e-9},
        **{'solver__precision': 'double', **parameters},
    )
    step = factor * stability_limit(scene)
    cloth = Cloth(scene, step_control=lambda _: FixedSteps(step), energy_monitor=None)
    cloth.positions = equilibrium = cloth.positions * (stretch, stretch, 1)
    start = crumple(cloth, 1e-9).positions
    cloth.advance(1000 * step)
    return np.abs(cloth.positions - equilibrium).max() / np.abs(start - equilibrium).max()


every_case = [
    pytest.param({'solver__method': method, 'springs__damping': damping}, id=f'{method}-{damping}')
    for method in INTEGRATORS
    for damping in (0.0, 0.02)
]


@pytest.mark.parametrize('case', every_case)
@pytest.mark.parametrize('stretch', [1.0, 1.5, 30.0])
def test_the_longest_step_taken_is_stable(stretch, case):
    # A flat sheet is soft across its plane, so that a deviation drifts.
    assert growth(stretch, stability.SAFETY, **case) < (1e4 if stretch == 1 else 30)


@pytest.mark.parametrize('case', every_case)
def test_a_step_slightly_above_the_limit_is_unstable(case):
    """Far stretched, springs are stiff in every direction, and the bound is nearly reached."""
    assert growth(30.0, 1.1, **case) > 1e6


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize(('stretch', 'size'), [(3.0, 1e-3), (0.6, 0.05), (1.0, 0.1)])
def test_violent_motion_does_not_gain_energy(stretch, size, method):
    """Explicit methods at 0.9 of the limit heat these states a hundredfold."""
    cloth = Cloth(
        scene_of(
            **{**SPRINGS_ONLY, 'pins': ['0,:'], 'sheet__rows': 12, 'sheet__columns': 12},
            solver__precision='double',
            solver__method=method,
        )
    )
    cloth.positions = cloth.positions * (stretch, stretch, 1)
    start = crumple(cloth, size, 2).energy()
    cloth.advance(2.0)
    assert 0.7 * start < cloth.energy() < 1.3 * start


def test_there_is_no_limit_without_springs_and_pins_have_no_effect_on_it():
    none = {f'springs__{name}': 0.0 for name in SPRING_TYPES}
    assert stability_limit(scene_of(**VACUUM, **none)) == math.inf
    assert stability_limit(scene_of(pins=[''])) == stability_limit(scene_of(pins=[':,0']))
