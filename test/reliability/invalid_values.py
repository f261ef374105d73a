"""Values for parameters and commands, most of them invalid, as hypothesis strategies."""

from __future__ import annotations

import array
import datetime
import decimal
import fractions
import math
import warnings
from collections.abc import Callable
from functools import reduce

import numpy as np
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.scene.parameter import PARAMETERS

DEFAULTS = Scene().flat()
NAMES = sorted(PARAMETERS)
GROUPS = ['sheet', 'springs', 'wind', 'wind.gust', 'sphere', 'collider', 'solver', 'markers']


def is_clear(message: str) -> bool:
    """Return True for an error of one printable line that ends in a remedy after a semicolon."""
    return message.isprintable() and '; ' in message and len(message) <= 1000


def refusal(call: Callable[[], object]) -> str | None:
    """Return the message of the ValueError (no subclass, no warning) of a call, or None."""
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        try:
            call()
        except ValueError as error:
            if type(error) is not ValueError:
                raise
            message = str(error)
        else:
            return None
    assert is_clear(message), message[:300]
    return message


RECURSIVE: list = [1.0]
RECURSIVE.append(RECURSIVE)
DEEP = reduce(lambda inner, _: [inner], range(100_000), [])  # deeper than Python recurses
NUMBERS: list[object] = [
    *(math.nan, math.inf, -math.inf, 5e-324, -5e-324, 1e308, -1e308, 0.0, -0.0, 1.5),
    *(2**31, 2**53, 2**53 + 1, 2**63, 2**64, -(2**63), 10**308, 10**400, 10**5000, -1, True),
    *(1j, decimal.Decimal('NaN'), decimal.Decimal('sNaN'), decimal.Decimal(10) ** 999),
    *(fractions.Fraction(1, 3), fractions.Fraction(10**400, 3)),
    *(np.float16(np.inf), np.float32(0.1), np.float64(np.nan), np.longdouble('1e4000')),
    *(np.int8(-1), np.uint64(2**64 - 1), np.bool_(True), np.complex64(1), np.str_('1')),
    *(np.datetime64('2020'), np.timedelta64(1, 's'), np.ma.masked, np.array(1.0)),
]
OBJECTS: list[object] = [
    *(None, ..., NotImplemented, object(), object, math.hypot, Scene, Scene(), Scene().sheet),
    *('', ' ', '1', 'nan', '1e3', '\0', '\ud800', '\n', 'é', 'x' * 100_000, '0,' + '9' * 5000),
    *('0,0', '0,:', '::,::', '-1,-1', '0,0,0', '٣,٣', '1_0,0', '0x1,0', '+-1,0', '0,::-1'),
    *(b'', b'1', b'\xff', bytearray(b'1'), memoryview(b'123'), range(3), range(10**30)),
    *({}, {1: 2}, {'x': 1}, {None: None}, set(), {1.0, 2.0, 3.0}, frozenset(), slice(3)),
    *(iter([1.0, 2.0, 3.0]), (x for x in [1.0]), datetime.date(2020, 1, 1), [], (), [[]], [()]),
    *([1.0], [1.0] * 2, [1.0] * 3, (0, 0, 1), [1.0] * 4, [1.0] * 5000, ['0,0'] * 5000),
    *([None] * 3, ['1', '2', '3'], [b'1'] * 3, [[1.0]] * 3, [True] * 3, [1j] * 3, [{}] * 3),
    *([math.nan] * 3, [math.inf] * 3, [1e308] * 3, [10**400] * 3, [10**5000] * 3, [0, 0, 0]),
    *(RECURSIVE, DEEP, [DEEP] * 3, {'rows': DEEP}),
    *(np.zeros(3), np.zeros((3, 1)), np.zeros((1, 3)), np.zeros(0), np.zeros(3, complex)),
    *(np.full(3, np.nan), np.zeros(3, 'M8[s]'), np.zeros(3, 'U3'), np.array([None] * 3)),
    *(np.zeros(3, [('x', float)]), np.ma.masked_all(3), np.full(3, '1e4000', np.longdouble)),
    *(np.zeros(10**6), array.array('d', [1, 2, 3]), np.array([[], None], object)),
]
OTHER_NAMES: list[object] = [
    *('', '.', 'sheet.', '.rows', 'sheet..rows', 'sheet.rows.x', 'rates', 'x' * 10_000, '\ud800'),
    *(None, 1, 1.5, (), ('sheet', 'rows'), b'rate', True, 10**5000),
]


def one_of(values: list) -> st.SearchStrategy[object]:
    """Return a strategy of values that hypothesis need not be able to print."""
    return st.sampled_from(range(len(values))).map(lambda place: values[place])


def mostly(usual: st.SearchStrategy, rare: st.SearchStrategy) -> st.SearchStrategy:
    """Return a strategy that draws from the first one nine times in ten."""
    return st.integers(0, 9).flatmap(lambda choice: usual if choice else rare)


def numbers() -> st.SearchStrategy[object]:
    """Return a strategy of numbers of every kind and size."""
    usual = (st.integers(-4, 70), st.floats(-100, 100))
    return st.one_of(one_of(NUMBERS), st.floats(), st.integers(), *usual)


def vectors() -> st.SearchStrategy[object]:
    """Return a strategy of lists, most of them of three numbers."""
    return st.lists(numbers(), min_size=3, max_size=3) | st.lists(numbers(), max_size=5)


def anything() -> st.SearchStrategy[object]:
    """Return a strategy of values of every kind."""
    leaves = st.one_of(numbers(), one_of(OBJECTS), st.text(max_size=8), st.binary(max_size=4))
    keys = st.sampled_from(NAMES + GROUPS) | st.text(max_size=4)
    compound = st.lists(leaves, max_size=4) | st.dictionaries(keys, leaves, max_size=3)
    return leaves | vectors() | compound


def near(name: str) -> st.SearchStrategy[object]:
    """Return a strategy of values of a parameter, and of those just outside its range."""
    known, default = PARAMETERS[name], DEFAULTS[name]
    if known.choices:
        return st.sampled_from([*known.choices, *(choice.upper() for choice in known.choices)])
    if isinstance(default, bool):
        return st.booleans()
    if name == 'collider.names':
        names = st.sampled_from(['', ' ', '2x', 'a b', 'wind', 'sphere', 'a', 'a', 'x' * 70, 'é'])
        return st.lists(names, max_size=4)
    if name == 'pins':
        place = st.integers(-33, 33).map(str) | st.sampled_from([':', '1:', '::5', '::-1', '4:4'])
        return st.lists(st.tuples(place, place).map(','.join), max_size=4)
    if known.low is None or known.high is None:
        return st.text(max_size=4)
    if isinstance(default, int):
        return st.integers(int(known.low) - 1, int(known.high) + 1)
    low, high = float(known.low), float(known.high)
    outside = [math.nextafter(low, -math.inf), math.nextafter(high, math.inf)]
    values = st.floats(low, high) | st.sampled_from([low, high, *outside])
    if isinstance(default, tuple):
        return st.lists(values, min_size=len(default), max_size=len(default))
    return values


def entries() -> st.SearchStrategy[tuple[object, object]]:
    """Return a strategy of names and values, most of which are valid or nearly so."""
    others = st.sampled_from(GROUPS) | one_of(OTHER_NAMES) | st.text(max_size=6)
    known = st.sampled_from(NAMES).flatmap(
        lambda name: st.tuples(st.just(name), mostly(mostly(near(name), numbers()), anything()))
    )
    return mostly(known, st.tuples(others, anything()))
