"""Energy and strain, and their agreement with the forces of the reference model."""

import numpy as np
import pytest
from builders import SPRINGS_ONLY, cloth_of, crumple, examples, scene_of, seeds
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.energy import EnergyMeter, energy
from cloth_ros.model.forces.springs import SPRING_TYPES
from cloth_ros.tradeoff.reference_model import spring_forces


def of_type(only: str | None, **parameters: object) -> dict[str, object]:
    """Return the parameters of a free sheet with one type of springs, or with all."""
    absent = {f'springs__{name}': 0.0 for name in SPRING_TYPES if only not in (None, name)}
    return {**SPRINGS_ONLY, 'sheet__size': [0.7, 1.3], **absent, **parameters}


@pytest.mark.parametrize('only', [*SPRING_TYPES, None])
@examples(0.5)
@given(seeds, st.integers(1, 6), st.integers(1, 6))
def test_the_gradient_of_the_elastic_energy_is_the_force_of_the_reference_model(
    only, seed, rows, columns
):
    scene = scene_of(**of_type(only, sheet__rows=rows, sheet__columns=columns))
    generator = np.random.default_rng(seed)
    positions, direction = generator.normal(size=(2, 3, rows, columns))
    rest = np.zeros_like(positions)
    above, below = (
        energy(positions + way * direction, rest, scene).elastic for way in (1e-6, -1e-6)
    )
    power = -np.sum(spring_forces(scene, positions, rest) * direction)
    assert (above - below) / 2e-6 == pytest.approx(power, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize(
    ('only', 'precision'),
    [*((name, 'double') for name in SPRING_TYPES), (None, 'double'), (None, 'single')],
)
def test_the_compiled_meter_agrees_with_the_definition(only, precision):
    cloth = cloth_of(
        **{**of_type(only), 'gravity': (1.0, 2.0, -9.81), 'sheet__position': (300.0, 0.0, 20.0)},
        sheet__rows=12,
        sheet__columns=11,
        solver__precision=precision,
    )
    state = crumple(cloth, 0.05, speed=1.0)._simulation.state
    found = EnergyMeter(cloth.scene, state.dtype).measure(state)
    tight = 1e-12 if precision == 'double' else 1e-5
    np.testing.assert_allclose(found, cloth.energy_by_kind(), rtol=tight)


def test_the_energy_of_two_particles():
    sheet = {'sheet__rows': 1, 'sheet__columns': 2, 'sheet__mass': 3.0}
    cloth = cloth_of(**sheet, pins=[''], sheet__position=(0, 0, 2))
    cloth.positions = np.array([[[0, 0, 2], [0, 0, 3.5]]])
    cloth.velocities = np.array([[[0, 0, 0], [0, 2, 0]]])
    kinds = cloth.energy_by_kind()
    expected = (0.5 * 1.5 * 2**2, 0.5 * 500 * 0.5**2, 1.5 * 9.81 * (2 + 3.5))
    assert tuple(kinds) == pytest.approx(expected)
    assert cloth.energy() == kinds.total == pytest.approx(sum(expected))
    assert kinds.motion == pytest.approx(sum(expected[:2]))
    assert cloth.largest_strain() == pytest.approx(0.5)


def test_the_strain_without_springs_is_zero():
    assert cloth_of(sheet__rows=1, sheet__columns=1, pins=['']).largest_strain() == 0.0
