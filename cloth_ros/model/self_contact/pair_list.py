"""
Pairs of features of the sheet that are near each other, in a list with a margin.

Pairs of cells that may touch are searched feature by feature: the order of the pairs is that of
their cells and features, whatever the positions are.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .closest_features import closest
from .motion import TILE


@exact
def bound_features(x, rows, columns, cells, bounded, boxes):  # type: ignore[no-untyped-def]
    """
    Write the bounds of the features of some cells.

    Parameters
    ----------
    x
        Positions, m, shape (rows * columns, 3), double precision.
    rows, columns
        Of the sheet.  Each particle begins a cell; those of the last row and column are lines.
    cells
        Pairs of cells, shape (n, 2).
    bounded
        Scratch: bool, shape (rows * columns,).
    boxes
        Receives least and greatest coordinates, m, of the vertex, the three edges and the two
        triangles of each cell: shape (6, rows * columns, 6).  Those that there are not are at
        infinity.

    """
    bounded[:] = False
    for p in range(2 * len(cells)):
        cell = cells[p // 2, p % 2]
        if bounded[cell]:
            continue
        bounded[cell] = True
        for n in range(6):
            if n < 3:
                i, j = _edge(cell, n, rows, columns)
                k, missing = i, i == j
                box = 1 + n
            elif n < 5:
                i, j, k, missing = _triangle(cell, n - 3, rows, columns)
                box = n + 1
            else:
                i, j, k, missing, box = cell, cell, cell, False, 0
            for axis in range(3):
                boxes[box, cell, axis] = min(x[i, axis], x[j, axis], x[k, axis])
                boxes[box, cell, 3 + axis] = max(x[i, axis], x[j, axis], x[k, axis])
                if missing:
                    boxes[box, cell, axis] = boxes[box, cell, 3 + axis] = np.inf


@exact_inlined
def _edge(cell, n, rows, columns):  # type: ignore[no-untyped-def]
    """Return the ends of edge n of a cell, the same particle twice if there is none."""
    beside = 1 if cell % columns + 1 < columns else 0
    below = columns if cell // columns + 1 < rows else 0
    if n == 0:
        return cell, cell + beside
    if n == 1:
        return cell, cell + below
    if beside and below:
        return cell + beside, cell + below
    return cell, cell


@exact_inlined
def _triangle(cell, n, rows, columns):  # type: ignore[no-untyped-def]
    """Return the corners of triangle n of a cell, and True if there is none."""
    if cell // columns + 1 >= rows or cell % columns + 1 >= columns:
        return cell, cell, cell, True
    return cell + n * (columns + 1), cell + 1, cell + columns, False


@exact_inlined
def _apart(boxes, m, a, n, b, reach):  # type: ignore[no-untyped-def]
    """Return whether the bounds of two features are out of reach."""
    for axis in range(3):
        if (
            boxes[m, a, axis] - boxes[n, b, 3 + axis] > reach
            or boxes[n, b, axis] - boxes[m, a, 3 + axis] > reach
        ):
            return True
    return False


@exact_inlined
def _append(out, normals, count, x, edges, i, j, k, h, reach):  # type: ignore[no-untyped-def]
    """Append a pair unless it is out of reach; return the number of pairs."""
    d, nx, ny, nz, _, _, _, _ = closest(x, edges, i, j, k, h)
    if d > reach:
        return count
    if count < len(out):
        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = i, j, k, h
        normals[count, 0], normals[count, 1], normals[count, 2] = nx, ny, nz
    return count + 1


@exact_inlined
def _vertices_and_triangles(  # type: ignore[no-untyped-def]
    x, boxes, a, b, rows, columns, reach, out, normals, count
):
    """Append the pairs of the vertex of a cell and the triangles of another."""
    for n in range(2):
        if _apart(boxes, 0, a, 4 + n, b, reach):
            continue
        j, k, h, _ = _triangle(b, n, rows, columns)
        if a != j and a != k and a != h:
            count = _append(out, normals, count, x, False, a, j, k, h, reach)
    return count


@exact
def find_pairs(x, rows, columns, boxes, cells, reach, motions, edges, out, normals):  # type: ignore[no-untyped-def]
    """
    List the pairs of vertices and triangles, or of edges, that may come into reach.

    Parameters
    ----------
    x, rows, columns
        As in `bound_features`.
    boxes
        From there.
    cells
        Pairs of cells, shape (n, 2).
    reach, motions
        Distance, m, up to which features are near; and motion of the particles of each tile for
        which the list is to be complete, m.
    edges
        True for pairs of edges, False for pairs of a vertex and a triangle.
    out, normals
        Receive the particles of each pair, shape (n, 4), and a unit vector, shape (n, 3).  Pairs
        beyond their length are counted only.

    Returns
    -------
    int
        Number of pairs.

    """
    count, least = 0, reach
    across = (columns + TILE - 1) // TILE
    for p in range(len(cells)):
        a, b = cells[p, 0], cells[p, 1]
        reach = least
        for cell in (a, b):
            reach += motions[cell // columns // TILE * across + cell % columns // TILE]
        if not edges:
            count = _vertices_and_triangles(
                x, boxes, a, b, rows, columns, reach, out, normals, count
            )
            if a != b:
                count = _vertices_and_triangles(
                    x, boxes, b, a, rows, columns, reach, out, normals, count
                )
        elif a != b:
            for m in range(3):
                i, j = _edge(a, m, rows, columns)
                for n in range(3):
                    if _apart(boxes, 1 + m, a, 1 + n, b, reach):
                        continue
                    k, h = _edge(b, n, rows, columns)
                    if i != k and i != h and j != k and j != h:
                        count = _append(out, normals, count, x, True, i, j, k, h, reach)
    return count
