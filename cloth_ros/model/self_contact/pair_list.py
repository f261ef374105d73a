"""
Pairs of features of the sheet that are near each other, in a list with a margin.

The sheet is divided into tiles of some cells.  Tiles whose bounds are near each other are searched
cell by cell, and near cells feature by feature.  Neighbouring tiles are left out where the sheet
is flat.  The order of the pairs is that of their tiles, cells and features, whatever the positions
are: results that depend on the order do not depend on when a list was made.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .closest_features import closest
from .flatness import TILE


@exact
def bound_cells(before, after, rows, columns, cells, tiles):  # type: ignore[no-untyped-def]
    """
    Write the bounds of all cells and tiles on a linear path.

    Parameters
    ----------
    before, after
        Positions, m, shape (rows * columns, 3), double precision.
    rows, columns
        Of the sheet.  Each particle begins a cell; those of the last row and column are lines.
    cells, tiles
        Receive least and greatest coordinates, m: shapes (rows * columns, 6) and (tiles, 6).

    """
    across = (columns + TILE - 1) // TILE
    tiles[:, :3] = np.inf
    tiles[:, 3:] = -np.inf
    for row in range(rows):
        below = columns if row + 1 < rows else 0
        for column in range(columns):
            beside = 1 if column + 1 < columns else 0
            i = row * columns + column
            tile = row // TILE * across + column // TILE
            for axis in range(3):
                low, high = np.inf, -np.inf
                for x in (before, after):
                    a, b = x[i, axis], x[i + beside, axis]
                    c, d = x[i + below, axis], x[i + below + beside, axis]
                    low = min(low, a, b, c, d)
                    high = max(high, a, b, c, d)
                cells[i, axis], cells[i, 3 + axis] = low, high
                tiles[tile, axis] = min(tiles[tile, axis], low)
                tiles[tile, 3 + axis] = max(tiles[tile, 3 + axis], high)


@exact_inlined
def gap_squared(first, i, second, j):  # type: ignore[no-untyped-def]
    """Return the squared distance of two boxes, m²."""
    x = max(first[i, 0] - second[j, 3], second[j, 0] - first[i, 3], 0.0)
    y = max(first[i, 1] - second[j, 4], second[j, 1] - first[i, 4], 0.0)
    z = max(first[i, 2] - second[j, 5], second[j, 2] - first[i, 5], 0.0)
    return x * x + y * y + z * z


@exact
def find_near_tiles(tiles, across, flat, reach, pairs):  # type: ignore[no-untyped-def]
    """
    List the pairs of tiles that may be nearer than `reach`, m.

    Parameters
    ----------
    tiles, across
        Bounds of the tiles, and their number along a row.
    flat
        From `find_flat`: such a tile is not paired with itself and its neighbours.
    reach
        m.
    pairs
        Receives the pairs, shape (n, 2); those beyond its length are counted only.

    Returns
    -------
    (int, float)
        Number of pairs, and the least distance of the tiles that are neither near nor neighbours,
        m.

    """
    count, clear = 0, np.inf
    for a in range(len(tiles)):
        row, column = a // across, a % across
        for b in range(a, len(tiles)):
            neighbours = b // across - row <= 1 and abs(b % across - column) <= 1
            if neighbours and (flat[a] or flat[b]):
                continue
            gap = gap_squared(tiles, a, tiles, b)
            if gap > reach * reach:
                if not neighbours:
                    clear = min(clear, gap)
                continue
            if count < len(pairs):
                pairs[count, 0], pairs[count, 1] = a, b
            count += 1
    return count, np.sqrt(clear)


@exact
def bound_features(before, after, rows, columns, boxes):  # type: ignore[no-untyped-def]
    """
    Write the bounds of the features of each cell on a linear path.

    Parameters
    ----------
    before, after, rows, columns
        As in `bound_cells`.
    boxes
        Receives least and greatest coordinates, m, of the vertex, the three edges and the two
        triangles of each cell: shape (6, rows * columns, 6).  Those that there are not are at
        infinity.

    """
    for cell in range(rows * columns):
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
def _append(out, normals, gaps, count, x, edges, i, j, k, h, reach, motion):  # type: ignore[no-untyped-def]
    """Append a pair unless it is out of reach; return the number of pairs."""
    d, nx, ny, nz, _, _, _, _ = closest(x, edges, i, j, k, h)
    if d > reach:
        return count
    if count < len(out):
        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = i, j, k, h
        normals[count, 0], normals[count, 1], normals[count, 2] = nx, ny, nz
        gaps[count] = d - motion
    return count + 1


@exact_inlined
def _pairs_of_cells(  # type: ignore[no-untyped-def]
    after, boxes, a, b, rows, columns, reach, exact_reach, motion, edges, out, normals, gaps, count
):
    """Append the pairs of a vertex, or an edge, of a cell and triangles, or edges, of another."""
    if edges:
        for m in range(3):
            i, j = _edge(a, m, rows, columns)
            for n in range(3):
                if _apart(boxes, 1 + m, a, 1 + n, b, reach):
                    continue
                k, h = _edge(b, n, rows, columns)
                if i != k and i != h and j != k and j != h:
                    count = _append(
                        out, normals, gaps, count, after, True, i, j, k, h, exact_reach, motion
                    )
        return count
    for n in range(2):
        if _apart(boxes, 0, a, 4 + n, b, reach):
            continue
        j, k, h, _ = _triangle(b, n, rows, columns)
        if a != j and a != k and a != h:
            count = _append(
                out, normals, gaps, count, after, False, a, j, k, h, exact_reach, motion
            )
    return count


@exact
def find_pairs(  # type: ignore[no-untyped-def]
    after, rows, columns, cells, tiles, boxes, tile_pairs, reach, swept, motion, edges, out,
    normals, gaps,
):  # fmt: skip
    """
    List the pairs of vertices and triangles, or of edges, that may come into reach.

    Parameters
    ----------
    after, rows, columns, cells, tiles
        As in `bound_cells`.
    boxes
        From `bound_features`.
    tile_pairs
        From `find_near_tiles`.
    reach
        m.
    swept
        True for a list that is complete all along the path; False for one at its end.
    motion
        How far the features of a pair may have moved relative to each other on the path, m.
    edges
        True for pairs of edges, False for pairs of a vertex and a triangle.
    out, normals, gaps
        Receive the particles of each pair, shape (n, 4); a unit vector, shape (n, 3); and a bound
        of the gap along it at the start of the path, m, shape (n,).  Pairs beyond their length are
        counted only.

    Returns
    -------
    int
        Number of pairs.

    """
    count = 0
    across = (columns + TILE - 1) // TILE
    exact_reach = np.inf if swept else reach
    for p in range(len(tile_pairs)):
        s, t = tile_pairs[p, 0], tile_pairs[p, 1]
        for r in range(s // across * TILE, min((s // across + 1) * TILE, rows)):
            for c in range(s % across * TILE, min((s % across + 1) * TILE, columns)):
                a = r * columns + c
                if gap_squared(cells, a, tiles, t) > reach * reach:
                    continue
                for q in range(t // across * TILE, min((t // across + 1) * TILE, rows)):
                    for d in range(t % across * TILE, min((t % across + 1) * TILE, columns)):
                        b = q * columns + d
                        if (s == t and b < a) or gap_squared(cells, a, cells, b) > reach * reach:
                            continue
                        if not edges or a != b:
                            count = _pairs_of_cells(
                                after, boxes, a, b, rows, columns, reach, exact_reach, motion,
                                edges, out, normals, gaps, count,
                            )  # fmt: skip
                        if not edges and a != b:
                            count = _pairs_of_cells(
                                after, boxes, b, a, rows, columns, reach, exact_reach, motion,
                                edges, out, normals, gaps, count,
                            )  # fmt: skip
    return count
