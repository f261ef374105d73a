"""
Search of a pair list for pairs whose path is not proven to be free.

Most pairs need no computation: see `contact_search`.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact
from .closest_features import closest, separation
from .contact_search import EDGES, ROUNDING, least_of
from .linear_path import stays_apart

# Distance, in thicknesses, that pairs keep on their paths, unless they begin nearer.
_SAFE = 0.25
# Distance, in thicknesses, to which pairs may approach: so far, a direction between them is well
# defined.  Pairs that begin nearer may lose this share of their distance on a path.
_LEAST, _STAYING = 0.05, 0.98


@exact
def find_blocked(  # type: ignore[no-untyped-def]
    before, now, pairs, normals, distances, groups, nearest, vertices, offsets, odometers, again,
    shifted, thickness, particles, rows,
):  # fmt: skip
    """
    List the pairs of a pair list whose path is not accepted.

    A path from the last accepted positions is accepted if the pair stays farther apart on it than
    a quarter of the thickness, or than half of its distance at the start if that is less.

    Parameters
    ----------
    before, now
        Positions, m, shape (n, 3), double precision: the last accepted ones, and those to be
        accepted.
    pairs, normals, distances, groups, nearest, vertices, offsets, odometers, thickness
        As in `find_contacts`; `offsets` at the end of the path, `odometers` all along it.
    again, shifted
        True to look only at the pairs of particles that were shifted since the last search, with
        the same accepted positions: bool, shape (n,).
    particles, rows
        Receive the pairs, shapes (m, 4) and (m, FOUND); those beyond their length are counted
        only.

    Returns
    -------
    int
        Number of pairs.

    """
    count = 0
    safe = _SAFE * thickness
    least_gap = safe * (1.0 + ROUNDING)
    for group in range(len(nearest)):
        g = np.uint64(group)
        a, b = np.uint64(groups[g, 2]), np.uint64(groups[g, 3])
        odometer, offset = odometers[a] + odometers[b], offsets[a] + offsets[b]
        if not again and nearest[g] - odometer > least_gap:
            continue
        edges = group >= vertices
        for pair in range(groups[g, 0], groups[g, 1]):
            p = np.uint64(pair)
            if not again and distances[p] - odometer > least_gap:
                continue
            i, j = np.uint64(pairs[p, 0]), np.uint64(pairs[p, 1])
            k, h = np.uint64(pairs[p, 2]), np.uint64(pairs[p, 3])
            if again and not (shifted[i] or shifted[j] or shifted[k] or shifted[h]):
                continue
            nx, ny, nz = (
                np.float64(normals[p, 0]), np.float64(normals[p, 1]), np.float64(normals[p, 2])
            )  # fmt: skip
            gap = separation(now, edges, i, j, k, h, nx, ny, nz)
            if gap > least_gap and separation(before, edges, i, j, k, h, nx, ny, nz) > least_gap:
                distances[p] = gap + offset
                continue
            d, nx, ny, nz, wi, wj, wk, wl = closest(now, edges, i, j, k, h)
            free = d > least_gap and (
                separation(before, edges, i, j, k, h, nx, ny, nz) > least_gap
            )
            if not free:
                d0, ax, ay, az, bi, bj, bk, bl = closest(before, edges, i, j, k, h)
                least = min(max(0.5 * min(safe, 0.5 * d0), _LEAST * thickness), _STAYING * d0)
                free = stays_apart(before, now, edges, i, j, k, h, least)
                if not free:
                    d, nx, ny, nz, wi, wj, wk, wl = d0, ax, ay, az, bi, bj, bk, bl
            normals[p, 0], normals[p, 1], normals[p, 2] = nx, ny, nz
            distances[p] = d + offset if free else -np.inf
            if free:
                continue
            if count < len(particles):
                particles[count, 0], particles[count, 1] = i, j
                particles[count, 2], particles[count, 3] = k, h
                rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = wi, wj, wk, wl
                rows[count, 4], rows[count, 5], rows[count, 6] = nx, ny, nz
                rows[count, 7] = d
                rows[count, 8] = EDGES * thickness if edges else thickness
            count += 1
        nearest[g] = least_of(distances, groups[g, 0], groups[g, 1])
    return count
