"""Pins as row and column, each an index or a slice as in Python."""

import numpy as np
from builders import scene_of
from hypothesis import given
from hypothesis import strategies as st

ROWS, COLUMNS = 4, 5


def parts(count: int) -> st.SearchStrategy[int | slice]:
    """Return a strategy of indices, and of slices that select at least one of `count`."""
    ends, steps = st.none() | st.integers(-6, 6), st.none() | st.integers(-3, 3).filter(bool)
    slices = st.builds(slice, ends, ends, steps).filter(lambda part: range(count)[part])
    return st.integers(-count, count - 1) | slices


def written(part: int | slice) -> str:
    if isinstance(part, int):
        return f' {part} '
    return ':'.join('' if end is None else f'{end}' for end in (part.start, part.stop, part.step))


@given(st.lists(st.tuples(parts(ROWS), parts(COLUMNS)), max_size=3))
def test_pins_select_what_numpy_selects(selections):
    expected = np.zeros((ROWS, COLUMNS), bool)
    for row, column in selections:
        expected[row, column] = True
    pins = [f'{written(row)},{written(column)}' for row, column in selections]
    scene = scene_of(sheet__rows=ROWS, sheet__columns=COLUMNS, pins=[*pins, ''])
    assert np.array_equal(scene.pinned(), expected)
