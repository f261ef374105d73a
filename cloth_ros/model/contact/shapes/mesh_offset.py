"""
How far from a mesh the particles of a sheet are kept, so that its triangles do not cut the mesh.

The condition.  A flat triangle that begins to cut touches the mesh at some point p, where its
plane is tangent.  Every point of a triangle is within its circumradius, at most ρ, of a corner.
So no triangle can touch if no particle is in the set of points x from which a line of length ρ or
less touches the mesh: those with a convex edge in their outline, seen from x, within ρ.  An edge
is in the outline of x if x is in front of one of its triangles and not in front of the other.

The offset at a point y of the mesh is the greatest δ for which y + δ n, with n the outward
direction, is in that set: √(R² + ρ²) - R on a sphere of radius R, √(ρ² - s²) on a face at the
distance s < ρ from a rectangular edge, 0 where the mesh is flat or concave within ρ.  It is
discontinuous across edges; the smallest function above it whose slope is at most `SLOPE` is taken
instead: on the face from s = 0.45 ρ a ramp that ends at s = 2.24 ρ.
"""

from __future__ import annotations

import numpy as np

from ...grid import Array
from ...kernels.jit import exact, exact_subroutine
from .box_tree import LEAF, STACK, box_distance, build_tree
from .mesh import Mesh

# Greatest change of the offset along the mesh, m/m.  Gentle, so that a sheet on a ramp does not
# meet a step; steeper ramps would be shorter.
SLOPE = 0.5
# Sine of the angle below which two triangles are one plane.
_FLAT = 1e-7


def convex_edges(mesh: Mesh) -> tuple[Array, Array]:
    """
    Return the convex edges of a mesh.

    Where more than two triangles meet in an edge, each pair of them that may be neighbours counts.

    Returns
    -------
    (array, array)
        Ends, m, and unit normals of the two triangles, both shape (n, 2, 3).

    """
    normals = mesh.normals()
    starts = mesh.triangles.ravel()
    ends = np.roll(mesh.triangles, -1, axis=1).ravel()
    owners = np.repeat(np.arange(len(mesh.triangles)), 3)
    size = len(mesh.vertices)
    forward = np.flatnonzero(starts < ends)
    backward = np.flatnonzero(starts > ends)
    keys, others = (
        starts[forward] * size + ends[forward],
        ends[backward] * size + starts[backward],
    )
    backward = backward[np.argsort(others, kind='stable')]
    others = np.sort(others)
    first, last = np.searchsorted(others, keys), np.searchsorted(others, keys, 'right')
    counts = last - first
    one = np.repeat(forward, counts)
    shift = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    two = backward[np.repeat(first, counts) + shift]
    edges = mesh.vertices[np.stack([starts[one], ends[one]], axis=1)]
    pairs = np.stack([normals[owners[one]], normals[owners[two]]], axis=1)
    along = edges[:, 1] - edges[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    sine = np.sum(np.cross(pairs[:, 0], pairs[:, 1]) * along, axis=1)
    folded = np.sum(pairs[:, 0] * pairs[:, 1], axis=1) < -1 + 1e-9
    chosen = (sine > _FLAT) | folded
    return np.ascontiguousarray(edges[chosen]), np.ascontiguousarray(pairs[chosen])


@exact_subroutine
def _roots(a, b, c):  # type: ignore[no-untyped-def]
    """Return the roots of a t² + 2 b t + c, a > 0; infinity and -infinity if there are none."""
    square = b * b - a * c
    if square < 0.0:
        return np.inf, -np.inf
    root = np.sqrt(square)
    return (-b - root) / a, (-b + root) / a


@exact_subroutine
def _within(ends, e, foot, normal, rho):  # type: ignore[no-untyped-def]
    """Return the first and the last t with foot + t normal within `rho` of an edge, m."""
    dd, dn, dm, mn, mm, bn, bb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        n = normal[axis]
        d = ends[e, 1, axis] - ends[e, 0, axis]
        m = foot[axis] - ends[e, 0, axis]
        b = foot[axis] - ends[e, 1, axis]
        dd += d * d
        dn += d * n
        dm += d * m
        mn += m * n
        mm += m * m
        bn += b * n
        bb += b * b
    rr = rho * rho
    first, last = _roots(1.0, mn, mm - rr)
    s, t = _roots(1.0, bn, bb - rr)
    first, last = min(first, s), max(last, t)
    a = dd - dn * dn
    if a > 1e-12 * dd:
        s, t = _roots(a, dd * mn - dm * dn, dd * (mm - rr) - dm * dm)
        if s <= t:
            if 0.0 <= dm + s * dn <= dd:
                first = min(first, s)
            if 0.0 <= dm + t * dn <= dd:
                last = max(last, t)
    return first, last


@exact_subroutine
def _offset_of_edge(ends, pairs, e, foot, normal, rho, best):  # type: ignore[no-untyped-def]
    """Return the greatest t from `best` to rho where foot + t normal has edge e in its outline."""
    c1, c2, s1, s2 = 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        d, n = foot[axis] - ends[e, 0, axis], normal[axis]
        c1 += d * pairs[e, 0, axis]
        c2 += d * pairs[e, 1, axis]
        s1 += n * pairs[e, 0, axis]
        s2 += n * pairs[e, 1, axis]
    # Heights above both planes, c + t s: the outline is where their signs differ.
    t1 = -c1 / s1 if s1 != 0.0 else -1.0
    t2 = -c2 / s2 if s2 != 0.0 else -1.0
    if (c1 + rho * s1) * (c2 + rho * s2) > 0.0 and not (best < t1 <= rho or best < t2 <= rho):
        return best
    first, last = _within(ends, e, foot, normal, rho)
    last = min(last, rho)
    if first > last or last <= best:
        return best
    if (c1 + last * s1) * (c2 + last * s2) <= 0.0:
        return last
    if max(first, best) <= t1 <= last:
        best = t1
    if max(first, best) <= t2 <= last:
        best = t2
    return best


@exact
def find_offsets(bounds, items, ends, pairs, feet, normals, rho, offsets):  # type: ignore[no-untyped-def]
    """
    Compute the offset at points of the mesh.

    Parameters
    ----------
    bounds, items
        Tree of the convex edges.
    ends, pairs
        See `convex_edges`.
    feet, normals
        The points, m, and the outward directions there, both shape (n, 3).
    rho
        m.
    offsets
        Receives the offsets, m, shape (n,).

    """
    stack = np.empty(STACK, np.int64)
    leaves = len(bounds) // 2
    # All of them are within 1.5 rho of the middle of the segment from y to y + rho n.
    reach = (1.5 * rho) ** 2
    for n in range(len(feet)):
        foot, normal = feet[n], normals[n]
        x, y, z = (
            foot[0] + 0.5 * rho * normal[0],
            foot[1] + 0.5 * rho * normal[1],
            foot[2] + 0.5 * rho * normal[2],
        )
        best = 0.0
        stack[0], depth = 1, 1
        while depth:
            depth -= 1
            node = stack[depth]
            if box_distance(bounds, node, x, y, z) > reach:
                continue
            if node < leaves:
                stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
                depth += 2
                continue
            first = LEAF * (node - leaves)
            for k in range(first, min(first + LEAF, len(items))):
                best = _offset_of_edge(ends, pairs, items[k], foot, normal, rho, best)
        offsets[n] = best


@exact
def limit_slope(numbers, nodes, feet, normals, slope, offsets):  # type: ignore[no-untyped-def]
    """
    Raise offsets until they change by at most `slope` per distance between neighbouring nodes.

    Parameters
    ----------
    numbers
        Number of each node in the following arrays, -1: in none; int32, shape (nx, ny, nz).
    nodes
        Indices of each node, shape (n, 3); in their order in the grid.
    feet, normals
        See `find_offsets`.  Nodes whose normals are opposed are on two sides of a wall.
    slope
        m/m.
    offsets
        m, shape (n,); updated.

    Returns
    -------
    bool
        Whether any was raised by more than a rounding error.

    """
    raised = False
    count = len(nodes)
    for turn in range(2 * count):
        n = turn if turn < count else 2 * count - 1 - turn
        best = offsets[n]
        for di in range(-1, 2):
            for dj in range(-1, 2):
                for dk in range(-1, 2):
                    i, j, k = nodes[n, 0] + di, nodes[n, 1] + dj, nodes[n, 2] + dk
                    if not (
                        0 <= i < numbers.shape[0]
                        and 0 <= j < numbers.shape[1]
                        and 0 <= k < numbers.shape[2]
                    ):
                        continue
                    m = numbers[i, j, k]
                    if m < 0 or offsets[m] <= best:
                        continue
                    squared, product = 0.0, 0.0
                    for axis in range(3):
                        squared += (feet[n, axis] - feet[m, axis]) ** 2
                        product += normals[n, axis] * normals[m, axis]
                    if product > -0.5:
                        best = max(best, offsets[m] - slope * np.sqrt(squared))
        if best > offsets[n]:
            raised = raised or best > offsets[n] * (1.0 + 1e-6)
            offsets[n] = best
    return raised


def offsets_at(mesh: Mesh, feet: Array, normals: Array, rho: float) -> Array:
    """
    Return the offset at points of a mesh, before its slope is limited, m, shape (n,).

    Parameters
    ----------
    mesh
        The mesh.
    feet, normals
        The points, m, and the outward directions there, both shape (n, 3).
    rho
        Greatest circumradius of the triangles of the sheet, m.

    """
    ends, pairs = convex_edges(mesh)
    offsets = np.zeros(len(feet))
    if len(ends):
        find_offsets(*build_tree(ends), ends, pairs, feet, normals, rho, offsets)
    return offsets
