"""Stability limits predicted from the tangent stiffness, beside those of real substeps."""

import math

import numpy as np
import pytest

from cloth_ros import Scene
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.stability import SAFETY
from cloth_ros.tradeoff import measured_stability
from cloth_ros.tradeoff.measured_stability import compare, measured_limit, states
from cloth_ros.tradeoff.tangent_stiffness import stability_limit

SHEETS = {
    'undamped': {},
    'slightly damped': {'springs.damping': 0.03},
    'limited by damping': {'springs.damping': 1.0, 'sheet.size': [0.3, 1.0]},
    'stiff in bending, oblong': {'springs.bending': 5e4, 'sheet.size': [3.0, 1.0]},
    'stiff in shear': {'springs.structural': 1.0, 'springs.shear': 500.0},
    'a strip': {'sheet.rows': 2, 'springs.damping': 0.03, 'pins': ['0,0']},
}


@pytest.mark.parametrize('method', INTEGRATORS)
@pytest.mark.parametrize('sheet', SHEETS)
def test_the_prediction_holds_in_every_state(sheet, method):
    scene = Scene().with_parameters({'sheet.rows': 4, 'sheet.columns': 5, **SHEETS[sheet]})
    for state in states(scene):
        row = compare(scene, method, state)
        assert row.predicted == pytest.approx(row.measured, rel=0.05), row
        # Neither the limit of the state nor that of all states is too long.
        assert SAFETY * row.predicted <= row.measured, row
        assert SAFETY * row.bound <= row.measured, row


def test_of_a_large_sheet_a_part_is_measured_that_has_the_same_limit(monkeypatch):
    monkeypatch.setattr(measured_stability, '_LARGEST', 8)
    scene = Scene().with_parameters({'sheet.rows': 13, 'sheet.columns': 12})
    row = compare(scene, 'auto', 'undeformed')
    assert (row.rows, row.columns) == (8, 8)
    whole = stability_limit(scene, states(scene)['undeformed'])
    assert row.measured == pytest.approx(whole, rel=0.02)


@pytest.mark.parametrize('method', INTEGRATORS)
def test_a_single_mass_is_stable_up_to_two_over_its_frequency(method):
    row = {'sheet.rows': 1, 'sheet.columns': 2, 'pins': ['0,0'], 'solver.method': method}
    for stiffness in (50.0, 200.0):
        scene = Scene().with_parameters({**row, 'springs.structural': stiffness})
        expected = 2 / math.sqrt(stiffness / scene.sheet.particle_mass)
        positions = states(scene)['undeformed']
        assert measured_limit(scene, positions) == pytest.approx(expected, rel=0.01)
        assert stability_limit(scene, positions) == pytest.approx(expected, rel=1e-3)


def test_buckling_does_not_count_as_instability():
    """A compressed sheet bulges at any substep; the limit is that of its stiff modes."""
    scene = Scene().with_parameters({'sheet.rows': 6, 'sheet.columns': 7})
    compressed = 0.6 * states(scene)['undeformed']
    limit = measured_limit(scene, compressed)
    assert np.isfinite(limit)
    assert stability_limit(scene, compressed) == pytest.approx(limit, rel=0.05)


def test_what_cannot_move_has_no_limit():
    scene = Scene().with_parameters({'sheet.rows': 3, 'sheet.columns': 3, 'pins': [':,:']})
    assert measured_limit(scene, states(scene)['undeformed']) == math.inf
