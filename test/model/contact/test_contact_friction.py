"""Coulomb friction: what sticks stays, what slides does so as a block, what turns drags along."""

import math

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, PRECISIONS, cloth_of
from colliders import NAME, matrix, product, solid, turn

GRAVITY = 9.81  # m/s²


def on_incline(folder, shape, angle, friction, **parameters):
    """Return a small sheet on a surface that is tilted by `angle`, rad, down towards x."""
    tilt = turn((0, 1, 0), angle)
    body = solid(shape, 1.0, folder)
    place = -body.top * matrix(tilt)[:, 2]
    return cloth_of(
        sheet={
            'rows': 6, 'columns': 6, 'size': (0.15, 0.15), 'mass': 0.01, 'position': (0, 0, 0),
            'orientation': tilt,
        },
        **{'pins': [''], 'drag': 0.0, **NEGLIGIBLE_AIR, **parameters},
        **body.scene(tuple(place), tilt, friction),
    )  # fmt: skip


@pytest.mark.parametrize('shape', ['plane', 'box'])
@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('substeps', [0, 500])
@pytest.mark.parametrize(('angle', 'friction'), [(0.2, 0.21), (math.pi / 4, 1.05)])
def test_what_sticks_does_not_creep(tmp_path, shape, precision, substeps, angle, friction):
    cloth = on_incline(
        tmp_path, shape, angle, friction, solver__precision=precision, solver__substeps=substeps
    )
    cloth.advance(0.1)
    start = cloth.positions
    cloth.advance(10.0)
    assert np.abs(cloth.positions - start).max() < 1e-4


@pytest.mark.parametrize('shape', ['plane', 'box'])
@pytest.mark.parametrize('precision', PRECISIONS)
@pytest.mark.parametrize('substeps', [0, 500])
@pytest.mark.parametrize(('angle', 'friction'), [(0.2, 0.1), (math.pi / 4, 0.5), (0.5, 0.0)])
def test_what_slides_does_so_as_a_block(tmp_path, shape, precision, substeps, angle, friction):
    cloth = on_incline(
        tmp_path, shape, angle, friction, solver__precision=precision, solver__substeps=substeps
    )
    down = matrix(turn((0, 1, 0), angle))[:, 0]
    cloth.advance(0.1)
    before = (cloth.velocities @ down).mean()
    cloth.advance(0.2)
    found = ((cloth.velocities @ down).mean() - before) / 0.2
    right = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
    assert found == pytest.approx(right, rel=0.01)


@pytest.mark.parametrize('shape', ['capsule', 'cylinder'])
def test_a_cloth_on_a_roll_turns_with_it(tmp_path, shape):
    """By 0.4 rad; as much of it hangs down on both sides at first."""
    body = solid(shape, 0.1, tmp_path)
    lying = turn((1, 0, 0), math.pi / 2)
    cloth = cloth_of(
        sheet={'rows': 8, 'columns': 24, 'size': (0.46, 0.1), 'position': (0, 0, 0.102)},
        **{'pins': [''], 'drag': 2.0, **NEGLIGIBLE_AIR, **body.scene((0, 0, 0), lying, 1.0)},
    )
    cloth.advance(3.0)
    before, touching = cloth.positions, _near_top(cloth)
    for n in range(120):
        angle = 0.4 * (n + 1) / 120
        turned = product(turn((0, 1, 0), angle), lying)
        cloth.move_collider(NAME, (0, 0, 0), turned)
        cloth.advance(1 / 60)
    found = _angles(cloth.positions)[touching] - _angles(before)[touching]
    assert touching.sum() > 20
    assert found.mean() == pytest.approx(0.4, rel=0.01)


def _angles(positions):
    """Return the angles, rad, of particles about the y axis, from z towards x."""
    return np.arctan2(positions[..., 0], positions[..., 2])


def _near_top(cloth):
    distance = np.hypot(cloth.positions[..., 0], cloth.positions[..., 2])
    return (distance < distance[4, 10:14].mean() + 1e-4) & (np.abs(_angles(cloth.positions)) < 0.6)
