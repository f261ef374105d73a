"""A cloth on a coarser grid than it is shown on."""

import numpy as np
import pytest

from cloth_ros import Cloth, Scene
from cloth_ros.live.coarse_cloth import CoarseCloth, cloth_on, take_over

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


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_a_sheet_that_has_fallen_for_hours_goes_on_from_another_grid(precision):
    free = SCENE.with_parameters({'pins': [''], 'drag': 0.0, 'solver.precision': precision})
    far = Cloth(free)
    shape, fallen = (
        far.positions - far.positions.mean(axis=(0, 1)),
        np.array([0.0, 0.0, -(2.0**36)]),
    )
    far._state.origin = fallen
    far._state.velocity[:] = np.array([[0.0], [0.0], [-3e5]]) * far._state.free
    far._forget()
    cloth = far
    for spacing in (4, 2, 1):
        cloth, before = cloth_on(free, spacing), cloth
        take_over(cloth, before)
        # A double tells 15 µm there, and a single 8 km.
        np.testing.assert_allclose(cloth.positions - fallen, shape, atol=5e-5)
        np.testing.assert_allclose(cloth.velocities, far.velocities)
        cloth.advance(0.0)


@pytest.mark.parametrize('away', [0.0, -4e9])
def test_pins_set_while_a_cloth_runs_hold_on_every_grid(away):
    before = Cloth(SCENE.with_parameters({'pins': ['']}))
    before._state.origin[2] += away
    before.advance(0.5)
    before.configure(SCENE)
    pinned = SCENE.pinned()
    held = before.positions[pinned]
    for spacing in (2, 4, 1):
        cloth = cloth_on(SCENE, spacing)
        take_over(cloth, before)
        cloth.advance(0.1)
        np.testing.assert_allclose(cloth.positions[pinned], held, atol=2e-6)
        before = cloth


def test_a_grid_of_too_few_particles_is_refused():
    with pytest.raises(ValueError, match='three particles'):
        CoarseCloth(SCENE, 32)
