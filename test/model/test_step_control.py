"""Substeps that follow the present state of a cloth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.present_stiffness import PresentStiffness
from cloth_ros.model.stability import rate_bounds
from cloth_ros.model.step_control import AdaptiveStepControl
from cloth_ros.tradeoff.eigenvalues import largest_eigenvalue
from cloth_ros.tradeoff.tangent_stiffness import TangentStiffness
from test.builders import cloth_of, examples, scene_of

CORNERS = ('0,0', '0,-1', '-1,0', '-1,-1')


def bound(cloth: Cloth) -> float:
    return PresentStiffness(cloth.scene).bound(cloth._simulation.state)


def stiffness(cloth: Cloth) -> float:
    """Return the largest eigenvalue of the stiffness per unit mass, 1/s²."""
    tangent = TangentStiffness(cloth.scene, np.moveaxis(cloth.positions, -1, 0)).stiffness
    start = np.random.default_rng(0).standard_normal(tangent.shape[0])
    return largest_eigenvalue(tangent.dot, start, 1e-6, symmetric=True).real


def test_the_bound_of_a_flat_sheet_is_that_of_an_unbounded_one():
    cloth = cloth_of(sheet__rows=9, sheet__columns=9, solver__precision='double')
    springs, mass = cloth.scene.springs, cloth.scene.sheet.cell_mass
    expected = 4 * (springs.structural + springs.shear + springs.bending) / mass
    assert bound(cloth) == pytest.approx(expected, rel=1e-12)
    assert 0.9 * bound(cloth) < stiffness(cloth) < bound(cloth)
    assert bound(cloth) < 0.8 * rate_bounds(cloth.scene)[0]


@examples(1)
@given(st.data())
def test_no_state_is_stiffer_than_its_bound(data):
    weights = st.just(0.0) | st.floats(1.0, 1000.0)
    scene = scene_of(
        sheet__rows=data.draw(st.integers(2, 6)),
        sheet__columns=data.draw(st.integers(2, 6)),
        sheet__size=[data.draw(st.floats(0.2, 2.0)), data.draw(st.floats(0.2, 2.0))],
        springs__structural=data.draw(st.floats(1.0, 1000.0)),
        springs__shear=data.draw(weights),
        springs__bending=data.draw(weights),
        pins=CORNERS,
        solver__precision='double',
    )
    cloth = Cloth(scene)
    random = np.random.default_rng(data.draw(st.integers(0, 999)))
    scale = data.draw(st.sampled_from([1e-3, 0.03, 0.3, 3.0]))
    cloth.positions = cloth.positions + scale * random.standard_normal(cloth.positions.shape)
    if scene.pinned().all():
        return
    assert stiffness(cloth) <= bound(cloth) * (1 + 1e-6)


def test_substeps_are_as_long_as_the_state_allows_and_change_rarely():
    cloth = cloth_of(sheet__rows=48, sheet__columns=48)
    lengths = []
    for _ in range(180):
        cloth.advance(1 / 60)
        lengths.append(cloth.substep)
    assert cloth.rollbacks.text == ''
    assert np.count_nonzero(np.diff(lengths)) < 12
    every_state = 2 / np.sqrt(rate_bounds(cloth.scene)[0])
    assert 0.95 * every_state < lengths[-1] < 1.15 * every_state
    # What is folded, or stretched, allows less.
    cloth.positions = cloth.positions * np.array([1.0, 0.02, 1.0])
    cloth.advance(1e-3)
    assert cloth.substep < lengths[-1]


def test_a_rejected_batch_shortens_substeps_to_what_is_stable_in_every_state():
    scene = scene_of(sheet__rows=48, sheet__columns=48)
    control, state = AdaptiveStepControl(scene), Cloth(scene)._simulation.state
    stable = control.substep
    control.begin(state, 0.0)
    longer = control.substep
    assert longer > 1.1 * stable
    assert control.shorten(0.0)
    assert control.substep == stable
    assert not control.shorten(0.0)
    times = np.arange(1, 200) / 60
    found = []
    for time in times:
        control.adapt(state, time)
        found.append(control.substep)
    assert found[0] == stable
    assert found[-1] == longer
    later = AdaptiveStepControl(scene)
    later.restore(control.account())
    assert later.account() == control.account()
    # Of a stiffer scene it would not be stable.
    stiff = AdaptiveStepControl(scene.with_parameters({'springs.structural': 5000.0}))
    start = stiff.account()
    stiff.restore(control.account())
    assert stiff.account() == start


@pytest.mark.slow
def test_a_flag_gains_no_energy_from_changes_of_its_substeps():
    # With substeps that were divided whenever its end was fast, this was 3 to 10 times too much.
    scene = Scene.from_yaml('config/flag.yaml').with_parameters(
        {'sheet.rows': 40, 'sheet.columns': 40}
    )

    def kinetic_energy(**solver: object) -> float:
        cloth = Cloth(scene.with_parameters({f'solver.{name}': v for name, v in solver.items()}))
        cloth.advance(2.0)
        found = []
        for _ in range(80):
            cloth.advance(0.1)
            found.append(cloth.energy_by_kind().kinetic)
        return float(np.mean(found))

    assert kinetic_energy() == pytest.approx(kinetic_energy(substeps=300), rel=0.25)
