"""The running cloth: commands, parameters, ticks, overload and the error estimate."""

import itertools
import math
import time

import numpy as np
import pytest
from builders import run_python, scene_of

from cloth_ros import Cloth
from cloth_ros.live.live_cloth import LiveCloth

TICK = 1 / 60
SCENE = scene_of(
    sheet__rows=9, sheet__columns=9, solver__precision='double', solver__tolerance=1e-4
)
SPHERE = SCENE.with_parameters({'sphere.radius': 0.1, 'sphere.position': (0.0, 0.0, 3.0)})


class Clock:
    """Injected wall-clock time: each reading takes `step` s."""

    now = step = 0.0

    def __call__(self) -> float:
        self.now += self.step
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Without cost, unless a test sets it: no substep is ever too expensive."""
    clock = Clock()
    monkeypatch.setattr(time, 'perf_counter', clock)
    return clock


@pytest.fixture(autouse=True)
def processor(monkeypatch):
    """Processor time that the process gets."""
    processor = Clock()
    monkeypatch.setattr(time, 'thread_time', processor)
    return processor


@pytest.fixture
def live(compiler, log):
    return LiveCloth(SCENE, log)


def run(live: LiveCloth, ticks: int = 1, elapsed: float = TICK, **arguments: object) -> bool:
    """Advance by ticks, with an estimate of the error."""
    for _ in range(ticks):
        done = live.tick(elapsed, period=TICK, wall=TICK, estimate_error=True, **arguments)
        live.estimate_error(TICK)
    return done


def simulated(live: LiveCloth) -> float:
    return live.values()['simulated time [s]']


def positions(live: LiveCloth) -> np.ndarray:
    sheet = live.scene.sheet
    out = np.empty((sheet.rows, sheet.columns, 3))
    live.write_positions(out)
    return out


def test_it_is_the_cloth_of_the_model_at_the_pace_of_the_ticks(live, log):
    run(live, 10)
    alone = Cloth(SCENE)
    for _ in range(10):
        alone.advance(TICK)
    np.testing.assert_allclose(positions(live), alone.positions, rtol=0, atol=1e-12)
    particles = np.empty((9, 9, 6))
    live.write_particles(particles)
    np.testing.assert_allclose(particles[..., 3:], alone.velocities, rtol=0, atol=1e-10)
    report, values = live.take_report(), live.values()
    assert report.real_time_factor == pytest.approx(1.0)
    assert (report.lost, report.held, report.reduction) == (0.0, '', '')
    assert values['simulated time [s]'] == pytest.approx(10 * TICK)
    assert values['energy [J]'] == pytest.approx(alone.energy())
    assert (live.running, live.revision, log.text) == (True, 10, '')
    assert 'position_verlet in double precision' in live.solver_summary


def test_a_scene_that_cannot_be_simulated_is_refused(compiler, log):
    with pytest.raises(ValueError, match=r'solver\.substeps'):
        LiveCloth(SCENE.with_parameters({'springs.structural': 1e6, 'solver.substeps': 1}), log)


def test_parameters_take_effect_when_their_kernels_are_compiled(live, compiler, log):
    compiler.missing = {'motion'}
    for number, drag in enumerate((1.0, 2.0, 3.0)):
        live.configure(SCENE.with_parameters({'drag': drag}))
        run(live)
        assert (live.scene, live.requested.drag) == (SCENE, drag)  # it continues as it was
        assert simulated(live) == pytest.approx((number + 1) * TICK)
    assert log.text.count('compiling kernels for the changed parameters') == 1
    assert len(compiler.futures) == 1  # of the first request
    state = positions(live)
    compiler.finish()
    live.set_wind((1.0, 0.0, 0.0))  # parameters that were set before hold for a command
    assert live.scene.drag == 1.0
    assert np.array_equal(positions(live), state)
    run(live, 2)
    assert live.scene.drag == 3.0
    live.take_report()
    assert 'stability limit' in log.text


def test_parameters_take_effect_once_a_tick_however_often_they_are_set(live):
    run(live)
    for drag in (1.0, 2.0, 3.0):
        live.configure(SCENE.with_parameters({'drag': drag}))
    assert live.scene.drag == 1.0
    run(live)
    assert live.scene.drag == 3.0
    assert live.scene is live.requested


def test_parameters_whose_kernels_cannot_be_compiled_are_tried_again_when_set(live, compiler, log):
    for _ in range(2):
        compiler.missing = {'motion'}
        live.configure(SCENE.with_parameters({'drag': 2.0}))
        run(live)
        compiler.finish(MemoryError('no more'))
        run(live, 5)
        assert live.scene is SCENE
    assert log.text.count('cannot be compiled (MemoryError: no more)') == 2
    assert simulated(live) == pytest.approx(12 * TICK)
    live.configure(SCENE.with_parameters({'drag': 2.5}))
    run(live)
    assert live.scene.drag == 2.5


def test_a_reset_returns_to_the_initial_state(compiler, log):
    live = LiveCloth(SPHERE, log)
    initial = positions(live)
    live.set_wind((3.0, 0.0, 0.0))
    live.bodies.move('sphere', (0.0, 1.0, 3.0))
    run(live, 5)
    assert live.colliders['sphere'].position == pytest.approx((0.0, 1.0, 3.0))
    assert 'error estimate, root mean square [m]' in live.values()
    run(live, elapsed=TICK / 3)
    assert live.pending != 0
    revision = live.revision
    live.reset()
    assert np.array_equal(positions(live), initial)
    assert (simulated(live), live.pending, live.revision) == (0.0, 0.0, revision + 1)
    assert live.colliders['sphere'].position == (0.0, 0.0, 3.0)
    assert live.air_velocity == SCENE.wind.velocity
    assert live.values()['error estimate [m]'] == 'not yet sampled'
    run(live, 3)
    assert simulated(live) == pytest.approx(3 * TICK)


def test_while_it_is_paused_no_time_passes_and_none_is_made_up(live):
    run(live, 3)
    state, revision = positions(live), live.revision
    live.paused = True
    assert run(live, 20)
    assert np.array_equal(positions(live), state)
    assert (live.revision, live.pending) == (revision, 0.0)
    live.paused = False
    run(live)
    assert simulated(live) == pytest.approx(4 * TICK)


def test_a_tick_of_less_than_half_a_substep_does_not_change_the_state(live):
    run(live)
    before = positions(live), live.revision
    run(live, elapsed=1e-9)
    assert np.array_equal(positions(live), before[0])
    assert live.revision == before[1]


def test_an_interrupted_tick_leaves_a_state_that_continues(compiler, log):
    live = LiveCloth(SCENE.with_parameters({'solver.substeps': 200}), log)
    calls = itertools.count()
    assert not run(live, elapsed=0.1, interrupted=lambda: next(calls) == 10)
    assert not np.array_equal(positions(live), Cloth(SCENE).positions)
    assert run(live, 10)
    assert np.isfinite(positions(live)).all()
    assert live.values()['error estimate [m]'] < 1e-3


@pytest.mark.parametrize('command', ['wind', 'sphere', 'box'])
@pytest.mark.parametrize('value', [(math.nan, 0.0, 0.0), (0.0, 0.0), 'far', (1e30, 0.0, 0.0)])
def test_an_invalid_command_is_refused(compiler, log, command, value):
    live = LiveCloth(SPHERE, log)
    with pytest.raises(ValueError, match='must be'):
        live.set_wind(value) if command == 'wind' else live.bodies.move(command, value)
    assert live.air_velocity == SCENE.wind.velocity


def test_moving_a_sphere_that_is_not_there_names_its_parameter(live):
    with pytest.raises(ValueError, match=r'sphere\.radius'):
        live.bodies.move('sphere', (0.0, 0.0, 0.0))


def test_the_error_estimate_is_given_all_inputs(compiler, log):
    """With another wind or another path of the sphere it would be centimetres away."""
    accurate = {'solver.substeps': 200, 'sphere.position': (0.0, 0.4, 1.0)}
    live = LiveCloth(SPHERE.with_parameters(accurate), log)
    seen = []
    for number in range(24):
        live.set_wind((3.0 * math.sin(number), 2.0 * (number % 3), 0.0))
        for y in (0.38, 0.35):  # both waypoints are passed within a tick
            live.bodies.move('sphere', (0.0, y - 0.02 * number, 1.0))
        run(live)
        seen.append(live.values()['error estimate [m]'])
    assert live.values()['sphere penetration [m]'] >= 0
    assert positions(live)[..., 1].max() > 0.01  # the sheet was touched
    assert max(seen[3:]) < 1e-3  # that of contact


def test_lost_time_is_explained_by_the_processor_time_that_the_process_got(
    live, log, clock, processor
):
    """The clocks count 50 ms a reading; half of the time and then all of it on a processor."""
    clock.step, processor.step = 0.05, 0.001
    run(live, 30)
    report = live.take_report()
    assert report.lost > 0.1
    assert report.waiting == pytest.approx(30 * 0.049, rel=0.2)
    assert 'did not get the processor' in report.cause
    processor.step = 0.05
    run(live, 30)
    report = live.take_report()
    assert report.waiting == pytest.approx(0.0, abs=1e-9)
    assert '% of real time' in report.cause
    assert 'processor' not in report.cause
    clock.step = processor.step = 0.0
    run(live, 300)
    live.take_report()
    run(live)
    assert live.take_report().cause == ''
    assert log.text == ''


def test_a_scene_that_is_too_slow_says_so_at_the_start_and_when_it_is_set(compiler, log, clock):
    clock.step = 0.01  # of 17 substeps
    stiff = {'springs.structural': 5e7}
    live = LiveCloth(SCENE.with_parameters(stiff), log)
    assert 'too slow for real time: ' in log.text
    assert 'because springs.structural is 5e+07 N/m at a mass of 0.2 kg' in log.text
    clock.step, log.text = 0.0, ''
    live.configure(SCENE)
    assert log.text == ''
    clock.step = 0.01
    live.configure(SCENE.with_parameters(stiff))
    run(live)
    assert log.text.count('too slow for real time: ') == 1


def test_implausible_values_are_told_once(compiler, log):
    live = LiveCloth(SCENE.with_parameters({'sheet.mass': 200.0}), log)
    assert log.text.count('an areal density of 200 kg/m²') == 1
    live.configure(SCENE.with_parameters({'sheet.mass': 200.0, 'drag': 1.0}))
    run(live)
    assert log.text.count('is this value meant?') == 1
    live.configure(SCENE.with_parameters({'gravity': [0.0, 0.0, -981.0]}))
    assert log.text.count('is this value meant? gravity is 981 m/s²') == 1


def test_an_overload_coarsens_the_grid_and_returns_step_by_step(compiler, log, clock):
    scene = SCENE.with_parameters({'solver.overload': 'coarsen', 'solver.tolerance': 1e-6})
    live = LiveCloth(scene, log)
    run(live, 10)
    held, before = positions(live)[scene.pinned()], simulated(live)
    live._published.cloth.rollbacks.refined += 7
    clock.step = 1.0
    run(live, 30)
    clock.step = 0.0
    assert live.take_report().reduction == 'grid 4 times coarser'
    assert 'overload, grid 4 times coarser: ' in log.text
    assert live.scene.sheet == scene.sheet
    assert live._published.cloth.positions.shape == (3, 3, 3)
    assert before <= simulated(live) < before + 30 * TICK  # slow motion
    seen = []
    for _ in range(300):
        run(live)
        seen.append(live.take_report().reduction)
        assert np.array_equal(positions(live)[scene.pinned()], held)
        if not seen[-1]:
            break
    run(live)
    assert live.scene is scene
    assert live._published.cloth.positions.shape == (9, 9, 3)
    levels = list(dict.fromkeys(seen))
    assert levels[:2] == ['grid 4 times coarser', 'grid 2 times coarser']
    assert 'tolerance relaxed' in levels[-2]
    assert levels[-1] == ''
    assert live.values()['substep batches refined'] == 7
    assert simulated(live) > before


def test_a_level_whose_kernels_cannot_be_compiled_is_reported(compiler, log, clock):
    live = LiveCloth(SCENE.with_parameters({'solver.overload': 'coarsen'}), log)
    compiler.missing = {'motion'}
    clock.step = 1.0
    run(live, 30)
    compiler.finish(OSError('no space'))
    run(live)
    assert 'overload, grid 4 times coarser: the kernels cannot be compiled (OSError' in log.text


def test_closing_ends_the_background_work(live, compiler):
    live.close()
    assert compiler.closed


# Whole lines from each thread: what `print` writes in pieces could be interrupted by the log.
FIRST_START = """
import logging, sys, time
import numpy as np
from cloth_ros import Scene
from cloth_ros.live.live_cloth import LiveCloth
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format='%(message)s')
log = logging.getLogger()
live = LiveCloth(Scene(
    sheet={'rows': 9, 'columns': 9}, sphere={'radius': 0.1, 'position': (0.0, 0.0, 9.0)}
), log)
def positions():
    out = np.empty((9, 9, 3))
    live.write_positions(out)
    return out
def tick_while(condition):
    while condition():
        live.tick(1 / 60, period=1 / 60, wall=1 / 60)
        live.estimate_error(1 / 60)
        time.sleep(0.002)
first = positions()
live.tick(1 / 60, period=1 / 60, wall=1 / 60)
log.info(f'held at first: {live.take_report().held} {np.array_equal(first, positions())}')
tick_while(lambda: not live.running)
tick_while(lambda: np.array_equal(first, positions()))
log.info('moves')
live.bodies.move('sphere', (0.0, 0.0, 1.0))
tick_while(lambda: live.colliders['sphere'].position[2] > 5.0)
log.info('sphere moved')
tick_while(lambda: live.values()['error estimate [m]'] == 'not yet sampled')
log.info(f"estimated {live.values()['error estimate [m]'] < 0.01}")
live.close()
"""


@pytest.mark.slow
def test_the_first_start_with_real_processes_and_an_empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    done = run_python(FIRST_START)
    assert done.returncode == 0, done.stderr
    assert 'held at first: the kernels of motion are being compiled True' in done.stdout
    order = [
        'compiling the kernels of motion (1 of 3)',
        'compiled the kernels of motion (1 of 3)',
        '\nmoves',
        'the cloth is held: a collider may touch it, and the kernels of contact',
        'compiled the kernels of contact (2 of 3)',
        'sphere moved',
        'compiled the kernels of the error estimate (3 of 3)',
        'estimated True',
    ]
    found = [done.stdout.find(text) for text in order]
    assert -1 not in found, done.stdout
    assert found[:3] == sorted(found[:3])
    assert found[4:] == sorted(found[4:])
    assert 'in this process' not in done.stdout
