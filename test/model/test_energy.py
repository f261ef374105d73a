"""Energy, and its agreement with the forces of the reference model."""

import numpy as np
import pytest
from builders import SPRINGS_ONLY, cloth_of, crumple, examples, only, scene_of, seeds
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.energy import EnergyMeter, energy
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.tradeoff.reference_model import spring_forces


@pytest.mark.parametrize('name', SPRING_TYPES)
@examples(0.25)
@given(seeds, st.integers(1, 6), st.integers(1, 6))
def test_its_gradient_is_the_force_of_the_reference_model(name, seed, rows, columns):
    sheet = {'sheet__rows': rows, 'sheet__columns': columns, 'sheet__size': [0.7, 1.3]}
    scene = scene_of(**SPRINGS_ONLY, **sheet, **only(name))
    generator = np.random.default_rng(seed)
    positions, direction = generator.normal(size=(2, 3, rows, columns))
    rest, step = np.zeros_like(positions), 1e-6 * direction
    ahead, behind = (energy(positions + way, rest, scene).elastic for way in (step, -step))
    power = -np.sum(spring_forces(scene, positions, rest) * direction)
    assert (ahead - behind) / 2e-6 == pytest.approx(power, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize(
    ('springs', 'precision', 'tolerance'),
    [(only(name), 'double', 1e-12) for name in SPRING_TYPES]
    + [({}, 'double', 1e-12), ({}, 'single', 1e-5)],
)
def test_the_compiled_meter_agrees_with_the_definition(springs, precision, tolerance):
    place = {'gravity': (1.0, 2.0, -9.81), 'sheet__position': (300.0, 0.0, 20.0), 'pins': ['']}
    cloth = cloth_of(sheet__rows=12, **springs, **place, solver__precision=precision)
    state = crumple(cloth, 0.05, speed=1.0)._simulation.state
    found = EnergyMeter(cloth.scene, state.dtype).measure(state)
    np.testing.assert_allclose(found, cloth.energy_by_kind(), rtol=tolerance)


def test_the_energy_of_two_particles():
    sheet = {'sheet__rows': 1, 'sheet__columns': 2, 'sheet__mass': 3.0}
    cloth = cloth_of(**sheet, pins=[''], sheet__position=(0, 0, 2))
    cloth.positions = np.array([[[0, 0, 2], [0, 0, 3.5]]])
    cloth.velocities = np.array([[[0, 0, 0], [0, 2, 0]]])
    kinetic, elastic, gravitational = 0.5 * 1.5 * 2**2, 0.5 * 500 * 0.5**2, 1.5 * 9.81 * (2 + 3.5)
    kinds = cloth.energy_by_kind()
    assert tuple(kinds) == pytest.approx((kinetic, elastic, gravitational))
    assert cloth.energy() == kinds.total == pytest.approx(kinetic + elastic + gravitational)
    assert kinds.motion == pytest.approx(kinetic + elastic)
