"""
Pairs of features of the sheet that are near each other, in a list with a margin.

The sheet is divided into tiles of some cells.  Tiles whose bounds are near each other are searched
cell by cell, and near cells feature by feature.  Neighbouring tiles are left out where the sheet
is flat.  The order of the pairs is that of their tiles, cells and features, whatever the positions
are: results that depend on the order do not depend on when a list was made.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_subroutine
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


@exact_subroutine
def gap_squared(boxes, i, j):  # type: ignore[no-untyped-def]
    """Return the squared distance of two boxes, m²."""
    x = max(boxes[i, 0] - boxes[j, 3], boxes[j, 0] - boxes[i, 3], 0.0)
    y = max(boxes[i, 1] - boxes[j, 4], boxes[j, 1] - boxes[i, 4], 0.0)
    z = max(boxes[i, 2] - boxes[j, 5], boxes[j, 2] - boxes[i, 5], 0.0)
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
            gap = gap_squared(tiles, a, b)
            if gap > reach * reach:
                if not neighbours:
                    clear = min(clear, gap)
                continue
            if count < len(pairs):
                pairs[count, 0], pairs[count, 1] = a, b
            count += 1
    return count, np.sqrt(clear)


@exact_subroutine
def _apart(before, after, a, b, k, i, j, reach):  # type: ignore[no-untyped-def]
    """Return whether the bounds of a feature of some corners and of i … j are out of reach."""
    for axis in range(3):
        low, high = np.inf, -np.inf
        for n in (a, b, k):
            low = min(low, before[n, axis], after[n, axis])
            high = max(high, before[n, axis], after[n, axis])
        first = min(before[i, axis], after[i, axis], before[j, axis], after[j, axis])
        last = max(before[i, axis], after[i, axis], before[j, axis], after[j, axis])
        if first - high > reach or low - last > reach:
            return True
    return False


@exact_subroutine
def _append(out, normals, gaps, count, x, edges, i, j, k, l, reach, motion):  # type: ignore[no-untyped-def]
    """Append a pair unless it is out of reach; return the number of pairs."""
    d, nx, ny, nz, _, _, _, _ = closest(x, edges, i, j, k, l)
    if d > reach:
        return count
    if count < len(out):
        out[count, 0], out[count, 1], out[count, 2], out[count, 3] = i, j, k, l
        normals[count, 0], normals[count, 1], normals[count, 2] = nx, ny, nz
        gaps[count] = d - motion
    return count + 1


@exact_subroutine
def _vertex_and_cell(  # type: ignore[no-untyped-def]
    before, after, v, cell, rows, columns, reach, exact_reach, motion, out, normals, gaps, count
):
    """Append the pairs of a vertex and the triangles of a cell."""
    if cell // columns + 1 >= rows or cell % columns + 1 >= columns:
        return count
    right, below = cell + 1, cell + columns
    for far in (cell, below + 1):
        if v != right and v != below and v != far:
            if not _apart(before, after, right, below, far, v, v, reach):
                count = _append(
                    out, normals, gaps, count, after, False, v, right, below, far, exact_reach,
                    motion,
                )
    return count


@exact_subroutine
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


@exact_subroutine
def _edges_of_cells(  # type: ignore[no-untyped-def]
    before, after, a, b, rows, columns, reach, exact_reach, motion, out, normals, gaps, count
):
    """Append the pairs of the edges of two cells."""
    for m in range(3):
        i, j = _edge(a, m, rows, columns)
        if i == j:
            continue
        for n in range(3):
            k, l = _edge(b, n, rows, columns)
            if k == l or i == k or i == l or j == k or j == l:
                continue
            if not _apart(before, after, k, l, l, i, j, reach):
                count = _append(
                    out, normals, gaps, count, after, True, i, j, k, l, exact_reach, motion
                )
    return count


@exact
def find_pairs(  # type: ignore[no-untyped-def]
    before, after, rows, columns, cells, tile_pairs, reach, swept, motion, edges, out,
    normals, gaps,
):
    """
    List the pairs of vertices and triangles, or of edges, that may come into reach.

    Parameters
    ----------
    before, after, rows, columns, cells
        As in `bound_cells`.
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
        of the gap along it at the start of the path, m, shape (n,).  Pairs beyond their length are counted only.

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
                for q in range(t // across * TILE, min((t // across + 1) * TILE, rows)):
                    for d in range(t % across * TILE, min((t % across + 1) * TILE, columns)):
                        b = q * columns + d
                        if (s == t and b < a) or gap_squared(cells, a, b) > reach * reach:
                            continue
                        if edges:
                            if a != b:
                                count = _edges_of_cells(
                                    before, after, a, b, rows, columns, reach, exact_reach, motion,
                                    out, normals, gaps, count,
                                )  # fmt: skip
                            continue
                        count = _vertex_and_cell(
                            before, after, a, b, rows, columns, reach, exact_reach, motion, out,
                            normals, gaps, count,
                        )  # fmt: skip
                        if a != b:
                            count = _vertex_and_cell(
                                before, after, b, a, rows, columns, reach, exact_reach, motion,
                                out, normals, gaps, count,
                            )  # fmt: skip
    return count


@exact
def farthest(before, now):  # type: ignore[no-untyped-def]
    """Return the greatest displacement of a particle beyond the mean of all, m."""
    number = len(now)
    x, y, z = 0.0, 0.0, 0.0
    for i in range(number):
        x += now[i, 0] - before[i, 0]
        y += now[i, 1] - before[i, 1]
        z += now[i, 2] - before[i, 2]
    x, y, z = x / number, y / number, z / number
    most = 0.0
    for i in range(number):
        u = now[i, 0] - before[i, 0] - x
        v = now[i, 1] - before[i, 1] - y
        w = now[i, 2] - before[i, 2] - z
        squared = u * u + v * v + w * w
        if not squared <= most:  # as for NaN
            most = squared
    return np.sqrt(most)
