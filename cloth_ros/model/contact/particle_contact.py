"""
Contact of particles with colliders, after a drift: vectorised over blocks of particles.

A particle that a drift of h s has brought into a collider, by the depth d along the normal n, gets
the velocity that ends at the surface, but none away from it: with its velocity u relative to the
surface, the push along n is at most d/h and −u·n.  What depth then remains, by a surface that
moves out under it, is corrected in the position alone.  Coulomb friction takes up to μ times the
push from the sliding velocity, and no more than all of it.

What a kick and a drift conserve is v²/2 + x_n·K x_(n+1)/2, for springs K of unit masses.  A change
of velocity Δv between them adds Δv·(w + v + Δv)/2 to it, with w the velocity before the kick.  For
a push that is negative as long as w·n + (v + Δv)·n ≤ 0.  In exact arithmetic that holds for a
particle that was not inside before, as it has then moved by h w·n away from the surface; in
rounded arithmetic it is a condition on the push.  Without it, rounding shakes a sheet at rest.

So contact adds no energy in the frame of the collider, a particle at rest stays at rest to the
bit, and no order of particles or triangles has any influence.

Between the particles, the offset of a shape keeps triangles out; see `shapes.shape`.

A sheet touches a body with few of its particles.  Of blocks that may come into reach in a batch,
those that have touched nothing in the last drift are only looked at, which takes a fraction of the
time.
"""

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..kernels.jit import Kernel, components, disjoint, inlined
from .shapes.by_kind import DISTANCES, by_kind
from .shapes.shape import COMMON, CONSTANTS, ONE, ZERO

# A sliding velocity that the kick has reversed is not stopped if what it was exceeds this share of
# what it is.
TURNED = 1e-3
# Time, s, in which a depth is corrected in the position alone.
_CORRECTED = 5e-3
# Numbers in a row about a collider in one drift: rotation, row by row, from its frame to that of
# the state; the reference point after the drift, m; the matrix S, 1/s, and the velocity, m/s, of a
# material point, S y + velocity at y from the reference point; the inset, m, and
# the speed of the surface by which it decreases, m/s; friction; the gap up to which a particle
# touches, the depth that is left to later pushes, and how much more is corrected at once, m; and
# the constants of the shape, with those of all shapes.
ROTATION, POINT, SPIN, VELOCITY = 0, 9, 12, 21
INSET, GROWTH, FRICTION, SLOP, ALLOWANCE, LIMIT, SHAPE = 24, 25, 26, 27, 28, 29, 30
ROW = SHAPE + CONSTANTS + len(COMMON)

# Particles in a block, which is passed over where it is out of reach: one vector of the widest
# processors in single precision.
BLOCK = 16
# Whether a block may come into reach of a collider in a batch, and whether it has touched that in
# the last drift; else 0.
IN_REACH, IN_TOUCH = 1, 2

# Sums over the particles of a chunk: impulse, kg m/s, and its moment about the reference point,
# kg m²/s, for cells of 1 kg; the most work of the collider, J for these; particles touched, in all
# drifts, and in the last one.
IMPULSE, MOMENT, WORK, TOUCHED, TOUCHING = 0, 3, 6, 7, 8
SUMS = 9
# Numbers of a chunk for the kernel alone: sums over the particles at each place in a block; and
# where those of each sum begin.
TOTALS = 8 * BLOCK
_PUSH_X, _PUSH_Y, _PUSH_Z, _MOMENT_X, _MOMENT_Y, _MOMENT_Z, _RAISED, _WORK = range(
    0, TOTALS, BLOCK
)


@inlined
def load_row(rows, drift, n):  # type: ignore[no-untyped-def]
    """
    Return a row as tuples: rotation, point, S, velocity, from inset to limit, and the shape.

    Once for all loops: each of many elements takes its time to compile.
    """
    rotation = (
        rows[drift, n, 0], rows[drift, n, 1], rows[drift, n, 2],
        rows[drift, n, 3], rows[drift, n, 4], rows[drift, n, 5],
        rows[drift, n, 6], rows[drift, n, 7], rows[drift, n, 8],
    )  # fmt: skip
    point = (rows[drift, n, 9], rows[drift, n, 10], rows[drift, n, 11])
    spin = (
        rows[drift, n, 12], rows[drift, n, 13], rows[drift, n, 14],
        rows[drift, n, 15], rows[drift, n, 16], rows[drift, n, 17],
        rows[drift, n, 18], rows[drift, n, 19], rows[drift, n, 20],
    )  # fmt: skip
    velocity = (rows[drift, n, 21], rows[drift, n, 22], rows[drift, n, 23])
    others = (
        rows[drift, n, 24], rows[drift, n, 25], rows[drift, n, 26],
        rows[drift, n, 27], rows[drift, n, 28], rows[drift, n, 29],
    )  # fmt: skip
    constants = (
        rows[drift, n, 30], rows[drift, n, 31], rows[drift, n, 32], rows[drift, n, 33],
        rows[drift, n, 34], rows[drift, n, 35], rows[drift, n, 36], rows[drift, n, 37],
        rows[drift, n, 38], rows[drift, n, 39], rows[drift, n, 40], rows[drift, n, 41],
        rows[drift, n, 42], rows[drift, n, 43], rows[drift, n, 44], rows[drift, n, 45],
        rows[drift, n, 46], rows[drift, n, 47], rows[drift, n, 48],
    )  # fmt: skip
    return rotation, point, spin, velocity, others, constants


def _nearness(kind: int) -> Kernel:
    """Return the part that tells whether a particle of a block touches a shape."""
    distance = DISTANCES[kind]

    @disjoint
    def is_near(first, position, rho, fields, point, rotation, limits, constants):  # type: ignore[no-untyped-def]
        (xs, ys, zs), (px, py, pz) = position, point
        zero, one = constants[ZERO], constants[ONE]
        reach = limits[3] - limits[0]
        # A sum vectorises; a condition that is true once does not.
        near = zero
        for lane in range(np.uint64(BLOCK)):
            i = first + lane
            x, y, z = xs[i] - px, ys[i] - py, zs[i] - pz
            gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields)
            near += one if gap < reach else zero
        return near > zero

    return is_near


def _response(kind: int, *, several: bool, moving: bool) -> Kernel:
    """
    Return the part that changes the velocities and positions of a block in contact.

    Parameters
    ----------
    kind
        Of the shape.
    several, moving
        True if there is more than one collider, and if this one moves.

    """
    distance = DISTANCES[kind]

    @disjoint
    def respond(  # type: ignore[no-untyped-def]
        first, position, back_buffer, velocity, former, rho, mass, fields, point, rotation, spin,
        surface, limits, constants, times, totals,
    ):  # fmt: skip
        """
        Take the block from the flat index `first` on; return how many touch.

        Parameters
        ----------
        position, back_buffer, velocity, former
            Of all particles, as arrays of x, y and z: before the drift, after it, after the kick
            and before it.
        rho, mass, fields
            See `ContactTable`.
        point, rotation, spin, surface, limits, constants
            As `load_row` returns them; `limits` are from inset to limit.
        times
            Length of the drift, s, its reciprocal, and the share of a depth that is corrected in
            it.
        totals
            Sums of a chunk, added to, shape (TOTALS,).

        """
        number = mass.dtype.type
        zero, one, tiny, back = number(0), number(1), number(1e-20), number(-TURNED)
        (xs, ys, zs), (x_after, y_after, z_after) = position, back_buffer
        (us, vs, ws), (us_was, vs_was, ws_was) = velocity, former
        px, py, pz = point
        s0, s1, s2, s3, s4, s5, s6, s7, s8 = spin
        ux, uy, uz = surface
        inset, growth, friction, slop, allowance, hard = limits
        h, per_h, share = times
        touched = zero
        for lane in range(np.uint64(BLOCK)):
            i = first + lane
            x, y, z = x_after[i] - px, y_after[i] - py, z_after[i] - pz
            gap, nx, ny, nz = distance(x, y, z, rotation, constants, rho[i], fields)
            depth = slop - inset - gap
            # Velocity of the surface, and relative to it.
            p = q = r = zero
            vx, vy, vz = us[i], vs[i], ws[i]
            p_was, q_was, r_was = us_was[i], vs_was[i], ws_was[i]
            u, v, w = vx, vy, vz
            if moving:
                p = ux + s0 * x + s1 * y + s2 * z
                q = uy + s3 * x + s4 * y + s5 * z
                r = uz + s6 * x + s7 * y + s8 * z
                p_was, q_was, r_was = p_was - p, q_was - q, r_was - r
                u, v, w = vx - p, vy - q, vz - r
            along = u * nx + v * ny + w * nz
            was = p_was * nx + q_was * ny + r_was * nz
            turned = u * p_was + v * q_was + w * r_was - along * was
            touch = depth > zero and mass[i] > zero
            u, v, w = u - along * nx, v - along * ny, w - along * nz
            if moving:
                # Of what touches: the numbers of a ghost may be too large for single precision.
                u, v, w = u if touch else zero, v if touch else zero, w if touch else zero
                along, was = along - growth, was - growth
            # Before the kick; a push, and friction, must not add energy to what it was.
            push = min(depth * per_h, max(-along - max(was, zero), zero))
            push = push if touch else zero
            # Less than what is allowed is left to later pushes, and more is corrected bit by bit:
            # a jump of the position would shake the springs.
            left = max(depth - (slop + allowance) - push * h, zero)
            left = max(share * left, left - hard)
            left = left if touch else zero
            squared = u * u + v * v + w * w
            # At most the whole sliding velocity; the reciprocal root is fast.
            root = one / np.sqrt(max(squared, tiny))
            grip = min(friction * push * root, one)
            grip = grip if turned >= back * squared else zero
            # 0 where nothing touches; so are the changes of velocity below.
            tx, ty, tz = push * nx - grip * u, push * ny - grip * v, push * nz - grip * w
            u, v, w = vx + tx, vy + ty, vz + tz
            us[i], vs[i], ws[i] = u, v, w
            ex, ey, ez = left * nx, left * ny, left * nz
            if several:
                # What another collider has moved the particle by in this drift is kept.
                ax = x_after[i] - (xs[i] + h * vx)
                ay = y_after[i] - (ys[i] + h * vy)
                az = z_after[i] - (zs[i] + h * vz)
                moved = ax * ax + ay * ay + az * az > slop * slop
                ex = ex + (ax if moved else zero)
                ey = ey + (ay if moved else zero)
                ez = ez + (az if moved else zero)
            # From the position before the drift: a particle at rest stays there to the bit.
            at_x, at_y, at_z = xs[i] + h * u + ex, ys[i] + h * v + ey, zs[i] + h * w + ez
            x_after[i] = at_x if touch else x_after[i]
            y_after[i] = at_y if touch else y_after[i]
            z_after[i] = at_z if touch else z_after[i]
            tx, ty, tz = mass[i] * tx, mass[i] * ty, mass[i] * tz
            totals[_PUSH_X + lane] += tx
            totals[_PUSH_Y + lane] += ty
            totals[_PUSH_Z + lane] += tz
            totals[_MOMENT_X + lane] += y * tz - z * ty
            totals[_MOMENT_Y + lane] += z * tx - x * tz
            totals[_MOMENT_Z + lane] += x * ty - y * tx
            totals[_RAISED + lane] += mass[i] * left
            touched += one if touch else zero
            if moving:
                totals[_WORK + lane] += max(p * tx + q * ty + r * tz, zero)
        return touched

    return respond


@inlined
def _add_totals(totals, gravity, sums):  # type: ignore[no-untyped-def]
    """Add the sums of a chunk, which are those at each place in a block, to those of a batch."""
    gx, gy, gz = gravity
    weight = np.sqrt(gx * gx + gy * gy + gz * gz)  # at most, whatever the normal
    for lane in range(BLOCK):
        for k in range(6):
            sums[k] += totals[k * BLOCK + lane]
        sums[WORK] += totals[_WORK + lane] + weight * totals[_RAISED + lane]


# Sweeps over the colliders where several may touch the same particles.
_SWEEPS = 2


@functools.cache
def compose(kinds: Set[int], several: bool) -> Kernel:
    """
    Return the contact of a chunk of particles with colliders.

    Parameters
    ----------
    kinds
        Those of their shapes.
    several
        True if there is more than one.

    Returns
    -------
    Kernel
        It takes

        begin, first, last, chunk
            Flat index of the first particle of the sheet, and of the first and after the last one
            of the chunk, and its number; a chunk has a whole number of blocks of `BLOCK`;
        drift, h
            Number of the drift that these have made, and its length, s;
        before, after
            Their positions before and after it, m; the latter are corrected;
        velocity, former
            After the kick, m/s, which is corrected, and before it;
        gravity
            m/s²;
        contacts
            A `ContactTable`.

    """
    is_near = by_kind(kinds, _nearness)
    respond, respond_to_moving = [
        by_kind(kinds, functools.partial(_response, several=several, moving=moving))
        for moving in (False, True)
    ]

    @inlined
    def resolve(  # type: ignore[no-untyped-def]
        begin, first, last, chunk, drift, h, before, after, velocity, former, gravity, contacts
    ):
        types, rows, active, rho, mass, values, shares, starts, totals, sums = contacts
        number = velocity.dtype.type
        for n in range(len(types)):
            sums[n, chunk, TOUCHING] = 0
        low, high = (first - begin) // BLOCK, (last - begin + BLOCK - 1) // BLOCK
        sweeps = 1
        if several:
            for block in range(low, high):
                count = 0
                for n in range(len(types)):
                    count += active[n, block] != 0
                sweeps = _SWEEPS if count > 1 else sweeps
        before, after = components(before), components(after)
        velocity, former = components(velocity), components(former)
        totals = totals[chunk]
        times = (h, number(1) / h, number(1.0 - np.exp(-np.float64(h) / _CORRECTED)))
        for again in range(sweeps * len(types)):
            n = again % len(types)
            row = min(drift, len(rows) - 1)
            moves = rows[row, n, GROWTH] != 0.0
            for k in range(SPIN, INSET):
                moves = moves or rows[row, n, k] != 0.0
            rotation, point, spin, surface, limits, constants = load_row(rows, row, n)
            fields = (values, shares, np.uint64(starts[n]))
            totals[:] = 0
            for block in range(low, high):
                if active[n, block] == 0:
                    continue
                first = np.uint64(begin + block * BLOCK)
                if active[n, block] == IN_REACH and not is_near(
                    types[n], first, after, rho, fields, point, rotation, limits, constants
                ):
                    continue
                if moves:
                    touched = respond_to_moving(
                        types[n], first, before, after, velocity, former, rho, mass, fields,
                        point, rotation, spin, surface, limits, constants, times, totals,
                    )  # fmt: skip
                else:
                    touched = respond(
                        types[n], first, before, after, velocity, former, rho, mass, fields,
                        point, rotation, spin, surface, limits, constants, times, totals,
                    )  # fmt: skip
                active[n, block] = IN_TOUCH if touched > 0 else IN_REACH
                sums[n, chunk, TOUCHED] += touched
                sums[n, chunk, TOUCHING] += touched
            _add_totals(totals, gravity, sums[n, chunk])

    return resolve
