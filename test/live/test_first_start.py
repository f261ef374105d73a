"""The first start of a scene, while kernels are missing."""

import numpy as np
import pytest
from builders import scene_of

from cloth_ros import Cloth
from cloth_ros.live import first_start
from cloth_ros.live.first_start import FirstStart
from cloth_ros.live.kernel_cache import KernelNotCached
from cloth_ros.live.live_cloth import LiveCloth

TICK = 1 / 60
SCENE = scene_of(
    sheet__rows=9,
    sheet__columns=9,
    solver__precision='double',
    sphere__radius=0.1,
    sphere__position=(0.0, 0.0, 3.0),
)


def run(live: LiveCloth, ticks: int = 1) -> float:
    """Advance by ticks, and return the simulated time in ticks."""
    for _ in range(ticks):
        assert live.tick(TICK, period=TICK, wall=TICK)
    return live.values()['simulated time [s]'] / TICK


def test_a_cloth_is_held_until_kernels_of_motion_are_there_and_makes_up_no_time(compiler, log):
    compiler.missing = {'motion', 'contact'}
    live = LiveCloth(SCENE, log)
    assert not live.running
    live.set_wind((1.0, 0.0, 0.0))
    live.bodies.move('sphere', (0.0, 0.0, 4.0))
    assert run(live, 100) == 0
    assert live.take_report().held == 'the kernels of motion are being compiled'
    assert live.pending == 0
    out = np.empty((9, 9, 3))
    live.write_positions(out)
    assert np.array_equal(out, Cloth(SCENE).positions)  # it is published
    compiler.finish()
    live.poll()
    assert live.running
    assert run(live, 3) == pytest.approx(3, abs=0.5)
    assert live.colliders['sphere'].position == pytest.approx((0.0, 0.0, 4.0))
    assert live.air_velocity == (1.0, 0.0, 0.0)
    assert log.text.splitlines() == [
        'the cloth is held: the kernels of motion are being compiled',
        'the cloth is no longer held',
    ]


def test_without_kernels_of_contact_it_moves_until_a_collider_may_touch_it(compiler, log):
    compiler.missing = {'contact'}
    live = LiveCloth(SCENE, log)
    assert run(live, 5) == pytest.approx(5, abs=0.5)
    time = run(live, 0)
    live.bodies.move('sphere', (0.0, 0.0, -3.0))  # through the sheet
    assert run(live, 5) == time
    live.bodies.move('sphere', (0.0, 0.0, 3.0))
    assert run(live, 5) == time  # held until both waypoints can be passed
    assert live.colliders['sphere'].position == (0.0, 0.0, 3.0)
    report = live.take_report()
    assert report.held == (
        'a collider may touch it, and the kernels of contact are being compiled'
    )
    assert live.values()['error estimate [m]'] == 'not yet sampled'
    live.reset()  # which moves the sphere away
    assert run(live, 2) == pytest.approx(2, abs=0.5)
    live.bodies.move('sphere', (0.0, 0.0, -3.0))
    time = run(live)
    compiler.finish()
    run(live)
    assert live.take_report().held == ''
    assert run(live, 0) == pytest.approx(time + 1, abs=0.5)
    assert live.colliders['sphere'].position == pytest.approx((0.0, 0.0, -3.0))


@pytest.mark.parametrize('kind', ['motion', 'contact'])
def test_kernels_that_cannot_be_compiled_hold_it_until_others_are_requested(compiler, log, kind):
    compiler.missing = {kind}
    live = LiveCloth(SCENE, log)
    live.bodies.move('sphere', (0.0, 0.0, -3.0))
    compiler.finish(OSError('no space'))
    assert run(live, 3) == 0
    assert f'kernels of {kind} cannot be compiled (OSError: no space)' in log.text
    live.configure(SCENE.with_parameters({'drag': 1.0}))
    assert run(live, 3) > 2
    assert live.take_report().held == ''


def test_a_collider_that_comes_nearer_than_predicted_repeats_the_tick(compiler, log, monkeypatch):
    compiler.missing = {'contact'}
    start = FirstStart(SCENE, compiler, log)
    cloth = Cloth(SCENE)
    advance, before = cloth.advance_stepwise, cloth.positions

    def interrupted(seconds):
        yield from advance(seconds / 2)
        raise KernelNotCached

    monkeypatch.setattr(cloth, 'advance_stepwise', interrupted)
    assert list(start.advance(cloth, TICK)) != []
    assert (cloth.time, start.held.split(',')[0]) == (0.0, 'a collider may touch it')
    assert np.array_equal(cloth.positions, before)
    monkeypatch.undo()
    compiler.finish()
    start.poll()
    for _ in start.advance(cloth, TICK):
        pass
    assert cloth.time == TICK
    assert start.held == ''


def test_an_initial_state_that_needs_kernels_of_contact_waits_for_them(compiler, log, monkeypatch):
    compiler.missing = {'contact'}
    start = FirstStart(SCENE, compiler, log)
    calls = []

    def coarse_cloth(scene):
        calls.append(list(start.missing))
        if len(calls) == 1:
            compiler.finish()
            raise KernelNotCached
        return 'cloth'

    monkeypatch.setattr(first_start, 'CoarseCloth', coarse_cloth)
    assert start.initial_cloth() == 'cloth'
    assert calls == [['contact'], []]
    assert start.label('contact') == 'contact (2 of 3)'
    start.abandon()
    assert start.label('the error estimate') == 'the error estimate'
