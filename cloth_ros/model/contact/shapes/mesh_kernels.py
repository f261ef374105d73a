"""Kernels on triangles: closest point, inside of a mesh, thickness of walls."""

from __future__ import annotations

import numpy as np

from ...kernels.jit import exact, exact_subroutine
from .box_tree import LEAF, STACK, box_distance


@exact_subroutine
def _nearest_weights(uu, ww, vv, pp, pb, pc, uv, pu, pv):  # type: ignore[no-untyped-def]
    """
    Return the weights of b and c of the closest point on the edges of a triangle a b c.

    Parameters
    ----------
    uu, ww, vv
        Squared lengths of a b, b c and a c, m².
    pp, pb, pc
        Squared distances of the point from a, b and c, m².
    uv, pu, pv
        Products of a b and a c with each other, and with the vector from a to the point, m².

    """
    t = min(max(pu / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    best = pp + t * (t * uu - 2.0 * pu)
    v, w = t, 0.0
    pw = pv - pu - uv + uu
    t = min(max(pw / ww, 0.0), 1.0) if ww > 0.0 else 0.0
    other = pb + t * (t * ww - 2.0 * pw)
    if other < best:
        best, v, w = other, 1.0 - t, t
    t = min(max(pv / vv, 0.0), 1.0) if vv > 0.0 else 0.0
    if pp + t * (t * vv - 2.0 * pv) < best:
        v, w = 0.0, t
    return v, w


@exact_subroutine
def closest_point(corners, n, x, y, z):  # type: ignore[no-untyped-def]
    """Return the point of triangle `n` that is closest to x y z; it may be degenerate."""
    ax, ay, az = corners[n, 0, 0], corners[n, 0, 1], corners[n, 0, 2]
    ux, uy, uz = corners[n, 1, 0] - ax, corners[n, 1, 1] - ay, corners[n, 1, 2] - az
    vx, vy, vz = corners[n, 2, 0] - ax, corners[n, 2, 1] - ay, corners[n, 2, 2] - az
    px, py, pz = x - ax, y - ay, z - az
    uu = ux * ux + uy * uy + uz * uz
    uv = ux * vx + uy * vy + uz * vz
    vv = vx * vx + vy * vy + vz * vz
    pu = px * ux + py * uy + pz * uz
    pv = px * vx + py * vy + pz * vz
    # Weights of b and c of the projection, times the squared area of the parallelogram.
    area = uu * vv - uv * uv
    s = vv * pu - uv * pv
    t = uu * pv - uv * pu
    if area > 1e-12 * uu * vv and s >= 0.0 and t >= 0.0 and s + t <= area:
        s, t = s / area, t / area
    else:
        pp = px * px + py * py + pz * pz
        pb, pc, ww = pp - 2.0 * pu + uu, pp - 2.0 * pv + vv, uu - 2.0 * uv + vv
        s, t = _nearest_weights(uu, ww, vv, pp, pb, pc, uv, pu, pv)
    return ax + s * ux + t * vx, ay + s * uy + t * vy, az + s * uz + t * vz


@exact_subroutine
def closest(bounds, items, corners, x, y, z, guess, stack):  # type: ignore[no-untyped-def]
    """
    Find the triangle that is closest to a point.

    Parameters
    ----------
    bounds, items
        Tree of the triangles.
    corners
        m, shape (n, 3, 3).
    x, y, z
        The point, m.
    guess
        A triangle that is probably close; others that are farther away are not looked at.
    stack
        Scratch, int64, shape (STACK,).

    Returns
    -------
    (float, int)
        Squared distance, m², and the triangle.

    """
    leaves = len(bounds) // 2
    px, py, pz = closest_point(corners, guess, x, y, z)
    px, py, pz = px - x, py - y, pz - z
    best, found = px * px + py * py + pz * pz, guess
    stack[0], depth = 1, 1
    while depth:
        depth -= 1
        node = stack[depth]
        if box_distance(bounds, node, x, y, z) >= best:
            continue
        if node < leaves:
            left, right = 2 * node, 2 * node + 1
            if box_distance(bounds, left, x, y, z) < box_distance(bounds, right, x, y, z):
                left, right = right, left
            stack[depth], stack[depth + 1] = left, right  # the nearer one is next
            depth += 2
            continue
        first = LEAF * (node - leaves)
        for k in range(first, min(first + LEAF, len(items))):
            px, py, pz = closest_point(corners, items[k], x, y, z)
            px, py, pz = px - x, py - y, pz - z
            squared = px * px + py * py + pz * pz
            if squared < best:
                best, found = squared, items[k]
    return best, found


@exact
def fill_distances(  # type: ignore[no-untyped-def]
    bounds, items, corners, origin, cell, first, last, coarse, near, stride, values, owners
):
    """
    Write the distances of nodes from the mesh, without a sign.

    They are exact in blocks near the mesh, and elsewhere interpolated from corners of blocks.

    Parameters
    ----------
    bounds, items, corners
        As in `closest`.
    origin, cell
        Of the nodes, m.
    first, last
        Range of the first index to fill.
    coarse
        Distances of every `stride`-th node along each axis, m.
    near
        Which blocks of nodes are near the mesh, bool, shape that of `coarse`.
    stride
        Cells along the edge of a block.
    values, owners
        Receive the distances, m, and the closest triangles, or -1 where interpolated; shape
        (nx, ny, nz).

    """
    stack = np.empty(STACK, np.int64)
    start = items[0]
    for i in range(first, last):
        for j in range(values.shape[1]):
            found = start
            for k in range(values.shape[2]):
                a, b, c = i // stride, j // stride, k // stride
                if near[a, b, c]:
                    x, y, z = origin[0] + i * cell, origin[1] + j * cell, origin[2] + k * cell
                    squared, found = closest(bounds, items, corners, x, y, z, found, stack)
                    values[i, j, k], owners[i, j, k] = np.sqrt(squared), found
                    start = found
                    continue
                u, v, w = i % stride / stride, j % stride / stride, k % stride / stride
                total = 0.0
                for n in range(8):
                    p, q, r = n // 4, n // 2 % 2, n % 2
                    weight = (u if p else 1.0 - u) * (v if q else 1.0 - v)
                    weight *= w if r else 1.0 - w
                    if weight > 0.0:  # the last nodes have no block behind them
                        total += weight * coarse[a + p, b + q, c + r]
                values[i, j, k], owners[i, j, k] = total, -1


@exact
def find_feet(corners, points, triangles, feet):  # type: ignore[no-untyped-def]
    """Write the closest point of a triangle each, m, shape (n, 3)."""
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        feet[n, 0], feet[n, 1], feet[n, 2] = closest_point(corners, triangles[n], x, y, z)


@exact_subroutine
def _crossing(vertices, a, b, x, y):  # type: ignore[no-untyped-def]
    """
    Return 1, -1 or 0: whether edge a b, seen along z, crosses the ray from x y towards +x.

    Computed alike for both directions of an edge, so that the sum over a closed mesh is exactly
    zero, and no point is missed between two triangles or counted twice.
    """
    direction = 1
    if a > b:
        a, b, direction = b, a, -1
    if (vertices[a, 1] > y) == (vertices[b, 1] > y):
        return 0
    ex, ey = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
    side = ex * (y - vertices[a, 1]) - ey * (x - vertices[a, 0])
    if ey > 0.0:
        return direction if side > 0.0 else 0
    return -direction if side < 0.0 else 0


@exact_subroutine
def _height(vertices, a, b, c, x, y):  # type: ignore[no-untyped-def]
    """Return z where the line along z through x y meets a triangle, m."""
    ux, uy = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
    vx, vy = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1]
    az, bz, cz = vertices[a, 2], vertices[b, 2], vertices[c, 2]
    low, high = min(az, bz, cz), max(az, bz, cz)
    area = ux * vy - uy * vx
    if area == 0.0:
        return low
    px, py = x - vertices[a, 0], y - vertices[a, 1]
    s, t = (px * vy - py * vx) / area, (ux * py - uy * px) / area
    return min(max(az + s * (bz - az) + t * (cz - az), low), high)


@exact
def add_crossings(vertices, triangles, origin, cell, steps):  # type: ignore[no-untyped-def]
    """
    Add, where the lines of nodes along z cross the mesh, the change of the winding number.

    Parameters
    ----------
    vertices, triangles
        Of a closed mesh, m, shape (n, 3), and indices, shape (m, 3).
    origin, cell
        Of the nodes, m.
    steps
        Shape (nx, ny, nz + 1), int16.  At the first node behind each crossing 1 is added where
        the line enters, -1 where it leaves; the sum along z is the winding number.

    """
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for n in range(len(triangles)):
        a, b, c = triangles[n, 0], triangles[n, 1], triangles[n, 2]
        for axis in range(2):
            p, q, r = vertices[a, axis], vertices[b, axis], vertices[c, axis]
            start = np.floor((min(p, q, r) - origin[axis]) / cell)
            end = np.ceil((max(p, q, r) - origin[axis]) / cell)
            low[axis] = max(np.int64(start), np.int64(0))
            high[axis] = min(np.int64(end), np.int64(steps.shape[axis] - 1))
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                x, y = origin[0] + i * cell, origin[1] + j * cell
                turns = (
                    _crossing(vertices, a, b, x, y)
                    + _crossing(vertices, b, c, x, y)
                    + _crossing(vertices, c, a, x, y)
                )
                if turns:
                    z = (_height(vertices, a, b, c, x, y) - origin[2]) / cell
                    k = min(max(np.int64(np.ceil(z)), 0), steps.shape[2] - 1)
                    steps[i, j, k] -= turns


@exact_subroutine
def _box_on_ray(bounds, node, start, normal, length):  # type: ignore[no-untyped-def]
    """Return whether a segment from `start` against a normal meets a box of the tree."""
    first, last = 0.0, length
    for axis in range(3):
        low, high = bounds[node, axis] - start[axis], bounds[node, 3 + axis] - start[axis]
        if normal[axis] == 0.0:
            if low > 0.0 or high < 0.0:
                return False
            continue
        s, t = -low / normal[axis], -high / normal[axis]
        first, last = max(first, min(s, t)), min(last, max(s, t))
    return first <= last


@exact_subroutine
def _wall(corners, normals, m, start, normal, length, cosine):  # type: ignore[no-untyped-def]
    """Return how far the segment from `start` goes until triangle `m`; infinity without one."""
    cx, cy, cz = normals[m, 0], normals[m, 1], normals[m, 2]
    product = cx * normal[0] + cy * normal[1] + cz * normal[2]
    if product > cosine:
        return np.inf
    ax, ay, az = corners[m, 0, 0], corners[m, 0, 1], corners[m, 0, 2]
    t = (cx * (start[0] - ax) + cy * (start[1] - ay) + cz * (start[2] - az)) / product
    # Where bodies touch, the face of the other one lies in the point itself.
    if not 1e-4 * length < t < length:
        return np.inf
    x, y, z = start[0] - t * normal[0], start[1] - t * normal[1], start[2] - t * normal[2]
    px, py, pz = closest_point(corners, m, x, y, z)
    px, py, pz = px - x, py - y, pz - z
    return t if px * px + py * py + pz * pz <= (1e-6 * length) ** 2 else np.inf


@exact
def find_walls(  # type: ignore[no-untyped-def]
    bounds, items, corners, normals, points, triangles, length, cosine, thickness
):
    """
    Measure the mesh from points on it straight inwards to a surface that faces the other way.

    Parameters
    ----------
    bounds, items, corners
        As in `closest`.
    normals
        Of the triangles, shape (n, 3).
    points, triangles
        Where to measure, m, shape (k, 3), and on which triangle, shape (k,).
    length
        Longest thickness that is found, m.
    cosine
        Only surfaces whose normals have a product of at most this count; negative.
    thickness
        Receives the thickness, m, shape (k,); infinite where none is found.

    """
    stack = np.empty(STACK, np.int64)
    leaves = len(bounds) // 2
    for n in range(len(points)):
        start, normal = points[n], normals[triangles[n]]
        best = np.inf
        stack[0], depth = 1, 1
        while depth:
            depth -= 1
            node = stack[depth]
            if not _box_on_ray(bounds, node, start, normal, min(best, length)):
                continue
            if node < leaves:
                stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
                depth += 2
                continue
            first = LEAF * (node - leaves)
            for k in range(first, min(first + LEAF, len(items))):
                found = _wall(corners, normals, items[k], start, normal, length, cosine)
                best = min(best, found)
        thickness[n] = best
