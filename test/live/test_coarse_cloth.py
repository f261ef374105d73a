"""A cloth on a coarser grid than it is published on."""

import numpy as np
import pytest
from builders import examples, scene_of, seeds
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth
from cloth_ros.live.coarse_cloth import CoarseCloth, simulated_scene

PINS = ['0,0', '0,-1']
SCENE = scene_of(sheet__rows=33, sheet__columns=41, pins=PINS, solver__precision='double')


def test_positions_and_velocities_are_published_on_the_grid_of_the_scene():
    coarse = CoarseCloth(SCENE, 4)
    np.testing.assert_allclose(coarse.positions, Cloth(SCENE).positions, atol=1e-12)
    coarse.cloth.advance(0.1)
    particles, positions = np.empty((33, 41, 6), np.float32), np.empty((33, 41, 3))
    for cloth in (coarse, CoarseCloth(SCENE)):
        cloth.write_particles(particles)
        cloth.write_positions(positions)
        np.testing.assert_allclose(particles[..., :3], cloth.positions, atol=1e-6)
        np.testing.assert_allclose(particles[..., 3:], cloth.velocities, atol=1e-5)
        assert np.array_equal(positions, cloth.positions)
    # At every fourth particle there is one of the coarser grid.
    assert np.array_equal(coarse.positions[::4, ::4], coarse.cloth.positions)
    assert np.array_equal(coarse.velocities[::4, ::4], coarse.cloth.velocities)
    assert coarse.scene is SCENE
    assert coarse.cloth.scene == simulated_scene(SCENE, 4)
    assert coarse.cloth.stability_limit > 3 * Cloth(SCENE).stability_limit


def test_the_motion_is_that_of_the_same_cloth_as_far_as_the_grid_allows():
    fine, coarse = CoarseCloth(SCENE), CoarseCloth(SCENE, 2)
    for each in (fine, coarse):
        each.cloth.advance(0.3)
    fallen = np.abs(fine.positions - Cloth(SCENE).positions).max()
    assert np.abs(fine.positions - coarse.positions).max() < 0.1 * fallen


@examples(0.05)
@given(
    seed=seeds,
    spacings=st.lists(st.sampled_from([1, 2, 4]), min_size=1, max_size=4),
    pins=st.sampled_from([[''], PINS, ['::16,:']]),
    wind=st.tuples(*[st.floats(-5, 5)] * 3),
)
def test_a_change_of_grid_and_parameters_keeps_state_time_inputs_and_counts(
    seed, spacings, pins, wind
):
    """For an affine state, which every grid represents; others are tested in `test_snapshot`."""
    now = CoarseCloth(SCENE.with_parameters({'pins': ['']}))
    strain, spin = np.random.default_rng(seed).uniform(-0.2, 0.2, (2, 3, 3))
    now.cloth.advance(0.01)
    flat = Cloth(SCENE).positions
    # Far from where its pins would be placed.
    positions = now.cloth.positions = flat + flat @ strain - 5.0
    now.cloth.velocities = flat @ spin
    now.cloth.wind = wind
    counts = {'refined': 3, 'limited': 2, 'damped': 1, 'held': 4}
    vars(now.cloth.rollbacks).update(counts)
    time = now.cloth.time
    for spacing in spacings:
        scene = SCENE.with_parameters({'pins': pins, 'drag': 0.1 * spacing})
        former, now = now, now.changed(scene, spacing)
        assert (now is former) == (former.spacing == spacing)
        assert (now.scene, now.spacing) == (scene, spacing)
        assert now.cloth.scene == simulated_scene(scene, spacing)
        assert now.cloth.time == time
        assert now.cloth.wind == now.air_velocity == wind
        assert vars(now.cloth.rollbacks) == counts
        np.testing.assert_allclose(now.positions, positions, rtol=0, atol=1e-10)
        if not scene.pinned().any():  # what is pinned stops
            np.testing.assert_allclose(now.velocities, flat @ spin, rtol=0, atol=1e-10)
    held = now.positions[scene.pinned()]
    now.cloth.advance(0.01)
    np.testing.assert_allclose(now.positions[scene.pinned()], held, atol=1e-10)


def test_a_grid_of_too_few_particles_is_refused():
    with pytest.raises(ValueError, match='three particles'):
        CoarseCloth(SCENE, 32)
    with pytest.raises(ValueError, match='three particles'):
        CoarseCloth(SCENE, 4).changed(SCENE, 32)
