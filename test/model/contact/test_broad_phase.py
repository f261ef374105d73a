"""The broad phase finds what a search of the whole sheet finds, and seldom searches it."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from builders import cloth_of, examples, precisions, seeds
from geometry import triangle_distances, triangles
from hypothesis import example, given
from hypothesis import strategies as st

from cloth_ros.model.contact import broad_phase
from cloth_ros.model.contact.broad_phase import BroadPhase

ROUNDING = 2e-6  # m


@contextmanager
def compared_with_full_search() -> Iterator[Counter[str]]:
    """Compare all candidates with those of a new search of the whole sheet; count both."""
    find, search = BroadPhase.find, broad_phase._search
    counts: Counter[str] = Counter()

    def counted(*arguments):
        counts['searched'] += 1
        return search(*arguments)

    def both(self, *arguments):
        counts['found'] += 1
        found, new = find(self, *arguments), BroadPhase(self._grid)
        for one, other in zip(found, find(new, *arguments), strict=True):
            assert np.array_equal(one, other)
        counts['searched'] -= 1  # by the new one
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BroadPhase, 'find', both)
        patch.setattr(broad_phase, '_search', counted)
        yield counts


@examples(0.15)
@given(
    seed=seeds,
    sides=st.tuples(st.integers(3, 12), st.integers(3, 12)),
    radius=st.sampled_from([0.003, 0.05, 0.3]),
    speed=st.sampled_from([0.1, 1.0, 10.0, 300.0]),
    precision=precisions,
    pins=st.sampled_from(['', '0,0', '0,:', ':,:']),
)
@example(0, (12, 12), 0.3, 1.0, 'single', '0,:')
def test_candidates_are_those_of_a_full_search(seed, sides, radius, speed, precision, pins):
    """While the sphere is thrown about in the middle of the sheet, in a wind that turns."""
    sheet = {'sheet__rows': sides[0], 'sheet__columns': sides[1], 'pins': [pins]}
    sphere = {'sphere__radius': radius, 'sphere__position': [0.0, 0.0, 0.5]}
    cloth = cloth_of(**sheet, **sphere, solver__precision=precision)
    generator = np.random.default_rng(seed)
    with compared_with_full_search():
        for _ in range(12):
            cloth.wind = 3 * generator.normal(size=3)
            way = (0, 0, 1) + 0.3 * generator.normal(size=3) - cloth.sphere_position
            way *= min(speed / 60 / np.linalg.norm(way), 1.0)
            cloth.move_sphere(cloth.sphere_position + way)
            cloth.advance(1 / 60)
            corners, clearance = triangles(cloth.positions), cloth.colliders['sphere'].clearance
            if clearance > 0:
                distance = triangle_distances(corners, cloth.sphere_position).min()
                assert distance - cloth.sphere_radius >= clearance - ROUNDING


def test_the_whole_sheet_is_seldom_searched_while_the_sphere_touches_it():
    cloth = cloth_of(sphere__radius=0.02, sphere__position=[0.0, 0.0, 0.97], pins=[''])
    with compared_with_full_search() as counts:
        for _ in range(40):
            cloth.advance(1 / 60)
            cloth.move_sphere(np.add(cloth.sphere_position, (0.01, 0.0, 0.005)))
    assert counts['found'] > 500
    assert counts['searched'] < 0.15 * counts['found']
