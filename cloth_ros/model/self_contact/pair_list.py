"""
Pairs of features of the sheet that are near each other, in a list with a margin.

Pairs of cells that may touch are searched feature by feature: the order of the pairs is that of
their cells and features, whatever the positions are.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .closest_features import closest


@exact
def bound_features(before, after, rows, columns, cells, bounded, boxes):  # type: ignore[no-untyped-def]
    """
    Write the bounds of the features of some cells on a linear path.

    Parameters
    ----------
    before, after
        Positions at the start and the end of a linear path, m, shape (rows * columns, 3), double
        precision.
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
                low = min(before[i, axis], before[j, axis], before[k, axis])
                high = max(before[i, axis], before[j, axis], before[k, axis])
                boxes[box, cell, axis] = min(low, after[i, axis], after[j, axis], after[k, axis])
                boxes[box, cell, 3 + axis] = max(
                    high, after[i, axis], after[j, axis], after[k, axis]
                )
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
def _append(out, normals, distances, count, x, edges, i, j, k, h, reach):  # type: ignore[no-untyped-def]
    """Append a pair unless it is out of reach; return the number of pairs."""
    d, nx, ny, nz, _, _, _, _ = closest(x, edges, i, j, k, h)
    if d > reach:
        return count
    if count < len(out):
        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = i, j, k, h
        normals[count, 0], normals[count, 1], normals[count, 2] = nx, ny, nz
        distances[count] = d
    return count + 1


@exact_inlined
def _vertices_and_triangles(  # type: ignore[no-untyped-def]
    after, boxes, a, b, rows, columns, reach, exact_reach, out, normals, distances, count
):
    """Append the pairs of the vertex of a cell and the triangles of another."""
    for n in range(2):
        if _apart(boxes, 0, a, 4 + n, b, reach):
            continue
        j, k, h, _ = _triangle(b, n, rows, columns)
        if a != j and a != k and a != h:
            count = _append(out, normals, distances, count, after, False, a, j, k, h, exact_reach)
    return count


@exact
def find_pairs(  # type: ignore[no-untyped-def]
    after, rows, columns, boxes, cells, reach, margins, paths, edges, out, normals, distances,
    groups,
):  # fmt: skip
    """
    List the pairs of vertices and triangles, or of edges, that may come into reach.

    Parameters
    ----------
    after, rows, columns
        As in `bound_features`.
    boxes
        From there.
    cells
        Pairs of cells, shape (n, 2).
    reach
        m.
    margins
        How far the particles of each cell may move, m, shape (rows * columns,).
    paths
        How far they have moved on the path, m, shape (rows * columns,), if the list is to be
        complete all along it, and the boxes are those of the path; else 0.
    edges
        True for pairs of edges, False for pairs of a vertex and a triangle.
    out, normals, distances
        Receive the particles of each pair, shape (n, 4), a unit vector, shape (n, 3), and the
        distance, m, shape (n,).  Pairs beyond their length are counted only.
    groups
        Receives the first pair of each pair of cells: shape (n,).

    Returns
    -------
    int
        Number of pairs.

    """
    count = 0
    for p in range(len(cells)):
        a, b = cells[p, 0], cells[p, 1]
        groups[p] = count
        near = reach + margins[a] + margins[b]
        exact_reach = near + paths[a] + paths[b]
        if not edges:
            count = _vertices_and_triangles(
                after, boxes, a, b, rows, columns, near, exact_reach, out, normals, distances,
                count,
            )  # fmt: skip
            if a != b:
                count = _vertices_and_triangles(
                    after, boxes, b, a, rows, columns, near, exact_reach, out, normals, distances,
                    count,
                )  # fmt: skip
        elif a != b:
            for m in range(3):
                i, j = _edge(a, m, rows, columns)
                for n in range(3):
                    if _apart(boxes, 1 + m, a, 1 + n, b, near):
                        continue
                    k, h = _edge(b, n, rows, columns)
                    if i != k and i != h and j != k and j != h:
                        count = _append(
                            out, normals, distances, count, after, True, i, j, k, h, exact_reach
                        )
    return count
