"""The list of near pairs misses none, by sampled distances of all pairs of features."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from self_intersection import sheet_triangles

from bench.layers import folded, folded_again
from cloth_ros.model.grid import Grid
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
    first = near.groups[near.vertices, 0]
    cuts = [1] * first + [2] * (len(near.pairs) - first)
    return {
        form(pair[:cut], pair[cut:]) for pair, cut in zip(near.pairs.tolist(), cuts, strict=True)
    }


SHEETS = {
    'folded': lambda: folded(ROWS, COLUMNS, SIZE, THICKNESS),
    'folded twice': lambda: folded_again(folded(ROWS, COLUMNS, SIZE, THICKNESS), THICKNESS),
}


@pytest.mark.parametrize('name', list(SHEETS))
def test_lists_are_complete(name: str) -> None:
    random = np.random.default_rng(0)
    grid = Grid(ROWS, COLUMNS)
    state = State(grid, np.float32)
    near = Neighbours(grid, np.float32, THICKNESS, SPACING, 0.5 * SPACING)
    state.world_positions = np.moveaxis(SHEETS[name](), -1, 0)
    renewed = []
    # The motion of each part, as a share of the thickness: slow ones, then fast ones.
    for share in (0.0, 0.01, 0.02, 0.05, 0.1, 0.1, 0.3, 1.0):
        before = state.position.copy()
        noise = random.normal(size=(3, ROWS, COLUMNS))
        grid.interior(state.position)[...] += share * THICKNESS * noise
        renewed.append(near.follow(before, state.position, 1.0))
        near.prepare(state.position, state.velocity, 0.005)
        expected = near_pairs(state.world_positions.transpose(1, 2, 0), REACH * THICKNESS)
        assert len(expected) > 0
        missing = expected - listed_pairs(near)
        assert not missing, f'{len(missing)} of {len(expected)} pairs are missing'
    assert not all(renewed[1:4])
