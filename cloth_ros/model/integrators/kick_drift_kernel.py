"""
Compiled kernel of kicks and drifts: a table of operations, each a loop over all particles.

A step of an explicit method kicks, v ← v + h a, and then lets the particles drift, x ← x + h′ v.
With springs and gravity alone that is one loop; with air and dashpots, accelerations and kicks
take one each, and each stage of the dashpots (see `dashpot_stages`) another one.  The table lists
the operations of many substeps, so that one call of the kernel does them all.  Code for effects
that the scene does not have is not compiled.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ..contact import particle_contact
from ..forces.aerodynamics import air_impulse, area_vector
from ..forces.springs import dashpot_acceleration, spring_acceleration
from ..grippers.held_particles import hold, hold_in_stage, hold_midpoint
from ..kernels.jit import Kernel, components, disjoint, inlined, kernel
from ..kernels.thread_pool import (
    CHUNK,
    barrier,
    claim_chunk,
    mark_done,
    notify,
)
from ..self_contact.sheet_contacts import copy_particles, sweep, write_back

# Operations; those up to KICK write new positions.  Plain numbers and not an enumeration: Numba
# takes both as constants, but NumPy calls Python code of an IntEnum when it compares with one, and
# discards a KeyboardInterrupt that is raised there.
DRIFT = 0
KICK_BY_SPRINGS = 1  # acceleration by springs and gravity, kick with drag, and drift
KICK = 2  # kick by the stored accelerations, with drag and air, and drift
KICK_TO_MIDPOINT = 3  # the same kick, but write the velocities to `midpoint` and do not drift
ACCELERATE = 4  # by springs and gravity
DAMP = 5  # a stage of the dashpots, the first one at the velocities of `midpoint`
# Half the change of velocity by contact, and by the air, since the last kick, to `stage`, which
# the first stage of the dashpots writes over.
FIND_CONTACT_KICK = 6
RESOLVE = 7  # contact alone, after a drift that has been made
# Contacts of the sheet with itself, after a drift that has been made: those on two sides of the
# sheet, then those between them; and the end, which writes back what has changed.
SWEEP_SIDES = 8
SWEEP_BETWEEN = 9
END_SWEEPS = 10

# Columns of the table: the operation, the factors of velocity and acceleration in a kick, the
# length of the drift after it, the strength of the air, and 1 to add the contact kick in `stage`.
_OPERATION, _DECAY, _GAIN, _LENGTH, _AIR, _RESISTED = range(6)
# Those of a stage of the dashpots: its number, from 1; the factors of the stage before, of the one
# before that and of the dashpots; and for the last stage, the factor of the result.
_STAGE, _BEFORE, _TWO_BEFORE, _RATE, _SHARE = range(1, 6)


@disjoint
def _drift(first, last, position, back_buffer, velocity, copy, h, copying):  # type: ignore[no-untyped-def]
    """Drift for `h` s; copy the velocities with which particles do, if `copying`."""
    (xs, ys, zs), (us, vs, ws) = back_buffer, copy
    for i in range(first, last):
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        if copying:
            us[i], vs[i], ws[i] = u, v, w
        xs[i], ys[i], zs[i] = (
            position[0, i] + h * u,
            position[1, i] + h * v,
            position[2, i] + h * w,
        )


@disjoint
def _accelerate(  # type: ignore[no-untyped-def]
    first, last, position, out, mobility, row, springs, structural, shear, bending, double
):
    xs, ys, zs = out
    for i in range(first, last):
        xs[i], ys[i], zs[i] = spring_acceleration(
            position, i, row, mobility, springs, structural, shear, bending, double
        )


@disjoint
def _find_contact_kick(first, last, velocity, former, acceleration, out, decay, gain):  # type: ignore[no-untyped-def]
    """Write half the difference of the velocities from those after the last kick."""
    half = velocity.dtype.type(0.5)
    xs, ys, zs = out
    for i in range(first, last):
        xs[i] = half * (velocity[0, i] - (decay * former[0, i] + gain * acceleration[0, i]))
        ys[i] = half * (velocity[1, i] - (decay * former[1, i] + gain * acceleration[1, i]))
        zs[i] = half * (velocity[2, i] - (decay * former[2, i] + gain * acceleration[2, i]))


@disjoint
def _add(first, last, added, out):  # type: ignore[no-untyped-def]
    xs, ys, zs = out
    for i in range(first, last):
        xs[i], ys[i], zs[i] = xs[i] + added[0, i], ys[i] + added[1, i], zs[i] + added[2, i]


@inlined
def _change(velocity, start, accelerated, i, before, rate):  # type: ignore[no-untyped-def]
    """Return the change from `start` after a stage, without the part from two stages before."""
    x, y, z = accelerated
    return (
        before * (velocity[0, i] - start[0, i]) + rate * x,
        before * (velocity[1, i] - start[1, i]) + rate * y,
        before * (velocity[2, i] - start[2, i]) + rate * z,
    )


@disjoint
def _damp(  # type: ignore[no-untyped-def]
    first, last, position, velocity, start, out, mobility, row, springs, before, two_before, rate,
    structural, shear, bending, double,
):  # fmt: skip
    """Make a stage of the dashpots, to `out`, which holds what two stages before wrote, if any."""
    xs, ys, zs = out
    begun = two_before != 0
    for i in range(first, last):
        accelerated = dashpot_acceleration(
            position, velocity, i, row, mobility, springs, structural, shear, bending, double
        )
        x, y, z = _change(velocity, start, accelerated, i, before, rate)
        if begun:
            x += two_before * (xs[i] - start[0, i])
            y += two_before * (ys[i] - start[1, i])
            z += two_before * (zs[i] - start[2, i])
        xs[i], ys[i], zs[i] = start[0, i] + x, start[1, i] + y, start[2, i] + z


@disjoint
def _end_damping(  # type: ignore[no-untyped-def]
    first, last, position, velocity, start, former, out, mobility, row, springs, before,
    two_before, rate, share, structural, shear, bending, double,
):  # fmt: skip
    """Make the last stage of the dashpots, and add `share` times their change of velocity."""
    xs, ys, zs = out
    for i in range(first, last):
        accelerated = dashpot_acceleration(
            position, velocity, i, row, mobility, springs, structural, shear, bending, double
        )
        x, y, z = _change(velocity, start, accelerated, i, before, rate)
        xs[i] += share * (x + two_before * (former[0, i] - start[0, i]))
        ys[i] += share * (y + two_before * (former[1, i] - start[1, i]))
        zs[i] += share * (z + two_before * (former[2, i] - start[2, i]))


@disjoint
def _kick(  # type: ignore[no-untyped-def]
    first, last, position, velocity, out, former, acceleration, mobility, row, air_velocity,
    decay, gain, strength, bounds, air, keep,
):  # fmt: skip
    """Kick; return the work of the air on what it accelerates, J per kg of a cell."""
    zero, unit = velocity.dtype.type(0), velocity.dtype.type(1)
    quarter = velocity.dtype.type(0.25)
    (us, vs, ws), (us_was, vs_was, ws_was) = out, former
    work = zero
    for i in range(first, last):
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        if keep:
            us_was[i], vs_was[i], ws_was[i] = u, v, w
        x = decay * u + gain * acceleration[0, i]
        y = decay * v + gain * acceleration[1, i]
        z = decay * w + gain * acceleration[2, i]
        if air:
            inverse_mass = mobility[0, i] * mobility[1, i]
            p, q, r = air_velocity
            normal, change, mean = air_impulse(
                area_vector(position, i, row, quarter, bounds[0]),
                u - p, v - q, w - r, x - p, y - q, z - r,
                inverse_mass * strength, bounds[1], bounds[2], unit,
            )  # fmt: skip
            change = change * min(inverse_mass, unit)  # 0 if pinned, however it is rounded
            # Air at rest does no work: the error of a long step must not count as some.
            along = change * (p * normal[0] + q * normal[1] + r * normal[2])
            work += unit / max(inverse_mass, unit) * max(along + min(change * mean, zero), zero)
            x, y, z = x + change * normal[0], y + change * normal[1], z + change * normal[2]
        us[i], vs[i], ws[i] = x, y, z
    return work


@functools.cache
def compose(
    structural: bool,
    shear: bool,
    bending: bool,
    damped: bool,
    air: bool,
    separate: bool,
    double: bool,
    kinds: frozenset[int] = frozenset(),
    several: bool = False,
    gripping: bool = False,
    sweeping: bool = False,
) -> Kernel:
    """
    Compile the kernel for the effects that a scene has.

    Parameters
    ----------
    structural, shear, bending, damped, air
        True for each type of spring, for dashpots and for air where the scene has them.
    separate
        True to compile the operations that accelerate and kick in separate loops.
    double
        True for double precision.
    kinds
        Those of the shapes in contact, see `contact.shapes`; none: the kernel ignores contact.
        With any, and with `sweeping`, `former` receives the velocities before each kick.
    several
        True if there is more than one collider.
    gripping
        True if the scene has grippers: `grips` is a `GripTable`, and else an empty tuple.
    sweeping
        True if the scene has contact of the sheet with itself: `sheet_contacts` is a
        `SheetContacts`, and else an empty tuple.

    """
    contact = bool(kinds)
    keep = contact or sweeping
    # Without a collider nothing calls it.
    resolve: Any = particle_contact.compose(kinds, several) if contact else None

    @disjoint
    def kick_by_springs(  # type: ignore[no-untyped-def]
        first, last, position, back_buffer, velocity, former, mobility, row, springs, decay, gain,
        h,
    ):  # fmt: skip
        # To the back buffer: neighbours still read the old positions.
        (xs, ys, zs), (us, vs, ws), (us_was, vs_was, ws_was) = back_buffer, velocity, former
        for i in range(first, last):
            x, y, z = spring_acceleration(
                position, i, row, mobility, springs, structural, shear, bending, double
            )
            u, v, w = us[i], vs[i], ws[i]
            if keep:
                us_was[i], vs_was[i], ws_was[i] = u, v, w
            u, v, w = decay * u + gain * x, decay * v + gain * y, decay * w + gain * z
            us[i], vs[i], ws[i] = u, v, w
            xs[i], ys[i], zs[i] = (
                position[0, i] + h * u, position[1, i] + h * v, position[2, i] + h * w
            )  # fmt: skip

    @inlined
    def damp(  # type: ignore[no-untyped-def]
        first, last, position, back_buffer, midpoint, stage, acceleration, mobility, row, springs,
        columns, grips,
    ):  # fmt: skip
        # Odd stages write to `stage`, even ones to the back buffer, free until the next drift.
        number = position.dtype.type
        count = int(columns[_STAGE])
        before, two_before = number(columns[_BEFORE]), number(columns[_TWO_BEFORE])
        rate, share = number(columns[_RATE]), number(columns[_SHARE])
        source, out = (back_buffer, stage) if count % 2 else (stage, back_buffer)
        if count == 1:
            source = midpoint
        if share == 0:
            _damp(
                first, last, position, source, midpoint, components(out), mobility, row, springs,
                before, two_before, rate, structural, shear, bending, double,
            )  # fmt: skip
        else:
            former = out if two_before != 0 else midpoint
            _end_damping(
                first, last, position, source, midpoint, former, components(acceleration),
                mobility, row, springs, before, two_before, rate, share, structural, shear,
                bending, double,
            )  # fmt: skip
        if gripping:
            hold_in_stage(
                first, last, count, before, two_before, share, midpoint, out, acceleration, grips
            )

    @kernel
    def make(  # type: ignore[no-untyped-def]
        notified, counters, thread, threads, begin, end, stride, table, position, back_buffer,
        velocity, former, midpoint, stage, acceleration, mobility, springs, air_velocity, bounds,
        work, contacts, grips, sheet_contacts,
    ):  # fmt: skip
        notify(notified, thread)
        number = velocity.dtype.type
        row = np.uint64(stride)
        chunks = (end - begin + CHUNK - 1) // CHUNK
        drifts = np.int64(0)  # a literal would be compiled for itself
        for n in range(len(table)):
            operation = int(table[n, _OPERATION])
            decay, gain = number(table[n, _DECAY]), number(table[n, _GAIN])
            h = number(table[n, _LENGTH])
            strength = number(table[n, _AIR])
            chunk = claim_chunk(counters, thread, threads, chunks, n)
            while chunk >= 0:
                first = np.uint64(begin + chunk * CHUNK)
                last = np.uint64(min(begin + (chunk + 1) * CHUNK, end))
                if operation == DRIFT:
                    _drift(
                        first, last, position, components(back_buffer), velocity,
                        components(former), h, keep,
                    )  # fmt: skip
                elif operation == KICK_BY_SPRINGS:
                    kick_by_springs(
                        first, last, position, components(back_buffer), components(velocity),
                        components(former), mobility, row, springs, decay, gain, h,
                    )  # fmt: skip
                elif separate:
                    if operation == ACCELERATE:
                        _accelerate(
                            first, last, position, components(acceleration), mobility, row,
                            springs, structural, shear, bending, double,
                        )  # fmt: skip
                    elif operation == DAMP and damped:
                        damp(
                            first, last, position, back_buffer, midpoint, stage, acceleration,
                            mobility, row, springs, table[n], grips,
                        )  # fmt: skip
                    elif operation == KICK_TO_MIDPOINT and damped:
                        _kick(
                            first, last, position, velocity, components(midpoint),
                            components(former), acceleration, mobility, row, air_velocity, decay,
                            gain, strength, bounds, air, keep,
                        )  # fmt: skip
                        if keep and table[n, _RESISTED] != 0:
                            _add(first, last, stage, components(midpoint))
                    elif operation == FIND_CONTACT_KICK and damped and keep:
                        _find_contact_kick(
                            first, last, velocity, former, acceleration, components(stage), decay,
                            gain,
                        )  # fmt: skip
                    elif operation == KICK:
                        work[chunk] += _kick(
                            first, last, position, velocity, components(midpoint),
                            components(former), acceleration, mobility, row, air_velocity, decay,
                            gain, strength, bounds, air, keep,
                        )  # fmt: skip
                        # From `midpoint`: in place, the loop before would not vectorise.
                        _drift(
                            first, last, position, components(back_buffer), midpoint,
                            components(velocity), h, True,
                        )  # fmt: skip
                if sweeping and operation == SWEEP_BETWEEN and chunk == 0:
                    copy_particles(2, h, position, velocity, former, sheet_contacts)
                    sweep(2, h, sheet_contacts)
                    write_back(2, h, position, velocity, sheet_contacts)
                elif sweeping and operation >= SWEEP_SIDES:
                    for side in range(chunk, 2, chunks):
                        if operation == SWEEP_SIDES:
                            copy_particles(side, h, position, velocity, former, sheet_contacts)
                            sweep(side, h, sheet_contacts)
                        elif operation == END_SWEEPS:
                            write_back(side, h, position, velocity, sheet_contacts)
                if gripping:
                    if operation <= KICK:
                        hold(first, last, drifts, back_buffer, velocity, grips)
                    elif operation == KICK_TO_MIDPOINT:
                        hold_midpoint(first, last, velocity, midpoint, grips)
                if contact:
                    before, after = position, back_buffer
                    if operation == RESOLVE:
                        before, after = back_buffer, position
                    if operation <= KICK or operation == RESOLVE:
                        gravity = (springs[0], springs[1], springs[2])
                        resolve(
                            begin, first, last, chunk, drifts, h, before, after, velocity, former,
                            gravity, contacts,
                        )  # fmt: skip
                mark_done(counters)
                chunk = claim_chunk(counters, thread, threads, chunks, n)
            barrier(counters, chunks, n)
            if operation <= KICK:
                position, back_buffer = back_buffer, position
                drifts += 1

    return make
