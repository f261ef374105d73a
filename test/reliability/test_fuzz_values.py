"""Bad parameters and commands in Python."""

import array
import contextlib
import decimal
import warnings

import numpy as np
import pytest
from builders import examples
from hypothesis import given
from hypothesis import strategies as st
from reliability.invalid_values import (
    DEFAULTS,
    NAMES,
    anything,
    entries,
    mostly,
    numbers,
    refusal,
    vectors,
)

from cloth_ros import Cloth, Scene


def make_scene(way: str, changes: object) -> str | None:
    """Make a scene in one of several ways; return the refusal, or check the scene."""
    base, made = Scene(), []
    make = base.with_parameters if way == 'with_parameters' else Scene.from_parameters
    refused = refusal(lambda: made.append(make(changes)))
    for scene in made:
        flat = scene.flat()
        assert all(type(flat[name]) is type(DEFAULTS[name]) for name in NAMES)
        assert scene.with_parameters({}) == scene
    assert base == Scene()
    return refused


# Each of these was accepted, or failed in another way, once.
INVALID = [
    *({'wind.gust.seed': 2**53 + 1}, {'rate': b'60'}, {'rate': np.array([60.0])}),
    *({'rate': 10**5000}, {'rate': decimal.Decimal('sNaN')}, {'pins': ['9' * 5000 + ',0']}),
    *({'pins': ['0,0'] * 5000}, {'gravity': range(10**30)}, {'gravity': np.full(3, 1 + 1j)}),
    *({'gravity': np.zeros((3, 3))}, {'frame_id': '\ud800'}, {'frame_id': 'a\0b'}),
    *({'frame_id': 'x' * 10**6}, {'x' * 10**5: 1}, {10**5000: 1}, {'sheet': 4, 'sheet.rows': 3}),
    *({'sheet.rows': array.array('d', [1.0])}, None, [], 'rate'),
]


WAYS = ('with_parameters', 'from_parameters')


@pytest.mark.parametrize('way', WAYS)
def test_parameters_known_to_be_invalid(way):
    """Parameters that were accepted or failed otherwise once: a clear error."""
    for changes in INVALID:
        assert make_scene(way, changes), changes


@examples(2)
@given(
    way=st.sampled_from(WAYS),
    changes=mostly(st.lists(entries(), min_size=1, max_size=3).map(dict), anything()),
)
def test_parameters(way, changes, outcomes):
    """Parameters: a clear error, or a valid scene."""
    outcomes['refused' if make_scene(way, changes) else 'valid'] += 1


def test_a_group_given_twice_is_merged():
    """A group as an object, and one of its parameters: both hold."""
    scene = Scene.from_parameters({'sheet': Scene(sheet={'rows': 7}).sheet, 'sheet.columns': 9})
    assert (scene.sheet.rows, scene.sheet.columns) == (7, 9)


SHAPE = (5, 6, 3)


@pytest.fixture(scope='module')
def cloth() -> Cloth:
    """A small cloth that can be given every command."""
    sphere = {'radius': 0.1, 'position': [0.0, 0.0, 2.0]}
    return Cloth(Scene(sheet={'rows': 5, 'columns': 6}, sphere=sphere, pins=['0,0']))


def state(cloth: Cloth) -> tuple:
    """Return everything that a refused command must leave as it is, to the bit."""
    arrays = (cloth.positions.tobytes(), cloth.velocities.tobytes())
    return (*arrays, cloth.inputs, cloth.sphere_position, cloth.time, cloth.scene)


def give(cloth: Cloth, command: str, value: object) -> str | None:
    """Give a command; return the refusal, or check the cloth after a tick and reset it."""
    before = state(cloth)
    if command in ('advance', 'move_sphere'):
        refused = refusal(lambda: getattr(cloth, command)(value))
    else:
        refused = refusal(lambda: setattr(cloth, command, value))
    if refused:
        assert state(cloth) == before
    else:
        cloth.advance(1 / 60)
        assert np.isfinite(cloth.positions).all()
        assert np.isfinite(cloth.velocities).all()
        cloth.reset()
    return refused


HUGE = '1e4000', np.longdouble
COMMANDS = {
    'advance': [None, '0.1', 10**400, [0.1], np.array([0.1])],
    'wind': [list('123'), [1j] * 3, [10**5000] * 3, np.zeros(3, complex), np.full(3, *HUGE)],
    'move_sphere': [None, {0: 1}],
    'positions': [None, [[1.0], [1.0, 2.0]], np.full(SHAPE, 'x'), np.full(SHAPE, *HUGE)],
    'velocities': [np.full(SHAPE, None), [np.ma.masked], np.zeros(SHAPE, complex)],
}


@pytest.mark.parametrize('command', COMMANDS)
def test_commands_known_to_be_invalid(cloth, command):
    """Commands to a cloth that were accepted or failed otherwise once: a clear error."""
    for value in COMMANDS[command]:
        assert give(cloth, command, value), value


def fields() -> st.SearchStrategy:
    """Return a strategy of values for positions and velocities."""
    kinds = ['f8', 'f4', 'f2', np.longdouble, int, bool, complex, object, 'U9', 'M8[s]']

    def filled(kind: object, value: object, place: int) -> np.ndarray:
        field = np.zeros(SHAPE, kind)
        with warnings.catch_warnings(), contextlib.suppress(Exception):
            warnings.simplefilter('ignore')  # not every value fits every kind
            field.reshape(-1)[place] = value
        return field

    arrays = st.builds(filled, st.sampled_from(kinds), numbers(), st.integers(0, 89))
    return arrays | arrays.map(np.ndarray.tolist) | anything()


SECONDS = st.floats(0, 0.05) | st.sampled_from([-1e-9, 1e6 + 1, -0.0, 5e-324])
SECONDS |= anything().filter(lambda x: not (isinstance(x, (int, float)) and 0.05 < x <= 1e6))


@examples(0.75)
@given(
    command=st.one_of(
        st.tuples(st.just('advance'), SECONDS),
        st.tuples(st.sampled_from(['wind', 'move_sphere']), vectors() | anything()),
        st.tuples(st.sampled_from(['positions', 'velocities']), fields()),
    )
)
def test_commands(command, cloth, outcomes):
    """Commands to a cloth: a clear error and the cloth as before, or a finite state."""
    outcomes['refused' if give(cloth, *command) else 'valid'] += 1
