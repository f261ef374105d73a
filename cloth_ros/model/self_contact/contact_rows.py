"""Contacts from the pairs that a search has found: without those that others repeat."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .pair_list import CHUNKS
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

# Distance, as a share of that at rest, from which on nearer pairs are parted no harder.
_HARDEST = 0.05
# Inverse mass, in units of that of a cell, of a pair that cannot move.
_NO_MASS = 1e-3
# Numbers about a vertex: the normals of its last two contacts with an edge or a corner, and those
# of contacts with triangles; and from which difference, or up to which cosine of the angle between
# them, two are different.
LAST, FACES = 6, 6
_SAME, _ALIKE = 1e-5, 0.8


@exact_inlined
def _known(last, i, x, y, z):  # type: ignore[no-untyped-def]
    """Return whether one of the last two contacts of a vertex has this direction; note it."""
    i = np.uint64(i)
    for n in range(0, LAST, 3):
        u, v, w = x - last[i, n], y - last[i, n + 1], z - last[i, n + 2]
        if u * u + v * v + w * w < _SAME * _SAME:
            return True
    last[i, 3], last[i, 4], last[i, 5] = last[i, 0], last[i, 1], last[i, 2]
    last[i, 0], last[i, 1], last[i, 2] = x, y, z
    return False


@exact_inlined
def _write_row(  # type: ignore[no-untyped-def]
    particles, rows, c, found_particles, found, f, inverse_masses, supports, flat
):
    """Write the numbers about a contact, in the order in which a `SheetContacts` has them."""
    number = rows.dtype.type
    c, f = np.uint64(c), np.uint64(f)
    nx, ny, nz, d, rest = found[f, 4], found[f, 5], found[f, 6], found[f, 7], found[f, 8]
    mass, supported = 0.0, 0.0
    for n in range(4):
        w, particle = found[f, n], np.uint64(found_particles[f, n])
        place = np.uint64(flat[particle])
        particles[c, n] = place
        inverse = w * inverse_masses[particle]
        share = 1.0
        if supports[place, 3] > UNSUPPORTED:
            supported = 1.0
            into = nx * supports[place, 0] + ny * supports[place, 1] + nz * supports[place, 2]
            # It cannot be pushed into the collider.
            if w * into < 0.0:
                share = max(1.0 - into * into, 0.0)
        mass += share * w * inverse
        if n > 0:
            rows[c, WEIGHTS + n - 1] = number(w)
        rows[c, INVERSE_MASSES + n] = number(inverse)
    rows[c, NORMAL], rows[c, NORMAL + 1] = number(nx), number(ny)
    rows[c, NORMAL + 2] = number(nz)
    rows[c, REST] = number(rest)
    rows[c, LACK] = number(max(rest - d, 0.0))
    rows[c, HARDNESS] = number(max(rest / max(d, _HARDEST * rest), 1.0))
    rows[c, MASS] = number(1.0 / mass if mass > _NO_MASS else 0.0)
    rows[c, SUPPORTED] = number(supported)


@exact_inlined
def _faces(faces, i, nx, ny, nz, note):  # type: ignore[no-untyped-def]
    """Return whether a vertex is in contact with a triangle in a like direction, or note this."""
    i = np.uint64(i)
    for n in range(0, FACES, 3):
        x, y, z = faces[i, n], faces[i, n + 1], faces[i, n + 2]
        if nx * x + ny * y + nz * z > _ALIKE:
            return True
        if note and x == 0.0 and y == 0.0 and z == 0.0:
            faces[i, n], faces[i, n + 1], faces[i, n + 2] = nx, ny, nz
            return False
    return False


@exact_inlined
def _inside(found, f):  # type: ignore[no-untyped-def]
    """Return whether a vertex is above the inside of a triangle."""
    return found[f, 1] != 0.0 and found[f, 2] != 0.0 and found[f, 3] != 0.0


@exact
def write_contacts(  # type: ignore[no-untyped-def]
    found, found_particles, counts, inverse_masses, supports, flat, faces, last, particles, rows
):
    """
    Write the contacts of a part.

    Contacts of a vertex with an edge or a corner that others repeat are left out: those with a
    second triangle there, and those in the direction of a triangle that the vertex is above.

    Parameters
    ----------
    found, found_particles, counts
        From `find_contacts`.
    inverse_masses
        Of the particles, 0 for those that are held, shape (n,).
    supports
        From `find_supports`.
    flat
        Flat index of each particle.
    faces, last
        Scratch: shapes (n, FACES), (n, LAST).
    particles, rows
        Receive the flat indices of the particles of each contact, shape (n, CORNERS), and the
        numbers about it, shape (n, ROW): no shorter than `found`.

    Returns
    -------
    int
        Number of contacts.

    """
    faces[:] = 0.0
    last[:] = 0.0
    room = len(found) // (2 * CHUNKS)
    for chunk in range(CHUNKS):
        for each in range(chunk * room, chunk * room + counts[chunk]):
            f = np.uint64(each)
            if _inside(found, f):
                i = found_particles[f, 0]
                _faces(faces, i, found[f, 4], found[f, 5], found[f, 6], True)
    count = 0
    for chunk in range(2 * CHUNKS):
        for each in range(chunk * room, chunk * room + counts[chunk]):
            f = np.uint64(each)
            if chunk < CHUNKS and not _inside(found, f):
                i, x, y, z = found_particles[f, 0], found[f, 4], found[f, 5], found[f, 6]
                if _faces(faces, i, x, y, z, False) or _known(last, i, x, y, z):
                    continue
            _write_row(
                particles, rows, count, found_particles, found, f, inverse_masses, supports, flat
            )
            count += 1
    return count
