"""
Contact of particles with colliders, after a drift: a vectorised loop over the particles.

A particle that a drift of h s has brought into a collider, by the depth d along the normal n, gets
the velocity that ends at the surface, but none away from it: with its velocity u relative to the
surface, the push along n is min(d/h, −u·n).  What depth then remains, by a surface that moves out
under it, is corrected in the position alone.  Coulomb friction takes up to μ times the push from
the sliding velocity, and no more than all of it.  So contact adds no energy in the frame of the
collider, a particle at rest stays at rest to the bit, and no order of particles or triangles has
any influence.

Between the particles, the offset of a shape keeps triangles out; see `shapes.shape`.
"""

from __future__ import annotations

import functools
from collections.abc import Set

import numpy as np

from ..kernels.jit import Kernel, inlined_variant
from .shapes import box, capsule, cylinder, mesh_distance, plane, sphere
from .shapes.shape import COMMON, CONSTANTS, Distance

# Numbers in a row about a collider in one drift: rotation, row by row, from its frame to that of
# the state; the reference point after the drift, m; the matrix S, 1/s, and the velocity, m/s, of a
# material point, S y + velocity at y from the reference point; the inset, m; friction; the depth
# below 0 that counts as contact, m; and the constants of the shape, with those of all shapes.
ROTATION, POINT, SPIN, VELOCITY = 0, 9, 12, 21
INSET, FRICTION, SLOP, SHAPE = 24, 25, 26, 27
ROW = SHAPE + CONSTANTS + len(COMMON)
_ALL = CONSTANTS + len(COMMON)

# Particles that are passed over together where they are out of reach.
BLOCK = 128

# Sums over the particles of a block: impulse, kg m/s, and its moment about the reference point,
# kg m²/s, for cells of 1 kg; the most work of the collider, J for these; particles touched, in all
# drifts, and in the last one.
IMPULSE, MOMENT, WORK, TOUCHED, TOUCHING = 0, 3, 6, 7, 8
SUMS = 9


def _particle_loop(distance: Distance) -> Kernel:
    @inlined_variant
    def loop(  # type: ignore[no-untyped-def]
        first, last, position, back_buffer, velocity, mobility, rho, row, fields, gravity, h, sums
    ):
        number = velocity.dtype.type
        zero, one, tiny = number(0), number(1), number(1e-20)
        rotation = (
            number(row[0]), number(row[1]), number(row[2]), number(row[3]), number(row[4]),
            number(row[5]), number(row[6]), number(row[7]), number(row[8]),
        )  # fmt: skip
        px, py, pz = number(row[9]), number(row[10]), number(row[11])
        s0, s1, s2 = number(row[12]), number(row[13]), number(row[14])
        s3, s4, s5 = number(row[15]), number(row[16]), number(row[17])
        s6, s7, s8 = number(row[18]), number(row[19]), number(row[20])
        ux, uy, uz = number(row[21]), number(row[22]), number(row[23])
        inset, friction, slop = number(row[24]), number(row[25]), number(row[26])
        constants = (
            number(row[27]), number(row[28]), number(row[29]), number(row[30]), number(row[31]),
            number(row[32]), number(row[33]), number(row[34]), number(row[35]), number(row[36]),
            number(row[37]), number(row[38]), number(row[39]), number(row[40]), number(row[41]),
            number(row[42]),
        )  # fmt: skip
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
            along = u * nx + v * ny + w * nz
            touch = depth > zero and inverse_mass > zero
            push = min(depth * per_h, max(-along, zero))
            left = max(depth - slop - push * h, zero)
            u, v, w = u - along * nx, v - along * ny, w - along * nz
            sliding = np.sqrt(max(u * u + v * v + w * w, tiny))
            grip = min(friction * push, sliding) / sliding
            tx = vx + (push * nx - grip * u)
            ty = vy + (push * ny - grip * v)
            tz = vz + (push * nz - grip * w)
            tx, ty, tz = tx if touch else vx, ty if touch else vy, tz if touch else vz
            left = left if touch else zero
            velocity[0, i], velocity[1, i], velocity[2, i] = tx, ty, tz
            # From the position before the drift: a particle at rest stays there to the bit.
            back_buffer[0, i] = (
                position[0, i] + h * tx + left * nx if touch else back_buffer[0, i]
            )
            back_buffer[1, i] = (
                position[1, i] + h * ty + left * ny if touch else back_buffer[1, i]
            )
            back_buffer[2, i] = (
                position[2, i] + h * tz + left * nz if touch else back_buffer[2, i]
            )
            mass = one / max(inverse_mass, one)
            tx, ty, tz = mass * (tx - vx), mass * (ty - vy), mass * (tz - vz)
            x, y, z = x if touch else zero, y if touch else zero, z if touch else zero
            jx, jy, jz = jx + tx, jy + ty, jz + tz
            lx += y * tz - z * ty
            ly += z * tx - x * tz
            lz += x * ty - y * tx
            p, q, r = p if touch else zero, q if touch else zero, r if touch else zero
            lifted = max(-(gx * nx + gy * ny + gz * nz), zero) * left
            lifted = lifted if touch else zero
            work += max(p * tx + q * ty + r * tz, zero) + mass * lifted
            touched += one if touch else zero
        sums[0] += jx
        sums[1] += jy
        sums[2] += jz
        sums[3] += lx
        sums[4] += ly
        sums[5] += lz
        sums[6] += work
        sums[7] += touched
        sums[8] = touched

    return loop


_with_plane = _particle_loop(plane.distance)
_with_sphere = _particle_loop(sphere.distance)
_with_capsule = _particle_loop(capsule.distance)
_with_box = _particle_loop(box.distance)
_with_cylinder = _particle_loop(cylinder.distance)
_with_mesh = _particle_loop(mesh_distance.distance)

# Sweeps over the colliders where several may touch the same particles.
_SWEEPS = 2


@functools.cache
def compose(kinds: Set[int]) -> Kernel:
    """
    Return the contact of a chunk of particles with colliders whose shapes are of these kinds.

    It takes

    begin, first, last
        Flat index of the first particle of the sheet, and of the first and after the last one of
        the chunk, which begins a whole number of blocks of `BLOCK` after `begin`;
    drift, h
        Number of the drift that these have made, and its length, s;
    before, after
        Their positions before and after it, m; the latter are corrected;
    velocity, mobility
        As in `State`; the former is corrected;
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
    def resolve(begin, first, last, drift, h, before, after, velocity, mobility, gravity, contacts):  # type: ignore[no-untyped-def]
        types, rows, active, rho, values, shares, starts, sums = contacts
        chunk_end = last
        for block in range((first - begin) // BLOCK, (last - begin + BLOCK - 1) // BLOCK):
            count = 0
            for n in range(len(types)):
                count += active[n, block]
            first = np.uint64(begin + block * BLOCK)
            last = min(np.uint64(first + BLOCK), chunk_end)
            for again in range(min(count, _SWEEPS) * len(types)):
                n = again % len(types)
                if not active[n, block]:
                    continue
                kind = types[n]
                row = rows[drift if len(rows) > 1 else 0, n]
                out = sums[n, block]
                fields = (values[starts[n] :], shares[starts[n] :])
                if has_plane:
                    if kind == plane.KIND:
                        _with_plane(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip
                if has_sphere:
                    if kind == sphere.KIND:
                        _with_sphere(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip
                if has_capsule:
                    if kind == capsule.KIND:
                        _with_capsule(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip
                if has_box:
                    if kind == box.KIND:
                        _with_box(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip
                if has_cylinder:
                    if kind == cylinder.KIND:
                        _with_cylinder(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip
                if has_mesh:
                    if kind == mesh_distance.KIND:
                        _with_mesh(
                            first, last, before, after, velocity, mobility, rho, row, fields,
                            gravity, h, out,
                        )  # fmt: skip

    return resolve
