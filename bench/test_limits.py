"""Limits of the processor: rates of additions and multiplications, roots, and memory."""

from __future__ import annotations

import numpy as np
import pytest

from cloth_ros.model.kernels.jit import inlined, kernel

from .sheets import timed

# Numbers of elements that fit into the first-level cache, and into no cache.
IN_CACHE, IN_MEMORY = 2048, 16_000_000
# Dependent operations per element in each of four chains.  They are written out by inlined
# functions: with an inner loop, the loop over elements would not be vectorised.
CHAIN = 32


@inlined
def _four(x, factor, term):  # type: ignore[no-untyped-def]
    x = x * factor + term
    x = x * factor + term
    x = x * factor + term
    return x * factor + term


@inlined
def _sixteen(x, factor, term):  # type: ignore[no-untyped-def]
    x = _four(_four(x, factor, term), factor, term)
    return _four(_four(x, factor, term), factor, term)


@kernel
def multiply_and_add(values, factor, term):  # type: ignore[no-untyped-def]
    """Make 2 · 4 · CHAIN operations per element, in four chains."""
    for i in range(np.uint64(values.size)):
        x = values[i]
        y, z, w = x + term, x - term, x * term
        x = _sixteen(_sixteen(x, factor, term), factor, term)
        y = _sixteen(_sixteen(y, factor, term), factor, term)
        z = _sixteen(_sixteen(z, factor, term), factor, term)
        w = _sixteen(_sixteen(w, factor, term), factor, term)
        values[i] = x - y + z - w


@inlined
def _roots(x, term):  # type: ignore[no-untyped-def]
    x = term / np.sqrt(x + term)
    x = term / np.sqrt(x + term)
    x = term / np.sqrt(x + term)
    return term / np.sqrt(x + term)


@kernel
def take_roots(values, term):  # type: ignore[no-untyped-def]
    """Compute CHAIN reciprocal square roots per element, in four chains."""
    for i in range(np.uint64(values.size)):
        x = values[i]
        y, z, w = x + term, x + term + term, x * term
        x, y = _roots(_roots(x, term), term), _roots(_roots(y, term), term)
        z, w = _roots(_roots(z, term), term), _roots(_roots(w, term), term)
        values[i] = x - y + z - w


@kernel
def move(source, more, out, factor):  # type: ignore[no-untyped-def]
    """Read two numbers and write one, per element."""
    for i in range(np.uint64(out.size)):
        out[i] = source[i] + factor * more[i]


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_arithmetic(benchmark, precision):
    """Fused multiply-adds, counted as two operations each."""
    number = np.float32 if precision == 'single' else np.float64
    values = np.ones(IN_CACHE, number)
    operations = 8 * CHAIN * IN_CACHE
    timed(
        benchmark,
        lambda: [multiply_and_add(values, number(0.5), number(0.5)) for _ in range(10)],
        10 * operations,
        table='limit',
        what='additions and multiplications',
        precision=precision,
    )


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_roots(benchmark, precision):
    """Reciprocal square roots to full precision."""
    number = np.float32 if precision == 'single' else np.float64
    values = np.ones(IN_CACHE, number)
    timed(
        benchmark,
        lambda: [take_roots(values, number(1)) for _ in range(10)],
        10 * CHAIN * IN_CACHE,
        table='limit',
        what='reciprocal roots',
        precision=precision,
    )


def test_memory(benchmark):
    """Bandwidth of the memory, outside the caches."""
    source, more, out = (np.ones(IN_MEMORY, np.float32) for _ in range(3))
    timed(
        benchmark,
        lambda: move(source, more, out, np.float32(2)),
        12 * IN_MEMORY,
        table='limit',
        what='bytes moved',
        precision='single',
    )
