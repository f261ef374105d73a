"""
Contact of particles with colliders, after a drift: a vectorised loop over the particles.

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
"""

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..kernels.jit import Kernel, inlined
from .shapes import mesh_distance
from .shapes.by_kind import IN_LOOPS, by_kind
from .shapes.shape import COMMON, CONSTANTS

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

# Particles that are passed over together where they are out of reach.
BLOCK = 64

# Sums over the particles of a chunk: impulse, kg m/s, and its moment about the reference point,
# kg m²/s, for cells of 1 kg; the most work of the collider, J for these; particles touched, in all
# drifts, and in the last one.
IMPULSE, MOMENT, WORK, TOUCHED, TOUCHING = 0, 3, 6, 7, 8
SUMS = 9


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


@inlined
def _respond(  # type: ignore[no-untyped-def]
    i, gap, nx, ny, nz, x, y, z, position, back_buffer, velocity, former, mass, spin, surface,
    limits, times, several, moving,
):  # fmt: skip
    """
    Change velocity and position of a particle that a drift has brought into a collider.

    One part for all shapes: it takes longest to compile.

    Parameters
    ----------
    gap, nx, ny, nz
        Distance from the surface, m, and its normal.
    x, y, z
        The particle after the drift, m, from the reference point.
    spin, surface
        As `load_row` returns them.
    limits
        Inset, growth, friction, slop, allowance and limit of the row.
    times
        Length of the drift, s, its reciprocal, and the share of a depth that is corrected in it.
    several, moving
        True if there is more than one collider, and if this one moves.

    Returns
    -------
    float, float, float, float, float, float
        Impulse, kg m/s, for cells of 1 kg; mass by which height it is raised, kg m; work of the
        collider, J; and 1 if it is touched, else 0.

    """
    number = velocity.dtype.type
    zero, one, tiny, back = number(0), number(1), number(1e-20), number(-TURNED)
    s0, s1, s2, s3, s4, s5, s6, s7, s8 = spin
    ux, uy, uz = surface
    inset, growth, friction, slop, allowance, hard = limits
    h, per_h, share = times
    depth = slop - inset - gap
    # Velocity of the surface, and relative to it.
    p = q = r = zero
    vx, vy, vz = velocity[0, i], velocity[1, i], velocity[2, i]
    p_was, q_was, r_was = former[0, i], former[1, i], former[2, i]
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
    # Of what touches: the numbers of a ghost may be too large for single precision.
    u = u - along * nx if touch else zero
    v = v - along * ny if touch else zero
    w = w - along * nz if touch else zero
    if moving:
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
    velocity[0, i], velocity[1, i], velocity[2, i] = u, v, w
    ex, ey, ez = left * nx, left * ny, left * nz
    if several:
        # What another collider has moved the particle by in this drift is kept.
        ax = back_buffer[0, i] - (position[0, i] + h * vx)
        ay = back_buffer[1, i] - (position[1, i] + h * vy)
        az = back_buffer[2, i] - (position[2, i] + h * vz)
        moved = ax * ax + ay * ay + az * az > slop * slop
        ex = ex + (ax if moved else zero)
        ey = ey + (ay if moved else zero)
        ez = ez + (az if moved else zero)
    # From the position before the drift: a particle at rest stays there to the bit.
    at_x = position[0, i] + h * u + ex
    at_y = position[1, i] + h * v + ey
    at_z = position[2, i] + h * w + ez
    back_buffer[0, i] = at_x if touch else back_buffer[0, i]
    back_buffer[1, i] = at_y if touch else back_buffer[1, i]
    back_buffer[2, i] = at_z if touch else back_buffer[2, i]
    tx, ty, tz = mass[i] * tx, mass[i] * ty, mass[i] * tz
    work = max(p * tx + q * ty + r * tz, zero) if moving else zero
    return tx, ty, tz, mass[i] * left, work, one if touch else zero


def _particle_loop(distance: Kernel, several: bool) -> Kernel:
    """
    Return the loop for a shape, without what one collider alone does not need.

    `distance` is one of `shapes.by_kind.IN_LOOPS`.
    """

    @inlined
    def loop(  # type: ignore[no-untyped-def]
        first, last, fields, position, back_buffer, velocity, former, mass, rho, rows, drift, n,
        gravity, h, sums, chunk, moving,
    ):  # fmt: skip
        number = velocity.dtype.type
        zero, one = number(0), number(1)
        rotation, point, spin, surface, limits, constants = load_row(rows, drift, n)
        px, py, pz = point
        times = (h, one / h, number(1.0 - np.exp(-np.float64(h) / _CORRECTED)))
        jx = jy = jz = lx = ly = lz = work = raised = touched = zero
        for i in range(first, last):
            x, y, z = back_buffer[0, i] - px, back_buffer[1, i] - py, back_buffer[2, i] - pz
            gap, nx, ny, nz = distance(x, y, z, rotation, constants, rho[i], fields, i - first)
            tx, ty, tz, up, done, touch = _respond(
                i, gap, nx, ny, nz, x, y, z, position, back_buffer, velocity, former, mass, spin,
                surface, limits, times, several, moving,
            )  # fmt: skip
            jx, jy, jz = jx + tx, jy + ty, jz + tz
            lx += y * tz - z * ty
            ly += z * tx - x * tz
            lz += x * ty - y * tx
            raised += up
            work += done
            touched += touch
        gx, gy, gz = gravity
        weight = np.sqrt(gx * gx + gy * gy + gz * gz)  # at most, whatever the normal
        sums[n, chunk, 0] += jx
        sums[n, chunk, 1] += jy
        sums[n, chunk, 2] += jz
        sums[n, chunk, 3] += lx
        sums[n, chunk, 4] += ly
        sums[n, chunk, 5] += lz
        sums[n, chunk, 6] += work + weight * raised
        sums[n, chunk, 7] += touched
        sums[n, chunk, 8] += touched

    return loop


def _contact(kind: int, several: bool) -> Kernel:
    """Return the contact of a range of particles with a shape."""
    loop = _particle_loop(IN_LOOPS[kind], several)
    return _tiled(loop) if kind == mesh_distance.KIND else loop


def _tiled(loop: Kernel) -> Kernel:
    """Return a loop for meshes."""
    tiles = mesh_distance.in_tiles(loop)

    @inlined
    def in_tiles(  # type: ignore[no-untyped-def]
        first, last, fields, position, back_buffer, velocity, former, mass, rho, rows, drift, n,
        gravity, h, sums, chunk, moving,
    ):  # fmt: skip
        rotation, point, _, _, _, constants = load_row(rows, drift, n)
        arguments = (
            position, back_buffer, velocity, former, mass, rho, rows, drift, n, gravity, h, sums,
            chunk, moving,
        )  # fmt: skip
        tiles(first, last, back_buffer, point, rotation, constants, fields, arguments)

    return in_tiles


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
    contact = by_kind(kinds, lambda kind: _contact(kind, several))

    @inlined
    def resolve(  # type: ignore[no-untyped-def]
        begin, first, last, chunk, drift, h, before, after, velocity, former, gravity, contacts
    ):
        types, rows, active, rho, mass, values, shares, starts, sums = contacts
        for n in range(len(types)):
            sums[n, chunk, TOUCHING] = 0
        chunk_end = last
        low, high = (first - begin) // BLOCK, (last - begin + BLOCK - 1) // BLOCK
        sweeps = 1
        if several:
            for block in range(low, high):
                count = 0
                for n in range(len(types)):
                    count += active[n, block]
                sweeps = _SWEEPS if count > 1 else sweeps
        for again in range(sweeps * len(types)):
            n = again % len(types)
            number = min(drift, len(rows) - 1)
            moves = rows[number, n, GROWTH] != 0.0
            for k in range(SPIN, INSET):
                moves = moves or rows[number, n, k] != 0.0
            fields = (values, shares, np.uint64(starts[n]))
            block = low
            while block < high:
                if not active[n, block]:
                    block += 1
                    continue
                # Blocks in a row together: to enter the loop takes longer than a block.
                first = np.uint64(begin + block * BLOCK)
                while block < high and active[n, block]:
                    block += 1
                last = min(np.uint64(begin + block * BLOCK), chunk_end)
                # One of these becomes a loop without what a collider at rest does not need; plain
                # constants would be compiled each for itself.
                if moves:
                    contact(
                        types[n], first, last, fields, before, after, velocity, former, mass,
                        rho, rows, number, n, gravity, h, sums, chunk, np.bool_(True),
                    )  # fmt: skip
                else:
                    contact(
                        types[n], first, last, fields, before, after, velocity, former, mass,
                        rho, rows, number, n, gravity, h, sums, chunk, np.bool_(False),
                    )  # fmt: skip

    return resolve
