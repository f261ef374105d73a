"""
Search of a pair list for contacts, and for pairs whose path is not proven to be free.

A pair is in contact if it is nearer than its distance at rest, or if it is within reach and would
be nearer than its distance at rest after the next part.

The path of a pair from the last accepted positions is accepted if the pair stays farther apart on
it than `SAFE` times the thickness, or than half of its distance at the start if that is less.
Most pairs are decided by the unit vector that is stored with them: the gap along it is at most
their distance.  It only saves time: a pair that it decides would be decided in the same way
without it, so that results do not depend on when a list was made.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .closest_features import closest, separation
from .linear_path import stays_apart

# Least reach, in thicknesses: within it, pairs are in contact before they are too near.
REACH = 1.25
# Distance, in thicknesses, at which two edges rest: layers rest on the vertices, which would press
# on the edges as well where edges of both layers cross.
EDGES = 0.85
# Distance, in thicknesses, that pairs keep on their paths, unless they begin nearer.
SAFE = 0.25
# Distance, in thicknesses, to which pairs may approach: so far, a direction between them is well
# defined.  Pairs that begin nearer may lose this share of their distance on a path.
_LEAST, _STAYING = 0.05, 0.98
# By how much a gap must exceed a distance that is compared with a computed one: rounding.
_ROUNDING = 1e-5

# Columns of a contact: weights of its particles, normal, distance, distance at rest, and whether
# its path was not accepted.
WEIGHTS, NORMAL, DISTANCE, REST, BLOCKED = 0, 4, 7, 8, 9
CONTACT = 10
# Numbers about a vertex: the vectors of its last two contacts with an edge or a corner, m; and the
# share of their length by which two are different.
LAST = 6
_SAME = 1e-6


@exact_inlined
def _known(last, i, nx, ny, nz, d):  # type: ignore[no-untyped-def]
    """Return whether one of the last two contacts of a vertex has the same vector; note this."""
    x, y, z = d * nx, d * ny, d * nz
    for n in range(0, LAST, 3):
        u, v, w = x - last[i, n], y - last[i, n + 1], z - last[i, n + 2]
        if u * u + v * v + w * w < _SAME * _SAME * d * d:
            return True
    last[i, 3], last[i, 4], last[i, 5] = last[i, 0], last[i, 1], last[i, 2]
    last[i, 0], last[i, 1], last[i, 2] = x, y, z
    return False


@exact
def search(  # type: ignore[no-untyped-def]
    before, now, ahead, pairs, normals, gaps, vertices, chosen, every, slack, again, thickness,
    reach, margin, last, particles, contacts,
):  # fmt: skip
    """
    List the contacts of a pair list, and the pairs whose path is not accepted.

    Parameters
    ----------
    before, now, ahead
        Positions, m, shape (n, 3), double precision: the last accepted ones, those to be
        accepted, and those expected after the next part.
    pairs, normals, gaps
        Of the list: particles, a unit vector, and the gap along it at the last accepted
        positions, m.  The latter two are updated.
    vertices
        Number of pairs, at the beginning of the list, of a vertex and a triangle.
    chosen, every
        Indices of the pairs that are looked at, shape (m,); or True for all of them, and those
        that are not farther than `margin` from contact are then written to `chosen`.
    slack
        By how much the gaps may have decreased since they were computed, m.
    again
        True for a second search with the same accepted positions, which the gaps are not of.
    thickness, reach, margin
        m.
    last
        Scratch: shape (n, LAST).
    particles, contacts
        Receive the contacts, shapes (m, 4) and (m, CONTACT); those beyond their length are
        counted only.

    Returns
    -------
    (int, int, int, float)
        Number of contacts, of those whose path is not accepted, and of chosen pairs; the least
        distance, m, of pairs that were not known to be apart.

    """
    last[...] = 0.0
    count, blocked, near, nearest = 0, 0, 0, np.inf
    safe = SAFE * thickness
    for q in range(len(pairs) if every else len(chosen)):
        p = q if every else np.int64(chosen[q])
        edges = p >= vertices
        rest = EDGES * thickness if edges else thickness
        i, j, k, h = pairs[p, 0], pairs[p, 1], pairs[p, 2], pairs[p, 3]
        nx, ny, nz = (
            np.float64(normals[p, 0]),
            np.float64(normals[p, 1]),
            np.float64(normals[p, 2]),
        )
        gap = separation(now, edges, i, j, k, h, nx, ny, nz)
        start = np.float64(gaps[p]) - slack
        if again:
            start = separation(before, edges, i, j, k, h, nx, ny, nz)
        known = min(start, gap) > safe * (1.0 + _ROUNDING)
        apart = rest * (1.0 + _ROUNDING)
        if (
            known
            and gap > apart
            and (
                gap > reach * (1.0 + _ROUNDING)
                or separation(ahead, edges, i, j, k, h, nx, ny, nz) > apart
            )
        ):
            gaps[p] = gap
            if every and gap <= apart + margin:
                chosen[near] = p
                near += 1
            continue
        d, nx, ny, nz, wi, wj, wk, wl = closest(now, edges, i, j, k, h)
        free = known
        if not free and d > safe * (1.0 + _ROUNDING):
            free = separation(before, edges, i, j, k, h, nx, ny, nz) > safe * (1.0 + _ROUNDING)
        if not free:
            d0, ax, ay, az, bi, bj, bk, bl = closest(before, edges, i, j, k, h)
            least = min(max(0.5 * min(safe, 0.5 * d0), _LEAST * thickness), _STAYING * d0)
            free = stays_apart(before, now, edges, i, j, k, h, least)
            if not free:
                d, nx, ny, nz, wi, wj, wk, wl = d0, ax, ay, az, bi, bj, bk, bl
        if every and d <= apart + margin:
            chosen[near] = p
            near += 1
        normals[p, 0], normals[p, 1], normals[p, 2] = nx, ny, nz
        gaps[p] = d if free else 0.0
        nearest = min(nearest, d)
        if free:
            # The ends of edges are in contact as vertices.
            if edges and (wi == 0.0 or wj == 0.0 or wk == 0.0 or wl == 0.0):
                continue
            if d >= rest:
                if d >= reach:
                    continue
                if closest(ahead, edges, i, j, k, h)[0] >= rest:
                    continue
            # A vertex next to an edge or a corner is in contact with one of the triangles there.
            beside = not edges and (wj == 0.0 or wk == 0.0 or wl == 0.0)
            if beside and _known(last, i, nx, ny, nz, d):
                continue
        else:
            blocked += 1
        if count < len(particles):
            particles[count, 0], particles[count, 1] = i, j
            particles[count, 2], particles[count, 3] = k, h
            contacts[count, WEIGHTS], contacts[count, WEIGHTS + 1] = wi, wj
            contacts[count, WEIGHTS + 2], contacts[count, WEIGHTS + 3] = wk, wl
            contacts[count, NORMAL], contacts[count, NORMAL + 1] = nx, ny
            contacts[count, NORMAL + 2], contacts[count, DISTANCE] = nz, d
            contacts[count, REST] = rest
            contacts[count, BLOCKED] = 0.0 if free else 1.0
        count += 1
    return count, blocked, near if every else len(chosen), nearest
