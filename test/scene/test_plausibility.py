"""Values that are allowed and almost certainly an error of the unit or of the place."""

import math

import pytest
from builders import SCENE_FILES, examples, scene_of
from hypothesis import assume, example, given
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.scene_check import circumradius
from cloth_ros.scene.plausibility import implausible_values


@pytest.mark.parametrize(
    ('changes', 'name', 'meaning'),
    [
        ({'sheet__mass': 200.0}, 'sheet.mass', 'an areal density of 200 kg/m²; cotton'),
        ({'sheet__mass': 2e-4}, 'sheet.mass', 'an areal density of 0.0002 kg/m²'),
        ({'sheet__size': [500.0, 300.0], 'sheet__mass': 2e4}, 'sheet.size', 'a sheet of 500 m'),
        (
            {'sphere__radius': 150.0, 'sphere__position': [0, 0, -500]},
            'sphere.radius',
            '300 m wide',
        ),
        ({'gravity': [0, 0, -981.0]}, 'gravity', '100 times that of the Earth'),
        ({'wind__velocity': [0, 200.0, 0]}, 'wind.velocity', '720 km/h'),
        (
            {'wind__gust__speed': [0, 500.0], 'wind__gust__period': 5.0},
            'wind.gust.speed',
            '1800 km/h',
        ),
        ({'solver__tolerance': 1.0}, 'solver.tolerance', '1 mm is 0.001'),
        (
            {'sphere__radius': 0.3, 'sphere__position': [0.0, 0.1, 0.8]},
            'sphere.position',
            'overlaps the sheet by 0.1 m; it starts as large as there is room',
        ),
    ],
)
def test_a_value_in_another_unit_is_told_with_its_meaning(changes, name, meaning):
    found = implausible_values(scene_of(**changes))
    assert list(found) == [name]
    assert found[name].startswith(f'{name} is ')
    assert meaning in found[name]


@pytest.mark.parametrize('path', SCENE_FILES, ids=lambda path: path.stem)
def test_the_scenes_of_the_package_and_other_sheets_are_plausible(path):
    scene = Scene.from_yaml(path)
    others = (
        {},
        {'sheet.rows': 1, 'sheet.mass': 20.0, 'sheet.size': [5.0, 1000.0]},  # a rope
        {'sheet.mass': 2.0, 'solver.tolerance': 0.1},
        {'sheet.size': [12.0, 30.0], 'sheet.mass': 100.0},
        {'wind.gust.speed': [0, 500.0], 'wind.gust.period': 0.0},  # no gusts
    )
    for changes in others:
        assert implausible_values(scene.with_parameters({'sphere.radius': 0.0, **changes})) == {}
    assert implausible_values(scene) == {}


@examples(0.2)
@example(0.03125, (0.0, 0.0, 0.375), (0.0, 1.0, 0.0, 0.5))  # small beside the triangles
@given(
    radius=st.floats(0.02, 0.4),
    offset=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    orientation=st.tuples(*[st.floats(-1.0, 1.0)] * 4),
)
def test_a_sphere_overlaps_the_sheet_if_it_starts_smaller_than_it_is(radius, offset, orientation):
    assume(sum(x * x for x in orientation) > 0.1)
    centre = (1.0, -2.0, 0.5)
    scene = scene_of(
        **{'sheet__rows': 5, 'sheet__columns': 6, 'sheet__size': [0.6, 1.0]},
        **{'sheet__position': centre, 'sheet__orientation': orientation},
        sphere__radius=radius,
        sphere__position=[a + b for a, b in zip(centre, offset, strict=True)],
    )
    # It may also start smaller without an overlap: so that no triangle can reach it, particles are
    # at first as far away as its surface is beyond a circumradius of the triangles.
    room = math.hypot(radius, 1.05 * circumradius(scene))
    near, overlaps = (
        'sphere.position' in implausible_values(scene.with_parameters({'sphere.radius': r}))
        for r in (room + 2e-3, radius - 2e-3)
    )
    starts_smaller = Cloth(scene).sphere_radius < radius
    assert overlaps <= starts_smaller <= near
