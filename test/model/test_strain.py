"""Stretch, shear and folding, of sheets of known deformation and of a flag."""

import math

import numpy as np
import pytest
from builders import cloth_of, examples, scene_of, seeds
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cloth_ros import Cloth
from cloth_ros.model.forces.springs import spring_ends, spring_families
from cloth_ros.model.strain import strain

SIZE = (1.2, 0.8)


def deformed(
    rows: int, columns: int, stretch: tuple[float, float], shear: float, fold: float, row: int
) -> np.ndarray:
    """
    Return a sheet in the plane, shape (3, rows, columns).

    Its edges are stretched by two factors, its right angles changed by `shear`, and the rows
    beyond `row` rotated by `fold` about that row.
    """
    along = stretch[0] * SIZE[0] * np.linspace(0, 1, columns)
    across = stretch[1] * SIZE[1] * (np.arange(rows) - row) / (rows - 1)
    x = along + math.sin(shear) * across[:, None]
    plane = np.broadcast_to(math.cos(shear) * across[:, None], x.shape)
    beyond = plane > 0
    y = np.where(beyond, math.cos(fold), 1.0) * plane
    z = np.where(beyond, math.sin(fold), 0.0) * plane
    return np.array([x, y, z])


@examples(0.5)
@given(
    seed=seeds,
    rows=st.integers(3, 7),
    columns=st.integers(3, 7),
    stretch=st.tuples(*[st.sampled_from([0.5, 0.97, 1.0, 1.01, 1.2]) | st.floats(0.5, 2.0)] * 2),
    shear=st.just(0.0) | st.floats(-1.4, 1.4),
    fold=st.just(0.0) | st.floats(0.0, math.pi),
)
def test_each_figure_is_that_of_the_known_deformation(seed, rows, columns, stretch, shear, fold):
    """Stretched, sheared and folded at once, in any place, orientation and order of the axes."""
    row = seed % (rows - 2) + 1
    positions = deformed(rows, columns, stretch, shear, fold, row)
    rotation = Rotation.random(random_state=seed).as_matrix()
    positions = (
        np.tensordot(rotation, positions, axes=1) + np.array([3.0, -2.0, 1.0])[:, None, None]
    )
    spacing = (SIZE[0] / (columns - 1), SIZE[1] / (rows - 1))
    # An edge at an angle to the fold turns by less than the sheet does.
    cosine = math.sin(shear) ** 2 + math.cos(shear) ** 2 * math.cos(fold)
    turn = math.acos(min(cosine, 1.0))
    expected = (max(*stretch, 1.0) - 1.0, abs(shear), turn)
    for turned in (positions, positions[:, ::-1], positions[:, :, ::-1]):
        assert strain(turned, spacing) == pytest.approx(expected, abs=1e-6)
    swapped = positions.swapaxes(1, 2)
    assert strain(swapped, spacing[::-1]) == pytest.approx(expected, abs=1e-6)


def test_a_sheet_without_edges_or_with_particles_in_one_place_has_none():
    pair = cloth_of(sheet__rows=1, sheet__columns=2, pins=[''], sheet__position=(0, 0, 2))
    pair.positions = np.array([[[0, 0, 2], [0, 0, 3.5]]])
    assert pair.strain() == pytest.approx((0.5, 0.0, 0.0))
    assert cloth_of(sheet__rows=1, sheet__columns=1, pins=['']).strain() == (0.0, 0.0, 0.0)
    assert strain(np.zeros((3, 4, 5)), (0.1, 0.1)) == (0.0, 0.0, 0.0)


def strains(cloth: Cloth, name: str) -> np.ndarray:
    """Return the relative changes of length of all springs of a type."""
    grid = np.moveaxis(cloth.positions, -1, 0)
    return np.concatenate(
        [
            (np.linalg.norm(np.subtract(*spring_ends(family, grid)), axis=0)).ravel()
            / family.rest_length
            - 1
            for family in spring_families(cloth.scene)
            if family.name == name
        ]
    )


def test_the_stretch_of_a_flag_is_that_of_its_structural_springs_however_much_it_folds():
    """A stiffer flag stretches less; what its folds do to bending springs is not stretch."""
    flag = scene_of(pins=[':,0'], wind__velocity=(4.0, 0.0, 1.0), sheet__rows=16)
    stretches = []
    for stiffness in (500.0, 50_000.0):
        cloth = Cloth(flag.with_parameters({'springs.structural': stiffness}))
        cloth.advance(0.8)
        found = cloth.strain()
        stretches.append(found.stretch)
        assert found.stretch == pytest.approx(strains(cloth, 'structural').max(), rel=1e-9)
        folded = -strains(cloth, 'bending').min()
        assert folded > 0.02
        # Edges of equal length: the chord of the fold is shorter by 1 − cos(θ/2).
        assert 1 - math.cos(found.fold_angle / 2) == pytest.approx(folded, rel=0.2)
        assert 0.0 < found.shear_angle < 2 * np.abs(strains(cloth, 'shear')).max() + 0.1
    assert stretches[0] > 0.005 > 5 * stretches[1]
