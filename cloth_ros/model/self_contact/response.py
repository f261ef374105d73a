"""Paths of blocked pairs: moved back, or shortened."""

from __future__ import annotations

from ..kernels.jit import exact

_SWEEPS = 8
# Share of its distance at the start that a blocked pair keeps.
_KEPT = 0.7


@exact
def push_back(now, inverse_masses, particles, rows, count, shifted):  # type: ignore[no-untyped-def]
    """
    Move pairs whose path is not accepted back to the sides of each other where they were.

    Parameters
    ----------
    now
        Positions, m, shape (n, 3), double precision; changed.
    inverse_masses
        Of the particles, 0 for those that are held, shape (n,).
    particles, rows, count
        From `find_blocked`.
    shifted
        Receives True for their particles, moved or not, whose pairs must be examined again: bool,
        shape (n,).

    """
    for c in range(count):
        for n in range(4):
            shifted[particles[c, n]] = True
    for _ in range(_SWEEPS):
        for c in range(count):
            inverse_mass, along = 0.0, 0.0
            for n in range(4):
                i, w = particles[c, n], rows[c, n]
                inverse_mass += w * w * inverse_masses[i]
                along += w * (
                    rows[c, 4] * now[i, 0] + rows[c, 5] * now[i, 1] + rows[c, 6] * now[i, 2]
                )
            missing = _KEPT * min(rows[c, 7], _KEPT * rows[c, 8]) - along
            if not (inverse_mass > 0.0 and missing > 0.0):
                continue
            for n in range(4):
                i = particles[c, n]
                push = rows[c, n] * inverse_masses[i] * missing / inverse_mass
                for axis in range(3):
                    now[i, axis] += push * rows[c, 4 + axis]


@exact
def shorten(now, before, share, particles, count, shifted):  # type: ignore[no-untyped-def]
    """
    Shorten the paths of the particles of pairs whose path is not accepted, to a share.

    Parameters
    ----------
    now, before
        Positions at the end and at the start of the path, m, shape (n, 3), double precision.
    share
        Of the path.
    particles, count
        From `find_blocked`.
    shifted
        Receives True for these particles, and False for others: bool, shape (n,).

    """
    shifted[:] = False
    for c in range(count):
        for n in range(4):
            i = particles[c, n]
            if not shifted[i]:
                shifted[i] = True
                for axis in range(3):
                    now[i, axis] = before[i, axis] + share * (now[i, axis] - before[i, axis])
