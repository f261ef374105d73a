"""
The part of the sheet that a sphere may touch in a substep.

Rows whose swept bounds are out of the sphere's reach are skipped as a whole; of the others, the
cells are found whose own bounds are not, and then their particles and triangles.
"""

from __future__ import annotations

import numpy as np

from .compile import exact, reduction


@reduction
def _row_bounds(position, velocity, first, columns, h, out):  # type: ignore[no-untyped-def]
    """Write the bounds of a row over the substep that has just ended, and its speed squared."""
    for axis in range(3):
        low, high = position[axis, first], position[axis, first]
        for i in range(np.uint64(first), np.uint64(first + columns)):
            after = position[axis, i]
            before = after - h * velocity[axis, i]
            low = min(low, min(before, after))
            high = max(high, max(before, after))
        out[axis], out[3 + axis] = low, high
    greatest = velocity.dtype.type(0)
    for i in range(np.uint64(first), np.uint64(first + columns)):
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        greatest = max(greatest, u * u + v * v + w * w)
    out[6] = greatest


@exact
def _distance(bounds, low, high):  # type: ignore[no-untyped-def]
    """Return the distance between two boxes; `bounds` is one, low x y z, then high x y z."""
    total = 0.0
    for axis in range(3):
        apart = max(bounds[axis] - high[axis], low[axis] - bounds[3 + axis], 0.0)
        total += apart * apart
    return np.sqrt(total)


@exact
def find_cells(  # type: ignore[no-untyped-def]
    position, velocity, begin, stride, rows, columns, h, low, high, radius, sphere_speed, cells
):
    """
    Find the cells that may touch the sphere in the substep of `h` s that has just ended.

    Parameters
    ----------
    position, velocity
        Flat arrays after the substep.
    low, high
        Bounds of the path of the sphere's centre, m, shape (3,).
    radius, sphere_speed
        m and m/s.
    cells
        Receives row × columns + column of each cell found.

    Returns
    -------
    (int, float)
        Number of cells found, and the least distance from the sphere to any row, m.

    """
    down, across = min(rows - 1, 1), min(columns - 1, 1)
    bounds = np.empty((2, 7))
    single = np.empty(7, position.dtype)
    merged, box = np.empty(7), np.empty(6)
    count, clearance = 0, np.inf
    _row_bounds(position, velocity, begin, columns, h, single)
    bounds[0] = single
    for row in range(max(rows - 1, 1)):
        upper, lower = row % 2, (row + down) % 2
        _row_bounds(position, velocity, begin + (row + down) * stride, columns, h, single)
        bounds[lower] = single
        for axis in range(3):
            merged[axis] = min(bounds[upper, axis], bounds[lower, axis])
            merged[3 + axis] = max(bounds[upper, 3 + axis], bounds[lower, 3 + axis])
        # What is pushed in the sweep may leave its bounds by as much as it moves.
        speed = np.sqrt(max(bounds[upper, 6], bounds[lower, 6])) + sphere_speed
        reach = radius + h * speed
        distance = _distance(merged, low, high)
        clearance = min(clearance, distance - reach)
        if distance > reach:
            continue
        for column in range(max(columns - 1, 1)):
            i = begin + row * stride + column
            for axis in range(3):
                box[axis], box[3 + axis] = np.inf, -np.inf
                for j in (i, i + across, i + down * stride, i + down * stride + across):
                    after = np.float64(position[axis, j])
                    before = after - h * np.float64(velocity[axis, j])
                    box[axis] = min(box[axis], before, after)
                    box[3 + axis] = max(box[3 + axis], before, after)
            if _distance(box, low, high) <= reach:
                cells[count] = row * columns + column
                count += 1
    return count, clearance


@exact
def gather(cells, count, begin, stride, rows, columns, particles, local):  # type: ignore[no-untyped-def]
    """
    List the particles and the triangles of the found cells.

    Parameters
    ----------
    cells, count
        From `find_cells`.
    particles
        Receives the flat index of each particle once.
    local
        Scratch, shape (size,), all -1 before and after.

    Returns
    -------
    (int, array of int32, shape (triangles, 3))
        Number of particles, and the corners of the triangles as indices into them.

    """
    down, across = min(rows - 1, 1), min(columns - 1, 1)
    whole = down + across == 2
    triangles = np.empty((count * (4 if whole else 1), 3), np.int32)
    number = 0
    corner = np.empty(4, np.int32)
    for n in range(count):
        i = begin + cells[n] // columns * stride + cells[n] % columns
        for k in range(4):
            j = i + (k // 2) * down * stride + (k % 2) * across
            if local[j] < 0:
                local[j] = number
                particles[number] = j
                number += 1
            corner[k] = local[j]
        if whole:
            for k in range(4):  # each triangle leaves out one corner
                triangles[4 * n + k, 0] = corner[(k + 1) % 4]
                triangles[4 * n + k, 1] = corner[(k + 2) % 4]
                triangles[4 * n + k, 2] = corner[(k + 3) % 4]
        else:
            triangles[n, 0] = corner[0]
            triangles[n, 1] = corner[3]
            triangles[n, 2] = corner[3]
    for n in range(number):
        local[particles[n]] = -1
    return number, triangles
