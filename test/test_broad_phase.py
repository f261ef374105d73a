"""The broad phase lacks nothing that a search of the whole sheet finds, and seldom searches it."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from reference import distances, triangles

from cloth_ros import Cloth, Scene
from cloth_ros.model.contact import broad_phase
from cloth_ros.model.contact.broad_phase import BroadPhase
from cloth_ros.model.grid import Grid
from cloth_ros.model.state import State

ROUNDING = 2e-6  # m


@contextmanager
def compared() -> Iterator[Counter[str]]:
    """Compare whatever is found with what a search of the whole sheet finds; count both."""
    find, search = BroadPhase.find, broad_phase._search
    counts: Counter[str] = Counter()

    def counted(*arguments):
        counts['searched'] += 1
        return search(*arguments)

    def both(self, state, h, start, end, radius, way):
        counts['found'] += 1
        found = find(self, state, h, start, end, radius, way)
        expected = find(BroadPhase(self._grid_layout), state, h, start, end, radius, way)
        counts['searched'] -= 1  # by the other
        assert np.array_equal(found[0], expected[0])
        assert np.array_equal(found[1], expected[1])
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BroadPhase, 'find', both)
        patch.setattr(broad_phase, '_search', counted)
        yield counts


def throw(cloth: Cloth, seed: int, speed: float, ticks: int = 20) -> None:
    """Throw the sphere about in the middle of the sheet, in a wind that turns."""
    generator = np.random.default_rng(seed)
    middle = np.array(cloth.scene.sheet.position)
    for _ in range(ticks):
        cloth.wind = 3 * generator.normal(size=3)
        way = middle + 0.3 * generator.normal(size=3) - cloth.sphere_position
        way *= min(speed / 60 / np.linalg.norm(way), 1.0)
        cloth.move_sphere(cloth.sphere_position + way)
        cloth.advance(1 / 60)
        clearance = cloth._contact._broad_phase.clearance
        corners = triangles(cloth.positions, both_diagonals=True)
        if clearance > 0 and len(corners):
            distance = distances(corners, cloth.sphere_position).min()
            assert distance - cloth.sphere_radius >= clearance - ROUNDING


@settings(max_examples=50, deadline=None)
@given(
    st.integers(0, 2**31),
    st.integers(1, 12),
    st.integers(1, 12),
    st.sampled_from([0.003, 0.05, 0.3]),
    st.sampled_from([0.1, 1.0, 10.0, 300.0]),
    st.sampled_from(['single', 'double']),
    st.sampled_from(['', '0,0', '0,:', ':,:']),
)
@example(0, 12, 12, 0.3, 1.0, 'single', '0,:')
def test_candidates_lack_nothing(seed, rows, columns, radius, speed, precision, pins):
    values = {
        'sheet.rows': rows,
        'sheet.columns': columns,
        'pins': [pins],
        'sphere.radius': radius,
        'sphere.position': [0.0, 0.0, 0.5],
        'solver.precision': precision,
    }
    with compared():
        throw(Cloth(Scene().with_parameters(values)), seed, speed)


def test_a_sphere_in_touch_seldom_has_the_whole_sheet_searched():
    values = {'sphere.radius': 0.2, 'sphere.position': [0.0, 0.0, 0.7], 'pins': ['']}
    cloth = Cloth(Scene().with_parameters(values))
    with compared() as counts:
        for _ in range(60):
            cloth.advance(1 / 60)
            cloth.move_sphere(np.add(cloth.sphere_position, (0.01, 0.0, 0.005)))
    assert counts['found'] > 1000
    assert counts['searched'] < 0.15 * counts['found']


def test_a_sphere_that_has_become_slow_has_few_candidates():
    # It passes below a sheet at rest, without a touch.
    still = {'gravity': [0.0, 0.0, 0.0], 'wind.air_density': 0.0}
    place = {'sphere.radius': 0.05, 'sphere.position': [-0.3, 0.0, 0.94]}
    cloth = Cloth(Scene().with_parameters(still | place))
    phase = cloth._contact._broad_phase
    cloth.move_sphere((0.0, 0.0, 0.94))
    cloth.advance(0.03)
    many = phase._count
    assert many > 20
    cloth.advance(0.01)
    assert phase._count < 0.5 * many
    assert phase.clearance == pytest.approx(0.01, abs=1e-4)


def test_a_sphere_that_grows_is_watched():
    contact = Cloth(Scene().with_parameters({'sphere.radius': 0.1}))._contact
    state = State(Grid(2, 2), np.float64)
    contact._broad_phase.clearance = 1.0
    assert contact.is_clear(state, 1e-3, 1.0)
    contact.radius = 0.05
    assert not contact.is_clear(state, 1e-3, 1.0)
