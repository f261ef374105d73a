"""Grippers: forces, momentum, energy, rigidity, slip, grasp, and the same bits again."""

import dataclasses
import math
from contextlib import suppress

import numpy as np
import pytest
from builders import (
    NEGLIGIBLE_AIR,
    Disturbance,
    bits,
    cloth_of,
    crumple,
    examples,
    mean_by_mass,
    momentum,
    overwrite,
    scene_of,
    seeds,
)
from colliders import matrix, turn
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Inputs
from cloth_ros.model.integrators import kick_drift
from cloth_ros.model.resample import resample_scene
from cloth_ros.model.snapshot_file import decode, encode

WEIGHT = 0.2 * 9.81  # N, of the sheet by default
SHEET = {'rows': 12, 'columns': 12, 'size': (0.5, 0.5), 'position': (0.0, 0.0, 1.0)}
CORNERS = {'left': (-0.25, -0.25, 1.0), 'right': (0.25, -0.25, 1.0)}


def gripped(radius: float = 0.08, **parameters: object) -> Cloth:
    """Return a free sheet, two corners of which are held by grippers."""
    cloth = Cloth(gripped_scene(radius, **parameters))
    for name in CORNERS:
        assert cloth.grasp(name) >= 1
    return cloth


def gripped_scene(radius: float = 0.08, **parameters: object):
    grippers = {name: {'position': place, 'radius': radius} for name, place in CORNERS.items()}
    values = {
        'sheet': SHEET, 'pins': [''], 'solver__precision': 'double', **NEGLIGIBLE_AIR,
        'gripper': {'names': list(CORNERS), **grippers},
    }  # fmt: skip
    return scene_of(**{**values, **parameters})


def held(cloth: Cloth, name: str) -> np.ndarray:
    """Return the positions of the particles that a gripper holds, m, shape (n, 3)."""
    return cloth.positions.reshape(-1, 3)[cloth.grippers[name].held]


def local(cloth: Cloth, name: str) -> np.ndarray:
    """Return these in the frame of the gripper."""
    gripper = cloth.grippers[name]
    return (held(cloth, name) - gripper.position) @ matrix(gripper.orientation)


def test_two_grippers_carry_the_weight_of_a_hanging_sheet():
    """Also its moment: forces and torques balance the weight in the centre of mass."""
    cloth = gripped(drag=4.0)
    cloth.advance(5.0)
    cloth.advance(1.0)
    force, torque = np.zeros(3), np.zeros(3)
    for name, gripper in cloth.grippers.items():
        push, twist = map(np.array, cloth.gripper_wrench(name))
        force += push
        torque += np.cross(gripper.position, push) + twist
    assert force == pytest.approx(np.array([0, 0, -WEIGHT]), abs=0.01 * WEIGHT)
    centre = mean_by_mass(cloth, cloth.positions)
    assert torque == pytest.approx(np.cross(centre, (0, 0, -WEIGHT)), abs=0.002 * WEIGHT)


@examples(0.05)
@given(
    seed=seeds, speed=st.sampled_from([0.5, 5.0, 100.0]), damping=st.sampled_from([0.0, 0.01, 1.0])
)
def test_momentum_changes_by_gravity_and_the_grippers_alone(seed, speed, damping):
    """While they take particles, move and turn them, and release them, in a free swing."""
    cloth = crumple(gripped(drag=0.0, springs__damping=damping), 1e-3, seed, speed=0.5)
    generator = np.random.default_rng(seed)
    for n in range(12):
        place = np.array(cloth.grippers['left'].position) + speed / 60 * generator.normal(size=3)
        cloth.move_gripper('left', place.tolist(), turn(generator.normal(size=3), 0.3 * n))
        if n == 8:
            cloth.release('right')
        before, counts = momentum(cloth), dataclasses.replace(cloth.rollbacks)
        cloth.advance(1 / 60)
        repeated = cloth.rollbacks.since(counts)
        if repeated.limited or repeated.damped or repeated.held:  # takes momentum from the sheet
            continue
        forces = [np.array(cloth.gripper_wrench(name)[0]) for name in CORNERS]
        expected = (np.array([0, 0, -WEIGHT]) - np.sum(forces, axis=0)) / 60
        scale = max(np.abs(forces).max(), WEIGHT) / 60
        assert momentum(cloth) - before == pytest.approx(expected, abs=1e-11 * scale)
        assert (cloth.gripper_wrench('right')[0] == (0, 0, 0)) == (n >= 8)


def test_a_batch_that_is_rolled_back_leaves_no_force_and_no_motion():
    """Its momentum would be missing; that of the start of the motion must not."""
    disturbance = Disturbance(overwrite('velocity', 1e3), 3)
    cloth = Cloth(gripped_scene(drag=0.0), observer=disturbance)
    before = momentum(cloth)
    assert cloth.grasp('left') + cloth.grasp('right') > 2
    cloth.move_gripper('left', (-0.25, -0.25, 1.05))
    cloth.advance(1 / 60)
    assert cloth.rollbacks.refined > 0
    assert cloth.rollbacks.held == cloth.rollbacks.damped == cloth.rollbacks.limited == 0
    forces = [np.array(cloth.gripper_wrench(name)[0]) for name in CORNERS]
    expected = (np.array([0, 0, -WEIGHT]) - np.sum(forces, axis=0)) / 60
    assert momentum(cloth) - before == pytest.approx(expected, abs=1e-11 * WEIGHT)


@pytest.mark.parametrize('speed', [0.5, 5.0])
def test_a_gripper_adds_no_energy_but_its_work(speed):
    """In a grasp of a moving sheet, a circuit with turns, and a stop."""
    cloth = crumple(gripped(drag=0.0, solver__substeps=300), 0.0, speed=0.3)
    before = cloth.energy()
    total = most = 0.0
    for n in range(30):
        angle = 2 * math.pi * (n + 1) / 20
        x, y, z = CORNERS['left']
        r = speed / 60 / (2 * math.pi / 20)
        if n < 20:
            place = (x + r * math.sin(angle), y, z + r * (1 - math.cos(angle)))
            cloth.move_gripper('left', place, turn((0, 1, 0), 0.1 * n))
        work = cloth.work
        cloth.advance(1 / 60)
        total, most = total + abs(cloth.work - work), max(most, cloth.energy() - before)
        assert cloth.energy() - before == pytest.approx(cloth.work, abs=0.02 * total)
    assert most > 0
    assert not vars(cloth.rollbacks)['held']


@examples(0.05)
@given(seed=seeds, speed=st.sampled_from([0.1, 10.0, 1000.0]))
def test_what_is_held_follows_the_pose_rigidly_at_any_speed(seed, speed):
    cloth = crumple(gripped(), 1e-3, seed)
    cloth.advance(1e-4)
    before = local(cloth, 'left')
    generator = np.random.default_rng(seed)
    for n in range(4):
        x, y, z = cloth.grippers['left'].position
        away = speed / 60 * generator.normal(size=3)
        place = (x + away[0], y + away[1], z + away[2])
        cloth.move_gripper('left', place, turn(generator.normal(size=3), 3.0 * n))
        cloth.advance(1 / 60)
        assert cloth.grippers['left'].position == pytest.approx(place, abs=1e-12)
        assert local(cloth, 'left') == pytest.approx(before, abs=1e-13 * (1 + np.abs(place).max()))
        assert np.isfinite(cloth.positions).all()


def test_the_sheet_follows_within_an_advance_and_a_grasp_moves_nothing():
    cloth = crumple(gripped(), 1e-3)
    before = cloth.positions
    simulation = cloth.advance_stepwise(1.0)
    next(simulation)
    simulation.close()
    numbers = cloth.grippers['left'].held
    assert np.array_equal(held(cloth, 'left'), before.reshape(-1, 3)[numbers])
    cloth.move_gripper('left', (-0.25, -0.25, 2.0))
    seen = []
    for _ in cloth.advance_stepwise(1.0):
        seen.append(held(cloth, 'left')[0, 2])
    assert np.all(np.diff(seen) > 0)
    assert len(seen) > 20
    assert np.abs(np.diff(seen)).max() < 4 / len(seen)


@pytest.mark.parametrize('force', [0.5, 3.0])
def test_a_grip_slips_at_the_force_said(force):
    """The sheet hangs from one gripper, in gravity that grows slowly."""
    left = {'position': CORNERS['left'], 'radius': 0.08, 'slip_force': force}
    cloth = Cloth(gripped_scene(drag=20.0, gripper={'names': ['left'], 'left': left}))
    count = cloth.grasp('left')
    assert count > 2
    pull = 0.6 * force
    while len(cloth.grippers['left'].held) in (0, count) and pull < 2 * force:
        pull *= 1.003
        cloth.configure(cloth.scene.with_parameters({'gravity': (0.0, 0.0, -pull / 0.2)}))
        cloth.advance(0.1)
    assert pull == pytest.approx(force, rel=0.1)
    harder = {'gravity': (0.0, 0.0, -1.5 * force / 0.2)}
    cloth.configure(cloth.scene.with_parameters(harder))
    cloth.advance(2.0)
    assert len(cloth.grippers['left'].held) == 0


def test_a_grasp_takes_what_is_within_the_radius_and_says_how_far_it_is():
    scene = gripped_scene(0.1, pins=['0,0'])
    cloth = Cloth(scene)
    near = np.linalg.norm(cloth.positions - CORNERS['left'], axis=-1) <= 0.1
    assert cloth.grasp('left') == near.sum() - 1  # the pin is not taken
    cloth.advance(0.01)
    assert np.array_equal(np.flatnonzero(near)[1:], cloth.grippers['left'].held)
    # The other one, at the same place, takes nothing of that.
    cloth.move_gripper('right', CORNERS['left'])
    cloth.advance(0.01)
    with pytest.raises(ValueError, match=r"^the distance of 'right' .* is 0\.1\d* m, but must be"):
        cloth.grasp('right')
    assert cloth.release('left') == near.sum() - 1
    assert cloth.release('right') == 0
    assert cloth.grasp('right') == near.sum() - 1  # of what the first one releases
    cloth.advance(0.01)
    assert [len(each.held) for each in cloth.grippers.values()] == [0, near.sum() - 1]
    cloth.move_gripper('left', (0.0, 0.0, 3.0))
    cloth.advance(0.01)
    with pytest.raises(ValueError, match=r' is [12]\.\d+ m, but must be at most gripper\.left\.r'):
        cloth.grasp('left')
    assert cloth.inputs.grips == ()
    with pytest.raises(ValueError, match=r"^gripper is 'middle', but must be one of: left, right"):
        cloth.grasp('middle')
    with pytest.raises(ValueError, match=r'one of: none'):
        cloth_of().release('left')


def test_grippers_that_a_snapshot_lacks_are_open_and_pins_are_released():
    cloth = gripped()
    cloth.advance(0.01)
    count = len(cloth.grippers['left'].held)
    pinned = cloth.scene.with_parameters({'pins': ['0,0']})
    cloth.configure(pinned)
    assert len(cloth.grippers['left'].held) == count - 1
    cloth.move_gripper('left', (0.0, 0.0, 2.0))
    cloth.advance(0.01)
    without = Cloth(pinned.with_parameters({'gripper.names': ['']}))
    cloth.restore(without.snapshot())
    assert [len(each.held) for each in cloth.grippers.values()] == [0, 0]
    assert cloth.grippers['left'].position == CORNERS['left']
    cloth.advance(0.05)
    without.advance(0.05)
    assert cloth.positions == pytest.approx(without.positions, abs=1e-9)
    without.restore(gripped().snapshot())  # has no gripper to hold anything


def test_colliders_do_not_move_what_is_held():
    sphere = {'radius': 0.1, 'position': (-0.25, -0.25, 1.2)}
    cloth = gripped(sphere=sphere)
    cloth.advance(0.05)
    before = held(cloth, 'left')
    for _ in range(6):
        x, y, z = cloth.sphere_position
        cloth.move_sphere((x, y, z - 0.04))
        cloth.advance(1 / 60)
        assert np.array_equal(held(cloth, 'left'), before)
    # It presses on the sheet beside the grip.
    assert np.linalg.norm(cloth.contact_wrench('sphere')[0]) > 0


# The same again

actions = st.lists(
    st.tuples(
        st.sampled_from(['left', 'right']),
        st.sampled_from(['grasp', 'release', 'move', 'fast']),
        st.sampled_from([0.001, 1 / 60]),
    ),
    min_size=2,
    max_size=5,
)


def act(cloth: Cloth, plan: list[tuple[str, str, float]]) -> list[tuple[Inputs, object]]:
    """Give commands and advance; return the inputs of each advance, and the bits after it."""
    result = []
    for n, (name, action, seconds) in enumerate(plan):
        if action in ('move', 'fast'):
            x, y, z = cloth.grippers[name].position
            shift = 0.01 if action == 'move' else 0.5
            cloth.move_gripper(name, (x, y + shift, z + shift), turn((1, 2, 0), 0.3 * n))
        elif action == 'release':
            cloth.release(name)
        else:
            with suppress(ValueError):  # nothing may be there
                cloth.grasp(name)
        inputs = cloth.inputs
        cloth.advance(seconds)
        result.append((inputs, bits(cloth.snapshot())))
    return result


@pytest.mark.parametrize('threads', [1, 3])
def test_the_same_commands_give_the_same_bits(threads, monkeypatch):
    """After a restored state, from a file, and with any number of threads; roll-backs included."""
    monkeypatch.setattr(kick_drift, '_MIN_THREADED', 1)
    parameters = {
        'sheet': {**SHEET, 'rows': 48, 'columns': 48},
        'sphere': {'radius': 0.1, 'position': (0.0, 0.0, 0.85)},
    }  # fmt: skip
    cloth = gripped(**parameters, solver__threads=threads)
    cloth.configure(cloth.scene.with_parameters({'gripper.right.slip_force': 0.2}))

    @examples(0.02)
    @given(plan=actions)
    def check(plan):
        start = cloth.snapshot()
        expected = act(cloth, plan)
        other = gripped(**parameters, solver__threads=4 - threads)
        other.configure(other.scene.with_parameters({'gripper.right.slip_force': 0.2}))
        loaded = decode(encode(start))
        assert bits(loaded) == bits(start)
        for each, snapshot in ((cloth, start), (cloth, loaded)):
            each.restore(snapshot)
            assert act(each, plan) == expected
        other.restore(dataclasses.replace(start, scene=other.scene))
        for (_, _, seconds), (inputs, _) in zip(plan, expected, strict=True):
            other.advance(seconds, inputs)
        assert np.array_equal(other.positions, cloth.positions)
        assert np.array_equal(other.velocities, cloth.velocities)

    check()


@pytest.mark.parametrize('factor', [0.5, 2.0])
def test_a_grip_is_kept_on_another_grid(factor):
    """And a small one, between the particles of a coarser grid."""
    fine = gripped_scene(0.06, sheet={**SHEET, 'rows': 17, 'columns': 21})
    cloth = Cloth(fine)
    cloth.move_gripper('right', (0.03, 0.0, 1.0))
    cloth.advance(1e-4)
    for name in CORNERS:
        assert cloth.grasp(name)
    cloth.move_gripper('left', (-0.25, -0.2, 1.05), turn((0, 0, 1), 0.3))
    cloth.advance(0.1)
    other = Cloth(resample_scene(fine, factor))
    other.restore(cloth.snapshot())
    for name in CORNERS:
        assert np.ptp(held(other, name), axis=0).max() < 0.15
        assert len(held(other, name)) >= 1
        middle = held(other, name).mean(axis=0)
        assert middle == pytest.approx(held(cloth, name).mean(axis=0), abs=0.05)
    before = {name: local(other, name) for name in CORNERS}
    other.move_gripper('left', (-0.25, -0.1, 1.2))
    other.advance(0.1)
    for name in CORNERS:
        assert local(other, name) == pytest.approx(before[name], abs=1e-12)
    back = Cloth(fine)
    back.restore(other.snapshot())
    for name in CORNERS:
        assert abs(len(back.grippers[name].held) - len(cloth.grippers[name].held)) <= 5
