"""
Continuous collision of a collider with triangles, in the frame of the collider.

All positions and velocities are relative to the collider, whose origin stays at that of the frame.
Within a substep the particles move in several advances.  An advance is as long as the clearance
allows, but at least half the radius of the largest ball in the collider: a point that starts
outside of that ball and ends outside of it on the other side would have to travel two radii.  So
contact at the end of every advance is enough that nothing ever passes (conservative advancement;
B. Mirtich, "Impulse-based dynamic simulation of rigid body systems", 1996, section 2.3), however
small or fast the collider.

At the start of an advance, velocities that would end inside the collider lose the part that does:
inelastic impulses at the closest point of the triangle, shared by its corners by their
barycentric weights, with Coulomb friction.  No impulse adds energy in the frame of the collider.
Penetration that remains because of curvature is projected out at the end of the advance, without
velocity.  Where even that fails, the corners concerned move with the collider, which leaves their
triangles just as far from it as they were: the end of an advance is never worse than its start,
except where pinned particles are swept over.  The same ends a substep that would take too many
advances.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact_subroutine
from .deepest_point import deepest_point, plane_is_beyond
from .triangle_projection import deepest, project

_VELOCITY_PASSES = 20
# Advances in one substep, beyond which everything in reach moves with the collider.
_MAX_ADVANCES = 200
# Fewer for many triangles: a substep must end in milliseconds.
_WORK, _LEAST_ADVANCES = 1000, 2
# Share of the tolerance by which a contact may deepen in an advance without a further impulse.
_CREEP = 1e-2
# Travel of a particle in one advance, in radii of the ball, from which its triangles might change
# sides.
_CARRIED = 1.8


@exact_subroutine
def _is_claimed(claimed, advance, a, b, c, wa, wb, wc):  # type: ignore[no-untyped-def]
    """Tell if the closest point is a corner that another triangle has been noted for already."""
    if wa == 1.0:
        corner = a
    elif wb == 1.0:
        corner = b
    elif wc == 1.0:
        corner = c
    else:
        return False
    if claimed[corner] == advance:
        return True
    claimed[corner] = advance
    return False


@exact_subroutine
def _max_speed(velocities):  # type: ignore[no-untyped-def]
    greatest = 0.0
    for i in range(len(velocities)):
        u, v, w = velocities[i, 0], velocities[i, 1], velocities[i, 2]
        greatest = max(greatest, u * u + v * v + w * w)
    return np.sqrt(greatest)


@exact_subroutine
def _travel(points, start):  # type: ignore[no-untyped-def]
    greatest = 0.0
    for i in range(len(points)):
        u, v = points[i, 0] - start[i, 0], points[i, 1] - start[i, 1]
        w = points[i, 2] - start[i, 2]
        greatest = max(greatest, u * u + v * v + w * w)
    return np.sqrt(greatest)


@exact_subroutine
def _scale_row(array, i, factor):  # type: ignore[no-untyped-def]
    """Multiply a row by a factor; loops compile much faster than NumPy's row operations."""
    for axis in range(3):
        array[i, axis] *= factor


@exact_subroutine
def _add_row(array, i, factor, other, j):  # type: ignore[no-untyped-def]
    """Add `factor` times row j of another array to row i."""
    for axis in range(3):
        array[i, axis] += factor * other[j, axis]


@exact_subroutine
def _copy_row(array, i, other, j):  # type: ignore[no-untyped-def]
    """Copy row j of another array to row i."""
    for axis in range(3):
        array[i, axis] = other[j, axis]


@exact_subroutine
def _apply_impulse(  # type: ignore[no-untyped-def]
    velocities, inverse_masses, triangles, weights, normals, t, least, slack, friction
):
    """Let a contact point recede at `least` m/s or faster; return whether it fell short."""
    triangle, weight, normal = triangles[t], weights[t], normals[t]
    u, v, w = 0.0, 0.0, 0.0
    inverse_mass = 0.0
    for k in range(3):
        i = triangle[k]
        u += weight[k] * velocities[i, 0]
        v += weight[k] * velocities[i, 1]
        w += weight[k] * velocities[i, 2]
        inverse_mass += inverse_masses[i] * weight[k] * weight[k]
    along = u * normal[0] + v * normal[1] + w * normal[2]
    if inverse_mass == 0.0 or along >= least - slack:
        return False
    push = least - along
    # Coulomb: at most friction × push against the sliding, and never past its end.
    u, v, w = u - along * normal[0], v - along * normal[1], w - along * normal[2]
    sliding = np.sqrt(u * u + v * v + w * w)
    grip = min(friction * push / sliding, 1.0) if sliding > 0.0 else 0.0
    for k in range(3):
        i = triangle[k]
        share = inverse_masses[i] * weight[k] / inverse_mass
        velocities[i, 0] += share * (push * normal[0] - grip * u)
        velocities[i, 1] += share * (push * normal[1] - grip * v)
        velocities[i, 2] += share * (push * normal[2] - grip * w)
    return True


@exact_subroutine
def _move_with_collider(  # type: ignore[no-untyped-def]
    points, velocities, start, gaps, inverse_masses, triangles, shape, inner, tolerance
):
    """Stop particles that moved too far; move those of too deep triangles with it."""
    carried = np.empty(len(inverse_masses), np.bool_)
    for i in range(len(points)):
        carried[i] = inverse_masses[i] == 0.0
        travel = 0.0
        for axis in range(3):
            travel += (points[i, axis] - start[i, axis]) ** 2
        travel = np.sqrt(travel)
        if travel > _CARRIED * inner:
            for axis in range(3):
                displacement = points[i, axis] - start[i, axis]
                points[i, axis] = start[i, axis] + displacement * _CARRIED * inner / travel
                velocities[i, axis] = 0.0
    changed = True
    while changed:
        changed = False
        for t in range(len(triangles)):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            # What was too deep before the advance is less deep where it was projected to.
            if gaps[t] < -2.0 * tolerance:
                continue
            gap = deepest_point(points, a, b, c, shape, -tolerance, 0.1 * tolerance)[0]
            if gap >= -tolerance:
                continue
            for k in range(3):
                i = triangles[t, k]
                if not carried[i]:
                    carried[i] = True
                    _copy_row(points, i, start, i)
                    for axis in range(3):
                        velocities[i, axis] = 0.0
                    changed = True


@exact_subroutine
def _leave_to_pins(points, velocities, inverse_masses, triangles, shape, h, tolerance):  # type: ignore[no-untyped-def]
    """
    Return the triangles without pinned corners and edges in the collider, and how many had any.

    Nothing can push these out, and what is free of their triangles would be thrown about in vain:
    of those an edge or a corner remains.
    """
    kept, found = triangles, 0
    whole = True
    for i in range(len(inverse_masses)):
        whole = whole and inverse_masses[i] > 0.0
    if whole:
        return kept, found
    place = np.zeros((3, 3))
    for t in range(len(triangles)):
        pinned, other = 0, -1
        for k in range(3):
            i = triangles[t, k]
            if inverse_masses[i] > 0.0:
                other = i
            else:
                _copy_row(place, pinned, points, i)
                pinned += 1
        if pinned == 0 or other < 0:
            continue
        b, c = min(1, pinned - 1), pinned - 1
        nearest = deepest_point(place, np.int64(0), b, c, shape, -tolerance, 0.1 * tolerance)[0]
        # Pins move so little in a substep that they all move alike.
        for k in range(3):
            if inverse_masses[triangles[t, k]] == 0.0:
                for corner in range(3):
                    _add_row(place, corner, h, velocities, triangles[t, k])
                break
        moved = deepest_point(place, np.int64(0), b, c, shape, -tolerance, 0.1 * tolerance)[0]
        if min(nearest, moved) < -tolerance:
            if found == 0:
                kept = np.empty_like(triangles)
                for n in range(len(triangles)):
                    _copy_row(kept, n, triangles, n)
            found += 1
            for k in range(3):
                if inverse_masses[triangles[t, k]] == 0.0:
                    kept[t, k] = other
    return kept, found


@exact_subroutine
def resolve_contact(  # type: ignore[no-untyped-def]
    points, velocities, inverse_masses, triangles, shape, outer, inner, friction, h, tolerance
):
    """
    Move points through `h` seconds past a collider.

    Parameters
    ----------
    points, velocities
        m and m/s, in the frame of the collider, shape (n, 3), double precision; changed in place.
    inverse_masses
        In any unit; 0 for pinned particles; shape (n,).
    triangles
        Corners as indices into the points, shape (m, 3); equal corners as in `deepest_point`.
    shape
        Kind, row and fields, as in `deepest_point`.
    outer, inner
        Radii of a ball about the origin that contains the collider, and of one within it, m.
    friction
        Coulomb's coefficient.
    h
        Length of the substep, s.
    tolerance
        Depth, m, that is not corrected.

    Returns
    -------
    (float, bool, bool)
        Greatest depth of a triangle at the end, m, or 0 where it is within the tolerance; whether
        there was contact at all; and whether points had to be moved otherwise than by velocities.

    """
    whole = triangles
    triangles, pinned = _leave_to_pins(
        points, velocities, inverse_masses, whole, shape, h, tolerance
    )
    weights = np.empty((len(triangles), 3))
    normals = np.empty((len(triangles), 3))
    gaps = np.empty(len(triangles))
    near = np.empty(len(triangles), np.int64)
    start = np.empty_like(points)
    claimed = np.zeros(len(points), np.int64)
    advance = 0
    most = min(max(_WORK // max(len(triangles), 1), _LEAST_ADVANCES), _MAX_ADVANCES)
    left, touched, forced, deep = h, False, False, pinned > 0
    while left > 0.0:
        fastest = _max_speed(velocities)
        if not np.isfinite(fastest):
            break
        if advance == most:
            for i in range(len(points)):
                if inverse_masses[i] == 0.0:  # pins stay where they are, seen from the world
                    _add_row(points, i, left, velocities, i)
                _scale_row(velocities, i, 0.0)
            forced = deep = True
            break
        reach = left * fastest
        advance += 1
        clearance = np.inf
        count = 0
        for t in range(len(triangles)):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            gaps[t] = reach  # or more
            if plane_is_beyond(points, a, b, c, outer + reach):
                continue
            gaps[t], wa, wb, wc, x, y, z = deepest_point(
                points, a, b, c, shape, reach, 0.1 * tolerance
            )
            if gaps[t] <= reach:
                clearance = min(clearance, gaps[t])
                if _is_claimed(claimed, advance, a, b, c, wa, wb, wc):
                    continue
                weights[t, 0], weights[t, 1], weights[t, 2] = wa, wb, wc
                normals[t, 0], normals[t, 1], normals[t, 2] = x, y, z
                near[count] = t
                count += 1
        if count == 0:
            for i in range(len(points)):
                _add_row(points, i, left, velocities, i)
            break
        touched = True
        allowed = max(clearance, 0.5 * inner)
        length = left if reach <= allowed else allowed / fastest
        slack = _CREEP * tolerance / length
        for _ in range(_VELOCITY_PASSES):
            pushed = False
            for n in range(count):
                t = near[n]
                if gaps[t] <= length * fastest:
                    least = min(-gaps[t] / length, 0.0)
                    pushed |= _apply_impulse(
                        velocities, inverse_masses, triangles, weights, normals, t, least, slack,
                        friction,
                    )  # fmt: skip
            if not pushed:
                break
        for i in range(len(points)):
            _copy_row(start, i, points, i)
            _add_row(points, i, length, velocities, i)
        travel = _travel(points, start)
        resolved, held, _ = project(
            points, inverse_masses, triangles, gaps, travel, shape, outer, inner, tolerance
        )
        displaced = clearance < inner and _travel(points, start) > _CARRIED * inner
        if displaced or not resolved:
            _move_with_collider(
                points, velocities, start, gaps, inverse_masses, triangles, shape, inner,
                tolerance,
            )  # fmt: skip
        forced = forced or displaced or not resolved
        deep = pinned > 0 or held or displaced or not resolved
        left -= length
    depth = deepest(points, whole, shape, outer, tolerance) if deep else 0.0
    if depth <= 2.0 * tolerance:
        depth = 0.0
    return depth, touched, forced
