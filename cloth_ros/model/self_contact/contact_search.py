"""
Search of a pair list for contacts, and for pairs whose path is not proven to be free.

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
from .closest_features import closest, separation
from .linear_path import stays_apart
from .sheet_contacts import (
    HARDNESS,
    INVERSE_MASSES,
    LACK,
    MASS,
    NORMAL,
    REST,
    SUPPORTED,
    WEIGHTS,
)
from .supports import UNSUPPORTED

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
_EDGES = 0.85
# Share of the distance at rest to which features that are near in the sheet may come without being
# parted: a sharp fold leaves them no more.
_FOLDED = 0.5
# Distance, as a share of that at rest, from which on nearer pairs are parted no harder.
_HARDEST = 0.05
# Distance, in thicknesses, that pairs keep on their paths, unless they begin nearer.
_SAFE = 0.25
# Distance, in thicknesses, to which pairs may approach: so far, a direction between them is well
# defined.  Pairs that begin nearer may lose this share of their distance on a path.
_LEAST, _STAYING = 0.05, 0.98
# By how much a gap must exceed a distance that is compared with a computed one: rounding.
_ROUNDING = 1e-5

# Inverse mass, in units of that of a cell, of a pair that cannot move.
_NO_MASS = 1e-3

# Numbers about a pair whose path is blocked, at the start of the path: weights of its particles,
# unit vector, distance and distance at rest.
BLOCKED = 9
# Numbers about a vertex: the normals of its last two contacts with an edge or a corner, and those
# of contacts with triangles; and from which difference, or up to which cosine of the angle between
# them, two are different.
LAST, FACES = 6, 6
_SAME, _ALIKE = 1e-5, 0.8


@exact_inlined
def _known(last, i, x, y, z):  # type: ignore[no-untyped-def]
    """Return whether one of the last two contacts of a vertex has this direction; note it."""
    for n in range(0, LAST, 3):
        u, v, w = x - last[i, n], y - last[i, n + 1], z - last[i, n + 2]
        if u * u + v * v + w * w < _SAME * _SAME:
            return True
    last[i, 3], last[i, 4], last[i, 5] = last[i, 0], last[i, 1], last[i, 2]
    last[i, 0], last[i, 1], last[i, 2] = x, y, z
    return False


@exact_inlined
def _beside(i, j, columns):  # type: ignore[no-untyped-def]
    """Return whether two particles are near each other in the sheet."""
    i, j = np.int64(i), np.int64(j)
    down, across = i // columns - j // columns, i % columns - j % columns
    return max(abs(down), abs(across)) < _APART


@exact_inlined
def _write_row(  # type: ignore[no-untyped-def]
    particles, rows, c, pairs, p, weights, nx, ny, nz, d, rest, inverse_masses, supports, begin,
    stride, columns,
):  # fmt: skip
    """Write a contact, as a `SheetContacts` has it."""
    number = rows.dtype.type
    mass, supported = 0.0, 0.0
    for n in range(4):
        w, particle = weights[n], np.int64(pairs[p, n])
        flat = begin + particle // columns * stride + particle % columns
        particles[c, n] = flat
        inverse = w * inverse_masses[particle]
        share = 1.0
        if supports[3, flat] > UNSUPPORTED:
            supported = 1.0
            into = nx * supports[0, flat] + ny * supports[1, flat] + nz * supports[2, flat]
            # It cannot be pushed into the collider.
            if w * into < 0.0:
                share = max(1.0 - into * into, 0.0)
        mass += share * w * inverse
        rows[c, WEIGHTS + n] = number(w)
        rows[c, INVERSE_MASSES + n] = number(inverse)
    rows[c, NORMAL], rows[c, NORMAL + 1], rows[c, NORMAL + 2] = (
        number(nx), number(ny), number(nz)
    )  # fmt: skip
    rows[c, REST] = number(rest)
    rows[c, LACK] = number(max(rest - d, 0.0))
    rows[c, HARDNESS] = number(max(rest / max(d, _HARDEST * rest), 1.0))
    rows[c, MASS] = number(1.0 / mass if mass > _NO_MASS else 0.0)
    rows[c, SUPPORTED] = number(supported)


@exact_inlined
def _faces(faces, i, nx, ny, nz, note):  # type: ignore[no-untyped-def]
    """Return whether a vertex is in contact with a triangle in a like direction, or note this."""
    for n in range(0, FACES, 3):
        x, y, z = faces[i, n], faces[i, n + 1], faces[i, n + 2]
        if nx * x + ny * y + nz * z > _ALIKE:
            return True
        if note and x == 0.0 and y == 0.0 and z == 0.0:
            faces[i, n], faces[i, n + 1], faces[i, n + 2] = nx, ny, nz
            return False
    return False


@exact_inlined
def _without_repeated(particles, rows, numbers, count, faces, last):  # type: ignore[no-untyped-def]
    """
    Remove contacts of a vertex with an edge or a corner that others repeat; return their number.

    That is so with one of the triangles there, and in the direction of a triangle that the vertex
    is above.
    """
    kept = 0
    for c in range(count):
        i = numbers[c]
        x, y, z = rows[c, NORMAL], rows[c, NORMAL + 1], rows[c, NORMAL + 2]
        beside = False
        for n in range(1, 4):
            beside = beside or rows[c, WEIGHTS + n] == 0.0
        if beside and (_faces(faces, i, x, y, z, False) or _known(last, i, x, y, z)):
            continue
        if kept < c:
            particles[kept] = particles[c]
            rows[kept] = rows[c]
        kept += 1
    return kept


@exact_inlined
def _least(distances, first, last):  # type: ignore[no-untyped-def]
    least = np.inf
    for p in range(first, last):
        least = min(least, distances[p])
    return least


@exact
def find_contacts(  # type: ignore[no-untyped-def]
    now, ahead, motions, pairs, normals, distances, groups, nearest, vertices, offsets, odometers,
    motions_of_cells, thickness, foreseen, inverse_masses, supports, begin, stride, columns, faces,
    last, numbers, particles, rows,
):  # fmt: skip
    """
    List the contacts of a pair list.

    A pair is in contact if it is near its distance at rest, or nearer; or if it would be nearer
    after the next part, along its present normal, and is not near in the sheet.

    Parameters
    ----------
    now, ahead, motions
        Positions, m, shape (n, 3), double precision, at the start of a part, and those expected
        at its end; and how far particles move, m, shape (n,).
    pairs, normals, distances
        Of the list: particles, shape (m, 4), a unit vector, shape (m, 3), and a bound of the
        distance, m: the present one is not less than that minus the `odometers` of both cells.
        The latter two are updated.
    groups, nearest
        First pair and cells of each group, shape (k + 1, 3), and the least of its bounds, m,
        which is updated, shape (k,).
    vertices
        Number of groups, at the beginning of the list, of vertices and triangles.
    offsets, odometers
        Numbers of both cells, m, shape (n,), that are added to a distance that was computed; and
        see above.
    motions_of_cells
        The greatest of the motions at the corners of each cell, m, or more: shape (n,).
    thickness, foreseen
        Of the sheet, and the longest approach that is foreseen, m.
    inverse_masses
        Of the particles, 0 for those that are held, shape (n,).
    supports
        As a `SheetContacts` has them.
    begin, stride, columns
        Layout of flat arrays.
    faces, last, numbers
        Scratch: shapes (n, FACES), (n, LAST), and that of `rows`, without its columns.
    particles, rows
        Receive the contacts, as a `SheetContacts` has them; those beyond their length are counted
        only.

    Returns
    -------
    (int, int, float)
        Number of contacts, and of rows that this takes; the least distance of a pair in contact,
        m.

    """
    faces[:] = 0.0
    last[:] = 0.0
    count, room, least = 0, 0, np.inf
    weights = np.empty(4)
    for g in range(len(nearest)):
        edges = g >= vertices
        if g == vertices:
            room = count
            if count <= len(rows):
                count = _without_repeated(particles, rows, numbers, count, faces, last)
        rest = _EDGES * thickness if edges else thickness
        near = rest if edges else _NEAR * thickness
        a, b = groups[g, 1], groups[g, 2]
        odometer = odometers[a] + odometers[b]
        approach = motions_of_cells[a] + motions_of_cells[b]
        if nearest[g] - odometer >= max(near, rest + min(approach, foreseen)):
            continue
        offset = offsets[a] + offsets[b]
        for p in range(groups[g, 0], groups[g + 1, 0]):
            i, j, k, h = pairs[p, 0], pairs[p, 1], pairs[p, 2], pairs[p, 3]
            if edges:
                approach = max(motions[i], motions[j]) + max(motions[k], motions[h])
            else:
                approach = motions[i] + max(motions[j], motions[k], motions[h])
            reach = near
            if not edges or approach > _SLOW * thickness:
                reach = max(near, rest + min(approach, foreseen))
            if distances[p] - odometer >= reach:
                continue
            nx, ny, nz = (
                np.float64(normals[p, 0]), np.float64(normals[p, 1]), np.float64(normals[p, 2])
            )  # fmt: skip
            gap = separation(now, edges, i, j, k, h, nx, ny, nz)
            if gap > reach * (1.0 + _ROUNDING) or (
                gap > near * (1.0 + _ROUNDING) and _beside(i, k, columns)
            ):
                distances[p] = gap + offset
                continue
            d, nx, ny, nz, wi, wj, wk, wl = closest(now, edges, i, j, k, h)
            normals[p, 0], normals[p, 1], normals[p, 2] = nx, ny, nz
            distances[p] = d + offset
            # The ends of edges are in contact as vertices.
            if d >= reach or (edges and (wi == 0.0 or wj == 0.0 or wk == 0.0 or wl == 0.0)):
                continue
            beside = _beside(i, k, columns)
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
            if not edges and wj != 0.0 and wk != 0.0 and wl != 0.0:
                _faces(faces, i, nx, ny, nz, True)
            if count < len(rows):
                weights[0], weights[1], weights[2], weights[3] = wi, wj, wk, wl
                numbers[count] = i
                kept = max(min(d, rest), _FOLDED * rest) if beside else rest
                _write_row(
                    particles, rows, count, pairs, p, weights, nx, ny, nz, d, kept,
                    inverse_masses, supports, begin, stride, columns,
                )  # fmt: skip
            count += 1
        nearest[g] = _least(distances, groups[g, 0], groups[g + 1, 0])
    if vertices == len(nearest):
        room = count
        if count <= len(rows):
            count = _without_repeated(particles, rows, numbers, count, faces, last)
    return count, max(room, count), least


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
        Receive the pairs, shapes (m, 4) and (m, BLOCKED); those beyond their length are counted
        only.

    Returns
    -------
    int
        Number of pairs.

    """
    count = 0
    safe = _SAFE * thickness
    least_gap = safe * (1.0 + _ROUNDING)
    for g in range(len(nearest)):
        a, b = groups[g, 1], groups[g, 2]
        odometer, offset = odometers[a] + odometers[b], offsets[a] + offsets[b]
        if not again and nearest[g] - odometer > least_gap:
            continue
        edges = g >= vertices
        for p in range(groups[g, 0], groups[g + 1, 0]):
            if not again and distances[p] - odometer > least_gap:
                continue
            i, j, k, h = pairs[p, 0], pairs[p, 1], pairs[p, 2], pairs[p, 3]
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
                rows[count, 8] = _EDGES * thickness if edges else thickness
            count += 1
        nearest[g] = _least(distances, groups[g, 0], groups[g + 1, 0])
    return count
