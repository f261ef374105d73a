"""Layers of a sheet: closed solutions, conserved quantities, and repeated results."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from builders import ROOT, masses, scene_of

from bench.layers import folded
from bench.self_contact import fold_twice, four_layers
from cloth_ros import Cloth, Scene

SCENE = ROOT / 'config' / 'towel.yaml'
TICK = 1 / 60
SIZE, THICKNESS = (0.6, 0.3), 0.004
# Springs that keep no layer from moving.
LOOSE = {
    'springs__structural': 1e-4,
    'springs__shear': 1e-4,
    'springs__bending': 1e-4,
    'drag': 0.0,
    'wind__air_density': 0.0,
    'sheet__rows': 9,
    'sheet__columns': 17,
    'sheet__size': SIZE,
    'solver__substeps': 40,
}
FREE = {'gravity': (0.0, 0.0, 0.0), 'pins': ['']}
# Columns of both layers that are some way off the fold.
LOWER, UPPER = slice(0, 6), slice(11, 17)


def layers(gap: float, **parameters: object) -> Cloth:
    values = {**LOOSE, 'self_contact__thickness': THICKNESS, **parameters}
    cloth = Cloth(scene_of(**values))
    sheet = cloth.scene.sheet
    cloth.positions = folded(sheet.rows, sheet.columns, sheet.size, gap)
    return cloth


def distance(cloth: Cloth) -> float:
    """Return the mean distance of the layers, m."""
    z = cloth.positions[..., 2]
    return float(z[:, UPPER].mean() - z[:, LOWER].mean())


@pytest.mark.parametrize('speed', [0.1, 1.0, 5.0])
def test_layers_that_approach_stop_at_the_thickness(speed: float) -> None:
    cloth = layers(0.02, **FREE)
    velocities = np.zeros((9, 17, 3))
    velocities[:, 9:, 2] = -speed
    cloth.velocities = velocities
    momentum = (masses(cloth) * velocities).sum((0, 1))
    energy = cloth.energy()
    cloth.advance(0.02 / speed + 0.1)
    # Faster layers are stopped within the thickness; the velocity that parts them remains.
    most = 1.2 * THICKNESS if speed <= 1 else 3 * THICKNESS
    assert 0.8 * THICKNESS < distance(cloth) < most
    after = cloth.velocities
    # Perfectly inelastic: both go on with the mean of both.
    assert after[:, UPPER, 2].mean() == pytest.approx(after[:, LOWER, 2].mean(), abs=0.1 * speed)
    np.testing.assert_allclose(
        (masses(cloth) * after).sum((0, 1)), momentum, atol=1e-6 * abs(momentum).max()
    )
    assert cloth.energy() <= energy * (1 + 1e-6)


def _tilted(angle: float, friction: float, seconds: float) -> float:
    """Return how far a layer slides on another, which is held, on an incline, m."""
    gravity = (0.0, 9.81 * math.sin(angle), -9.81 * math.cos(angle))
    cloth = layers(
        THICKNESS,
        gravity=gravity,
        self_contact__friction=friction,
        pins=[':,0:8'],
    )
    before = cloth.positions[:, UPPER, 1].mean()
    cloth.advance(seconds)
    return float(cloth.positions[:, UPPER, 1].mean() - before)


def test_friction_holds_up_to_its_angle() -> None:
    friction = 0.5
    limit = math.atan(friction)
    assert abs(_tilted(limit - 0.1, friction, 0.5)) < 1e-3
    # Beyond it, the layer slides with the acceleration of a block.
    angle, seconds = limit + 0.1, 0.2
    sliding = 9.81 * (math.sin(angle) - friction * math.cos(angle))
    assert _tilted(angle, friction, seconds) == pytest.approx(0.5 * sliding * seconds**2, rel=0.15)


def _pile(**parameters: object) -> Cloth:
    cloth = Cloth(
        scene_of(
            **{
                'springs__structural': 200.0,
                'springs__shear': 50.0,
                'springs__bending': 2.0,
                'sheet__rows': 20,
                'sheet__columns': 20,
                'sheet__size': (0.6, 0.6),
                'sheet__mass': 0.1,
                'pins': [''],
                'wind__air_density': 0.0,
                'self_contact__thickness': THICKNESS,
                'self_contact__friction': 0.5,
                'collider': {'names': ['table'], 'table': {'type': 'plane', 'friction': 0.5}},
                **parameters,
            }
        )
    )
    sheet = cloth.scene.sheet
    start = folded(sheet.rows, sheet.columns, sheet.size, 2 * THICKNESS)
    start[..., 2] += 0.01
    cloth.positions = start
    return cloth


def test_a_sheet_folded_twice_comes_to_rest() -> None:
    """Its folds as well, where contacts exclude each other."""
    cloth = four_layers(24)
    cloth.advance(0.5)
    assert np.median(np.linalg.norm(cloth.velocities, axis=-1)) < 5e-3  # m/s


def test_layers_lie_still_at_the_limit_of_stability() -> None:
    cloth = Cloth(Scene.from_yaml(SCENE).with_parameters({'solver.tolerance': 0.001}))
    fold_twice(cloth, 1.0)
    speed = np.linalg.norm(cloth.velocities, axis=2)
    assert math.sqrt((speed**2).mean()) < 0.011
    before = cloth.positions.mean(axis=(0, 1))
    cloth.advance(1.0)
    assert np.abs(cloth.positions.mean(axis=(0, 1)) - before).max() < 2e-4


def test_layers_keep_their_distance_at_rest() -> None:
    # Limp, so that the fold stays closed.
    limp = {'springs__bending': 0.1, 'sheet__rows': 16, 'sheet__columns': 32}
    cloth = _pile(drag=2.0, sheet__size=SIZE, **limp)
    cloth.advance(3.0)
    height = cloth.positions[:, 26:, 2] - cloth.positions[:, :6, 2].mean()
    assert height.mean() == pytest.approx(THICKNESS, rel=0.2)
    np.testing.assert_allclose(height, THICKNESS, rtol=0.3)
    speed = np.linalg.norm(cloth.velocities, axis=2)
    assert math.sqrt((speed**2).mean()) < 0.03
    energy = cloth.energy()
    cloth.advance(1.0)
    assert cloth.energy() < energy + 1e-5
    # The table bears all layers, and no path had to be moved back.
    assert -cloth.contact_wrench('table')[0][2] == pytest.approx(0.1 * 9.81, rel=0.02)
    assert cloth.self_contact is not None
    assert cloth.self_contact.division == 1


def _approaching() -> Cloth:
    """Return layers that approach slowly, and have done so long enough for long parts."""
    cloth = layers(0.02, **FREE)
    velocities = np.zeros((9, 17, 3))
    velocities[:, 9:, 2] = -0.06
    cloth.velocities = velocities
    cloth.advance(8 * TICK)
    assert cloth.self_contact is not None
    assert cloth.self_contact.pace[1] >= 16
    return cloth


@pytest.mark.parametrize('start', [_pile, _approaching])
def test_restored_cloth_continues_with_the_same_bits(start: Callable[[], Cloth]) -> None:
    cloth = start()
    cloth.advance(10 * TICK)
    snapshot = cloth.snapshot()
    states = []
    for other in (cloth, Cloth(cloth.scene)):
        if other is not cloth:
            other.restore(snapshot)
        for _ in range(10):
            other.advance(TICK)
        states.append(np.concatenate([other.positions, other.velocities]).tobytes())
    assert cloth.self_contact is not None
    assert cloth.self_contact.contacts > 0
    assert states[0] == states[1]


def test_results_do_not_depend_on_the_number_of_threads() -> None:
    states = []
    for threads in (1, 2):
        cloth = _pile(
            sheet__rows=64,
            sheet__columns=64,
            solver__threads=threads,
            self_contact__thickness=0.003,
        )
        for _ in range(6):
            cloth.advance(TICK)
        states.append(np.concatenate([cloth.positions, cloth.velocities]).tobytes())
    assert states[0] == states[1]


def test_sheet_that_passes_through_itself_is_refused() -> None:
    cloth = layers(0.02, **FREE)
    before = cloth.positions
    crossing = before.copy()
    crossing[4, -3, 2] = -0.01
    with pytest.raises(ValueError, match=r'passes through itself at particles .* move them'):
        cloth.positions = crossing
    np.testing.assert_array_equal(cloth.positions, before)
    without = Cloth(cloth.scene.with_parameters({'self_contact.thickness': 0.0}))
    without.positions = crossing
    with pytest.raises(ValueError, match='passes through itself'):
        cloth.restore(without.snapshot())


@pytest.mark.parametrize(
    ('parameters', 'expected'),
    [
        ({'thickness': 0.02}, r'at most 0.4 of the spacing of the particles, 0.012\d* m; write'),
        ({'thickness': 1e-6}, r'0 or at least 0.0003\d* m, which this precision resolves; write'),
    ],
)
def test_thickness_that_cannot_be_simulated_is_refused(
    parameters: dict[str, float], expected: str
) -> None:
    scene = scene_of(self_contact=parameters)
    with pytest.raises(ValueError, match=expected) as error:
        Cloth(scene)
    remedy = float(str(error.value).split('write ')[1].split(',')[0])
    Cloth(scene.with_parameters({'self_contact.thickness': remedy}))


def test_coarse_grids_are_refused() -> None:
    scene = scene_of(self_contact__thickness=0.005, solver__overload='coarsen')
    with pytest.raises(ValueError, match=r'solver.overload is .*coarsen.* write solver.overload'):
        Cloth(scene)
