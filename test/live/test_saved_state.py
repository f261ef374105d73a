"""Snapshots of a running cloth: taken and restored while kernels are made, and in overload."""

import time

import numpy as np
import pytest
from builders import bits, scene_of

from cloth_ros import Cloth
from cloth_ros.live.live_cloth import LiveCloth

TICK = 1 / 60
SCENE = scene_of(
    sheet__rows=9, sheet__columns=9, solver__precision='double', solver__tolerance=1e-4
)


def run(live: LiveCloth, ticks: int = 1) -> None:
    for _ in range(ticks):
        live.tick(TICK, period=TICK, wall=TICK)


@pytest.fixture
def live(compiler, log):
    live = LiveCloth(SCENE, log)
    run(live, 5)
    return live


def test_a_state_is_restored_at_once_where_its_scene_is_simulated(live):
    snapshot, revision = live.snapshot(), live.revision
    assert snapshot.scene == SCENE
    run(live, 3)
    assert live.restore(snapshot)
    assert bits(live.snapshot()) == bits(snapshot)
    assert (live.pending, live.revision) == (0.0, revision + 4)


def test_a_state_of_other_parameters_is_restored_when_these_are_simulated(live, compiler):
    snapshot = live.snapshot()
    run(live, 2)
    compiler.missing = {'motion'}
    live.configure(SCENE.with_parameters({'drag': 2.0}))
    run(live)
    assert not live.restore(snapshot)
    live.configure(SCENE)
    before = live.time
    run(live, 2)
    assert live.time == pytest.approx(before + 2 * TICK)  # it continues as it was
    compiler.finish()
    live.paused = True
    run(live, 3)
    assert bits(live.snapshot()) == bits(snapshot)


@pytest.mark.parametrize('change', ['reset', 'failure'])
def test_a_state_that_waits_is_given_up(live, compiler, log, change):
    snapshot = live.snapshot()
    compiler.missing = {'motion'}
    live.configure(SCENE.with_parameters({'drag': 2.0}))
    assert not live.restore(snapshot)
    if change == 'reset':
        live.reset()
        compiler.finish()
    else:
        compiler.finish(MemoryError('no more'))
    before = live.time
    run(live, 3)
    assert live.time == pytest.approx(before + 3 * TICK)
    assert ('is not restored' in log.text) == (change == 'failure')


def test_in_overload_the_state_is_that_of_the_requested_scene(compiler, log, monkeypatch):
    """On its grid, so that it can be loaded wherever the scene can."""
    scene = SCENE.with_parameters({'solver.overload': 'coarsen', 'solver.tolerance': 1e-6})
    live = LiveCloth(scene, log)
    run(live, 10)
    readings = iter(range(10**9))
    with monkeypatch.context() as slow:
        slow.setattr(time, 'perf_counter', lambda: float(next(readings)))
        slow.setattr(time, 'thread_time', lambda: float(next(readings)))
        run(live, 30)
    assert live.reduction == 'grid 4 times coarser'
    snapshot = live.snapshot()
    assert snapshot.scene == scene
    alone = Cloth(scene)
    alone.restore(snapshot)
    published = np.empty((9, 9, 3))
    live.write_positions(published)
    np.testing.assert_allclose(alone.positions, published, atol=0.02)
    assert alone.time == live.time
    run(live, 5)
    assert live.restore(snapshot)
    live.write_positions(published)
    np.testing.assert_allclose(alone.positions, published, atol=0.02)


def test_a_step_is_an_advance_by_one_tick(live):
    with pytest.raises(ValueError, match='not paused'):
        live.step()
    alone = Cloth(SCENE)
    alone.restore(live.snapshot())
    live.paused = True
    for _ in range(3):
        revision = live.revision
        run(live)
        assert live.step()
        assert live.revision == revision + 1
        alone.advance(1 / SCENE.rate)
    assert bits(live.snapshot()) == bits(alone.snapshot())


def test_a_held_cloth_is_not_stepped(compiler, log):
    compiler.missing = {'motion'}
    live = LiveCloth(SCENE, log)
    live.paused = True
    before = bits(live.snapshot())
    with pytest.raises(ValueError, match='held: the kernels of motion are being compiled'):
        live.step()
    assert bits(live.snapshot()) == before
    compiler.finish()
    assert live.step()
