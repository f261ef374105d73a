"""No triangles of a sheet intersect, by a test that knows nothing of the model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from builders import scene_of
from self_intersection import intersecting_edges

from bench.layers import folded, twisted
from bench.self_contact import four_layers
from cloth_ros import Cloth

TICK = 1 / 60
SOFT = {
    'springs__structural': 200.0,
    'springs__shear': 50.0,
    'springs__bending': 2.0,
    'sheet__mass': 0.1,
    'wind__air_density': 0.0,
}
TABLE = {'names': ['table'], 'table': {'type': 'plane', 'friction': 0.5}}


def sheet(side: int, size: float = 0.6, thickness: float = 0.004, **parameters: object) -> Cloth:
    return Cloth(
        scene_of(
            **SOFT,
            **{
                'sheet__rows': side,
                'sheet__columns': side,
                'sheet__size': (size, size),
                'pins': [''],
                'self_contact__thickness': thickness,
                **parameters,
            },
        )
    )


def check(cloth: Cloth, ticks: int, before_tick: Callable[[int], None] | None = None) -> None:
    """Advance, and assert after each tick that nothing intersects."""
    for tick in range(ticks):
        if before_tick is not None:
            before_tick(tick)
        cloth.advance(TICK)
        found = intersecting_edges(cloth.positions)
        assert len(found) == 0, f'{len(found)} intersections after tick {tick}'
    assert cloth.rollbacks.held == 0


def test_intersections_are_found() -> None:
    """The independent test finds layers that cross, and nothing where they do not."""
    positions = folded(9, 16, (0.6, 0.3), 0.05)
    assert len(intersecting_edges(positions)) == 0
    positions[4, -3, 2] = -0.01
    assert len(intersecting_edges(positions)) > 0


@pytest.mark.parametrize(
    'seed', [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 4))]
)
def test_sheet_dropped_on_its_folded_self(seed: int) -> None:
    random = np.random.default_rng(seed)
    cloth = sheet(20, collider=TABLE)
    start = folded(20, 20, (0.6, 0.6), random.uniform(0.008, 0.15))
    start[..., 2] += 0.02
    cloth.positions = start
    cloth.velocities = random.normal(scale=0.3, size=start.shape) * (seed > 0)
    check(cloth, 90)


def test_sheet_that_falls_on_its_edge() -> None:
    cloth = sheet(
        20,
        collider=TABLE,
        sheet__position=(0.0, 0.0, 0.35),
        sheet__orientation=(0.7071, 0.02, 0.03, 0.7071),
    )
    check(cloth, 60)


@pytest.mark.slow
def test_twisted_strip() -> None:
    rows, columns, size = 8, 40, (0.6, 0.11)
    cloth = sheet(
        rows,
        sheet__columns=columns,
        sheet__size=size,
        pins=['0:8,0', '0:8,-1'],
        gravity=(0.0, 0.0, -2.0),
    )
    cloth.positions = twisted(rows, columns, size, 3.0)
    check(cloth, 120)


@pytest.mark.slow
def test_sheet_between_two_cylinders() -> None:
    """Held in the middle, while two cylinders move up beside it: pulled through their gap."""
    apart, radius = 0.039, 0.03
    sides = {'left': -apart, 'right': apart}
    cylinder = {'type': 'cylinder', 'radius': radius, 'length': 0.8, 'friction': 0.2}
    colliders = {
        name: {**cylinder, 'position': (x, 0.0, 0.2), 'orientation': (0.7071, 0.0, 0.0, 0.7071)}
        for name, x in sides.items()
    }
    cloth = sheet(
        24,
        size=0.4,
        sheet__position=(0.0, 0.0, 0.25),
        pins=['9:15,11:13'],
        collider={'names': list(sides), **colliders},
    )

    def lift(tick: int) -> None:
        for name, x in sides.items():
            cloth.move_collider(name, (x, 0.0, 0.2 + 0.0025 * min(tick, 110)))

    check(cloth, 130, lift)


@pytest.mark.slow
def test_four_layers_that_come_to_rest() -> None:
    """Blocked paths are examined again even if moving their particles back changed nothing."""
    check(four_layers(32), 30)
