"""Every type of collider keeps all triangles out, whatever it does, and nothing passes through."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, PRECISIONS, cloth_of, examples, seeds
from colliders import CLOSED, NAME, Solid, depth, each_shape, matrix, product, solid, turn
from geometry import ray_crossings, triangles
from hypothesis import example, given
from hypothesis import strategies as st

from cloth_ros import Cloth

SHEET = {'rows': 16, 'columns': 16, 'size': (0.6, 0.6), 'position': (0, 0, 0.5)}
RIM = ['0,:', '-1,:', ':,0', ':,-1']


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


def random_turn(generator: np.random.Generator, most: float = math.pi) -> tuple[float, ...]:
    return turn(generator.normal(size=3), generator.uniform(-most, most))


# Depth


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('shape', each_shape())
@examples(0.02)
@given(seed=seeds, size=st.sampled_from([0.02, 0.06, 0.15]))
@example(seed=0, size=0.06)
@example(seed=8252, size=0.15)  # a mesh was thought farther away than it was
def test_a_falling_sheet_stays_outside(folder, shape, precision, seed, size):
    """In any orientation of the collider; a plane is tilted a little."""
    generator, body = np.random.default_rng(seed), solid(shape, size, folder)
    turned = random_turn(generator, 0.3 if shape == 'plane' else math.pi)
    below = 0.5 - (0.15 if shape == 'plane' else math.sqrt(6) * size + 0.02)
    place = (*generator.uniform(-0.1, 0.1, 2), below)
    cloth = cloth_of(
        sheet=SHEET, pins=[''], solver__precision=precision, **NEGLIGIBLE_AIR,
        **body.scene(place, turned),
    )  # fmt: skip
    for _ in range(30):
        cloth.advance(1 / 60)
        assert depth(cloth, body) < body.tolerance
    assert cloth.rollbacks.text == ''


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('shape', each_shape())
@examples(0.02)
@given(
    seed=seeds,
    size=st.sampled_from([0.02, 0.06, 0.1]),
    speed=st.sampled_from([0.3, 2.0]),
    spin=st.sampled_from([0.0, 1.0, 10.0]),
)
def test_a_collider_that_moves_and_turns_stays_outside(
    folder, shape, precision, seed, size, speed, spin
):
    """Down into a sheet that is held along its rim, 0.1 m deep; a plane up."""
    generator, body = np.random.default_rng(seed), solid(shape, size, folder)
    axis, turned = generator.normal(size=3), random_turn(generator)
    start, end = 0.52 + math.sqrt(6) * size, 0.45
    pins = RIM
    if shape == 'plane':  # a sheet that hangs at one corner, which a plane does not reach
        pins, turned, axis, spin = ['0,0'], (0, 0, 0, 1), (0, 0, 1), spin
        start, end = 0.45, 0.48
    cloth = cloth_of(
        sheet=SHEET, pins=pins, solver__precision=precision, **NEGLIGIBLE_AIR,
        **body.scene((0.03, 0.02, start), turned),
    )  # fmt: skip
    rotation, z = matrix(turned), start
    for n in range(40):
        z += max(min(end - z, speed / 60), -speed / 60)
        step = turn(axis, spin * (n + 1) / 60)
        cloth.move_collider(NAME, (0.03, 0.02, z), product(step, turned))
        cloth.advance(1 / 60)
        assert depth(cloth, body) < body.tolerance
    assert np.allclose(matrix(cloth.colliders[NAME].orientation), matrix(step) @ rotation)
    assert cloth.rollbacks.damped == cloth.rollbacks.held == 0


# Tunnelling


def hangs_below(cloth: Cloth, body: Solid) -> bool:
    """Return whether a ray down from within the collider meets the sheet, and one up does not."""
    collider = cloth.colliders[NAME]
    inside = matrix(collider.orientation) @ body.inside + collider.position
    corners = triangles(cloth.positions)
    down = ray_crossings(corners, inside, (1e-5, 2e-5, -1)) % 2 == 1
    return down and ray_crossings(corners, inside, (1e-5, 2e-5, 1)) % 2 == 0


def thrust(body: Solid, speed: float) -> Iterator[Cloth]:
    """
    Yield sheets that are held along their rims, after a collider was thrust 10 cm into each.

    The collider is smaller than the spacing, at several places and in any orientation.
    """
    spacing, generator = 0.5 / 11, np.random.default_rng(int(speed))
    sheet = {'rows': 12, 'columns': 12, 'size': (0.5, 0.5), 'position': (0, 0, 0.5)}
    for offset in ((0.0, 0.0), (0.4, 0.3)):
        x, y = (each * spacing for each in offset)
        turned = random_turn(generator)
        cloth = cloth_of(
            sheet=sheet, pins=RIM, **NEGLIGIBLE_AIR, **body.scene((x, y, 0.6), turned)
        )
        ticks = max(round(0.2 / speed * 60), 1)
        for n in range(ticks):
            cloth.move_collider(NAME, (x, y, 0.6 - 0.2 * (n + 1) / ticks), turned)
            cloth.advance(0.2 / speed / ticks)
        assert np.isfinite(cloth.positions).all()
        yield cloth


def thrusts() -> list[object]:
    """Return shapes and speeds, m/s, as parameters of a test; some of a torn sheet are slow."""
    pairs = [(shape, speed) for shape in CLOSED for speed in (1.0, 10.0, 100.0, 1000.0)]
    slow = {('box', 1000.0), ('capsule', 1000.0), *(pair for pair in pairs if pair[0] == 'mesh')}
    return [pytest.param(*pair, marks=[pytest.mark.slow] * (pair in slow)) for pair in pairs]


@pytest.mark.parametrize(('shape', 'speed'), thrusts())
def test_a_fast_collider_smaller_than_the_spacing_stays_outside_and_does_not_pass(
    folder, shape, speed
):
    body = solid(shape, 0.3 * 0.5 / 11, folder)
    for cloth in thrust(body, speed):
        for _ in range(4):
            assert hangs_below(cloth, body)
            assert depth(cloth, body) < body.tolerance
            cloth.advance(1 / 60)


@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('shape', ['plane', 'box'])
def test_a_fast_sheet_does_not_pass_a_plate(folder, shape, precision):
    body = solid(shape, 0.5, folder)
    top = 0.0
    if shape == 'box':
        body.parameters['size'], top = (1, 1, 0.01), 0.005
    scene = body.scene((0, 0, -top))
    sheet = {**SHEET, 'position': (0.01, 0.02, 0.3)}
    cloth = cloth_of(
        sheet=sheet, pins=[''], solver__precision=precision, **NEGLIGIBLE_AIR, **scene
    )
    cloth.velocities = np.zeros((16, 16, 3)) + np.array([0.0, 0.0, -30.0])
    for _ in range(20):
        cloth.advance(1 / 60)
        assert cloth.positions[..., 2].min() > -1e-4
