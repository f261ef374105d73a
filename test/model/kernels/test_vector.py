"""Vectors of four numbers in compiled kernels, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.kernels.jit import kernel
from cloth_ros.model.kernels.vector import dot, load, number, store, vector3


@kernel
def _combine(rows, out, scale):  # type: ignore[no-untyped-def]
    """Write what the operations return for the vectors of each row."""
    for row in range(len(rows)):
        r = np.uint64(row)
        first, second = load(rows, r, 0), load(rows, r, 1)
        store(out, r, 0, first + second)
        store(out, r, 1, first - second)
        store(out, r, 2, scale * first)
        store(out, r, 3, vector3(number(first, 3), number(second, 1), dot(first, second)))


@pytest.mark.parametrize('precision', [np.float32, np.float64])
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 5), scale=st.floats(-10.0, 10.0))
def test_operations(precision: type, seed: int, count: int, scale: float) -> None:
    rows = np.random.default_rng(seed).normal(size=(count, 9)).astype(precision)
    out, factor = np.full((count, 17), 7.0, precision), precision(scale)
    _combine(rows, out, factor)
    first, second = rows[:, :4], rows[:, 4:8]
    dots = np.einsum('ij,ij->i', first, second)
    zero = np.zeros(count)
    last = np.stack([first[:, 3], second[:, 1], dots, zero], axis=1)
    expected = np.hstack([first + second, first - second, factor * first, last])
    tolerance = 8 * np.finfo(precision).eps * max(1.0, float(np.abs(rows).max(initial=0.0)) ** 2)
    np.testing.assert_allclose(out[:, :16], expected, rtol=0, atol=10 * tolerance)
    assert (out[:, 16] == 7.0).all()
