"""Depth of triangles in a collider, and their projection out of it, in its frame."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact_subroutine
from .deepest_point import deepest_point, plane_is_beyond

_POSITION_PASSES = 50
# Searches for the deepest point of a triangle in these passes, for each triangle at hand.
_EVALUATIONS = 10


@exact_subroutine
def project(points, inverse_masses, triangles, gaps, travel, shape, outer, inner, tolerance):  # type: ignore[no-untyped-def]
    """
    Push triangles out of the collider until none is deeper than `tolerance`.

    Triangles had at least these `gaps` to it, and no point has gone farther than `travel`
    since.  Return whether that was done, whether pins alone hold some triangle deeper, and the
    greatest depth found on the way, m, or 0.
    """
    weights = np.empty(3)
    held, deepest_found = False, 0.0
    # Only what has moved is looked at again: numbers of pushes, when a point moved, and when a
    # triangle was looked at.
    moved, seen = np.zeros(len(points), np.int64), np.zeros(len(triangles), np.int64)
    pushes, left = 0, _EVALUATIONS * len(triangles)
    for t in range(len(triangles)):
        seen[t] = 0 if gaps[t] > travel else -1
    for _ in range(_POSITION_PASSES):
        clear = True
        for t in range(len(triangles)):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if max(max(moved[a], moved[b]), moved[c]) <= seen[t]:
                continue
            seen[t] = pushes
            if plane_is_beyond(points, a, b, c, outer - tolerance):
                continue
            left -= 1
            gap, weights[0], weights[1], weights[2], x, y, z = deepest_point(
                points, a, b, c, shape, -tolerance, 0.1 * tolerance
            )
            if gap >= -tolerance:
                continue
            inverse_mass = 0.0
            most = 0.0
            for k in range(3):
                i = triangles[t, k]
                inverse_mass += inverse_masses[i] * weights[k] * weights[k]
                most = max(most, inverse_masses[i] * weights[k])
            if inverse_mass == 0.0:
                held = True
                continue
            clear = False
            deepest_found = max(deepest_found, -gap)
            pushes += 1
            # Near a pinned corner the lever is long: no more than half a radius at a time.
            push = min(-gap / inverse_mass, 0.5 * inner / most)
            for k in range(3):
                i = triangles[t, k]
                share = inverse_masses[i] * weights[k] * push
                points[i, 0] += share * x
                points[i, 1] += share * y
                points[i, 2] += share * z
                if share > 0.0:
                    moved[i] = pushes
        if clear:
            return True, held, deepest_found
        if left <= 0:
            break
    return False, held, deepest_found


@exact_subroutine
def deepest(points, triangles, shape, outer, tolerance):  # type: ignore[no-untyped-def]
    """Return the greatest depth of a triangle in the collider, m, or 0."""
    depth = 0.0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if not plane_is_beyond(points, a, b, c, outer):
            depth = max(depth, -deepest_point(points, a, b, c, shape, 0.0, 0.1 * tolerance)[0])
    return depth
