"""
Passes over the particles, many in a row, in one compiled kernel.

A step of an explicit method kicks, v ← v + h a, and then lets the particles drift, x ← x + h′ v.
Where springs and gravity act alone that is one pass; with air and dashpots, accelerations,
triangles and kicks take one each.  A table says which passes to make.  What the scene lacks is
not in the code that is compiled for it.
"""

from __future__ import annotations

import functools

import numpy as np

from ..forces.aerodynamics import apply_air_drag, facets_of_quad, matrix
from ..forces.springs import spring_acceleration
from ..kernels.jit import Kernel, inlined, kernel
from ..kernels.thread_pool import chunk_length, claim_chunk, mark_done, notify, wait

# What a pass does; those up to KICK write new positions.  Plain numbers: Numba takes them as
# constants, and NumPy, which looks for its own methods in what it compares with, finds nothing to
# run there, where it would keep Ctrl-C to itself.
DRIFT = 0
KICK_BY_SPRINGS = 1  # with gravity and drag, and drift
KICK = 2  # by the accelerations, drag and air, and drift
KICK_MIDDLE = 3  # the same, but write velocities elsewhere and do not drift
ACCELERATE = 4  # by springs, gravity and dashpots
ACCELERATE_MIDDLE = 5  # the same, with the velocities from there
FACETS = 6  # of the triangles

# Columns of the table: the kind, what a kick multiplies velocities and accelerations by, the drift
# after it, and the strength of dashpots and air.
_KIND, _DECAY, _GAIN, _LENGTH, _DASHPOTS, _AIR = range(6)


@inlined
def _drift(first, last, position, other, velocity, h):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        other[0, i] = position[0, i] + h * velocity[0, i]
        other[1, i] = position[1, i] + h * velocity[1, i]
        other[2, i] = position[2, i] + h * velocity[2, i]


@inlined
def _settle(first, last, position, other, velocity, middle, h):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        u, v, w = middle[0, i], middle[1, i], middle[2, i]
        velocity[0, i], velocity[1, i], velocity[2, i] = u, v, w
        other[0, i] = position[0, i] + h * u
        other[1, i] = position[1, i] + h * v
        other[2, i] = position[2, i] + h * w


@inlined
def _accelerate(  # type: ignore[no-untyped-def]
    first, last, position, velocity, out, free, row, springs, dashpots, structural, shear,
    bending, damped, double,
):  # fmt: skip
    for i in range(first, last):
        x, y, z = spring_acceleration(
            position, velocity, i, row, springs, dashpots,
            structural, shear, bending, damped, double,
        )  # fmt: skip
        out[0, i], out[1, i], out[2, i] = free[i] * x, free[i] * y, free[i] * z


@inlined
def _facets(first, last, position, facets, row, bounds):  # type: ignore[no-untyped-def]
    half = position.dtype.type(0.5)
    for i in range(first, last):
        facets_of_quad(position, facets, i, row, half, bounds[0], bounds[1])


@inlined
def _kick(  # type: ignore[no-untyped-def]
    first, last, velocity, out, acceleration, facets, free, row, wind, decay, gain, strength,
    bounds, air,
):  # fmt: skip
    """Kick, and return the work of the air on the particles that it speeds up, J/kg."""
    zero, unit = velocity.dtype.type(0), velocity.dtype.type(1)
    half = velocity.dtype.type(0.5)
    work = zero
    for i in range(first, last):
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        x = decay * u + gain * acceleration[0, i]
        y = decay * v + gain * acceleration[1, i]
        z = decay * w + gain * acceleration[2, i]
        if air:
            # Relative to the air, before and after.
            x, y, z = x - wind[0], y - wind[1], z - wind[2]
            p, q, r = apply_air_drag(
                matrix(facets, i, row, zero),
                u - wind[0],
                v - wind[1],
                w - wind[2],
                x,
                y,
                z,
                strength,
                bounds[2],
                bounds[1],
                unit,
            )
            # Air at rest does no work, whatever a step that is too long makes of it.
            relative = p * p + q * q + r * r - x * x - y * y - z * z
            along = wind[0] * (p - x) + wind[1] * (q - y) + wind[2] * (r - z)
            work += free[i] * max(along + half * min(relative, zero), zero)
            x, y, z = wind[0] + p, wind[1] + q, wind[2] + r
        out[0, i], out[1, i], out[2, i] = free[i] * x, free[i] * y, free[i] * z
    return work


@functools.cache
def compose(
    structural: bool,
    shear: bool,
    bending: bool,
    damped: bool,
    air: bool,
    apart: bool,
    double: bool,
) -> Kernel:
    """
    Compose the kernel of a scene.

    Parameters
    ----------
    structural, shear, bending, damped, air
        What there is.
    apart
        True if it must be able to accelerate apart from kicks.
    double
        True for double precision.

    """

    @kernel
    def make(  # type: ignore[no-untyped-def]
        posted, counters, thread, threads, begin, end, stride, table, position, other, velocity,
        middle, acceleration, facets, free, springs, wind, bounds, work,
    ):  # fmt: skip
        notify(posted, thread)
        number = velocity.dtype.type
        row = np.uint64(stride)
        size = chunk_length(threads, begin, end)
        chunks = (end - begin + size - 1) // size
        for n in range(len(table)):
            kind = int(table[n, _KIND])
            decay, gain = number(table[n, _DECAY]), number(table[n, _GAIN])
            h = number(table[n, _LENGTH])
            dashpots, strength = number(table[n, _DASHPOTS]), number(table[n, _AIR])
            chunk = claim_chunk(counters, thread, threads, chunks, n)
            while chunk >= 0:
                first = np.uint64(begin + chunk * size)
                last = np.uint64(min(begin + (chunk + 1) * size, end))
                if kind == DRIFT:
                    _drift(first, last, position, other, velocity, h)
                elif kind == KICK_BY_SPRINGS:
                    for i in range(first, last):
                        x, y, z = spring_acceleration(
                            position, velocity, i, row, springs, dashpots,
                            structural, shear, bending, False, double,
                        )  # fmt: skip
                        u = free[i] * (decay * velocity[0, i] + gain * x)
                        v = free[i] * (decay * velocity[1, i] + gain * y)
                        w = free[i] * (decay * velocity[2, i] + gain * z)
                        velocity[0, i], velocity[1, i], velocity[2, i] = u, v, w
                        # Elsewhere: neighbours still ask for the positions before.
                        other[0, i] = position[0, i] + h * u
                        other[1, i] = position[1, i] + h * v
                        other[2, i] = position[2, i] + h * w
                elif apart:
                    if kind == ACCELERATE:
                        _accelerate(
                            first, last, position, velocity, acceleration, free, row, springs,
                            dashpots, structural, shear, bending, damped, double,
                        )  # fmt: skip
                    elif kind == ACCELERATE_MIDDLE and damped:
                        _accelerate(
                            first, last, position, middle, acceleration, free, row, springs,
                            dashpots, structural, shear, bending, damped, double,
                        )  # fmt: skip
                    elif kind == FACETS and air:
                        _facets(first, last, position, facets, row, bounds)
                    elif kind == KICK_MIDDLE and damped:
                        _kick(
                            first, last, velocity, middle, acceleration, facets, free, row, wind,
                            decay, gain, strength, bounds, air,
                        )  # fmt: skip
                    elif kind == KICK:
                        work[chunk] += _kick(
                            first, last, velocity, middle, acceleration, facets, free, row, wind,
                            decay, gain, strength, bounds, air,
                        )  # fmt: skip
                        # From there: in place, the compiler leaves the loop before scalar.
                        _settle(first, last, position, other, velocity, middle, h)
                mark_done(counters)
                chunk = claim_chunk(counters, thread, threads, chunks, n)
            wait(counters, chunks, n)
            if kind <= KICK:
                position, other = other, position

    return make
