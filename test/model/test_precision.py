"""Choice of precision: single precision is used only where it resolves every effect of a scene."""

import math

import numpy as np
import pytest
from builders import (
    ROOT,
    SCENE_FILES,
    SPRINGS_ONLY,
    cloth_of,
    examples,
    mean_by_mass,
    scene_of,
)
from hypothesis import given, reject
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.live.solver_summary import solver_summary
from cloth_ros.model import check_scene
from cloth_ros.model.integrators.integrator import SubstepBatch
from cloth_ros.model.precision import (
    MAX_LOSS,
    fall_speed,
    precision_for,
    reason_for_double,
    rounding_heating_rate,
    rounding_losses,
    terminal_speed,
)
from cloth_ros.model.state import max_speed
from cloth_ros.model.step_control import ConstantStep
from cloth_ros.model.time_step import dissipation_interval, substep_length

# Free sheets of 3 × 3 particles without air move as one particle does.
DOUBLE = {'solver.precision': 'double'}
FREE = {'sheet__rows': 3, 'sheet__columns': 3, 'pins': [''], 'wind__air_density': 0.0}


def magnitudes(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def optional(strategy: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    return st.just(0.0) | strategy


@st.composite
def free_scenes(draw: st.DrawFn) -> Scene:
    """Draw scenes of which some need double precision for each effect, and some do not."""
    parts = np.array([draw(st.floats(-1, 1)), draw(st.floats(-1, 1)), -1.0])
    pull = draw(magnitudes(1e-3, 1e3))
    scene = scene_of(
        **FREE,
        rate=draw(magnitudes(1.0, 1000.0)),
        gravity=list(pull * parts / np.linalg.norm(parts)),
        drag=draw(optional(magnitudes(1e-4, 1e4))),
        sheet__size=[draw(magnitudes(0.01, 100.0))] * 2,
        sheet__mass=draw(magnitudes(1e-5, 1e3)),
        springs__structural=draw(magnitudes(0.1, 1e6)),
        springs__damping=draw(optional(magnitudes(1e-6, 1e3))),
        solver__substeps=draw(st.just(0) | magnitudes(1.0, 1e6).map(round)),
    )
    try:
        check_scene(scene)
    except ValueError:  # a fixed number of substeps is too small
        reject()
    return scene


class IntervalsOfSingle(ConstantStep):
    """Step control in which air acts in one of several substeps, also in double precision."""

    division = 1

    def __init__(self, scene: Scene) -> None:
        self._scene, self.substep = scene, substep_length(scene)

    def batches(self, state, count, h, division, airspeed):
        airspeed += max_speed(state)
        return [SubstepBatch(count, h, dissipation_interval(self._scene, h, 0.0, airspeed))]


def single_cloth(scene: Scene, **more: object) -> Cloth:
    """Return a cloth in single precision, also of a scene that needs double precision."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr('cloth_ros.model.simulation.precision_for', lambda scene: 'single')
        return Cloth(scene, **more)


def push(cloth: Cloth, velocity: np.ndarray) -> np.ndarray:
    """Set the same velocity everywhere; return it as it is rounded."""
    cloth.velocities = np.broadcast_to(velocity, cloth.velocities.shape)
    return cloth.velocities[0, 0]


def exact_change(cloth: Cloth, start: np.ndarray, seconds: float) -> tuple[np.ndarray, ...]:
    """Return how much gravity and drag change a velocity exactly, m/s, without springs."""
    scene = cloth.scene
    lost = -math.expm1(-scene.drag * seconds)
    gained = np.array(scene.gravity) * (lost / scene.drag if scene.drag else seconds)
    return gained, -lost * start


# Against the exact solution


@pytest.mark.parametrize(
    'change', [{'solver__substeps': 1_000_000}, {'sheet__mass': 1e-3, 'springs__damping': 200.0}]
)
def test_gravity_is_not_lost_in_many_short_substeps(change):
    cloth = cloth_of(**FREE, drag=0.0, **change)
    push(cloth, np.array([0.0, 0.0, -5.0]))
    cloth.advance(1e-4)
    np.testing.assert_allclose(cloth.velocities[..., 2] + 5.0, -9.81e-4, rtol=1e-3)


@given(scene=free_scenes(), share=st.floats(0, 1), substeps=st.integers(50, 1000))
def test_a_fall_is_exact_whatever_the_scene(scene, share, substeps):
    """From any speed up to that of a fall by the diagonal, with drag and dashpots."""
    cloth = Cloth(scene)
    pull = np.linalg.norm(scene.gravity)
    start = push(cloth, share * fall_speed(scene) / pull * np.array(scene.gravity))
    seconds = substeps * cloth.substep
    cloth.advance(seconds)
    gained, lost = exact_change(cloth, start, seconds)
    found = mean_by_mass(cloth, cloth.velocities) - start
    # At a constant speed up to 8/3 of the mean; and two roundings of the velocity itself.
    allowed = MAX_LOSS * (8 / 3 * np.linalg.norm(gained) + np.linalg.norm(lost))
    allowed += 2**-23 * np.linalg.norm(start + gained + lost)
    assert np.linalg.norm(found - gained - lost) <= allowed


@examples(0.5)
@given(scene=free_scenes(), share=st.floats(-1, 1), substeps=st.integers(50, 1000))
def test_a_steady_fall_is_exact_whatever_the_scene(scene, share, substeps):
    speed = terminal_speed(scene)
    if not speed < fall_speed(scene):
        reject()
    cloth = Cloth(scene)
    start = push(cloth, np.array(scene.gravity) / scene.drag)
    cloth.positions = cloth.positions + share * np.array([*scene.sheet.size, scene.sheet.size[0]])
    before = cloth.positions
    seconds = substeps * cloth.substep
    cloth.advance(seconds)
    moved = mean_by_mass(cloth, cloth.positions - before)
    resolution = 2**-23 * scene.sheet.diagonal
    # Twice the mean over all positions, gravity and drag.
    allowed = (2 + 8 / 3 + 1) * MAX_LOSS * speed * seconds + resolution
    assert np.linalg.norm(moved - start * seconds) <= allowed


# The bounds, in single precision where double would be chosen


@given(scene=free_scenes(), substeps=st.integers(50, 1000))
def test_the_loss_of_gravity_is_bounded(scene, substeps):
    scene = scene.with_parameters({'drag': 0.0})
    cloth, speed = single_cloth(scene), fall_speed(scene)
    pull = np.linalg.norm(scene.gravity)
    direction = np.array(scene.gravity) / pull
    start = push(cloth, 0.8 * speed * direction)
    seconds = min(substeps * cloth.substep, 0.2 * speed / pull)
    cloth.advance(seconds)
    gained = (mean_by_mass(cloth, cloth.velocities) - start) @ direction
    # At a constant speed up to 8/3 of the mean; and a rounding of the velocity itself.
    bound = 8 / 3 * rounding_losses(scene)['gravity'] * pull * seconds + 2**-24 * speed
    assert abs(gained - pull * seconds) <= bound


@given(scene=free_scenes(), substeps=st.integers(50, 1000))
def test_the_loss_of_drag_is_bounded(scene, substeps):
    drag = min(scene.drag or 0.5, 3 / (substeps * substep_length(scene)))
    scene = scene.with_parameters({'drag': drag, 'gravity': [0.0, 0.0, 0.0]})
    cloth = single_cloth(scene)
    # So slow that no substep is divided.
    start = push(cloth, 0.05 * scene.sheet.size[0] / cloth.substep * np.array([0.3, 0.0, -0.7]))
    seconds = substeps * cloth.substep
    cloth.advance(seconds)
    rate = -np.log(np.linalg.norm(mean_by_mass(cloth, cloth.velocities)) / np.linalg.norm(start))
    assert abs(rate / (drag * seconds) - 1) <= rounding_losses(scene)['drag'] + 1e-6


@examples(0.5)
@given(scene=free_scenes(), wind=magnitudes(1e-4, 30.0), substeps=st.integers(50, 1000))
def test_the_loss_of_wind_is_bounded(scene, wind, substeps):
    """Compared with double precision: the air does not accelerate all particles alike."""
    bare = {'drag': 0.0, 'gravity': [0.0, 0.0, 0.0], 'springs.damping': 0.0}
    air = {'wind.air_density': 1.2, 'wind.velocity': [0.0, 0.8 * wind, 0.6 * wind]}
    scene = scene.with_parameters({**bare, **air})
    single = single_cloth(scene, step_control=IntervalsOfSingle)
    double = Cloth(scene.with_parameters(DOUBLE), step_control=IntervalsOfSingle)
    # No longer than until the cloth is about as fast as the wind.
    kappa = 0.6 * scene.sheet.size[0] ** 2 / scene.sheet.mass
    seconds = min(substeps * single.substep, max(1 / (kappa * wind), 17 * single.substep))
    for cloth in (single, double):
        cloth.advance(seconds)
    loss = np.linalg.norm(mean_by_mass(single, single.velocities - double.velocities))
    allowed = (rounding_losses(scene)['wind'] + 1e-6) * kappa * wind**2 * seconds
    # And less than what moves a particle by some roundings of its position.
    assert loss <= allowed + 2**-21 * scene.sheet.diagonal / seconds


@pytest.mark.parametrize(
    ('effect', 'parameters'),
    [
        ('gravity', {'drag': 0.0, 'solver__substeps': 1_000_000}),
        ('drag', {'drag': 1e-3, 'solver__substeps': 1_000_000}),
        ('steady motion', {'drag': 1e5, 'solver__substeps': 1000}),
    ],
)
def test_each_effect_is_lost_in_single_precision_where_its_bound_is_large(effect, parameters):
    scene = scene_of(**FREE, **parameters)
    assert rounding_losses(scene)[effect] > 0.5
    cloth = single_cloth(scene.with_parameters({'gravity': [0, 0, -9.81 * (effect != 'drag')]}))
    speed = min(9.0, terminal_speed(scene))
    push(cloth, np.array([0.0, 0.0, -speed]))
    cloth.positions = cloth.positions + np.array([0.0, 0.0, 0.7])
    field = 'positions' if effect == 'steady motion' else 'velocities'
    before = getattr(cloth, field)[..., 2]
    cloth.advance(100 * cloth.substep)
    assert np.array_equal(getattr(cloth, field)[..., 2], before)


# Which scenes need double precision, and what the log says


def hanging(size: int, **changes: object) -> Scene:
    return scene_of(sheet__rows=size, sheet__columns=size, **changes)


BARE = {'wind__air_density': 0.0, 'drag': 0.0}
ORDINARY = {
    'defaults': Scene(),
    **{path.stem: Scene.from_yaml(path) for path in SCENE_FILES},
    **{f'bare, {2**n}': hanging(2**n, **BARE) for n in range(4, 11)},
    **{f'with air and drag, {2**n}': hanging(2**n) for n in range(4, 10)},
    **{f'free, {2**n}': hanging(2**n, pins=['']) for n in range(4, 8)},
    **{
        f'wind of {speed:g} m/s': hanging(64, wind__velocity=[0, speed, 0])
        for speed in (0.1, 1.0, 20.0)
    },
    'dashpots': hanging(128, springs__damping=1e-3),
    'stiff': hanging(32, springs__structural=5e4),
    'on the moon': hanging(64, gravity=[0, 0, -1.62]),
    'small': hanging(32, sheet__size=[0.1, 0.1], sheet__mass=2e-3),
    'large': hanging(128, sheet__size=[10, 10], sheet__mass=20.0),
    'fine tolerance': hanging(32, solver__tolerance=1e-5),
}


@pytest.mark.parametrize('name', ORDINARY)
def test_ordinary_scenes_are_simulated_in_single_precision(name):
    assert reason_for_double(ORDINARY[name]) == ''


@pytest.mark.parametrize(
    ('parameters', 'reason'),
    [
        ({'solver__precision': 'double'}, 'as requested'),
        ({'solver__precision': 'auto', 'solver__tolerance': 9e-4}, 'for a tolerance below 1 mm'),
        ({**SPRINGS_ONLY, 'springs__structural': 1e8, 'sheet__mass': 1e-3}, 'would heat'),
        ({'gravity': (0, 0, -1e-3), **BARE}, ' % of the gravity'),
        ({'solver__substeps': 1_000_000, **BARE}, 'up to 72 % of the gravity'),
        ({'drag': 1e-3}, ' % of the drag'),
        ({'drag': 1e3}, ' % of the steady motion'),
        ({'wind__velocity': (0, 1e-3, 0)}, ' % of the wind'),
    ],
)
def test_the_summary_of_the_solver_says_why_a_scene_needs_double_precision(parameters, reason):
    scene = scene_of(**{'sheet__rows': 16, 'sheet__columns': 16, **parameters})
    assert precision_for(scene) == 'double'
    cloth = Cloth(scene)
    assert cloth._simulation.state.dtype is np.float64
    text = solver_summary(cloth, 0.0)
    assert 'in double precision (' in text
    assert reason in text.split('double precision (')[1].split(')')[0]
    assert ' in single precision, for a tolerance of 1 mm;' in solver_summary(Cloth(Scene()), 0.0)


def test_rounding_heats_stiff_and_light_cloths_alone():
    stiff = scene_of(**SPRINGS_ONLY, springs__structural=1e8, sheet__mass=1e-3)
    assert rounding_heating_rate(stiff) > 1
    assert rounding_heating_rate(Scene()) < 1e-5
    cloth = Cloth(stiff)
    cloth.advance(1e-3)
    assert cloth.energy() < 1e-9


def test_the_precision_changes_with_the_parameters_of_a_running_cloth():
    cloth = cloth_of(**FREE, drag=0.0)
    cloth.advance(0.5)
    for substeps, dtype in ((1_000_000, np.float64), (0, np.float32)):
        before = cloth.velocities[..., 2]
        cloth.configure(cloth.scene.with_parameters({'solver.substeps': substeps}))
        assert cloth._simulation.state.dtype is dtype
        cloth.advance(1e-4)
        np.testing.assert_allclose(cloth.velocities[..., 2] - before, -9.81e-4, rtol=1e-3)


def test_single_precision_is_exact_to_a_tenth_of_a_millimetre_until_the_sheet_folds():
    """Then a much smaller disturbance separates two runs as far: it decides where folds form."""

    def positions(precision: str, disturbance: float = 0.0) -> np.ndarray:
        scene = Scene.from_yaml(ROOT / 'config/hanging.yaml')
        cloth, ticks = Cloth(scene.with_parameters({'solver.precision': precision})), []
        noise = np.random.default_rng(0).normal(0, 1, cloth.positions.shape)
        cloth.positions = cloth.positions + disturbance * noise
        for _ in range(60):
            cloth.advance(1 / 60)
            ticks.append(cloth.positions)
        return np.array(ticks)

    double = positions('double')
    single, disturbed = (
        np.linalg.norm(other - double, axis=-1).max(axis=(1, 2))
        for other in (positions('single'), positions('double', 1e-9))
    )
    assert single[:12].max() < 1e-4  # 0.2 s
    assert disturbed.max() > 1e-4
    assert single.max() < 4 * disturbed.max()
