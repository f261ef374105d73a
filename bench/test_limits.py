"""The machine's own limit: how fast it adds and multiplies, takes roots, and moves memory."""

from __future__ import annotations

import numpy as np
import pytest

from cloth_ros.model.kernels.jit import inlined, kernel

from .sheets import timed

# Elements that stay in the first cache, and elements that fit in none.
NEAR, FAR = 2048, 16_000_000
# Operations on an element between load and store; in one loop, they would not be vectorised.
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
    """Take 2 · 4 · CHAIN operations for each element, in four chains."""
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
    """Take CHAIN reciprocal roots of each element, in four chains."""
    for i in range(np.uint64(values.size)):
        x = values[i]
        y, z, w = x + term, x + term + term, x * term
        x, y = _roots(_roots(x, term), term), _roots(_roots(y, term), term)
        z, w = _roots(_roots(z, term), term), _roots(_roots(w, term), term)
        values[i] = x - y + z - w


@kernel
def move(source, more, out, factor):  # type: ignore[no-untyped-def]
    """Read two numbers and write one."""
    for i in range(np.uint64(out.size)):
        out[i] = source[i] + factor * more[i]


@pytest.mark.parametrize('precision', ['single', 'double'])
def test_arithmetic(benchmark, precision):
    """Fused multiplications and additions, two operations each."""
    number = np.float32 if precision == 'single' else np.float64
    values = np.ones(NEAR, number)
    operations = 8 * CHAIN * NEAR
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
    """Reciprocal roots, to full precision."""
    number = np.float32 if precision == 'single' else np.float64
    values = np.ones(NEAR, number)
    timed(
        benchmark,
        lambda: [take_roots(values, number(1)) for _ in range(10)],
        10 * CHAIN * NEAR,
        table='limit',
        what='reciprocal roots',
        precision=precision,
    )


def test_memory(benchmark):
    """Memory that is in no cache."""
    source, more, out = (np.ones(FAR, np.float32) for _ in range(3))
    timed(
        benchmark,
        lambda: move(source, more, out, np.float32(2)),
        12 * FAR,
        table='limit',
        what='bytes moved',
        precision='single',
    )
