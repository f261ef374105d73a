import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.resample import interpolate, resample_scene


def test_the_same_cloth_has_the_same_mass_size_and_stiffness():
    scene = Scene.from_yaml('config/gust.yaml')
    finer = resample_scene(scene, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (71, 71)
    for name in ('sheet.mass', 'sheet.size', 'springs.structural', 'springs.shear'):
        assert finer.flat()[name] == scene.flat()[name]
    assert finer.springs.bending == pytest.approx(4 * scene.springs.bending)


def test_a_stretched_sheet_stores_the_same_energy_on_every_grid():
    energies = []
    for factor in (0.5, 1.0, 2.0):
        scene = resample_scene(
            Scene(sheet={'rows': 17, 'columns': 17}, springs={'shear': 0.0, 'bending': 0.0}),
            factor,
        )
        cloth = Cloth(scene)
        cloth.positions = cloth.positions * (1.01, 1.0, 1.0)
        # The border has a row of springs for half the cells; for each cell they are the same.
        rows = scene.sheet.rows
        energies.append(cloth.energy_by_kind().elastic * (rows - 1) / rows)
    np.testing.assert_allclose(energies, energies[0], rtol=1e-4)


@given(
    pins=st.lists(
        st.tuples(st.integers(0, 8), st.integers(0, 8)), min_size=1, max_size=6, unique=True
    ),
    factor=st.sampled_from([0.5, 2.0, 3.0]),
)
def test_pins_stay_where_they_were(pins, factor):
    scene = Scene(
        sheet={'rows': 9, 'columns': 9}, pins=[f'{row},{column}' for row, column in pins]
    )
    other = resample_scene(scene, factor)
    before, after = Cloth(scene), Cloth(other)
    old = before.positions[scene.pinned()]
    new = after.positions[other.pinned()]
    reach = max(scene.sheet.spacing[0], other.sheet.spacing[0])
    for place in old:
        assert np.abs(new - place).max(axis=1).min() <= 0.5 * reach + 1e-9


@pytest.mark.parametrize(
    ('pins', 'factor'),
    [
        ([':,:'], 0.5),
        ([':,:'], 3.0),
        (['::2,::2', '1::2,1::2'], 2.0),  # a checkerboard, and no particle beside another
        (['::3,::3'], 0.5),
        ([f'{row},{row}' for row in range(128)], 0.5),
        (['0,:', '-1,:', ':,0', ':,-1'], 2.0),
    ],
)
def test_many_pins_are_written_in_few_strings(pins, factor):
    scene = Scene(sheet={'rows': 128, 'columns': 129}, pins=pins)
    other = resample_scene(scene, factor)
    assert len(other.pins) <= 128
    shape = (other.sheet.rows, other.sheet.columns)
    wanted = np.zeros(shape, bool)
    for row, column in np.argwhere(scene.pinned()):
        wanted[round(row / 127 * (shape[0] - 1)), round(column / 128 * (shape[1] - 1))] = True
    assert np.array_equal(other.pinned(), wanted)


def test_a_grid_whose_pins_cannot_be_written_is_none():
    rng = np.random.default_rng(0)
    pins = [
        f'{row},{first}::{step}'
        for row in range(0, 511, 2)
        for first, step in rng.integers((0, 5), (100, 60), (16, 2))
    ]
    scene = Scene(sheet={'rows': 511, 'columns': 511}, pins=pins)
    assert resample_scene(scene, 0.5) is None


def test_no_pins_stay_no_pins():
    assert not resample_scene(Scene(pins=['']), 2.0).pinned().any()


def test_a_grid_is_sampled_where_the_coarser_particles_are():
    fine, coarse = (
        Cloth(Scene(sheet={'rows': rows, 'columns': columns})).positions
        for rows, columns in ((13, 17), (5, 9))
    )
    np.testing.assert_allclose(interpolate(fine[None], 5, 9)[0], coarse, atol=1e-6)


def test_a_strip_is_refined_along_its_length():
    strip = Scene(sheet={'rows': 1, 'columns': 9}, pins=['0,0'], springs={'bending': 2.0})
    finer = resample_scene(strip, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (1, 17)
    assert finer.springs.bending == pytest.approx(8.0)
    assert resample_scene(Scene(sheet={'rows': 1, 'columns': 1}), 2.0) is None
