"""Snapshots: everything that later results depend on, and nothing else."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest
from builders import bits, cloth_of, crumple, examples, momentum, precisions, scene_of, seeds
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Inputs, Scene
from cloth_ros.model.integrators import kick_drift
from cloth_ros.model.resample import resample_scene
from cloth_ros.model.snapshot_file import decode, encode


class Advance(NamedTuple):
    """An advance after commands; `abandon`: number of batches after which it is given up."""

    seconds: float
    wind: tuple[float, float, float] | None = None
    waypoints: tuple[tuple[float, float, float], ...] = ()
    abandon: int | None = None


vectors = st.tuples(*[st.sampled_from([-1.0, 0.0, 0.2, 1.0])] * 3)
plans = st.lists(
    st.builds(
        Advance,
        seconds=st.sampled_from([0.0, 1e-4, 0.011, 1 / 60]),
        wind=st.none() | vectors.map(lambda vector: tuple(20 * x for x in vector)),
        waypoints=st.lists(vectors, max_size=2).map(tuple),
        abandon=st.sampled_from([None, None, 1, 3]),
    ),
    min_size=1,
    max_size=3,
)


# Parameters of scenes with all forces, beside a sphere; all of them share two kernels.
PARAMETERS = {
    'rate': st.just(100.0),
    'sheet__rows': st.integers(3, 8),
    'sheet__columns': st.integers(3, 8),
    'sheet__position': st.sampled_from([(0.0, 0.0, 0.0), (1e4, -1e4, 100.0)]),
    'pins': st.sampled_from([[''], ['0,0', '0,-1'], ['0,:']]),
    'springs__structural': st.sampled_from([500.0, 5e4]),
    'springs__damping': st.sampled_from([1e-5, 1e-2]),
    'drag': st.sampled_from([0.0, 0.5]),
    'gravity': st.sampled_from([(0.0, 0.0, 0.0), (0.0, 1.0, -9.81)]),
    'wind__gust': st.sampled_from([{}, {'period': 0.0123, 'duration': 0.005}]),
    'sphere__radius': st.sampled_from([0.0, 0.1, 0.4]),
    'solver__precision': precisions,
}


def beside(parameters: dict, offset: tuple[float, float, float]) -> Scene:
    return scene_of(**parameters, sphere__position=np.add(parameters['sheet__position'], offset))


scenes = st.builds(beside, st.fixed_dictionaries(PARAMETERS), vectors)


def advance(cloth: Cloth, seconds: float, inputs: Inputs | None, abandon: int | None) -> object:
    """Advance, perhaps not to the end; return the bits of the state after it."""
    steps = cloth.advance_stepwise(seconds, inputs)
    for n, _ in enumerate(steps, 1):
        if n == abandon:
            steps.close()
    return bits(dataclasses.replace(cloth.snapshot(), inputs=Inputs()))


def play(cloth: Cloth, plan: list[Advance]) -> list[tuple[Inputs, object]]:
    """Give commands and advance; return the inputs of each advance, and the bits after it."""
    result = []
    for seconds, wind, waypoints, abandon in plan:
        cloth.wind = cloth.wind if wind is None else wind
        for point in waypoints if cloth.colliders else ():
            cloth.move_sphere(np.add(cloth.scene.sheet.position, point))
        result.append((cloth.inputs, advance(cloth, seconds, None, abandon)))
    return result


def check_repeatable(cloth: Cloth, history: list[Advance], plan: list[Advance]) -> None:
    """Check that the same advances give the same bits after `restore` and after `reset`."""
    play(cloth, history)
    snapshot = cloth.snapshot()
    before, loaded = bits(snapshot), decode(encode(snapshot))
    assert bits(loaded) == before
    expected = play(cloth, plan)
    assert bits(snapshot) == before  # later advances do not change it
    other = Cloth(cloth.scene.with_parameters({'drag': 3.0, 'sphere.radius': 0.2}))
    play(other, [*plan, *history])
    other.configure(cloth.scene)
    for each in (cloth, other, Cloth(cloth.scene)):
        each.restore(loaded)
        assert bits(each.snapshot()) == before
        assert play(each, plan) == expected
        each.restore(snapshot)
        for (seconds, _, _, abandon), (inputs, after) in zip(plan, expected, strict=True):
            assert advance(each, seconds, inputs, abandon) == after
    for each in (cloth, other):
        each.reset()
        assert bits(each.snapshot()) == bits(Cloth(each.scene).snapshot())
        assert play(each, plan) == play(Cloth(each.scene), plan)


@examples(0.25)
@given(
    scene=scenes,
    seed=seeds,
    size=st.sampled_from([0.0, 0.003, 0.3]),
    speed=st.sampled_from([0.0, 1.0, 100.0]),
    history=plans,
    plan=plans,
)
def test_the_same_advances_give_the_same_bits(scene, seed, size, speed, history, plan):
    check_repeatable(crumple(Cloth(scene), size, seed, speed=speed), history, plan)


def test_a_file_has_the_bits_of_a_collider_that_was_placed_inside_the_sheet():
    cloth = cloth_of(
        sphere__radius=0.4, sphere__position=(-0.4, 0.0, 0.0), sheet__position=(0.0, 0.0, 0.0)
    )
    cloth.advance(1e-4)
    snapshot = cloth.snapshot()
    assert snapshot.contact.colliders['sphere'].inset > 0
    assert bits(decode(encode(snapshot))) == bits(snapshot)


@pytest.mark.parametrize('threads', [1, 3])
def test_also_with_contact_roll_backs_gusts_and_threads(threads, monkeypatch):
    monkeypatch.setattr(kick_drift, '_MIN_THREADED', 1)
    cloth = cloth_of(
        sheet={'rows': 34, 'columns': 34, 'position': (0.0, 0.0, 0.0)},
        springs={'structural': 5e4, 'damping': 1e-7},
        wind__gust={'period': 0.002, 'duration': 0.001},
        sphere={'radius': 0.3, 'position': (0.0, 0.0, -0.31)},
        solver__threads=threads,
    )
    start = crumple(cloth, 0.003).snapshot()
    plan = [Advance(0.003, (0.0, 9.0, 5.0), ((0.0, 0.0, -0.29),)), Advance(0.001)]
    check_repeatable(cloth, [], plan)
    before = cloth.rollbacks.refined
    cloth.restore(start)
    play(cloth, plan)
    assert cloth.rollbacks.refined > before
    distances = np.linalg.norm(cloth.positions - cloth.sphere_position, axis=-1)
    assert distances.min() == pytest.approx(cloth.sphere_radius, abs=5e-3)


# Conversion to other scenes


def converted(cloth: Cloth, scene: Scene) -> Cloth:
    """Return a cloth of another scene, in the state of a cloth."""
    other = Cloth(scene)
    other.restore(cloth.snapshot())
    assert (other.time, other.work, other.inputs) == (cloth.time, cloth.work, cloth.inputs)
    assert other.sphere_position == cloth.sphere_position
    return other


@examples(0.1)
@given(scenes, seeds)
def test_another_precision_keeps_the_state_to_rounding(scene, seed):
    single, double = (
        scene.with_parameters({'solver.precision': each}) for each in ('single', 'double')
    )
    cloth = crumple(Cloth(single), 0.1, seed, speed=1.0)
    cloth.wind = (1.0, 2.0, 3.0)
    fine = converted(cloth, double)
    assert np.array_equal(fine.positions, cloth.positions)
    assert np.array_equal(fine.velocities, cloth.velocities)
    again = converted(fine, single)
    assert bits(again.snapshot().position) == bits(cloth.snapshot().position)
    coarse = converted(crumple(fine, 0.1, seed, speed=1.0), single)
    np.testing.assert_allclose(coarse.positions, fine.positions, atol=1e-6)
    np.testing.assert_allclose(coarse.velocities, fine.velocities, rtol=1e-6)


@examples(0.25)
@given(
    *(seeds, precisions, st.sampled_from([1, 5, 9, 13]), st.sampled_from([5, 9, 17])),
    *(st.sampled_from([0.5, 2.0, 3.0]), st.sampled_from([0.0, 1e5])),
)
def test_another_grid_keeps_an_affine_state(seed, precision, rows, columns, factor, distance):
    """Shape, mean position and momentum, also far from the initial position."""
    sheet = {'sheet__rows': rows, 'sheet__columns': columns}
    scene = scene_of(**sheet, pins=[''], solver__precision=precision)
    generator, tight = np.random.default_rng(seed), 1e-6 if precision == 'single' else 1e-10
    strain, spin = generator.uniform(-0.2, 0.2, (2, 3, 3))
    shift, velocity = generator.normal(0, 1, (2, 3)) - ((0, 0, distance), (0, 0, 0))

    def affine(rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        flat = rest - scene.sheet.position
        return flat + flat @ strain + shift, flat @ spin + velocity

    cloth, other = Cloth(scene), Cloth(resample_scene(scene, factor))
    cloth.positions, cloth.velocities = affine(cloth.positions)
    there = converted(cloth, other.scene)
    positions, velocities = affine(other.positions)
    np.testing.assert_allclose(there.positions, positions, rtol=0, atol=tight)
    np.testing.assert_allclose(there.velocities, velocities, rtol=0, atol=tight)
    np.testing.assert_allclose(momentum(there), momentum(cloth), rtol=0, atol=tight)


@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('factor', [0.5, 2.0])
def test_another_grid_keeps_a_swinging_sheet_and_its_pins(factor, precision):
    sheet = {'rows': 17, 'columns': 21}
    # One of the pins is between the particles of the coarser grid.
    scene = scene_of(sheet=sheet, pins=['0,0', '0,-1', '5,3'], solver__precision=precision)
    cloth, other = Cloth(scene), resample_scene(scene, factor)
    cloth.advance(0.2)
    there, pinned = converted(cloth, other), other.pinned()
    initial = Cloth(other).positions[pinned]
    assert np.array_equal(there.positions[pinned], initial)
    assert not there.velocities[pinned].any()
    shift = there.positions.mean((0, 1)) - cloth.positions.mean((0, 1))
    slower = (momentum(there) - momentum(cloth)) / (0.2 * np.abs(cloth.velocities).max())
    assert np.abs([shift, slower]).max() < 0.05
    back = converted(there, scene)
    assert np.linalg.norm(back.positions - cloth.positions, axis=-1).max() < 0.1
    assigned = Cloth(other)
    assigned.positions, assigned.velocities = there.positions, there.velocities
    for each in (there, assigned):
        each.advance(0.05)
        assert np.array_equal(each.positions[pinned], initial)
    np.testing.assert_allclose(there.positions, assigned.positions, atol=1e-5)


@pytest.mark.parametrize('distance', [0.0, 4e9])
def test_pins_set_while_a_cloth_runs_stay_where_they_are_on_every_grid(distance):
    scene = scene_of(sheet__rows=33, sheet__columns=41, solver__precision='double')
    cloth = Cloth(scene.with_parameters({'pins': ['']}))
    cloth._simulation.state.origin = np.array((0.0, 0.0, 1.0 - distance))
    cloth.advance(0.5)
    held = cloth.positions[scene.pinned()]
    for factor in (1.0, 0.5, 0.25, 1.0):
        cloth = converted(cloth, resample_scene(scene, factor))
        cloth.advance(0.1)
        np.testing.assert_allclose(cloth.positions[cloth.scene.pinned()], held, atol=2e-6)
