"""Bad values given to the Python interface: scenes, and commands to a cloth."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene

from . import junk
from .tally import Tally, attempt

# Every part that can be commanded, and small.
COMMANDED = Scene(
    sheet={'rows': 5, 'columns': 6},
    sphere={'radius': 0.1, 'position': [0.0, 0.0, 2.0]},
    pins=['0,0'],
)
_TICK = 1 / 60  # s
KINDS = [float, np.float32, np.float16, np.longdouble, int, bool, complex, object, 'U9', 'M8[s]']


def drawn(cases: int, strategy: st.SearchStrategy, test: Callable) -> None:
    """Call `test` with so many examples of a strategy, the same ones each time."""
    everything = list(HealthCheck)
    settings(
        max_examples=cases,
        database=None,
        deadline=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=everything,
    )(given(strategy)(test))()


def nested(entries: dict) -> dict:
    """Return parameters by dotted names as nested mappings."""
    result: dict = {}
    for name, value in entries.items():
        into = result
        *groups, last = str(name).split('.')
        for group in groups:
            inner = into.setdefault(group, {})
            into = inner if isinstance(inner, dict) else {}
        into[last] = value
    return result


def try_scene(tally: Tally, way: str, changes: object) -> None:
    """Make a scene of parameters in one of several ways; what is accepted must be whole."""
    base = Scene()
    made: list[Scene] = []

    def make() -> None:
        if way == 'with_parameters':
            made.append(base.with_parameters(changes))
        elif way == 'nested' and isinstance(changes, dict):
            made.append(Scene.from_parameters(nested(changes)))
        else:
            made.append(Scene.from_parameters(changes))

    if attempt(tally, (way, changes), make):
        flat = made[0].flat()
        same_types = all(type(flat[name]) is type(junk.DEFAULTS[name]) for name in junk.NAMES)
        if not same_types or made[0].with_parameters({}) != made[0]:
            tally.blame('accepted, but not a valid scene', changes)
    if base != Scene():
        tally.blame('changed the scene before', changes)


def parameters(cases: int) -> Tally:
    """Fuzz the parameters."""
    tally = Tally('parameters, in Python')
    ways = st.sampled_from(['with_parameters', 'from_parameters', 'nested'])
    some = st.lists(junk.entries(), min_size=1, max_size=3).map(dict)
    changes = junk.mostly(some, junk.anything())
    drawn(cases, st.tuples(ways, changes), lambda case: try_scene(tally, *case))
    return tally


def state(cloth: Cloth) -> tuple:
    """Return all that a refused command must leave as it is, to the bit."""
    fields = (cloth.positions.tobytes(), cloth.velocities.tobytes())
    waypoints = [point.tolist() for point in cloth.sphere_waypoints]
    return (*fields, cloth.wind, cloth.sphere_position, waypoints, cloth.time, cloth.scene)


class Commanded:
    """A cloth that is given commands, and made anew where a valid one has moved it far."""

    def __init__(self, tally: Tally) -> None:
        self._tally = tally
        self.cloth = Cloth(COMMANDED)

    def give(self, command: str, value: object) -> None:
        """Give a command, and look at what has become of the cloth."""
        cloth, before = self.cloth, state(self.cloth)

        def call() -> None:
            if command in ('advance', 'move_sphere'):
                getattr(cloth, command)(value)
            else:
                setattr(cloth, command, value)

        if not attempt(self._tally, (command, value), call):
            if state(cloth) != before:
                self._tally.blame('refused, but not left as it was', (command, value))
            return
        cloth.advance(_TICK)
        if not (np.isfinite(cloth.positions).all() and np.isfinite(cloth.velocities).all()):
            self._tally.blame('not finite', (command, value))
        cloth.reset()


def fields() -> st.SearchStrategy:
    """Return a strategy of values for positions and velocities."""
    shape = (COMMANDED.sheet.rows, COMMANDED.sheet.columns, 3)
    right = st.sampled_from(KINDS)

    def filled(kind: object, value: object, place: int) -> object:
        field = np.zeros(shape, kind)
        with warnings.catch_warnings(), contextlib.suppress(Exception):
            warnings.simplefilter('ignore')  # not every value fits every kind
            field.reshape(-1)[place % field.size] = value
        return field

    arrays = st.builds(filled, right, junk.numbers(), st.integers(0, 1000))
    lists = arrays.map(lambda field: field.tolist())
    return st.one_of(arrays, lists, junk.anything())


def commands(cases: int) -> Tally:
    """Fuzz the commands to a cloth."""
    tally = Tally('commands to a cloth, in Python', 'the same; refused: the cloth as it was')
    cloth = Commanded(tally)
    # What is valid, and longer, takes longer.
    short = st.floats(0, 0.05) | st.sampled_from([-1e-9, 1e6 + 1, -0.0, 5e-324])
    seconds = st.one_of(short, junk.anything().filter(lambda value: not _is_long(value)))
    vector = junk.vectors() | junk.anything()
    every = st.one_of(
        st.tuples(st.just('advance'), seconds),
        st.tuples(st.sampled_from(['wind', 'move_sphere']), vector),
        st.tuples(st.sampled_from(['positions', 'velocities']), fields()),
    )
    drawn(cases, every, lambda case: cloth.give(*case))
    return tally


def _is_long(value: object) -> bool:
    return isinstance(value, (int, float)) and 0.05 < value <= 1e6
