"""The stability limit that is predicted, beside the one that is measured on real steps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.stability import SAFETY
from cloth_ros.tradeoff.measured_stability import compare, measured_limit, states
from cloth_ros.tradeoff.tangent_stiffness import stability_limit

every_method = pytest.mark.parametrize('method', INTEGRATORS)


def check(scene: Scene, method: str) -> None:
    for state in states(scene):
        row = compare(scene, method, state)
        assert row.predicted == pytest.approx(row.measured, rel=0.1), row
        # Neither what is predicted for the state nor what is taken in every state breaks.
        assert SAFETY * row.predicted <= row.measured, row
        assert SAFETY * row.bound <= row.measured, row


@every_method
@pytest.mark.parametrize('damping', [0.0, 0.03, 1.0])
def test_the_prediction_holds_in_every_state(damping, method):
    scene = Scene().with_parameters(
        {'sheet.rows': 10, 'sheet.columns': 12, 'springs.damping': damping}
    )
    check(scene, method)


@every_method
@settings(max_examples=8, deadline=None)
@given(
    rows=st.integers(1, 9),
    columns=st.integers(2, 9),
    stiffness=st.tuples(
        st.sampled_from([1.0, 500.0]), st.sampled_from([0.0, 250.0]), st.sampled_from([0.0, 5e4])
    ),
    damping=st.sampled_from([0.0, 0.01, 0.3]),
    width=st.floats(0.3, 3.0),
)
def test_the_prediction_holds_for_any_sheet(rows, columns, stiffness, damping, width, method):
    structural, shear, bending = stiffness
    scene = Scene().with_parameters(
        {
            'sheet.rows': rows,
            'sheet.columns': columns,
            'sheet.size': [width, 1.0],
            'springs.structural': structural,
            'springs.shear': shear,
            'springs.bending': bending,
            'springs.damping': damping,
        }
    )
    if not scene.pinned().all():
        check(scene, method)


@every_method
def test_four_times_the_stiffness_halves_the_limit(method):
    changes = {'sheet.rows': 6, 'sheet.columns': 6, 'solver.method': method}
    scene = Scene().with_parameters(changes)
    stiffer = scene.with_parameters(
        {
            f'springs.{name}': 4 * scene.flat()[f'springs.{name}']
            for name in ('structural', 'shear', 'bending')
        }
    )
    positions = states(scene)['undeformed']
    soft, stiff = (measured_limit(each, positions) for each in (scene, stiffer))
    assert stiff == pytest.approx(soft / 2, rel=0.02)


def test_a_single_mass_breaks_where_the_formula_says():
    changes = {'sheet.rows': 1, 'sheet.columns': 2, 'pins': ['0,0'], 'springs.structural': 50.0}
    scene = Scene().with_parameters(changes)
    expected = 2 / math.sqrt(50.0 / scene.sheet.particle_mass)
    positions = states(scene)['undeformed']
    assert measured_limit(scene, positions) == pytest.approx(expected, rel=0.01)
    assert stability_limit(scene, positions) == pytest.approx(expected, rel=1e-3)


def test_buckling_is_not_taken_for_a_method_that_breaks():
    """A sheet that is pressed flat bulges, at any step; the limit is that of its stiff modes."""
    scene = Scene().with_parameters({'sheet.rows': 8, 'sheet.columns': 8})
    pressed = 0.6 * states(scene)['undeformed']
    limit = measured_limit(scene, pressed)
    assert np.isfinite(limit)
    assert stability_limit(scene, pressed) == pytest.approx(limit, rel=0.1)
