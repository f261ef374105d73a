"""A cloth on a coarser grid than it is shown on."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.model.coarse import CoarseCloth, cloth_on, take_over

SCENE = Scene().with_parameters(
    {'sheet.rows': 33, 'sheet.columns': 41, 'pins': ['0,0', '0,-1'], 'solver.precision': 'double'}
)


def test_it_says_where_the_particles_of_the_scene_are():
    cloth = CoarseCloth(SCENE, 4)
    np.testing.assert_allclose(cloth.positions, Cloth(SCENE).positions, atol=1e-12)
    cloth.advance(0.1)
    assert cloth.positions.shape == cloth.velocities.shape == (33, 41, 3)
    particles = np.empty((33, 41, 6), np.float32)
    cloth.write_particles(particles)
    np.testing.assert_allclose(particles[..., :3], cloth.positions, atol=1e-6)
    np.testing.assert_allclose(particles[..., 3:], cloth.velocities, atol=1e-5)
    positions = np.empty((33, 41, 3))
    cloth.write_positions(positions)
    assert np.array_equal(positions, cloth.positions)
    assert cloth.scene is SCENE
    assert cloth.stability_limit > 3 * Cloth(SCENE).stability_limit


def test_it_is_the_same_cloth_as_far_as_its_grid_goes():
    fine, coarse = Cloth(SCENE), CoarseCloth(SCENE, 2)
    for cloth in (fine, coarse):
        cloth.advance(0.3)
    fallen = np.abs(fine.positions - Cloth(SCENE).positions).max()
    assert np.abs(fine.positions - coarse.positions).max() < 0.1 * fallen


def test_a_cloth_goes_on_from_another_grid():
    fine = Cloth(SCENE)
    fine.advance(0.25)
    fine.wind = (0.0, 1.0, 0.0)
    pinned, start = SCENE.pinned(), Cloth(SCENE).positions
    coarse = cloth_on(SCENE, 4)
    take_over(coarse, fine)
    assert np.abs(coarse.positions - fine.positions).max() < 0.05
    assert coarse.time == fine.time
    assert coarse.wind == fine.wind
    again = cloth_on(SCENE, 1)
    take_over(again, coarse)
    for cloth in (coarse, again):
        cloth.advance(0.05)
        np.testing.assert_allclose(cloth.positions[pinned], start[pinned], atol=1e-12)
        assert np.isfinite(cloth.positions).all()


def test_a_grid_of_too_few_particles_is_refused():
    with pytest.raises(ValueError, match='three particles'):
        CoarseCloth(SCENE, 32)
