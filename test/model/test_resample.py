"""The same cloth on another grid: parameters, pins and positions."""

import numpy as np
import pytest
from builders import ROOT, SPRINGS_ONLY, examples, scene_of, small_cloth
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.resample import interpolate, resample_scene


def test_mass_size_and_stiffness_remain():
    scene = Scene.from_yaml(ROOT / 'config/gust.yaml')
    finer = resample_scene(scene, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (71, 71)
    for name in ('sheet.mass', 'sheet.size', 'springs.structural', 'springs.shear'):
        assert finer.flat()[name] == scene.flat()[name]
    assert finer.springs.bending == pytest.approx(4 * scene.springs.bending)


def test_a_stretched_sheet_has_the_same_energy_on_every_grid():
    energies = []
    for factor in (0.5, 1.0, 2.0):
        scene = scene_of(sheet__rows=17, sheet__columns=17, springs__shear=0.0, springs__bending=0)
        cloth = Cloth(resample_scene(scene, factor))
        cloth.positions = cloth.positions * (1.01, 1.0, 1.0)
        # The border has a row of springs for half the cells; for each cell they are the same.
        rows = cloth.scene.sheet.rows
        energies.append(cloth.energy_by_kind().elastic * (rows - 1) / rows)
    np.testing.assert_allclose(energies, energies[0], rtol=1e-4)


@examples(0.5)
@given(
    pins=st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=6, unique=True),
    factor=st.sampled_from([0.5, 2.0, 3.0]),
)
def test_pins_move_to_the_nearest_particles(pins, factor):
    pins = [f'{row},{column}' for row, column in pins] or ['']
    scene = scene_of(sheet__rows=9, sheet__columns=9, pins=pins)
    other = resample_scene(scene, factor)
    before, after = (Cloth(each).positions[each.pinned()] for each in (scene, other))
    reach = max(scene.sheet.spacing[0], other.sheet.spacing[0])
    distances = np.abs(after[:, None] - before).max(axis=2)
    assert len(after) <= len(before)
    assert (distances.min(axis=0, initial=np.inf) <= 0.5 * reach + 1e-9).all()


@pytest.mark.parametrize(
    ('pins', 'factor'),
    [
        ([':,:'], 0.5),
        ([':,:'], 3.0),
        (['::2,::2', '1::2,1::2'], 2.0),  # a checkerboard, of which no two particles are adjacent
        (['::3,::3'], 0.5),
        ([f'{row},{row}' for row in range(128)], 0.5),
        (['0,:', '-1,:', ':,0', ':,-1'], 2.0),
    ],
)
def test_many_pins_are_written_as_few_slices(pins, factor):
    scene = scene_of(sheet__rows=128, sheet__columns=129, pins=pins)
    other = resample_scene(scene, factor)
    assert len(other.pins) <= 128
    shape = (other.sheet.rows, other.sheet.columns)
    expected = np.zeros(shape, bool)
    for row, column in np.argwhere(scene.pinned()):
        expected[round(row / 127 * (shape[0] - 1)), round(column / 128 * (shape[1] - 1))] = True
    assert np.array_equal(other.pinned(), expected)


def test_there_is_no_other_grid_if_the_pins_are_too_irregular_or_the_sides_too_short():
    generator = np.random.default_rng(0)
    pins = [
        f'{row},{first}::{step}'
        for row in range(0, 511, 2)
        for first, step in generator.integers((0, 5), (100, 60), (16, 2))
    ]
    assert resample_scene(scene_of(sheet__rows=511, sheet__columns=511, pins=pins), 0.5) is None
    for rows, columns, factor in ((1, 1, 2.0), (9, 4, 0.3), (300, 300, 2.0)):
        scene = scene_of(sheet__rows=rows, sheet__columns=columns)
        assert resample_scene(scene, factor) is None
        assert resample_scene(scene, 1.0) is scene


def test_a_strip_is_refined_along_its_length():
    strip = scene_of(sheet__rows=1, sheet__columns=9, pins=['0,0'], springs__bending=2.0)
    finer = resample_scene(strip, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (1, 17)
    assert finer.springs.bending == pytest.approx(8.0)


@pytest.mark.parametrize(('rows', 'columns'), [(13, 17), (3, 9), (1, 1)])
def test_a_flat_sheet_is_interpolated_exactly(rows, columns):
    flat, other = (
        small_cloth(**SPRINGS_ONLY, sheet__rows=r, sheet__columns=c, solver__precision='double')
        for r, c in ((5, 9), (rows, columns))
    )
    # A single particle of a side is at its beginning.
    expected = other.positions if rows > 1 else flat.positions[:1, :1]
    np.testing.assert_allclose(
        interpolate(flat.positions[None], rows, columns)[0], expected, atol=1e-12
    )
