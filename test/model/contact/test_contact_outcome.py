"""What the outcome of contact does not depend on: mirror images, ticks, threads, snapshots."""

import math
from pathlib import Path

import numpy as np
import pytest
from builders import NEGLIGIBLE_AIR, PRECISIONS, bits, cloth_of
from colliders import NAME, depth, each_shape, solid, turn

from cloth_ros import Cloth
from cloth_ros.model.contact.particle_batch import ParticleBatch
from cloth_ros.model.contact.particle_contact import IN_TOUCH
from cloth_ros.model.snapshot_file import decode, encode

AIR = {'wind__air_density': 1.2}


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


def dropped(body, position, turned=(0, 0, 0, 1), **parameters) -> Cloth:
    """Return a sheet above a collider, in double precision."""
    sheet = {'rows': 13, 'columns': 13, 'size': (0.4, 0.4), 'position': (0, 0, 0.5)}
    return cloth_of(
        **{'sheet': sheet, 'pins': [''], 'solver__precision': 'double', **parameters},
        **body.scene(position, turned, 0.3),
    )


@pytest.mark.parametrize('shape', each_shape())
def test_a_scene_that_is_its_mirror_image_stays_so(folder, shape):
    """About x = 0, in gusts along y; an angle section is symmetric about its diagonal."""
    body = solid(shape, 0.1, folder)
    turned = turn((0, 0, 1), math.pi / 4) if shape == 'mesh' else (0, 0, 0, 1)
    gusts = {'wind__gust__period': 0.2, 'wind__gust__duration': 0.1}
    cloth = dropped(body, (0, 0.01, 0.48 - body.top), turned, **AIR, **gusts)
    touched = 0.0
    for _ in range(24):
        cloth.advance(1 / 60)
        mirrored = cloth.positions[:, ::-1] * (-1, 1, 1)
        assert np.abs(cloth.positions - mirrored).max() < 1e-9
        touched = max(touched, np.abs(cloth.contact_wrench(NAME)[0]).max())
    assert touched > 0.1  # N


@pytest.mark.parametrize('shape', each_shape(['plane', 'sphere', 'box', 'mesh']))
def test_a_scene_that_is_symmetric_about_the_diagonal_stays_so(folder, shape):
    body = solid(shape, 0.1, folder)
    if shape == 'box':
        body.parameters['size'] = (0.2, 0.2, 0.16)
    wind = {'wind__velocity': (0.5, 0.5, 0.3)}
    cloth = dropped(body, (0.01, 0.01, 0.48 - body.top), **AIR, **wind)
    touched = 0.0
    for _ in range(24):
        cloth.advance(1 / 60)
        mirrored = np.swapaxes(cloth.positions, 0, 1)[..., [1, 0, 2]]
        assert np.abs(cloth.positions - mirrored).max() < 1e-9
        touched = max(touched, np.abs(cloth.contact_wrench(NAME)[0]).max())
    assert touched > 0.1  # N


def moving(folder: Path, shape: str, *, seconds: float, rate: int, **parameters: object) -> Cloth:
    """Return a sheet on a collider that moved and turned at constant rates in ticks of `rate`."""
    body = solid(shape, 0.1, folder)
    start = np.array([0.0, 0.01, 0.48 - body.top])
    cloth = dropped(body, tuple(start), **NEGLIGIBLE_AIR, rate=rate, **parameters)
    ticks = round(seconds * rate)
    for n in range(ticks):
        time = (n + 1) / rate
        place = start + np.array([0.2, 0.0, 0.1]) * time
        cloth.move_collider(NAME, tuple(place), turn((0, 0, 1), 2.0 * time))
        cloth.advance(1 / rate)
    return cloth


@pytest.mark.parametrize('shape', each_shape())
def test_the_outcome_does_not_depend_on_the_rate_of_ticks(folder, shape):
    """To rounding, where the same substeps are made in the same batches."""
    one, *others = (
        moving(folder, shape, seconds=0.3, rate=rate, solver__substeps=17 * 120 // rate)
        for rate in (120, 60, 30)
    )
    for other in others:
        assert np.abs(other.positions - one.positions).max() < 1e-9
    assert np.abs(one.contact_wrench(NAME)[0]).max() > 0.1  # N


# Beside edges the sheet folds at the rims, which amplifies any difference.
@pytest.mark.parametrize('shape', ['plane', 'sphere', 'capsule'])
def test_other_batches_change_less_than_other_substeps(folder, shape):
    """The bounds of triangles are those of a batch; the substeps are the same or half as long."""

    def positions(rate: int, substeps: int) -> np.ndarray:
        return moving(folder, shape, seconds=0.3, rate=rate, solver__substeps=substeps).positions

    one, finer = positions(60, 50), positions(60, 100)
    for rate in (30, 120):
        change = positions(rate, 3000 // rate) - one
        assert np.linalg.norm(change) < 0.5 * np.linalg.norm(finer - one)


@pytest.mark.parametrize('shape', each_shape())
def test_blocks_that_touch_nothing_may_be_passed_over(folder, shape, monkeypatch):
    """The same as if contact were computed for all blocks in reach in every drift, to the bit."""
    found = moving(folder, shape, seconds=0.2, rate=60)
    table = ParticleBatch.table

    def all_in_touch(self, *arguments):
        contacts = table(self, *arguments)
        contacts.active[contacts.active != 0] = IN_TOUCH
        return contacts

    monkeypatch.setattr(ParticleBatch, 'table', all_in_touch)
    same = moving(folder, shape, seconds=0.2, rate=60)
    assert np.abs(found.contact_wrench(NAME)[0]).max() > 0.1  # N
    assert np.array_equal(found.positions, same.positions)
    assert np.array_equal(found.velocities, same.velocities)


@pytest.mark.parametrize('shape', ['plane', 'sphere', 'box'])
def test_a_sheet_at_rest_that_is_set_in_motion_is_kept_out(folder, shape, monkeypatch):
    """At rest, a batch takes for granted that nothing moves by much; a storm moves it at once."""
    body = solid(shape, 0.1, folder)
    held, batches = ParticleBatch.held, []

    def noted(self, *arguments):
        batches.append(held(self, *arguments))
        return batches[-1]

    def blown(*, known: bool) -> Cloth:
        with monkeypatch.context() as patch:
            patch.setattr(ParticleBatch, 'held', noted)
            if not known:
                patch.setattr(ParticleBatch, 'found', lambda *_: None)
            cloth = dropped(body, (0, 0.01, 0.49 - body.top), drag=20.0, **AIR)
            cloth.advance(3.0)
            batches.clear()
            for n in range(12):
                cloth.wind = (2.0, 0.0, 10.0 if n < 3 else -10.0)
                cloth.advance(1 / 60)
                assert depth(cloth, body) < body.tolerance
        return cloth

    one = blown(known=True)
    assert False in batches
    assert np.abs(one.positions - blown(known=False).positions).max() < 1e-4  # m
    assert not batches


@pytest.mark.parametrize('shape', each_shape())
@pytest.mark.parametrize('precision', PRECISIONS)
def test_a_snapshot_gives_the_same_bits_again(folder, shape, precision):
    """Taken while the collider moves, turns and touches the sheet."""
    body = solid(shape, 0.1, folder)
    cloth = dropped(
        body, (0, 0.01, 0.48 - body.top), **NEGLIGIBLE_AIR, solver__precision=precision
    )

    def run(start: int, end: int) -> list[np.ndarray]:
        found = []
        for n in range(start, end):
            place = (0.005 * n, 0.01, 0.48 - body.top + 0.003 * n)
            cloth.move_collider(NAME, place, turn((0.2, 0.1, 1), 0.03 * n))
            cloth.advance(1 / 60)
            found += [cloth.positions, cloth.velocities, np.array(cloth.contact_wrench(NAME))]
        return found

    run(0, 12)
    snapshot = cloth.snapshot()
    first = run(12, 24)
    cloth.restore(snapshot)
    again = run(12, 24)
    assert np.abs(first[-1]).max() > 0
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))


@pytest.mark.parametrize('shape', ['sphere', 'box'])
def test_a_snapshot_of_a_calm_sheet_gives_the_same_bits_again(folder, shape):
    """Everything of it, where short batches use what was found out about the collider before."""
    body = solid(shape, 0.3, folder)
    cloth = cloth_of(
        sheet={'rows': 14, 'columns': 14, 'size': (0.3, 0.3), 'position': (0, 0, 0.5)},
        pins=[''], **body.scene((0, 0, 0.5 - body.top)),
    )  # fmt: skip

    def run() -> list[object]:
        found = []
        for _ in range(3):
            cloth.advance(1e-3)
            found.append(bits(cloth.snapshot()))
        return found

    cloth.advance(1.0)
    snapshot = cloth.snapshot()
    first = run()
    for start in (snapshot, decode(encode(snapshot))):
        cloth.restore(start)
        assert run() == first


@pytest.mark.parametrize('threads', [2, pytest.param(3, marks=pytest.mark.slow)])
def test_threads_give_the_same_bits(folder, threads):
    """Of a large sheet that two colliders push, one of them small beside its cells."""
    body = solid('box', 0.2, folder)

    def run(threads: int) -> Cloth:
        cloth = cloth_of(
            sheet={'rows': 128, 'columns': 128, 'size': (1, 1), 'position': (0, 0, 0.5)},
            **{'pins': [''], 'solver__threads': threads, **NEGLIGIBLE_AIR},
            sphere={'radius': 0.004, 'position': (0, 0, 0.51)},
            **body.scene((0, 0, 0.49 - body.top)),
        )
        for n in range(3):
            step = 0.005 * n
            cloth.move_sphere((0, 0, 0.51 - step))
            cloth.move_collider(NAME, (0, 0, 0.49 - body.top + step), turn((0, 0, 1), 0.1 * n))
            cloth.advance(1 / 60)
        return cloth

    one, other = run(1), run(threads)
    assert np.array_equal(one.positions, other.positions)
    assert one.contact_wrench(NAME) == other.contact_wrench(NAME)
    assert np.abs(one.contact_wrench('sphere')[0]).max() > 0
