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

# A branch on a constant must be nested: joined to another condition it would be compiled.
# ruff: noqa: SIM102

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..grid import GHOST
from ..kernels.jit import Kernel, inlined, inlined_variant, kernel
from .shapes import box, capsule, cylinder, mesh_distance, plane, sphere
from .shapes.shape import COMMON, CONSTANTS, Distance

# A sliding velocity that the kick has reversed is not stopped if what it was exceeds this share of
# what it is.
_TURNED = 1e-3
# Share of a depth that one drift corrects in the position alone.
_SHARE = 0.05
# Numbers in a row about a collider in one drift: rotation, row by row, from its frame to that of
# the state; the reference point after the drift, m; the matrix S, 1/s, and the velocity, m/s, of a
# material point, S y + velocity at y from the reference point; the inset, m; friction; the depth
# below 0 that counts as contact, m; and the constants of the shape, with those of all shapes.
ROTATION, POINT, SPIN, VELOCITY = 0, 9, 12, 21
INSET, GROWTH, FRICTION, SLOP, ALLOWANCE, SHAPE = 24, 25, 26, 27, 28, 29
ROW = SHAPE + CONSTANTS + len(COMMON)
_ALL = CONSTANTS + len(COMMON)

# Particles that are passed over together where they are out of reach.
BLOCK = 64

# Sums over the particles of a chunk: impulse, kg m/s, and its moment about the reference point,
# kg m²/s, for cells of 1 kg; the most work of the collider, J for these; particles touched, in all
# drifts, and in the last one.
IMPULSE, MOMENT, WORK, TOUCHED, TOUCHING = 0, 3, 6, 7, 8
SUMS = 9


@inlined
def _constants_of(row, number):  # type: ignore[no-untyped-def]
    """Return the rotation, and the constants of the shape, of a row as tuples."""
    rotation = (
        number(row[0]), number(row[1]), number(row[2]), number(row[3]), number(row[4]),
        number(row[5]), number(row[6]), number(row[7]), number(row[8]),
    )  # fmt: skip
    constants = (
        number(row[29]), number(row[30]), number(row[31]), number(row[32]), number(row[33]),
        number(row[34]), number(row[35]), number(row[36]), number(row[37]), number(row[38]),
        number(row[39]), number(row[40]), number(row[41]), number(row[42]), number(row[43]),
        number(row[44]),
    )  # fmt: skip
    return rotation, constants


def _search_loop(distance: Distance) -> Kernel:
    @inlined_variant
    def loop(first, last, position, velocity, rho, row, fields, seconds):  # type: ignore[no-untyped-def]
        """Return the least gap, m, that is left after so many s if all move towards the shape."""
        number = velocity.dtype.type
        rotation, constants = _constants_of(row, number)
        px, py, pz = number(row[9]), number(row[10]), number(row[11])
        inset, h, far = number(row[24]), number(seconds), number(GHOST)
        nearest = far
        for i in range(first, last):
            x, y, z = position[0, i] - px, position[1, i] - py, position[2, i] - pz
            gap, _, _, _ = distance(x, y, z, rotation, constants, rho[i], fields)
            u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
            gap += inset - h * np.sqrt(u * u + v * v + w * w)
            # False for a ghost, which is so far away that its distance may not be finite.
            nearest = gap if gap < nearest else nearest
        return nearest

    return loop


def _particle_loop(distance: Distance) -> Kernel:
    @inlined_variant
    def loop(  # type: ignore[no-untyped-def]
        first, last, position, back_buffer, velocity, former, mobility, rho, row, fields, gravity,
        h, sums,
    ):  # fmt: skip
        number = velocity.dtype.type
        zero, one, tiny, back = number(0), number(1), number(1e-20), number(-_TURNED)
        rotation, constants = _constants_of(row, number)
        px, py, pz = number(row[9]), number(row[10]), number(row[11])
        s0, s1, s2 = number(row[12]), number(row[13]), number(row[14])
        s3, s4, s5 = number(row[15]), number(row[16]), number(row[17])
        s6, s7, s8 = number(row[18]), number(row[19]), number(row[20])
        ux, uy, uz = number(row[21]), number(row[22]), number(row[23])
        inset, growth, friction = number(row[24]), number(row[25]), number(row[26])
        slop, allowed, share = number(row[27]), number(row[27] + row[28]), number(_SHARE)
        per_h = one / h
        gx, gy, gz = gravity
        jx = jy = jz = lx = ly = lz = work = touched = zero
        for i in range(first, last):
            x, y, z = back_buffer[0, i] - px, back_buffer[1, i] - py, back_buffer[2, i] - pz
            gap, nx, ny, nz = distance(x, y, z, rotation, constants, rho[i], fields)
            inverse_mass = mobility[0, i] * mobility[1, i]
            depth = slop - inset - gap
            # Velocity of the surface, and relative to it.
            p = ux + s0 * x + s1 * y + s2 * z
            q = uy + s3 * x + s4 * y + s5 * z
            r = uz + s6 * x + s7 * y + s8 * z
            vx, vy, vz = velocity[0, i], velocity[1, i], velocity[2, i]
            u, v, w = vx - p, vy - q, vz - r
            along = u * nx + v * ny + w * nz - growth
            touch = depth > zero and inverse_mass > zero
            # Before the kick; a push, and friction, must not add energy to what it was.
            p_was, q_was, r_was = former[0, i] - p, former[1, i] - q, former[2, i] - r
            was = p_was * nx + q_was * ny + r_was * nz - growth
            push = min(depth * per_h, max(-along - max(was, zero), zero))
            push = push if touch else zero
            # Less than what is allowed is left to later pushes, and more is corrected bit by bit:
            # a jump of the position would shake the springs.
            left = share * max(depth - allowed - push * h, zero)
            left = left if touch else zero
            turned = u * p_was + v * q_was + w * r_was - (along + growth) * (was + growth)
            along += growth
            u, v, w = u - along * nx, v - along * ny, w - along * nz
            squared = u * u + v * v + w * w
            # At most the whole sliding velocity; the reciprocal root is fast.
            root = one / np.sqrt(max(squared, tiny))
            grip = min(friction * push * root, one)
            grip = grip if turned >= back * squared else zero
            # 0 where nothing touches; so are the changes of velocity below.
            tx, ty, tz = push * nx - grip * u, push * ny - grip * v, push * nz - grip * w
            u, v, w = vx + tx, vy + ty, vz + tz
            velocity[0, i], velocity[1, i], velocity[2, i] = u, v, w
            # From the position before the drift: a particle at rest stays there to the bit.
            at_x = position[0, i] + h * u + left * nx
            at_y = position[1, i] + h * v + left * ny
            at_z = position[2, i] + h * w + left * nz
            back_buffer[0, i] = at_x if touch else back_buffer[0, i]
            back_buffer[1, i] = at_y if touch else back_buffer[1, i]
            back_buffer[2, i] = at_z if touch else back_buffer[2, i]
            mass = one / max(inverse_mass, one)
            tx, ty, tz = mass * tx, mass * ty, mass * tz
            jx, jy, jz = jx + tx, jy + ty, jz + tz
            lx += y * tz - z * ty
            ly += z * tx - x * tz
            lz += x * ty - y * tx
            lift = max(-(gx * nx + gy * ny + gz * nz), zero)
            work += max(p * tx + q * ty + r * tz, zero) + mass * lift * left
            touched += one if touch else zero
        sums[0] += jx
        sums[1] += jy
        sums[2] += jz
        sums[3] += lx
        sums[4] += ly
        sums[5] += lz
        sums[6] += work
        sums[7] += touched
        sums[8] += touched

    return loop


_with_plane, _to_plane = _particle_loop(plane.distance), _search_loop(plane.distance)
_with_sphere, _to_sphere = _particle_loop(sphere.distance), _search_loop(sphere.distance)
_with_capsule, _to_capsule = _particle_loop(capsule.distance), _search_loop(capsule.distance)
_with_box, _to_box = _particle_loop(box.distance), _search_loop(box.distance)
_with_cylinder, _to_cylinder = _particle_loop(cylinder.distance), _search_loop(cylinder.distance)
_with_mesh, _to_mesh = _particle_loop(mesh_distance.distance), _search_loop(mesh_distance.distance)

# Sweeps over the colliders where several may touch the same particles.
_SWEEPS = 2


@functools.cache
def compose(kinds: Set[int]) -> Kernel:
    """
    Return the contact of a chunk of particles with colliders whose shapes are of these kinds.

    It takes

    begin, first, last, chunk
        Flat index of the first particle of the sheet, and of the first and after the last one of
        the chunk, and its number; a chunk has a whole number of blocks of `BLOCK`;
    drift, h
        Number of the drift that these have made, and its length, s;
    before, after
        Their positions before and after it, m; the latter are corrected;
    velocity, former
        After the kick, m/s, which is corrected, and before it;
    mobility
        As in `State`;
    gravity
        m/s²;
    contacts
        A `ContactTable`.
    """
    has_plane, has_sphere = plane.KIND in kinds, sphere.KIND in kinds
    has_capsule, has_box = capsule.KIND in kinds, box.KIND in kinds
    has_cylinder, has_mesh = cylinder.KIND in kinds, mesh_distance.KIND in kinds

    # Branches on a constant are left out before they are compiled.
    @inlined_variant
    def resolve(  # type: ignore[no-untyped-def]
        begin, first, last, chunk, drift, h, before, after, velocity, former, mobility, gravity,
        contacts,
    ):  # fmt: skip
        types, rows, active, rho, values, shares, starts, sums = contacts
        sums[:, chunk, TOUCHING] = 0
        chunk_end = last
        low, high = (first - begin) // BLOCK, (last - begin + BLOCK - 1) // BLOCK
        repeat = False
        for block in range(low, high):
            count = 0
            for n in range(len(types)):
                count += active[n, block]
            repeat = repeat or count > 1
        for again in range(_SWEEPS * len(types)):
            n = again % len(types)
            if again >= len(types) and not repeat:
                break
            kind = types[n]
            row = rows[drift if len(rows) > 1 else 0, n]
            out = sums[n, chunk]
            fields = (values[starts[n] :], shares[starts[n] :])
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
                if has_plane:
                    if kind == plane.KIND:
                        _with_plane(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip
                if has_sphere:
                    if kind == sphere.KIND:
                        _with_sphere(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip
                if has_capsule:
                    if kind == capsule.KIND:
                        _with_capsule(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip
                if has_box:
                    if kind == box.KIND:
                        _with_box(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip
                if has_cylinder:
                    if kind == cylinder.KIND:
                        _with_cylinder(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip
                if has_mesh:
                    if kind == mesh_distance.KIND:
                        _with_mesh(
                            first, last, before, after, velocity, former, mobility, rho, row,
                            fields, gravity, h, out,
                        )  # fmt: skip

    return resolve


@functools.cache
def compose_search(kinds: Set[int]) -> Kernel:
    """
    Compile the search for the blocks of particles that colliders may touch in a batch.

    Parameters of the kernel
    ------------------------
    position, velocity, begin, end
        Of the sheet, as in `Grid` and `State`.
    seconds
        Length of the batch, s.
    contacts
        A `ContactTable`, whose `active` is written.
    approaches
        By how much each collider may move in the batch, m, shape (colliders,).
    clearances
        Receives a bound of the distance that is left between the sheet and each collider, m.

    """
    has_plane, has_sphere = plane.KIND in kinds, sphere.KIND in kinds
    has_capsule, has_box = capsule.KIND in kinds, box.KIND in kinds
    has_cylinder, has_mesh = cylinder.KIND in kinds, mesh_distance.KIND in kinds

    @kernel
    def search(position, velocity, begin, end, seconds, contacts, approaches, clearances):  # type: ignore[no-untyped-def]
        types, rows, active, rho, values, shares, starts, _ = contacts
        for n in range(len(types)):
            kind = types[n]
            row = rows[0, n]
            fields = (values[starts[n] :], shares[starts[n] :])
            clearance = np.inf
            for block in range(active.shape[1]):
                first = np.uint64(begin + block * BLOCK)
                last = np.uint64(min(begin + (block + 1) * BLOCK, end))
                gap = position[0, first]
                if has_plane:
                    if kind == plane.KIND:
                        gap = _to_plane(first, last, position, velocity, rho, row, fields, seconds)
                if has_sphere:
                    if kind == sphere.KIND:
                        gap = _to_sphere(
                            first, last, position, velocity, rho, row, fields, seconds
                        )
                if has_capsule:
                    if kind == capsule.KIND:
                        gap = _to_capsule(
                            first, last, position, velocity, rho, row, fields, seconds
                        )
                if has_box:
                    if kind == box.KIND:
                        gap = _to_box(first, last, position, velocity, rho, row, fields, seconds)
                if has_cylinder:
                    if kind == cylinder.KIND:
                        gap = _to_cylinder(
                            first, last, position, velocity, rho, row, fields, seconds
                        )
                if has_mesh:
                    if kind == mesh_distance.KIND:
                        gap = _to_mesh(first, last, position, velocity, rho, row, fields, seconds)
                clearance = min(clearance, gap)
                # True for NaN.
                active[n, block] = 0 if gap > approaches[n] else 1
            clearances[n] = clearance

    return search
