"""The list of near pairs misses none, by sampled distances of all pairs of features."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from self_intersection import sheet_triangles

from bench.layers import folded, folded_again
from bench.self_contact import towel
from cloth_ros import Cloth
from cloth_ros.model.grid import Grid
from cloth_ros.model.kernels.thread_pool import shared_thread_pool
from cloth_ros.model.self_contact import neighbours as neighbours_module
from cloth_ros.model.self_contact.contact_search import REACH
from cloth_ros.model.self_contact.neighbours import Neighbours
from cloth_ros.model.state import State

Array = NDArray[Any]
ROWS, COLUMNS, SIZE, THICKNESS = 14, 18, (0.34, 0.26), 0.004
SPACING = SIZE[0] / (COLUMNS - 1)
SHARES = np.linspace(0.0, 1.0, 5)
WEIGHTS = np.array([w for w in itertools.product(SHARES, repeat=3) if np.isclose(sum(w), 1.0)])


def near_pairs(positions: Array, reach: float) -> set[tuple[int, ...]]:
    """Return pairs whose sampled distance is less than `reach`, m, by their sorted particles."""
    points = positions.reshape(-1, 3)
    triangles = sheet_triangles(ROWS, COLUMNS)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    vertices = np.arange(len(points))[:, None]
    middles = np.stack([1.0 - SHARES, SHARES], axis=1)
    found = set()
    for first, second, mine, others in (
        (vertices, triangles, np.ones((1, 1)), WEIGHTS),
        (edges, edges, middles, middles),
    ):
        b = np.einsum('sk,mkx->msx', others, points[second])
        for feature in first:
            a = mine @ points[feature]
            distance = np.linalg.norm(b[:, None] - a[None, :, None], axis=-1).min(axis=(1, 2))
            for other in second[distance < reach]:
                if not set(feature.tolist()) & set(other.tolist()):
                    found.add(form(feature.tolist(), other.tolist()))
    return found


def form(first: list[int], second: list[int]) -> tuple[int, ...]:
    """Return a pair of features in one form, whatever the order of features and particles."""
    return tuple(
        itertools.chain(*sorted((sorted(first), sorted(second)), key=lambda f: (len(f), f)))
    )


def listed_pairs(near: Neighbours) -> set[tuple[int, ...]]:
    """Return the pairs of a list in the same form."""
    found = set()
    for number, (first, last) in enumerate(near.list.groups[:, :2].tolist()):
        cut = 1 if number < near.list.vertices else 2
        found.update(form(pair[:cut], pair[cut:]) for pair in near.list.pairs[first:last].tolist())
    return found


SHEETS = {
    'folded': lambda: folded(ROWS, COLUMNS, SIZE, THICKNESS),
    'folded twice': lambda: folded_again(folded(ROWS, COLUMNS, SIZE, THICKNESS), THICKNESS),
}


def missing_pairs(near: Neighbours, state: State) -> int:
    """Return how many pairs in reach are not in the list; there are some in reach."""
    expected = near_pairs(state.world_positions.transpose(1, 2, 0), REACH * THICKNESS)
    assert len(expected) > 0
    return len(expected - listed_pairs(near))


def sheet_and_list(name: str) -> tuple[Grid, State, Neighbours]:
    """Return a sheet, by name, and an empty list for it."""
    grid = Grid(ROWS, COLUMNS)
    state = State(grid, np.float32)
    state.world_positions = np.moveaxis(SHEETS[name](), -1, 0)
    pool = shared_thread_pool(1)
    return grid, state, Neighbours(grid, np.float32, THICKNESS, SPACING, 0.5 * SPACING, pool)


@pytest.mark.parametrize('name', list(SHEETS))
def test_lists_are_complete(name: str) -> None:
    random = np.random.default_rng(0)
    grid, state, near = sheet_and_list(name)
    renewed = []
    # The motion of each part, as a share of the thickness: slow ones, then fast ones.
    for share in (0.0, 0.01, 0.02, 0.05, 0.1, 0.1, 0.3, 1.0):
        before = state.position.copy()
        noise = random.normal(size=(3, ROWS, COLUMNS))
        grid.interior(state.position)[...] += share * THICKNESS * noise
        renewed.append(near.follow(before, state.position, 1.0))
        near.prepare(state.position, state.velocity, 0.005)
        assert missing_pairs(near, state) == 0
    assert not all(renewed[1:4])


@pytest.mark.parametrize('name', list(SHEETS))
def test_lists_that_are_renewed_in_places_are_complete(name: str) -> None:
    random = np.random.default_rng(1)
    grid, state, near = sheet_and_list(name)
    near.prepare(state.position, state.velocity, 0.005)
    in_places = 0
    for _ in range(10):
        # All of it moves together, a little of it apart, and a corner of a fold a lot.
        before, motion = state.position.copy(), np.zeros((3, ROWS, COLUMNS))
        motion[:] = random.normal(size=(3, 1, 1))
        motion += 0.01 * random.normal(size=motion.shape)
        row, column = random.integers(0, ROWS - 2), random.integers(0, COLUMNS - 2)
        motion[:, row : row + 2, column : column + 2] += random.normal(size=(3, 1, 1))
        grid.interior(state.position)[...] += 0.5 * THICKNESS * motion
        in_places += near.follow(before, state.position, 1.0) is True and not near.whole
        assert missing_pairs(near, state) == 0
    assert in_places > 2


def test_results_do_not_depend_on_where_a_list_is_renewed(monkeypatch: pytest.MonkeyPatch) -> None:
    results = []
    for whole in (False, True):
        if whole:
            monkeypatch.setattr(neighbours_module, '_WHOLE', 0.0)
        cloth = Cloth(towel(20, THICKNESS))
        cloth.positions = folded(20, 20, (0.6, 0.6), 2 * THICKNESS)
        cloth.advance(0.4)
        near = cloth._simulation.interactions.self_contact._neighbours  # type: ignore[union-attr]
        assert near.renewals > 3
        results.append(cloth.positions)
    np.testing.assert_array_equal(*results)
