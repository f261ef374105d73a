"""The last guard: provoked, and never needed where nothing is wrong."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.energy import EnergyMeter, energy
from cloth_ros.model.grid import Grid
from cloth_ros.model.integrators.damped_euler import DampedEuler
from cloth_ros.model.integrators.integrator import SubstepBatch
from cloth_ros.model.integrators.kick_drift import KickDrift
from cloth_ros.model.state import State
from cloth_ros.model.time_step import rounding_heating_rate

CONFIG = Path(__file__).parent.parent / 'config'
BARE = {'drag': 0.0, 'wind.air_density': 0.0}
SMALL = Scene().with_parameters({'sheet.rows': 12, 'sheet.columns': 12, **BARE})
WEIGHTLESS = SMALL.with_parameters({'gravity': [0.0, 0.0, 0.0]})


def crumpled(scene: Scene, size: float) -> Cloth:
    cloth = Cloth(scene)
    moved = cloth.positions + np.random.default_rng(0).normal(0, size, cloth.positions.shape)
    pinned = scene.pinned()
    moved[pinned] = cloth.positions[pinned]
    cloth.positions = moved
    return cloth


@pytest.mark.parametrize('size', [0.01, 0.1, 0.5])
@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_crumpled_cloth_gains_no_energy(size, precision):
    scene = WEIGHTLESS.with_parameters(
        {
            'springs.structural': 5e4,
            'springs.shear': 2.5e4,
            'springs.bending': 5e3,
            'solver.precision': precision,
        }
    )
    cloth = crumpled(scene, size)
    start = cloth.energy()
    for _ in range(20):
        cloth.advance(1 / 600)
        assert cloth.energy() < 1.03 * start
    # The first stretch was repeated finer, one time or two; after that the cloth knew.
    assert 1 <= cloth.rollbacks.finer <= 2
    assert cloth.rollbacks.held == cloth.rollbacks.damped == cloth.rollbacks.limited == 0


@pytest.mark.parametrize('size', [0.1, 0.5])
@pytest.mark.parametrize('more', [0, 1])
def test_a_fixed_step_lets_energy_swing_as_an_oscillator_does_and_no_farther(size, more):
    """At the longest step that is accepted, φ is 0.81, and anything had counted as a swing."""
    stiff = {'springs.structural': 5e4, 'springs.shear': 2.5e4, 'springs.bending': 5e3}
    scene = WEIGHTLESS.with_parameters({'rate': 600.0, **stiff})
    least = math.ceil(1 / (600 * 0.9 * scene.stability_limit()))
    scene = scene.with_parameters({'solver.substeps': least + more})
    step = 1 / (600 * (least + more))
    phase = 0.25 * step**2 * scene.rate_bounds()[0]
    cloth = crumpled(scene, size)
    start = cloth.energy()
    for _ in range(300):
        cloth.advance(1 / 60)
        assert cloth.energy() < 1.01 * start / (1 - phase)


@pytest.mark.parametrize('wrong', [np.nan, np.inf, 1e30])
def test_a_state_that_is_no_good_is_made_again_from_the_last_good_one(wrong):
    cloth, other = Cloth(SMALL), Cloth(SMALL)
    for each in (cloth, other):
        each.advance(0.1)
    cloth._state.velocity[0, cloth._grid_layout.begin + 20] = wrong
    for each in (cloth, other):
        each.advance(0.1)
    assert cloth.time == other.time
    assert np.isfinite(cloth.positions).all()
    assert np.isfinite(cloth.velocities).all()
    assert cloth.rollbacks.text == '1 finer'
    np.testing.assert_allclose(cloth.positions, other.positions, atol=1e-3)


def test_a_step_that_the_user_has_fixed_is_left_as_it_is():
    """Also where the energy of its oscillators swings by more than the guard's tolerance."""
    cloth = crumpled(WEIGHTLESS.with_parameters({'solver.substeps': 40}), 0.002)
    for _ in range(60):
        cloth.advance(1 / 60)
        assert cloth.substeps == 40
    assert cloth.rollbacks.text == ''


class Wrong:
    """A method that does its work, and then spoils what comes out."""

    def __init__(self, cloth: Cloth, spoil) -> None:
        self._method, self._spoil = cloth._method, spoil

    def run(self, state, blocks, moved, watched):
        yield from self._method.run(state, blocks, moved, watched)
        self._spoil(state)


def test_velocities_are_scaled_down_where_finer_steps_do_not_help():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    start = cloth.energy()
    moving = cloth.velocities

    def push(state):
        state.velocity *= 2

    cloth._method = Wrong(cloth, push)
    cloth.advance(1e-6)
    assert cloth.rollbacks.text == '2 finer, 1 limited'
    assert cloth.energy() == pytest.approx(start, abs=1e-3 * abs(start))
    np.testing.assert_allclose(cloth.velocities, moving, rtol=1e-2, atol=1e-3)


def test_a_cloth_goes_on_damped_where_nothing_else_helps():
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    start, before = cloth.energy(), cloth.positions

    def lose(state):
        state.velocity[...] = np.nan

    cloth._method = Wrong(cloth, lose)
    for n in range(1, 4):
        cloth.advance(1 / 60)
        assert cloth.rollbacks.damped >= n
        assert np.isfinite(cloth.positions).all()
        assert cloth.energy() <= start + 1e-6
    assert not np.array_equal(cloth.positions, before)
    assert cloth.rollbacks.held == 0


def test_a_cloth_is_held_where_even_that_does_not(monkeypatch):
    cloth = Cloth(SMALL)
    cloth.advance(0.3)
    before, time = cloth.positions, cloth.time

    def lose(state):
        state.position[...] = np.nan

    cloth._method = Wrong(cloth, lose)
    monkeypatch.setattr(cloth, '_damped', lambda _: cloth._method)
    cloth.advance(1 / 60)
    assert cloth.time == pytest.approx(time + 1 / 60)
    assert np.array_equal(cloth.positions, before)
    assert not cloth.velocities.any()
    assert cloth.rollbacks.held > 0


def test_a_cloth_is_held_where_even_contact_fails(monkeypatch):
    cloth = Cloth(SMALL.with_parameters({'sphere.radius': 0.1, 'sphere.position': [0, 0, 2.0]}))
    cloth.advance(0.3)
    before = cloth.positions
    monkeypatch.setattr(cloth._contact, 'resolve', lambda state, h: state.velocity.fill(np.inf))
    cloth.advance(1 / 60)
    assert np.array_equal(cloth.positions, before)
    assert not cloth.velocities.any()
    assert cloth.rollbacks.held > 0


@pytest.mark.parametrize('scene', sorted(CONFIG.glob('*.yaml'), key=lambda path: path.stem))
def test_nothing_is_repeated_in_the_scenes_that_come_along(scene):
    cloth = Cloth(Scene.from_yaml(scene))
    for _ in range(60):
        cloth.advance(1 / 60)
    assert cloth.rollbacks.text == ''


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    rows=st.integers(1, 7),
    columns=st.integers(1, 7),
    size=st.floats(0.001, 3.0),
    speed=st.floats(0.0, 100.0),
    step=st.floats(0.01, 0.9),
    drag=st.sampled_from([0.0, 0.5, 1e3, 1e6]),
    division=st.sampled_from([1, 2, 8]),
)
def test_the_damped_method_never_gains_energy(
    seed, rows, columns, size, speed, step, drag, division
):
    generator = np.random.default_rng(seed)
    scene = SMALL.with_parameters(
        {'sheet.rows': rows, 'sheet.columns': columns, 'pins': ['0,0'], 'drag': drag}
    )
    elastic, _ = scene.rate_bounds()
    h = step / math.sqrt(elastic) if elastic else step
    lattice = Grid(rows, columns)
    state = State(lattice, np.float64)
    state.pin(scene.pinned())
    state.world = Cloth(scene).positions.transpose(2, 0, 1)
    free = lattice.grid(state.free)
    state.world += generator.normal(0, size, (3, rows, columns)) * free
    lattice.grid(state.velocity)[...] = generator.normal(0, speed, (3, rows, columns)) * free
    more = DampedEuler.drag(h, elastic)
    method = DampedEuler(KickDrift(scene, lattice, np.zeros(3), np.float64, more_drag=more))
    before = energy(state.world, state.speeds, scene)
    for _ in range(15):
        for _ in method.run(
            state, [SubstepBatch(1, h / division)], lambda _: None, lambda _: False
        ):
            pass
        after = energy(state.world, state.speeds, scene)
        assert after.total <= before.total + 1e-12 * (before.motion + abs(before.gravitational))
        before = after


@given(q=st.floats(1e-6, 1.0, exclude_max=True), more=st.floats(0.0, 50.0), n=st.integers(1, 64))
def test_the_form_that_the_damped_method_rests_on_is_never_positive(q, more, n):
    """For substeps n times shorter than the drag was chosen for, and drag on top; h = 1."""
    rate = -0.5 * math.log1p(-q) / n + more
    s, g, q = math.exp(-rate), -math.expm1(-rate) / rate, q / n**2
    vv, va, aa = s * s * (1 + q) - 1, s * ((1 + q) * g - 1), g * ((1 + q) * g - 2)
    assert max(np.linalg.eigvalsh([[vv, va], [va, aa]])) < 1e-12


def test_a_stretch_that_is_divided_already_is_repeated_from_its_start():
    cloth = Cloth(SMALL)
    cloth.advance(0.1)
    cloth._energy_monitor.division = 4
    starts, spoil = [], [True]

    class Spoiling(Wrong):
        def run(self, state, blocks, moved, watched):
            starts.append(cloth.time)
            yield from super().run(state, blocks, moved, watched)

    def push(state):
        if spoil:
            spoil.clear()
            state.velocity *= 100

    cloth._method = Spoiling(cloth, push)
    cloth.advance(1e-3)
    assert starts == [0.1, 0.1]
    assert cloth._energy_monitor.division == 16


def test_longer_substeps_come_back_after_a_while():
    cloth = Cloth(SMALL.with_parameters({'drag': 0.5}))
    cloth.advance(1 / 60)
    calm = cloth.substeps
    cloth._state.velocity[0, cloth._grid_layout.begin + 20] = np.nan
    cloth.advance(1 / 60)
    assert cloth.substeps > 2 * calm
    for _ in range(300):
        cloth.advance(1 / 60)
    assert cloth.substeps == calm
    assert cloth.rollbacks.text == '1 finer'


def test_work_that_is_no_number_is_no_excuse():
    cloth = Cloth(SMALL)
    cloth.advance(0.1)
    assert not cloth._energy_monitor.accepts(cloth._state, math.nan)
    assert cloth._energy_monitor.accepts(cloth._state, 0.0)


def test_a_march_that_is_given_up_leaves_no_work_behind():
    cloth = Cloth(WEIGHTLESS.with_parameters({'wind.air_density': 1.2}))
    cloth.wind = (0.0, 0.0, 50.0)
    advance_stepwise = cloth.advance_stepwise(1.0)
    for _ in range(4):
        next(advance_stepwise)
    cloth.reset()
    cloth.advance(1e-4)
    assert abs(cloth.work) < 1e-6


@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('family', ['structural', 'shear', 'bending'])
def test_the_meter_agrees_with_the_definition(precision, family):
    others = {f'springs.{name}': 0.0 for name in ('structural', 'shear', 'bending')}
    scene = SMALL.with_parameters(
        {**others, f'springs.{family}': 100.0, 'solver.precision': precision}
    )
    cloth = crumpled(scene, 0.05)
    cloth.velocities = np.random.default_rng(1).normal(0, 1, cloth.positions.shape)
    meter = EnergyMeter(scene, cloth._state.dtype)
    tight = 1e-12 if precision == 'double' else 1e-5
    np.testing.assert_allclose(meter.measure(cloth._state), cloth.energy_by_kind(), rtol=tight)


def test_the_work_of_the_wind_is_what_the_cloth_has_gained_and_little_more():
    scene = WEIGHTLESS.with_parameters(
        {'wind.air_density': 1.2, 'pins': [''], 'solver.precision': 'double'}
    )
    cloth = Cloth(scene)
    cloth.wind = (1.0, 2.0, 5.0)
    for _ in range(30):
        cloth.advance(1 / 60)
    assert cloth.energy() > 1.0
    # What the wind slows down again is not taken off.
    assert 0.999 < cloth.work / cloth.energy() < 1.2


def test_air_at_rest_does_no_work():
    cloth = Cloth(SMALL.with_parameters({'wind.air_density': 1.2}))
    cloth.advance(0.5)
    assert cloth.work == 0


@pytest.mark.parametrize(('mass', 'speed'), [(0.02, 20.0), (0.005, 60.0)])
def test_nothing_is_repeated_in_a_storm_that_a_light_cloth_can_bear(mass, speed):
    scene = {'sheet.mass': mass, 'wind.velocity': [0.0, speed, 2.0]}
    cloth = Cloth(Scene().with_parameters(scene))
    for _ in range(120):
        cloth.advance(1 / 60)
    assert cloth.rollbacks.text == ''


def test_the_two_ends_of_a_spring_feel_the_same_force():
    """A free sheet that nothing acts on stays where it is, rounding or not."""
    cloth = Cloth(
        WEIGHTLESS.with_parameters(
            {
                'sheet.rows': 2,
                'sheet.columns': 11,
                'sheet.size': [2.2, 2.4],
                'pins': [''],
                'springs.structural': 1e6,
            }
        )
    )
    for _ in range(20):
        cloth.advance(1 / 60)
    assert np.abs(cloth.velocities.mean((0, 1))).max() < 0.01  # m/s, once 1
    assert cloth.energy() < 0.01  # J, once 0.6


def test_a_cloth_that_single_precision_would_heat_is_taken_in_double():
    stiff = WEIGHTLESS.with_parameters({'springs.structural': 1e8, 'sheet.mass': 1e-3})
    assert stiff.solver.precision == 'single'
    assert rounding_heating_rate(stiff) > 1
    cloth = Cloth(stiff)
    assert cloth.velocities.dtype == float
    assert cloth._state.dtype is np.float64
    cloth.advance(1e-3)
    assert cloth.energy() < 1e-9
    assert rounding_heating_rate(Scene()) < 1e-5
