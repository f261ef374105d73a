"""What error messages advise succeeds."""

import math

import pytest
from builders import examples, scene_of
from hypothesis import example, given
from hypothesis import strategies as st
from reliability.invalid_values import NAMES, anything, mostly, near
from remedies import as_in_a_file, as_set, follow

from cloth_ros import Scene
from cloth_ros.model import check_scene
from cloth_ros.model.kinematic_path import checked_position
from cloth_ros.scene.parameter import DEFAULTS, GROUPS, PARAMETERS, unknown_parameter_error

WRONG = {
    'nothing': None,
    'no text': '',
    'a text': 'fast',
    'a number with its unit': '2.5 m',
    'a number with underscores': '1_0',
    'true': True,
    'a number': 1.5,
    'a negative number': -1,
    'a small number': 1e-12,
    'a large number': 2**60,
    'infinity': math.inf,
    'not a number': math.nan,
    'an empty list': [],
    'a list of one': [0.5],
    'a list of two': [0, 0],
    'a list of five': [1, 2, 3, 4, 5],
    'a list with a text': [0.0, 'a', 1.0],
    'a list with infinity': [0.0, 0.0, math.inf],
    'a descending list': [2.0, 1.0],
    'zeros': [0.0, 0.0, 0.0],
    'four zeros': [0, 0, 0, 0],
    'a list of nothing': [None],
    'a nested list': [[1.0], [2.0], [3.0]],
    'a list as text': '[0,-1]',
    'a pin': '0,0',
    'a row': ['0'],
    'a pin outside': ['99,-99'],
    'no slice': ['4:4,0', '0,::0'],
    'many pins': ['0,0'] * 5000,
    'a group': {'x': 1.0},
    'a long text': 'x' * 1000,
    'what cannot be printed': 'a\0b\n',
}


@pytest.mark.parametrize('typed', [as_in_a_file, as_set])
@pytest.mark.parametrize('value', WRONG.values(), ids=WRONG)
def test_the_remedy_of_a_wrong_value_succeeds(value, typed):
    refused = 0
    for name in NAMES:
        errors = follow({name: value}, lambda values: Scene().with_parameters(values), typed)
        refused += bool(errors)
        assert all('; ' in error and error.isprintable() for error in errors)
    assert refused


@pytest.mark.parametrize('typed', [as_in_a_file, as_set])
@examples(1)
@example(changes={'collider.names': ['', 'a', '2x']})
@given(
    changes=st.dictionaries(st.sampled_from(NAMES), st.none(), min_size=1, max_size=3).flatmap(
        lambda names: st.fixed_dictionaries(
            {name: mostly(near(name), anything()) for name in names}
        )
    )
)
def test_the_remedies_of_any_values_succeed(changes, typed):
    follow(changes, lambda values: Scene().with_parameters(values), typed)


def edits(name: str) -> set[str]:
    """Return a name with one small mistake, several times."""
    middle = len(name) // 2
    return {
        f'{name}s',
        name[1:],
        name[:-1],
        name[:middle] + name[middle + 1 :],
        name[:middle] + name[middle] + name[middle:],
        name.upper(),
        name.replace('.', '/'),
        name.replace('_', '-'),
    } - {name}


def test_a_misspelt_name_is_answered_with_the_right_one():
    for name in (*PARAMETERS, *GROUPS):
        for wrong in edits(name) - set(PARAMETERS) - set(GROUPS):
            assert f'did you mean {name!r}' in str(unknown_parameter_error(wrong)), wrong
    for name in GROUPS:
        for wrong in edits(name) - set(GROUPS):
            error = unknown_parameter_error(wrong, group=True)
            assert f'did you mean {name!r}?' in str(error), wrong


@pytest.mark.parametrize(
    ('values', 'advice'),
    [
        ({'sheet.size': 1.5}, 'write [1.5, 1.5]'),
        ({'gravity': [0, 0]}, 'write [0.0, 0.0, -9.81]'),
        ({'sheets': {'rows': 8}}, "did you mean 'sheet'?"),
        ({'winds': {'velocity': [1, 0, 0]}}, "did you mean 'wind'?"),
        ({'winds': 3.0}, "did you mean 'wind', with velocity, air_density, "),
        ({'wind': {'gusts': {'period': 5.0}}}, "did you mean 'wind.gust'?"),
        ({'rows': 8}, "did you mean 'sheet.rows'?"),
        ({'sheet': 4}, 'write sheet.rows: 32'),
        ({'pins': [0, 0]}, 'write ["0,0"]'),
        ({'pins': '0,:'}, 'write ["0,:"]'),
        ({'pins': ['0']}, 'write "0,:"'),
        ({'pins': ['40,3']}, 'write "31,3"'),
        ({'wind.gust.seed': 2**60}, 'the nearest allowed value is 9007199254740992'),
        ({'rate': '60 Hz'}, 'write 60.0'),
        ({'sheet.rows': '8.5'}, 'write 8'),
        ({'markers.springs': 1}, 'write true'),
        ({'solver.precision': 'Double'}, 'write "double"'),
    ],
)
def test_remedies_that_a_user_expects(values, advice):
    with pytest.raises(ValueError, match='; ') as refusal:
        Scene.from_parameters(values)
    assert advice in str(refusal.value)


ACCEPTED = [
    ('gravity', '[0, 0, -9.81]', (0.0, 0.0, -9.81)),
    ('gravity', [0, 0, -9.81], (0.0, 0.0, -9.81)),
    ('gravity', ['0', 0, '-98.1e-1'], (0.0, 0.0, -9.81)),
    ('solver.tolerance', '1e-4', 1e-4),
    ('rate', ' 60 ', 60.0),
    ('sheet.rows', '8', 8),
    ('sheet.rows', '8.0', 8),
    ('wind.gust.seed', '9007199254740991', 2**53 - 1),
    ('markers.springs', 'True', True),
    ('pins', '[]', ()),
    ('pins', [], ()),
]


@pytest.mark.parametrize(('name', 'value', 'expected'), ACCEPTED)
def test_values_that_ros_delivers_in_another_type_are_taken(name, value, expected):
    found = Scene().with_parameters({name: value}).flat()[name]
    assert (found, type(found)) == (expected, type(expected))


STIFF = {'springs.structural': 1e8, 'sheet.mass': 1e-9, 'rate': 1.0}
IMPOSSIBLE = [
    STIFF,
    {**STIFF, 'springs.damping': 1e6},
    {'solver.substeps': 1},
    {'solver.substeps': 3, 'springs.structural': 1e5},
    {'solver.tolerance': 1e-6, 'sheet.mass': 1e-6, 'springs.shear': 1e8},
]


@pytest.mark.parametrize('values', IMPOSSIBLE)
def test_the_remedies_for_substeps_succeed(values):
    assert follow(values, lambda changed: check_scene(Scene().with_parameters(changed)))


@examples(0.5)
@given(stiffness=st.floats(1, 1e6), rate=st.floats(1, 1000), mass=st.floats(1e-3, 10))
def test_the_least_number_of_substeps_is_accepted(stiffness, rate, mass):
    scene = scene_of(springs__structural=stiffness, rate=rate, sheet__mass=mass)
    try:
        check_scene(scene.with_parameters({'solver.substeps': 1}))
    except ValueError as error:
        least = int(str(error).partition('0 or at least ')[2].split()[0])
        assert least > 1
        if least <= PARAMETERS['solver.substeps'].bounds[1]:
            check_scene(scene.with_parameters({'solver.substeps': least}))


@examples(0.5)
@given(point=st.tuples(*[st.floats(-1e6, 1e6)] * 3), size=st.floats(0, 1e3))
def test_the_nearest_position_of_a_sphere_is_accepted(point, size):
    sheet = Scene().sheet.position

    def move(values):
        checked_position('sphere', values['sphere position'], size, sheet)

    assert len(follow({'sphere position': point}, move)) <= 1


def test_defaults_are_those_of_a_scene():
    assert Scene().flat() == DEFAULTS
