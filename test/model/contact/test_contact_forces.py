"""Forces of contact: weight, moments, momentum, energy, rest."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import (
    NEGLIGIBLE_AIR,
    PRECISIONS,
    cloth_of,
    crumple,
    examples,
    mean_by_mass,
    momentum,
    seeds,
)
from colliders import CLOSED, NAME, each_shape, solid, turn
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth

WEIGHT = 0.2 * 9.81  # N, of the sheet by default
SHEET = {'rows': 14, 'columns': 14, 'size': (0.3, 0.3)}


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


@pytest.mark.parametrize('shape', each_shape())
@pytest.mark.parametrize('precision', PRECISIONS)
def test_a_collider_carries_the_weight_of_a_sheet_at_rest(folder, shape, precision):
    """The moment about the origin of the collider is that of the weight in the centre of mass."""
    body = solid(shape, 0.12, folder)
    lying = shape in ('capsule', 'cylinder')
    turned = turn((1, 0, 0), math.pi / 2) if lying else (0, 0, 0, 1)
    top = 0.12 if lying else body.top
    # An angle section carries a sheet over its corner.
    place = (0.04, 0.04, 0.5 - top) if shape == 'mesh' else (0, 0, 0.5 - top)
    cloth = cloth_of(
        sheet={**SHEET, 'position': (0, 0, 0.502)}, pins=[''], solver__precision=precision,
        drag=8.0, **NEGLIGIBLE_AIR, **body.scene(place, turned, 1.0),
    )  # fmt: skip
    cloth.advance(4.0)
    cloth.advance(1.0)
    force, torque = cloth.contact_wrench(NAME)
    assert force == pytest.approx((0, 0, -WEIGHT), abs=0.01 * WEIGHT)
    arm = mean_by_mass(cloth, cloth.positions) - place
    expected = np.cross(arm, (0, 0, -WEIGHT))
    assert torque == pytest.approx(tuple(expected), abs=0.01 * WEIGHT * 0.15)


@pytest.mark.parametrize('shapes', [CLOSED[:-1], pytest.param(('mesh',), marks=pytest.mark.slow)])
@examples(0.04)
@given(
    seed=seeds, data=st.data(), size=st.sampled_from([0.01, 0.03, 0.1]),
    friction=st.sampled_from([0.0, 0.5]), speed=st.sampled_from([0.5, 5.0]),
)  # fmt: skip
def test_momentum_changes_by_gravity_and_contact_alone(
    folder, shapes, seed, data, size, friction, speed
):
    """Of a free sheet that a sphere and another collider, which turns, push about."""
    body = solid(data.draw(st.sampled_from(shapes)), size, folder)
    generator = np.random.default_rng(seed)
    sheet = {'rows': 9, 'columns': 11, 'size': (0.5, 0.4), 'position': (0, 0, 0.5)}
    scene = body.scene((0.12, 0.03, 0.47 - math.sqrt(6) * size), friction=friction)
    cloth = cloth_of(
        sheet=sheet, pins=[''], drag=0.0, **NEGLIGIBLE_AIR, **scene, solver__precision='double',
        sphere={'radius': 0.04, 'position': (-0.17, -0.1, 0.56), 'friction': friction},
    )  # fmt: skip
    axis, touched = generator.normal(size=3), 0.0
    for n in range(20):
        x, y, z = cloth.colliders['sphere'].position
        cloth.move_sphere((x, y, z - speed / 60))
        x, y, z = cloth.colliders[NAME].position
        cloth.move_collider(NAME, (x, y, z + speed / 60), turn(axis, 0.1 * (n + 1)))
        before, counts = momentum(cloth), replace(cloth.rollbacks)
        cloth.advance(1 / 60)
        repeated = cloth.rollbacks.since(counts)
        if repeated.limited or repeated.damped or repeated.held:  # takes momentum from the sheet
            continue
        forces = [cloth.contact_wrench(name)[0] for name in ('sphere', NAME)]
        touched = max(touched, *np.abs(forces).max(axis=1))
        expected = np.array([0, 0, -WEIGHT]) / 60 - np.sum(forces, axis=0) / 60
        scale = np.abs(forces).max() / 60 + WEIGHT / 60
        assert momentum(cloth) - before == pytest.approx(expected, abs=1e-12 * scale)
    assert touched > 0.1  # N


# Energy


def thrown(folder, seed: int, shape: str, size: float) -> Cloth:
    """Return a crumpled sheet that moves down, with nothing but springs and a collider below."""
    body = solid(shape, size, folder)
    turned = (0, 0, 0, 1)
    if shape != 'plane':
        turned = turn(np.random.default_rng(seed).normal(size=3), 2.0)
    below = 0.5 - (0.05 if shape == 'plane' else math.sqrt(6) * size + 0.05)
    cloth = cloth_of(
        sheet={'rows': 9, 'columns': 10, 'size': (0.4, 0.36), 'position': (0, 0, 0.5)},
        pins=[''], drag=0.0, gravity=(0, 0, 0), **NEGLIGIBLE_AIR, solver__precision='double',
        solver__substeps=200, **body.scene((0.03, 0.02, below), turned, 0.0),
    )  # fmt: skip
    crumple(cloth, 1e-3, seed)
    cloth.velocities = cloth.velocities + np.array([0.0, 0.0, -2.0])
    return cloth


@pytest.mark.parametrize('shape', each_shape())
@examples(0.015)
@given(seed=seeds, size=st.sampled_from([0.01, 0.05, 0.12]))
def test_contact_adds_no_energy(folder, shape, seed, size):
    """Not more than what the energy of the same sheet oscillates by without contact."""
    cloth, free = thrown(folder, seed, shape, size), thrown(folder, seed, shape, size)
    away = {'plane': (0, 0, -9.0)}.get(shape, (9.0, 9.0, 9.0))
    free.configure(free.scene.with_parameters({f'collider.{NAME}.position': away}))
    found, without, touched = [], [], 0.0
    for _ in range(30):
        cloth.advance(1 / 120)
        free.advance(1 / 120)
        found.append(cloth.energy())
        without.append(free.energy())
        touched = max(touched, np.abs(cloth.contact_wrench(NAME)[0]).max())
    assert touched > 0
    assert max(found) < max(without) + 2 * (max(without) - min(without))
    assert min(found) < min(without)


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('shape', ['plane', 'box'])
def test_a_sheet_on_a_flat_surface_comes_to_rest(folder, shape, precision):
    body = solid(shape, 0.3, folder)
    cloth = cloth_of(
        sheet={**SHEET, 'position': (0, 0, 0.5)}, pins=[''], solver__precision=precision,
        **NEGLIGIBLE_AIR, **body.scene((0, 0, 0.5 - body.top)),
    )  # fmt: skip
    cloth.advance(1.0)
    assert np.abs(cloth.velocities).max() == 0


@pytest.mark.slow
@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('shape', each_shape(CLOSED))
def test_a_draped_sheet_comes_to_rest(folder, shape, precision):
    """
    Where it lies on a collider, as its overhang does: by drag, after 20 s.

    Over edges, particles lie above the surface by up to the circumradius of the triangles.
    Single precision leaves what the rounding of positions puts into the springs.
    """
    body = solid(shape, 0.15, folder)
    cloth = cloth_of(
        sheet={'rows': 64, 'columns': 64, 'size': (0.8, 0.8), 'position': (0, 0, 0.5)},
        pins=[''], solver__precision=precision,
        **body.scene((0, 0, 0.48 - body.top), friction=1.0),
    )  # fmt: skip
    cloth.advance(20.0)
    local = (cloth.positions - cloth.colliders[NAME].position).reshape(-1, 3)
    near = body.distance(local).reshape(64, 64) < 1e-3 + math.sqrt(0.5) * 0.8 / 63
    assert near.any()
    speed = np.sqrt(np.mean(np.sum(cloth.velocities[near] ** 2, axis=-1)))
    assert speed < (1e-3 if precision == 'double' else 4e-3)  # m/s
