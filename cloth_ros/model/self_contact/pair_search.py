"""
Search of pairs of cells for pairs of features that are near each other.

The order of the pairs of two cells is that of their features, whatever the positions are.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from ..kernels.thread_pool import barrier, claim_chunk, mark_done, notify
from .closest_features import closest
from .pair_list import CHUNKS, chunk_range


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
    m, a, n, b = np.uint64(m), np.uint64(a), np.uint64(n), np.uint64(b)
    for axis in range(3):
        if (
            boxes[m, a, axis] - boxes[n, b, 3 + axis] > reach
            or boxes[n, b, axis] - boxes[m, a, 3 + axis] > reach
        ):
            return True
    return False


@exact_inlined
def _append(out, normals, distances, count, end, x, edges, i, j, k, h, reach):  # type: ignore[no-untyped-def]
    """Append a pair unless it is out of reach; return the number of pairs."""
    i, j, k, h = np.uint64(i), np.uint64(j), np.uint64(k), np.uint64(h)
    d, nx, ny, nz, _, _, _, _ = closest(x, edges, i, j, k, h)
    if d > reach:
        return count
    if count < end:
        p = np.uint64(count)
        out[p, 0], out[p, 1], out[p, 2], out[p, 3] = i, j, k, h
        normals[p, 0], normals[p, 1], normals[p, 2] = nx, ny, nz
        distances[p] = d
    return count + 1


@exact_inlined
def _vertices_and_triangles(  # type: ignore[no-untyped-def]
    after, boxes, a, b, rows, columns, reach, exact_reach, out, normals, distances, count, end
):
    """Append the pairs of the vertex of a cell and the triangles of another."""
    for n in range(2):
        if _apart(boxes, 0, a, 4 + n, b, reach):
            continue
        j, k, h, _ = _triangle(b, n, rows, columns)
        if a != j and a != k and a != h:
            count = _append(
                out, normals, distances, count, end, after, False, a, j, k, h, exact_reach
            )
    return count


@exact_inlined
def _pairs_of_edges(  # type: ignore[no-untyped-def]
    after, boxes, a, b, rows, columns, reach, exact_reach, out, normals, distances, count, end
):
    """Append the pairs of the edges of two cells."""
    for m in range(3):
        i, j = _edge(a, m, rows, columns)
        for n in range(3):
            if _apart(boxes, 1 + m, a, 1 + n, b, reach):
                continue
            k, h = _edge(b, n, rows, columns)
            if i != k and i != h and j != k and j != h:
                count = _append(
                    out, normals, distances, count, end, after, True, i, j, k, h, exact_reach
                )
    return count


@exact
def find_pairs(  # type: ignore[no-untyped-def]
    notified, counters, thread, threads, after, rows, columns, boxes, cells, reach, margins, paths,
    edges, begin, room, out, normals, distances, groups, nearest, counts,
):  # fmt: skip
    """
    List the pairs of vertices and triangles, or of edges, that may come into reach.

    Parameters
    ----------
    notified, counters, thread, threads
        From a `ThreadPool`.
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
    begin, room
        First row of the pairs, and number of rows for each chunk of the pairs of cells.  Pairs
        beyond it are counted only.
    out, normals, distances
        Receive the particles of each pair, shape (m, 4), a unit vector, shape (m, 3), and the
        distance, m, shape (m,).
    groups, nearest
        Receive, from the first pair of cells of each chunk on, for those with a pair of features:
        the first pair, the row after its last one, and the cells, shape (n, 4); and the least
        distance, m, shape (n,).
    counts
        Receives the numbers of pairs and of groups of each chunk: shape (2, CHUNKS).

    """
    notify(notified, thread)
    chunk = claim_chunk(counters, thread, threads, CHUNKS, 0)
    while chunk >= 0:
        start = begin + chunk * room
        end, count = start + room, start
        first_cells, last_cells = chunk_range(len(cells), chunk)
        g = first_cells
        for p in range(first_cells, last_cells):
            a, b, first = cells[p, 0], cells[p, 1], count
            near = reach + margins[a] + margins[b]
            exact_reach = near + paths[a] + paths[b]
            if not edges:
                count = _vertices_and_triangles(
                    after, boxes, a, b, rows, columns, near, exact_reach, out, normals, distances,
                    count, end,
                )  # fmt: skip
                if a != b:
                    count = _vertices_and_triangles(
                        after, boxes, b, a, rows, columns, near, exact_reach, out, normals,
                        distances, count, end,
                    )  # fmt: skip
            elif a != b:
                count = _pairs_of_edges(
                    after, boxes, a, b, rows, columns, near, exact_reach, out, normals, distances,
                    count, end,
                )  # fmt: skip
            if first < count <= end:
                groups[g, 0], groups[g, 1], groups[g, 2], groups[g, 3] = first, count, a, b
                nearest[g] = np.min(distances[first:count])
                g += 1
        counts[0, chunk], counts[1, chunk] = count - start, g - first_cells
        mark_done(counters)
        chunk = claim_chunk(counters, thread, threads, CHUNKS, 0)
    barrier(counters, CHUNKS, 0)
