"""
Compiled part of the kernel of kicks and drifts: particles that grippers hold.

A held particle is kicked as every other one.  Then it gets the velocity with which a drift takes
it to where the gripper has it after the drift, and that position.  The impulse of the gripper is
its mass times the change Δv of the velocity; so momentum is balanced to rounding.  The work is
Δv·(w + v)/2 times the mass, w being the velocity before the kick and v that after the change: with
the work of the springs, which the kick has done at the same mean velocity, that is the change of
the kinetic energy.

Arithmetic is in double precision: a particle that is held at rest stays there to the bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid import Array
from ..kernels.jit import inlined

# Sums over the drifts of a particle, for cells of 1 kg: impulse of the gripper, kg m/s, and its
# moment about the origin of the gripper, kg m²/s; work, J; and impulse of the sheet and of
# gravity, kg m/s.
IMPULSE, MOMENT, WORK, PULL = 0, 3, 6, 7
SUMS = 10


class GripTable(NamedTuple):
    """
    Held particles, as the kernel of kicks and drifts takes them.

    Attributes
    ----------
    particles
        Flat indices of the particles, ascending: int64, shape (n,).
    owner
        Number of the gripper of each: int64, shape (n,).
    local
        Position in the frame of the gripper, m, shape (n, 3).
    mass
        In units of that of a cell, shape (n,).
    rows
        Motion of the grippers in each drift, or once if none moves: shape (drifts or 1, grippers,
        `kinematic_path.MOTION`).
    former
        Velocities before the next kick, m/s, shape (n, 3); changed.
    sums
        Added to: shape (n, SUMS).
    reactions
        What dashpots would have changed of the velocity if it were not kept, until the stage
        before and until the one before that, m/s, shape (n, 2, 3); changed.

    All numbers are in double precision.

    """

    particles: Array
    owner: Array
    local: Array
    mass: Array
    rows: Array
    former: Array
    sums: Array
    reactions: Array


@inlined
def _first_from(index, i):  # type: ignore[no-untyped-def]
    """Return the place of the first of ascending numbers that is not below i."""
    low, high = 0, len(index)
    while low < high:
        middle = (low + high) // 2
        if index[middle] < i:
            low = middle + 1
        else:
            high = middle
    return low


@inlined
def hold(first, last, drift, position, velocity, grips):  # type: ignore[no-untyped-def]
    """
    Move the held particles of a chunk with their grippers.

    Parameters
    ----------
    first, last
        Flat indices of the first particle of the chunk, and after the last one.
    drift
        Number of the drift that was made.
    position, velocity
        After it, m and m/s; changed.
    grips
        A `GripTable`.

    """
    index, owner, local, mass, rows, former, sums, _ = grips
    number = velocity.dtype.type
    row = min(drift, len(rows) - 1)
    end = np.int64(last)
    n = _first_from(index, np.int64(first))
    while n < len(index) and index[n] < end:
        i, g = index[n], owner[n]
        x, y, z = local[n, 0], local[n, 1], local[n, 2]
        p = rows[row, g, 0] * x + rows[row, g, 1] * y + rows[row, g, 2] * z
        q = rows[row, g, 3] * x + rows[row, g, 4] * y + rows[row, g, 5] * z
        r = rows[row, g, 6] * x + rows[row, g, 7] * y + rows[row, g, 8] * z
        position[0, i] = number(p + rows[row, g, 9])
        position[1, i] = number(q + rows[row, g, 10])
        position[2, i] = number(r + rows[row, g, 11])
        kicked_x = np.float64(velocity[0, i])
        kicked_y = np.float64(velocity[1, i])
        kicked_z = np.float64(velocity[2, i])
        velocity[0, i] = number(
            rows[row, g, 12] * p + rows[row, g, 13] * q + rows[row, g, 14] * r + rows[row, g, 21]
        )
        velocity[1, i] = number(
            rows[row, g, 15] * p + rows[row, g, 16] * q + rows[row, g, 17] * r + rows[row, g, 22]
        )
        velocity[2, i] = number(
            rows[row, g, 18] * p + rows[row, g, 19] * q + rows[row, g, 20] * r + rows[row, g, 23]
        )
        m = mass[n]
        u, v, w = (
            np.float64(velocity[0, i]),
            np.float64(velocity[1, i]),
            np.float64(velocity[2, i]),
        )
        jx, jy, jz = m * (u - kicked_x), m * (v - kicked_y), m * (w - kicked_z)
        a, b, c = former[n, 0], former[n, 1], former[n, 2]
        sums[n, 0] += jx
        sums[n, 1] += jy
        sums[n, 2] += jz
        sums[n, 3] += q * jz - r * jy
        sums[n, 4] += r * jx - p * jz
        sums[n, 5] += p * jy - q * jx
        sums[n, 6] += 0.5 * (jx * (u + a) + jy * (v + b) + jz * (w + c))
        sums[n, 7] += m * (kicked_x - a)
        sums[n, 8] += m * (kicked_y - b)
        sums[n, 9] += m * (kicked_z - c)
        former[n, 0], former[n, 1], former[n, 2] = u, v, w
        n += 1


@inlined
def hold_midpoint(first, last, velocity, midpoint, grips):  # type: ignore[no-untyped-def]
    """Give the held particles of a chunk their velocities in the middle of a kick as well."""
    index = grips[0]
    end = np.int64(last)
    n = _first_from(index, np.int64(first))
    while n < len(index) and index[n] < end:
        i = index[n]
        for axis in range(3):
            midpoint[axis, i] = velocity[axis, i]
        n += 1


@inlined
def hold_in_stage(  # type: ignore[no-untyped-def]
    first, last, stage, before, two_before, share, midpoint, out, acceleration, grips
):
    """
    Give the held particles of a chunk their velocities in a stage of the dashpots as well.

    What dashpots have changed there is kept, as it acts on the gripper, and is in the result.

    Parameters
    ----------
    first, last
        As of `hold`.
    stage, before, two_before, share
        Its number, and factors; see `kick_drift_kernel`.
    midpoint, out
        Velocities before the first stage, and after this one, m/s; `out` is changed.
    acceleration
        Where the last stage, whose `share` is not 0, adds the result; changed.
    grips
        A `GripTable`.

    """
    index, reactions = grips[0], grips[7]
    number = midpoint.dtype.type
    end = np.int64(last)
    n = _first_from(index, np.int64(first))
    while n < len(index) and index[n] < end:
        i = index[n]
        for axis in range(3):
            if stage == 1:
                reactions[n, 0, axis] = reactions[n, 1, axis] = 0.0
            change = before * reactions[n, 0, axis] + two_before * reactions[n, 1, axis]
            if share != 0:
                acceleration[axis, i] += number(share * change)
            else:
                change += np.float64(out[axis, i]) - np.float64(midpoint[axis, i])
                out[axis, i] = midpoint[axis, i]
                reactions[n, 1, axis] = reactions[n, 0, axis]
                reactions[n, 0, axis] = change
        n += 1
