"""
Contact of triangles with a collider in a substep: where particles alone are not enough.

A collider that is small beside the triangles, or so fast that these are torn apart, gets between
the particles.  Then the triangles that it may touch are moved through the substep together with
it, by `continuous_collision`.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_subroutine
from .continuous_collision import resolve_contact
from .distance import in_own_frame
from .particle_contact import FRICTION, POINT, SPIN, VELOCITY
from .triangle_projection import deepest, project


@exact_subroutine
def _rotate(matrix, x, y, z):  # type: ignore[no-untyped-def]
    """Return the product of a matrix, row by row, and a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[3] * x + matrix[4] * y + matrix[5] * z,
        matrix[6] * x + matrix[7] * y + matrix[8] * z,
    )


@exact_subroutine
def _rotate_back(matrix, x, y, z):  # type: ignore[no-untyped-def]
    """Return the product of a transposed matrix and a vector."""
    return (
        matrix[0] * x + matrix[3] * y + matrix[6] * z,
        matrix[1] * x + matrix[4] * y + matrix[7] * z,
        matrix[2] * x + matrix[5] * y + matrix[8] * z,
    )


@exact_subroutine
def _load(position, velocity, mobility, particles, h, before, after):  # type: ignore[no-untyped-def]
    """Return points, velocities and inverse masses before the substep, in the collider's frame."""
    number = len(particles)
    points, velocities = np.empty((number, 3)), np.empty((number, 3))
    inverse_masses = np.empty(number)
    for n in range(len(particles)):
        i = particles[n]
        inverse_masses[n] = mobility[0, i] * mobility[1, i]
        x, y, z = np.float64(position[0, i]), np.float64(position[1, i]), position[2, i]
        p, q, r = _rotate_back(after, x - after[POINT], y - after[POINT + 1], z - after[POINT + 2])
        if h > 0.0:
            x, y = x - h * velocity[0, i], y - h * velocity[1, i]
            z = z - h * velocity[2, i]
            x, y, z = x - before[POINT], y - before[POINT + 1], z - before[POINT + 2]
            points[n, 0], points[n, 1], points[n, 2] = _rotate_back(before, x, y, z)
            velocities[n, 0] = (p - points[n, 0]) / h
            velocities[n, 1] = (q - points[n, 1]) / h
            velocities[n, 2] = (r - points[n, 2]) / h
        else:
            points[n, 0], points[n, 1], points[n, 2] = p, q, r
            velocities[n, 0] = velocities[n, 1] = velocities[n, 2] = 0.0
    return points, velocities, inverse_masses


@exact_subroutine
def _store(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, gravity, after, points, velocities, former, sums,
    least,
):  # fmt: skip
    """
    Write back the particles that move, and add to the sums, as in `particle_contact`.

    Return the greatest change of a position, m.
    """
    touched, farthest = 0.0, 0.0
    for n in range(len(particles)):
        i = particles[n]
        inverse_mass = mobility[0, i] * mobility[1, i]
        if not inverse_mass > 0:
            continue
        mass = 1.0 / inverse_mass
        u, v, w = _rotate(
            after,
            velocities[n, 0] - former[n, 0],
            velocities[n, 1] - former[n, 1],
            velocities[n, 2] - former[n, 2],
        )
        x, y, z = _rotate(after, points[n, 0], points[n, 1], points[n, 2])
        dx, dy = x + after[POINT] - position[0, i], y + after[POINT + 1] - position[1, i]
        dz = z + after[POINT + 2] - position[2, i]
        squared = dx * dx + dy * dy + dz * dz
        if u == 0.0 and v == 0.0 and w == 0.0 and squared <= least * least:
            continue
        farthest = max(farthest, squared)
        rise = gravity[0] * dx + gravity[1] * dy + gravity[2] * dz
        touched += 1.0
        p, q, r = _rotate(after[SPIN : SPIN + 9], x, y, z)
        p, q, r = p + after[VELOCITY], q + after[VELOCITY + 1], r + after[VELOCITY + 2]
        sums[0] += mass * u
        sums[1] += mass * v
        sums[2] += mass * w
        sums[3] += mass * (y * w - z * v)
        sums[4] += mass * (z * u - x * w)
        sums[5] += mass * (x * v - y * u)
        sums[6] += mass * (max(p * u + q * v + r * w, 0.0) + max(-rise, 0.0))
        position[0, i] = x + after[POINT]
        position[1, i] = y + after[POINT + 1]
        position[2, i] = z + after[POINT + 2]
        velocity[0, i] += u
        velocity[1, i] += v
        velocity[2, i] += w
    sums[7] += touched
    sums[8] = touched
    return np.sqrt(farthest)


@exact_subroutine
def _without_pins(triangles, inverse_masses):  # type: ignore[no-untyped-def]
    """Return the triangles none of whose corners is pinned."""
    free, count = np.empty_like(triangles), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if min(inverse_masses[a], inverse_masses[b], inverse_masses[c]) > 0.0:
            free[count, 0], free[count, 1], free[count, 2] = a, b, c
            count += 1
    return free[:count]


@exact
def resolve_triangles(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, triangles, h, gravity, kind, before, after, fields,
    outer, inner, tolerance, sums,
):  # fmt: skip
    """
    Move a collider and a part of the sheet through a substep.

    Parameters
    ----------
    position, velocity, mobility
        Flat arrays after the substep, of which the first two are corrected.
    particles, triangles
        From `BroadPhase.find`.
    h
        Length of the substep, s.
    gravity
        m/s², shape (3,).
    kind, before, after, fields
        Of the collider, with its rows at the start and at the end of the substep, about its
        origin; see `particle_contact`.
    outer, inner, tolerance
        As in `resolve_contact`.
    sums
        See `particle_contact`.

    Returns
    -------
    (float, float, bool, bool, float)
        Depth as from `resolve_contact`, and that of triangles that no pinned particle holds, m;
        touch and force as from there; and the greatest correction of a position, m.

    """
    points, velocities, inverse_masses = _load(
        position, velocity, mobility, particles, h, before, after
    )
    former = velocities.copy()
    shape = (kind, in_own_frame(after), fields)
    depth, touched, forced = resolve_contact(
        points, velocities, inverse_masses, triangles, shape, outer, inner, after[FRICTION], h,
        tolerance,
    )  # fmt: skip
    farthest = 0.0
    if touched:
        farthest = _store(
            position, velocity, mobility, particles, gravity, after, points, velocities, former,
            sums, 1e-9,
        )  # fmt: skip
    unheld = depth
    free = _without_pins(triangles, inverse_masses)
    if depth > 0.0 and len(free) < len(triangles):
        unheld = deepest(points, free, shape, outer, tolerance)
        unheld = unheld if unheld > 2.0 * tolerance else 0.0
    return depth, unheld, touched, forced, farthest


@exact
def deepest_triangle(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, triangles, kind, row, fields, outer, tolerance
):
    """
    Return the greatest depth of some triangles in a collider, m, or 0.

    Parameters are those of `resolve_triangles`.
    """
    points, _, _ = _load(position, velocity, mobility, particles, 0.0, row, row)
    return deepest(points, triangles, (kind, in_own_frame(row), fields), outer, tolerance)


@exact
def push_out_triangles(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, triangles, gravity, kind, row, fields, outer, inner,
    tolerance, sums,
):  # fmt: skip
    """
    Move triangles out of a collider without velocity.

    Return the greatest depth of one, m, or 0; and what is left of those that no pinned particle
    holds.  Parameters are those of `resolve_triangles`.
    """
    points, velocities, inverse_masses = _load(
        position, velocity, mobility, particles, 0.0, row, row
    )
    shape = (kind, in_own_frame(row), fields)
    resolved, _, depth = project(
        points, inverse_masses, triangles, np.zeros(len(triangles)), 0.0, shape, outer, inner,
        tolerance,
    )  # fmt: skip
    _store(
        position, velocity, mobility, particles, gravity, row, points, velocities, velocities,
        sums, 1e-9,
    )  # fmt: skip
    left = 0.0
    if not resolved:
        free = _without_pins(triangles, inverse_masses)
        left = deepest(points, free, shape, outer, tolerance)
    return depth, left
