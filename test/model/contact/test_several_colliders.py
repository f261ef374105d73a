"""Colliders beside each other: none is left in the sheet where another one has moved it."""

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, cloth_of
from colliders import depth, solid

# One cell, 0.1 m wide.
CELL = {'rows': 2, 'columns': 2, 'size': (0.1, 0.1), 'position': (0, 0, 0.5)}
SMALL, GAP = 0.005, 0.001  # m
SUBSTEP = 1e-3  # s


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


@pytest.mark.parametrize(
    'names', [('moving', 'still'), ('still', 'moving')], ids='first {}'.format
)
def test_a_collider_that_another_one_moves_the_sheet_into_moves_it_out(folder, names):
    """In one substep: a ball lifts one side of a cell, and with it the other one, into a ball."""
    body = solid('sphere', SMALL, folder)
    above, below = (0.03, 0, 0.5 + SMALL + GAP), (-0.03, 0, 0.5 - SMALL - GAP)
    places = {'still': above, 'moving': below}
    cloth = cloth_of(
        sheet=CELL, pins=[''], rate=1 / SUBSTEP, gravity=(0, 0, 0), **NEGLIGIBLE_AIR,
        collider__names=list(names),
        **{
            f'collider__{name}__{parameter}': value
            for name in names
            for parameter, value in {**body.parameters, 'position': places[name]}.items()
        },
    )  # fmt: skip
    cloth.advance(SUBSTEP)
    cloth.move_collider('moving', (-0.03, 0, 0.5 - SMALL + 12 * GAP))
    cloth.advance(SUBSTEP)
    assert cloth.substeps == 1
    assert cloth.positions[..., 2].max() > 0.5 + 5 * GAP
    for name in names:
        assert depth(cloth, body, name) < body.tolerance
        assert cloth.colliders[name].inset == 0


def test_a_ball_that_comes_from_afar_hits_a_sheet_beside_another_collider(folder):
    """It is near for one batch, while it is fast, then not for many, in which another is."""
    small, ball = solid('sphere', SMALL, folder), solid('sphere', 0.02, folder)
    places = {'slow': (-0.03, 0, 0.5 - SMALL - GAP), 'moving': (0.03, 0, 3.5)}
    cloth = cloth_of(
        sheet=CELL, pins=[''], rate=1 / SUBSTEP, gravity=(0, 0, 0), **NEGLIGIBLE_AIR,
        collider__names=list(places),
        **{
            f'collider__{name}__{parameter}': value
            for name, each in (('slow', small), ('moving', ball))
            for parameter, value in {**each.parameters, 'position': places[name]}.items()
        },
    )  # fmt: skip
    for n, height in enumerate((2.0, *np.arange(1.95, 0.3, -0.05))):
        cloth.move_collider('moving', (0.03, 0, height))
        cloth.move_collider('slow', (-0.03, 2e-3 * (n % 2), places['slow'][2]))
        cloth.advance(SUBSTEP)
        assert depth(cloth, ball, 'moving') < ball.tolerance
    assert cloth.positions[..., 2].min() < 0.4
