"""The point of a triangle that is deepest in a collider, or nearest to it."""

from __future__ import annotations

import math

import numpy as np

from ..kernels.jit import exact_subroutine
from .closest_point import closest_point, normal_of
from .distance import distance_from
from .particle_contact import INSET, SHAPE
from .shapes import capsule

_ITERATIONS = 30
_BISECTIONS = 30
# Sections of a line, and the golden ratio: the larger part of a section.
_SECTIONS = 26
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@exact_subroutine
def plane_is_beyond(points, a, b, c, reach):  # type: ignore[no-untyped-def]
    """Tell if the plane of a triangle is farther from the origin than `reach`; cheap."""
    nx, ny, nz = normal_of(points, a, b, c)
    height = nx * points[a, 0] + ny * points[a, 1] + nz * points[a, 2]
    return height * height > reach * reach * (nx * nx + ny * ny + nz * nz)


@exact_subroutine
def _at(points, a, b, c, wa, wb, wc):  # type: ignore[no-untyped-def]
    return (
        wa * points[a, 0] + wb * points[b, 0] + wc * points[c, 0],
        wa * points[a, 1] + wb * points[b, 1] + wc * points[c, 1],
        wa * points[a, 2] + wb * points[b, 2] + wc * points[c, 2],
    )


@exact_subroutine
def _nearest_to_ball(points, a, b, c, radius):  # type: ignore[no-untyped-def]
    """Return the same as `deepest_point` for a ball about the origin, in closed form."""
    squared, wa, wb, wc = closest_point(points, a, b, c)
    length = np.sqrt(squared)
    if length > 1e-6 * radius:
        x, y, z = _at(points, a, b, c, wa, wb, wc)
        return length - radius, wa, wb, wc, x / length, y / length, z / length
    # The origin lies in the triangle, whose normal is taken as the direction.
    x, y, z = normal_of(points, a, b, c)
    area = np.sqrt(x * x + y * y + z * z)
    if area > 0.0:
        return length - radius, wa, wb, wc, x / area, y / area, z / area
    return length - radius, wa, wb, wc, 0.0, 0.0, 1.0


@exact_subroutine
def _along(points, a, b, c, wa, shape, sections):  # type: ignore[no-untyped-def]
    """Return the least distance where the weight of a is given, and the weight of b there."""
    kind, row, fields = shape
    low, high = 0.0, 1.0 - wa
    near, far = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    x, y, z = _at(points, a, b, c, wa, near, 1.0 - wa - near)
    at_near = distance_from(kind, row, fields, x, y, z, 0.0)[0]
    x, y, z = _at(points, a, b, c, wa, far, 1.0 - wa - far)
    at_far = distance_from(kind, row, fields, x, y, z, 0.0)[0]
    for _ in range(sections):
        if at_near < at_far:
            high, far, at_far = far, near, at_near
            near = high - _GOLDEN * (high - low)
            x, y, z = _at(points, a, b, c, wa, near, 1.0 - wa - near)
            at_near = distance_from(kind, row, fields, x, y, z, 0.0)[0]
        else:
            low, near, at_near = near, far, at_far
            far = low + _GOLDEN * (high - low)
            x, y, z = _at(points, a, b, c, wa, far, 1.0 - wa - far)
            at_far = distance_from(kind, row, fields, x, y, z, 0.0)[0]
    return (at_near, near) if at_near < at_far else (at_far, far)


@exact_subroutine
def _by_golden_sections(points, a, b, c, shape, tolerance):  # type: ignore[no-untyped-def]
    """Return the least distance of a triangle from a shape, and the weights of a and b."""
    longest = 0.0
    for axis in range(3):
        side = abs(points[b, axis] - points[a, axis]) + abs(points[c, axis] - points[a, axis])
        longest = max(longest, side)
    # Each section leaves 0.62 of the interval.
    sections = min(max(int(np.log(max(longest / tolerance, 2.0)) / 0.48), 8), _SECTIONS)
    low, high = 0.0, 1.0
    near, far = 1.0 - _GOLDEN, _GOLDEN
    at_near, _ = _along(points, a, b, c, near, shape, sections)
    at_far, _ = _along(points, a, b, c, far, shape, sections)
    for _ in range(sections):
        if at_near < at_far:
            high, far, at_far = far, near, at_near
            near = high - _GOLDEN * (high - low)
            at_near, _ = _along(points, a, b, c, near, shape, sections)
        else:
            low, near, at_near = near, far, at_far
            far = low + _GOLDEN * (high - low)
            at_far, _ = _along(points, a, b, c, far, shape, sections)
    wa = near if at_near < at_far else far
    d, wb = _along(points, a, b, c, wa, shape, sections)
    return d, wa, wb


@exact_subroutine
def deepest_point(points, a, b, c, shape, reach, tolerance):  # type: ignore[no-untyped-def]
    """
    Find the point of a triangle with the least signed distance from a collider.

    The distance from a convex shape is a convex function.  It is minimised over the weights of
    the corners by pairwise steps of Frank and Wolfe (S. Lacoste-Julien, M. Jaggi, "On the global
    linear convergence of Frank-Wolfe optimization variants", NIPS 2015), from the best of a few
    points.  They may stop where the distance has creases, as inside the shape, and are slow near
    edges: then by golden section along lines between golden sections of two sides.  In a mesh that
    is not convex the result is a local minimum.

    Parameters
    ----------
    points
        m, in the frame of the collider, shape (n, 3), double precision.
    a, b, c
        Which of them are the corners; equal corners make a segment or a point.
    shape
        Kind, row and fields of the collider, as `distance_from` takes them, about its origin and
        `in_own_frame`.
    reach
        Distance, m, beyond which the result need not be exact, only beyond it as well.
    tolerance
        Error of the distance, m.

    Returns
    -------
    tuple of 7 floats
        Distance, m, negative inside; weights of the corners; and the normal at that point.

    """
    kind, row, fields = shape
    if kind == capsule.KIND and row[SHAPE + 3] == 0.0:
        return _nearest_to_ball(points, a, b, c, row[SHAPE + 4] - row[INSET])
    weights = np.zeros(3)
    corner = np.array((a, b, c))
    _, weights[0], weights[1], weights[2] = closest_point(points, a, b, c)
    x, y, z = _at(points, a, b, c, weights[0], weights[1], weights[2])
    best, nx, ny, nz = distance_from(kind, row, fields, x, y, z, 0.0)
    farthest = 0.0
    for k in range(3):
        i = corner[k]
        u, v, w = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
        farthest = max(farthest, u * u + v * v + w * w)
    if best - np.sqrt(farthest) > reach:  # no point is nearer than that
        return best - np.sqrt(farthest), weights[0], weights[1], weights[2], nx, ny, nz
    for k in range(4):
        wa = 1.0 if k == 0 else (1.0 / 3.0 if k == 3 else 0.0)
        wb = 1.0 if k == 1 else (1.0 / 3.0 if k == 3 else 0.0)
        x, y, z = _at(points, a, b, c, wa, wb, 1.0 - wa - wb)
        d, u, v, w = distance_from(kind, row, fields, x, y, z, 0.0)
        if d < best:
            best, nx, ny, nz = d, u, v, w
            weights[0], weights[1], weights[2] = wa, wb, 1.0 - wa - wb
    gap = np.inf
    for _ in range(_ITERATIONS):
        low, high, mean = np.inf, -np.inf, 0.0
        lowest, highest = 0, 0
        for k in range(3):
            i = corner[k]
            slope = nx * points[i, 0] + ny * points[i, 1] + nz * points[i, 2]
            mean += weights[k] * slope
            if slope < low:
                low, lowest = slope, k
            if weights[k] > 0.0 and slope > high:
                high, highest = slope, k
        gap = mean - low
        if gap < tolerance or best - gap > reach:  # best - gap is a lower bound
            break
        i, j = corner[highest], corner[lowest]
        dx = points[j, 0] - points[i, 0]
        dy = points[j, 1] - points[i, 1]
        dz = points[j, 2] - points[i, 2]
        x, y, z = _at(points, a, b, c, weights[0], weights[1], weights[2])
        most = weights[highest]
        begin, end = 0.0, most
        step = most
        d, u, v, w = distance_from(
            kind, row, fields, x + step * dx, y + step * dy, z + step * dz, 0.0
        )
        if u * dx + v * dy + w * dz > 0.0:
            for _ in range(_BISECTIONS):
                step = 0.5 * (begin + end)
                d, u, v, w = distance_from(
                    kind, row, fields, x + step * dx, y + step * dy, z + step * dz, 0.0
                )
                if u * dx + v * dy + w * dz > 0.0:
                    end = step
                else:
                    begin = step
                if (end - begin) * (abs(dx) + abs(dy) + abs(dz)) < 0.1 * tolerance:
                    break
        if d >= best:
            break
        best, nx, ny, nz = d, u, v, w
        weights[lowest] += step
        weights[highest] = most - step if step < most else 0.0
    if gap >= tolerance and best - gap <= reach:
        d, wa, wb = _by_golden_sections(points, a, b, c, shape, tolerance)
        if d < best:
            weights[0], weights[1], weights[2] = wa, wb, 1.0 - wa - wb
            x, y, z = _at(points, a, b, c, wa, wb, weights[2])
            best, nx, ny, nz = distance_from(kind, row, fields, x, y, z, 0.0)
    return best, weights[0], weights[1], weights[2], nx, ny, nz
