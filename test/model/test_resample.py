"""The same cloth on another grid: parameters and pins."""

import numpy as np
import pytest
from builders import ROOT, examples, scene_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator

from cloth_ros import Cloth, Scene
from cloth_ros.model.resample import resample_scene


def test_mass_size_and_stiffness_remain():
    scene = Scene.from_yaml(ROOT / 'config/gust.yaml')
    finer = resample_scene(scene, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (71, 71)
    for name in ('sheet.mass', 'sheet.size', 'springs.structural', 'springs.shear'):
        assert finer.flat()[name] == scene.flat()[name]
    assert finer.springs.bending == pytest.approx(4 * scene.springs.bending)
    strip = scene_of(sheet__rows=1, sheet__columns=9, pins=['0,0'], springs__bending=2.0)
    finer = resample_scene(strip, 2.0)
    assert (finer.sheet.rows, finer.sheet.columns) == (1, 17)
    assert finer.springs.bending == pytest.approx(8.0)


def test_a_stretched_sheet_has_the_same_energy_on_every_grid():
    energies = []
    for factor in (0.5, 1.0, 2.0):
        scene = scene_of(sheet__rows=17, sheet__columns=17, springs={'shear': 0.0, 'bending': 0.0})
        cloth = Cloth(resample_scene(scene, factor))
        cloth.positions = cloth.positions * (1.01, 1.0, 1.0)
        energies.append(cloth.energy_by_kind().elastic)
    np.testing.assert_allclose(energies, energies[0], rtol=1e-4)


@examples(0.25)
@given(
    st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=6, unique=True),
    st.sampled_from([0.5, 2.0, 3.0]),
)
def test_pins_move_to_the_nearest_particles(pins, factor):
    pins = [f'{row},{column}' for row, column in pins]
    scene = scene_of(sheet__rows=9, sheet__columns=9, pins=pins)
    other = resample_scene(scene, factor)
    before, after = (Cloth(each).positions[each.pinned()] for each in (scene, other))
    distances = np.abs(after[:, None] - before).max(axis=2)
    reach = 0.5 * max(scene.sheet.spacing[0], other.sheet.spacing[0]) + 1e-9
    assert (distances.min(axis=0, initial=np.inf) <= reach).all()
    assert (distances.min(axis=1, initial=np.inf) <= reach).all()


@given(st.sampled_from(['0,:', ':,-1', '2:5,3:7', ':,:']), st.sampled_from([0.5, 2.0, 3.0]))
def test_what_is_pinned_throughout_stays_so(pins, factor):
    other = resample_scene(scene_of(sheet__rows=9, sheet__columns=9, pins=[pins]), factor)
    pinned = np.argwhere(other.pinned())
    (top, left), (bottom, right) = pinned.min(axis=0), pinned.max(axis=0)
    assert len(pinned) == (bottom - top + 1) * (right - left + 1)


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
    sides = np.array((other.sheet.rows, other.sheet.columns))
    places = np.argwhere(scene.pinned()) / (127, 128) * (sides - 1)
    rows, columns = (np.linspace(0, 1, n) for n in scene.pinned().shape)
    between = RegularGridInterpolator((rows, columns), scene.pinned().astype(float))
    expected = between(np.indices(sides).T / (sides - 1)).T > 1 - 1e-9
    expected[tuple(np.rint(places).astype(int).T)] = True
    assert np.array_equal(other.pinned(), expected)


def test_there_is_no_other_grid_if_the_pins_are_too_irregular_or_the_sides_too_short():
    generator = np.random.default_rng(0)
    pins = [
        f'{row},{first}::{step}'
        for row in range(0, 511, 2)
        for first, step in generator.integers((0, 5), (100, 60), (16, 2))
    ]
    for rows, columns, factor, pins_there in (
        *((1, 1, 2.0, ['']), (9, 4, 0.3, ['']), (300, 300, 2.0, [''])),
        (511, 511, 0.5, pins),
    ):
        scene = scene_of(sheet__rows=rows, sheet__columns=columns, pins=pins_there)
        assert resample_scene(scene, factor) is None
        assert resample_scene(scene, 1.0) is scene
