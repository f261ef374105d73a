import gc
import math
import weakref

import numpy as np
import pytest

from cloth_ros import Cloth, Scene

SMALL = Scene(sheet={'rows': 6, 'columns': 7})


def test_the_sheet_starts_flat_where_it_is_put():
    turned = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # columns then run along +y
    sheet = {'rows': 3, 'columns': 5, 'size': (2.0, 1.0), 'position': (1, 2, 3)}
    p = Cloth(Scene(sheet=sheet)).positions
    assert p.shape == (3, 5, 3)
    np.testing.assert_allclose(p[0, 0], (0, 1.5, 3), atol=1e-6)
    np.testing.assert_allclose(p[0, -1], (2, 1.5, 3), atol=1e-6)
    np.testing.assert_allclose(p[-1, 0], (0, 2.5, 3), atol=1e-6)
    q = Cloth(Scene(sheet={**sheet, 'orientation': turned})).positions
    np.testing.assert_allclose(q[0, -1] - q[0, 0], (0, 2, 0), atol=1e-6)
    np.testing.assert_allclose(q[-1, 0] - q[0, 0], (-1, 0, 0), atol=1e-6)


def test_far_from_the_origin_single_precision_is_no_worse():
    near = Cloth(SMALL)
    far = Cloth(SMALL.with_parameters({'sheet.position': [1e5, -1e5, 1e5]}))
    for cloth in (near, far):
        cloth.advance(0.5)
    shift = np.array((1e5, -1e5, 1e5 - 1))
    np.testing.assert_allclose(far.positions - shift, near.positions, atol=1e-9)


def test_a_sheet_that_falls_far_keeps_its_precision():
    changes = {'pins': [''], 'gravity': [0, 0, 0], 'wind.air_density': 0.0, 'drag': 0.0}
    cloth = Cloth(SMALL.with_parameters(changes))
    cloth.velocities = np.broadcast_to((300.0, 0, -500.0), (6, 7, 3))
    start = cloth.positions
    cloth.advance(20.0)
    np.testing.assert_allclose(cloth.positions.mean((0, 1)), (6000, 0, -9999), atol=0.1)
    assert cloth.largest_strain() < 5e-3
    cloth.reset()
    assert np.array_equal(cloth.positions, start)


def test_two_runs_have_the_same_bits_and_so_has_one_after_a_reset():
    first, second = Cloth(SMALL), Cloth(SMALL)
    for cloth in (first, second):
        cloth.wind = (1, 2, 3)
        for _ in range(20):
            cloth.advance(1 / 60)
    assert np.array_equal(first.positions, second.positions)
    once = first.positions
    first.reset()
    assert first.time == 0
    assert first.wind == (0, 0, 0)
    first.wind = (1, 2, 3)
    for _ in range(20):
        first.advance(1 / 60)
    assert np.array_equal(first.positions, once)


def test_time_is_what_was_advanced():
    cloth = Cloth(SMALL)
    for seconds in (1 / 60, 0.0, 1e-6, 0.37, 2.0):
        before = cloth.time
        cloth.advance(seconds)
        assert cloth.time == before + seconds


@pytest.mark.parametrize('seconds', [-1.0, math.nan, math.inf, 1e300])
def test_time_that_cannot_be_is_refused(seconds):
    with pytest.raises(ValueError, match='seconds is'):
        Cloth(SMALL).advance(seconds)


def test_substeps_fill_the_tick_and_respect_the_limit():
    for rate in (1.0, 30.0, 60.0, 97.3, 1000.0):
        cloth = Cloth(SMALL.with_parameters({'rate': rate}))
        count = 1 / rate / cloth.substep
        assert count == pytest.approx(round(count))
        assert cloth.substep < cloth.stability_limit
        cloth.advance(1 / rate)
        assert cloth.substeps == round(count)
    assert Cloth(SMALL.with_parameters({'solver.substeps': 77})).substep == 1 / 60 / 77


def test_a_tighter_tolerance_takes_more_substeps_and_is_closer():
    reference = Cloth(
        Scene().with_parameters({'solver.substeps': 2000, 'solver.precision': 'double'})
    )
    reference.advance(0.5)
    errors = []
    for tolerance in (0.01, 0.001, 0.0001):
        cloth = Cloth(
            Scene().with_parameters({'solver.tolerance': tolerance, 'solver.precision': 'double'})
        )
        cloth.advance(0.5)
        errors.append(np.linalg.norm(cloth.positions - reference.positions, axis=-1).max())
        assert errors[-1] < 1.5 * tolerance
    assert errors == sorted(errors, reverse=True)


def test_arrays_are_copies_that_say_so():
    cloth = Cloth(SMALL)
    with pytest.raises(ValueError, match='read-only'):
        cloth.positions[0, 0] = 0
    moved = cloth.positions + 1.0
    cloth.positions = moved
    np.testing.assert_allclose(cloth.positions, moved, atol=1e-6)
    for wrong in (np.zeros((7, 6, 3)), np.full((6, 7, 3), np.nan)):
        with pytest.raises(ValueError, match='positions is'):
            cloth.positions = wrong


@pytest.mark.parametrize('wind', [(1, 2), (1, 2, math.nan), (0, 0, 1e5), 'north', None])
def test_wind_that_cannot_be_is_refused_and_the_old_one_holds(wind):
    cloth = Cloth(SMALL)
    cloth.wind = (1, 2, 3)
    with pytest.raises(ValueError, match=r'wind is .*-10000 to 10000 m/s'):
        cloth.wind = wind
    assert cloth.wind == (1, 2, 3)


def test_a_running_cloth_takes_a_new_scene_without_a_jerk():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    p, v = cloth.positions, cloth.velocities
    cloth.configure(SMALL.with_parameters({'springs.shear': 0.0, 'solver.precision': 'double'}))
    assert np.array_equal(cloth.positions, p)
    assert np.array_equal(cloth.velocities, v)
    cloth.advance(0.1)
    assert not np.array_equal(cloth.positions, p)


def test_pins_set_while_running_hold_particles_where_they_are():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    before = cloth.positions
    cloth.configure(SMALL.with_parameters({'pins': ['-1,:']}))
    cloth.advance(0.1)
    assert np.array_equal(cloth.positions[-1], before[-1])
    assert not np.array_equal(cloth.positions[0, 0], before[0, 0])


def test_the_sheet_cannot_change_while_running():
    with pytest.raises(ValueError, match=r'sheet\.rows is 5.*new Cloth'):
        Cloth(SMALL).configure(SMALL.with_parameters({'sheet.rows': 5}))


def test_energy_is_the_sum_of_its_kinds():
    cloth = Cloth(
        Scene(sheet={'rows': 1, 'columns': 2, 'mass': 3.0, 'position': (0, 0, 2)}, pins=[''])
    )
    cloth.positions = np.array([[[0, 0, 2], [0, 0, 3.5]]])
    cloth.velocities = np.array([[[0, 0, 0], [0, 2, 0]]])
    by_kind = cloth.energy_by_kind()
    assert by_kind.kinetic == pytest.approx(0.5 * 1.5 * 4)
    assert by_kind.elastic == pytest.approx(0.5 * 500 * 0.5**2)
    assert by_kind.gravitational == pytest.approx(1.5 * 9.81 * 5.5)
    assert cloth.energy() == pytest.approx(sum(by_kind))
    assert cloth.largest_strain() == pytest.approx(0.5)


@pytest.mark.parametrize(('rows', 'columns'), [(1, 1), (1, 5), (5, 1), (2, 2), (3, 1), (200, 3)])
def test_sheets_of_every_shape_run(rows, columns):
    cloth = Cloth(Scene(sheet={'rows': rows, 'columns': columns}, pins=['0,0']))
    cloth.wind = (3, 0, 1)
    cloth.advance(0.2)
    assert np.isfinite(cloth.positions).all()
    assert cloth.largest_strain() < 1.0


def test_a_sheet_set_far_away_keeps_its_shape():
    """Single precision resolves 6 cm at a distance of 1000 km."""
    cloth = Cloth(SMALL)
    moved = cloth.positions + np.array([1e6, -1e6, 1e3])
    cloth.positions = moved
    assert np.abs(cloth.positions - moved).max() < 1e-6
    cloth.advance(0.1)
    assert cloth.largest_strain() < 0.1
    assert np.array_equal(cloth.positions, cloth.positions)


def test_what_is_no_scene_and_no_division_is_refused():
    with pytest.raises(ValueError, match=r'scene is None, but must be a cloth_ros\.Scene'):
        Cloth(SMALL).configure(None)
    with pytest.raises(ValueError, match='finer is 0, but must be 1 to 1000'):
        Cloth(SMALL, finer=0)


def test_what_a_scene_needed_is_freed_with_it():
    """At once: arrays of NumPy do not make the garbage collector run."""
    cloth = Cloth(SMALL)
    cloth.advance(0.1)
    gc.disable()
    try:
        before = weakref.ref(cloth._kick_drift)
        cloth.configure(SMALL.with_parameters({'springs.bending': 5.0}))
        assert before() is None
    finally:
        gc.enable()


def test_substeps_have_one_length_however_late_it_is():
    """Times are rounded, but each other length would be one more table of passes."""
    cloth = Cloth(SMALL)
    for _ in range(3000):
        cloth.advance(1 / 60)
    assert len(cloth._kick_drift._tables) < 10
