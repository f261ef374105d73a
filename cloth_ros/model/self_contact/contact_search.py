"""
Search of a pair list for contacts, in several threads.

Most pairs need no computation: a bound of the distance of a pair that was found once decreases by
how far the particles of both cells have moved since then, and pairs of the same cells are looked
at only if the least of their bounds is in reach.  Others are decided by the unit vector that is
stored with them: the gap along it is at most their distance.  Both only save time: a pair that
they decide would be decided in the same way without them, so that results do not depend on when a
list was made.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from ..kernels.thread_pool import barrier, claim_chunk, mark_done, notify
from .closest_features import closest, separation
from .pair_list import CHUNKS, chunk_range

# Least reach, in thicknesses: within it, pairs are in contact before they are too near.
REACH = 1.25
# Distance, in thicknesses, at which a vertex is in contact even if it does not approach:
# vibrations of springs may let it.
_NEAR = 1.1
# Approach, in thicknesses, up to which edges are in contact only if they are near: the vertices of
# layers that are as slow keep them apart.
_SLOW = 0.25
# Rows or columns from one feature to another from which they are in contact before they are near:
# those that are nearer in the sheet hardly approach each other otherwise than by vibrations.
_APART = 4
# Distance, in thicknesses, at which two edges rest: layers rest on the vertices, which would press
# on the edges as well where edges of both layers cross.
EDGES = 0.85
# Share of the distance at rest to which features that are near in the sheet may come without being
# parted: a sharp fold leaves them no more.
_FOLDED = 0.5
# By how much a gap must exceed a distance that is compared with a computed one: rounding.
ROUNDING = 1e-5
# Numbers about a pair that was found: weights of its particles, unit vector, distance and distance
# at rest, m.
FOUND = 9


@exact_inlined
def _beside(i, j, columns):  # type: ignore[no-untyped-def]
    """Return whether two particles are near each other in the sheet."""
    i, j = np.int64(i), np.int64(j)
    down, across = i // columns - j // columns, i % columns - j % columns
    return max(abs(down), abs(across)) < _APART


@exact_inlined
def least_of(distances, first, last):  # type: ignore[no-untyped-def]
    """Return the least of some distances."""
    least = np.inf
    for p in range(first, last):
        least = min(least, distances[p])
    return least


@exact_inlined
def _find_in_group(  # type: ignore[no-untyped-def]
    g, edges, now, ahead, motions, pairs, normals, distances, groups, odometer, offset, reach,
    near, rest, thickness, foreseen, columns, found, found_particles, count, end,
):  # fmt: skip
    """Append the pairs of a group that are in contact; return their number and least distance."""
    least = np.inf
    for pair in range(groups[g, 0], groups[g, 1]):
        p = np.uint64(pair)
        if distances[p] - odometer >= reach:
            continue
        i, j = np.uint64(pairs[p, 0]), np.uint64(pairs[p, 1])
        k, h = np.uint64(pairs[p, 2]), np.uint64(pairs[p, 3])
        if edges:
            approach = max(motions[i], motions[j]) + max(motions[k], motions[h])
        else:
            approach = motions[i] + max(motions[j], motions[k], motions[h])
        most = near
        if not edges or approach > _SLOW * thickness:
            most = max(near, rest + min(approach, foreseen))
        if distances[p] - odometer >= most:
            continue
        nx, ny, nz = (
            np.float64(normals[p, 0]), np.float64(normals[p, 1]), np.float64(normals[p, 2])
        )  # fmt: skip
        gap = separation(now, edges, i, j, k, h, nx, ny, nz)
        beside = _beside(i, k, columns)
        if gap > most * (1.0 + ROUNDING) or (gap > near * (1.0 + ROUNDING) and beside):
            distances[p] = gap + offset
            continue
        d, nx, ny, nz, wi, wj, wk, wl = closest(now, edges, i, j, k, h)
        normals[p, 0], normals[p, 1], normals[p, 2] = nx, ny, nz
        distances[p] = d + offset
        # The ends of edges are in contact as vertices.
        if d >= most or (edges and (wi == 0.0 or wj == 0.0 or wk == 0.0 or wl == 0.0)):
            continue
        if d >= near:
            if beside:
                continue
            expected = 0.0
            for axis, component in enumerate((nx, ny, nz)):
                origin = ahead[i, axis]
                expected += component * (
                    wj * (ahead[j, axis] - origin)
                    + wk * (ahead[k, axis] - origin)
                    + wl * (ahead[h, axis] - origin)
                )
            if expected >= rest:
                continue
        least = min(least, d)
        if count < end:
            f = np.uint64(count)
            found[f, 0], found[f, 1], found[f, 2], found[f, 3] = wi, wj, wk, wl
            found[f, 4], found[f, 5], found[f, 6] = nx, ny, nz
            found[f, 7] = d
            found[f, 8] = max(min(d, rest), _FOLDED * rest) if beside else rest
            found_particles[f, 0], found_particles[f, 1] = i, j
            found_particles[f, 2], found_particles[f, 3] = k, h
        count += 1
    return count, least


@exact
def find_contacts(  # type: ignore[no-untyped-def]
    notified, counters, thread, threads, now, ahead, motions, pairs, normals, distances, groups,
    nearest, vertices, offsets, odometers, motions_of_cells, thickness, foreseen, columns, found,
    found_particles, counts, least,
):  # fmt: skip
    """
    Find the pairs of a pair list that are in contact.

    A pair is in contact if it is near its distance at rest, or nearer; or if it would be nearer
    after the next part, along its present normal, and is not near in the sheet.

    Parameters
    ----------
    notified, counters, thread, threads
        From a `ThreadPool`.
    now, ahead, motions
        Positions, m, shape (n, 3), double precision, at the start of a part, and those expected
        at its end; and how far particles move, m, shape (n,).
    pairs, normals, distances
        Of the list: particles, shape (m, 4), a unit vector, shape (m, 3), and a bound of the
        distance, m: the present one is not less than that minus the `odometers` of both cells.
        The latter two are updated.
    groups, nearest
        First pair of each group, the row after its last one, and its cells, shape (k, 4), and the
        least of its bounds, m, which is updated, shape (k,).
    vertices
        Number of groups, at the beginning of the list, of vertices and triangles.
    offsets, odometers
        Numbers of both cells, m, shape (n,), that are added to a distance that was computed; and
        see above.
    motions_of_cells
        The greatest of the motions at the corners of each cell, m, or more: shape (n,).
    thickness, foreseen
        Of the sheet, and the longest approach that is foreseen, m.
    columns
        Of the sheet.
    found, found_particles
        Receive numbers about each pair in contact, shape (2 * CHUNKS * r, FOUND), and its
        particles: r rows for each chunk of the list.  Those beyond its rows are counted only.
    counts, least
        Receive the number of pairs in each chunk, and their least distance, m, inf if there is
        none: shape (2 * CHUNKS,).

    """
    notify(notified, thread)
    room = len(found) // (2 * CHUNKS)
    chunk = claim_chunk(counters, thread, threads, 2 * CHUNKS, 0)
    while chunk >= 0:
        edges = chunk >= CHUNKS
        first, number = (vertices, len(nearest) - vertices) if edges else (0, vertices)
        part = chunk - CHUNKS if edges else chunk
        rest = EDGES * thickness if edges else thickness
        near = rest if edges else _NEAR * thickness
        begin, shortest = chunk * room, np.inf
        count = begin
        first_group, last_group = chunk_range(number, part)
        for group in range(first + first_group, first + last_group):
            g = np.uint64(group)
            a, b = np.uint64(groups[g, 2]), np.uint64(groups[g, 3])
            odometer = odometers[a] + odometers[b]
            approach = motions_of_cells[a] + motions_of_cells[b]
            reach = max(near, rest + min(approach, foreseen))
            if nearest[g] - odometer >= reach:
                continue
            count, d = _find_in_group(
                g, edges, now, ahead, motions, pairs, normals, distances, groups, odometer,
                offsets[a] + offsets[b], reach, near, rest, thickness, foreseen, columns, found,
                found_particles, count, begin + room,
            )  # fmt: skip
            shortest = min(shortest, d)
            nearest[g] = least_of(distances, groups[g, 0], groups[g, 1])
        counts[chunk], least[chunk] = count - begin, shortest
        mark_done(counters)
        chunk = claim_chunk(counters, thread, threads, 2 * CHUNKS, 0)
    barrier(counters, 2 * CHUNKS, 0)
