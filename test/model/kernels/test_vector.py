"""Vectors of four numbers in compiled kernels, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.kernels.jit import kernel
from cloth_ros.model.kernels.vector import (
    filled,
    gather,
    greatest,
    least,
    load,
    root,
    scatter,
    where_positive,
)

PRECISIONS = [np.float32, np.float64]


@kernel
def _store(vector, index, out):  # type: ignore[no-untyped-def]
    """Write a vector as the first column of a matrix, from an index on."""
    zero = vector - vector
    rows = (index, index + 4, index + 8, index + 12)
    scatter(out, rows, 0, (vector, zero, zero, zero))


@kernel
def _combine(numbers, out, scale):  # type: ignore[no-untyped-def]
    """Write what the operations return for two vectors."""
    first, second = load(numbers, 0), load(numbers, 5)
    _store(first + second, 0, out)
    _store(first - second, 16, out)
    _store(first * second, 32, out)
    _store(first / second, 48, out)
    _store(scale * first, 64, out)
    _store(least(first, second), 80, out)
    _store(greatest(first, second), 96, out)
    _store(where_positive(first, filled(scale)), 112, out)
    _store(root(second), 128, out)


@pytest.mark.parametrize('precision', PRECISIONS)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(-10.0, 10.0))
def test_operations(precision: type, seed: int, scale: float) -> None:
    numbers = np.random.default_rng(seed).normal(size=9).astype(precision)
    numbers[5:] = 0.1 + np.abs(numbers[5:])
    out, factor = np.full(145, 7.0, precision), precision(scale)
    _combine(numbers, out, factor)
    first, second = numbers[:4], numbers[5:]
    expected = [
        first + second,
        first - second,
        first * second,
        first / second,
        factor * first,
        np.minimum(first, second),
        np.maximum(first, second),
        np.where(first > 0, factor, 0),
        np.sqrt(second),
    ]
    np.testing.assert_allclose(
        out[:144].reshape(9, 4, 4)[..., 0], expected, rtol=0, atol=2e3 * np.finfo(precision).eps
    )
    assert (out[144] == 7.0).all()


def test_of_a_number_and_one_that_is_none_the_second_is_taken() -> None:
    numbers, out = np.full(9, np.nan, np.float32), np.zeros(145, np.float32)
    numbers[5:] = 2.0
    _combine(numbers, out, np.float32(1.0))
    results = out[:144].reshape(9, 4, 4)[..., 0]
    assert (results[5:7] == 2.0).all()
    assert (results[7] == 0.0).all()


@kernel
def _copy(source, out, indices):  # type: ignore[no-untyped-def]
    """Copy the second four numbers of four rows to the first ones, in the opposite order."""
    rows = (indices[0], indices[1], indices[2], indices[3])
    x, y, z, w = gather(source, rows, 1)
    scatter(out, rows, 0, (w, z, y, x))


@pytest.mark.parametrize('precision', PRECISIONS)
def test_rows_are_gathered_and_scattered(precision: type) -> None:
    source = np.arange(60).reshape(6, 10).astype(precision)
    rows = np.array([5, 0, 3, 1])
    out = np.zeros_like(source)
    _copy(source, out, 10 * rows)
    expected = np.zeros_like(source)
    expected[rows, :4] = source[rows, 4:8][:, ::-1]
    np.testing.assert_array_equal(out, expected)
