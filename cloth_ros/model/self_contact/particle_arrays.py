"""Copies of the particles of a sheet, in double precision and by particle, for self-contact."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact


@exact
def load_vectors(field, flat, chosen, vectors):  # type: ignore[no-untyped-def]
    """Copy the vectors of chosen particles of a flat array to an array of shape (n, 3)."""
    for n in chosen:
        i = np.uint64(flat[n])
        for axis in range(3):
            vectors[n, axis] = field[axis, i]


@exact
def load_start(  # type: ignore[no-untyped-def]
    position, velocity, mobility, seconds, mean, flat, chosen, now, ahead, motions, inverse_masses
):
    """
    Copy what is known of chosen particles at the start of a part.

    Parameters
    ----------
    position, velocity, mobility
        Flat arrays, as in `State`.
    seconds, mean
        Duration of the part, and the mean velocity, m/s, shape (3,).
    flat
        Flat index of each particle.
    chosen
        Particles, by row and column.
    now, ahead, motions
        Receive positions, m, and those expected at the end, shape (n, 3), and how far particles
        move beyond the mean, m, shape (n,).
    inverse_masses
        Receives these, in units of that of a cell; 0 for held particles; shape (n,).

    """
    for n in chosen:
        i = np.uint64(flat[n])
        squared = 0.0
        for axis in range(3):
            now[n, axis] = position[axis, i]
            ahead[n, axis] = position[axis, i] + seconds * velocity[axis, i]
            squared += (velocity[axis, i] - mean[axis]) ** 2
        motions[n] = seconds * np.sqrt(squared)
        inverse_masses[n] = mobility[0, i] * mobility[1, i]


@exact
def store_positions(now, shifted, flat, position):  # type: ignore[no-untyped-def]
    """Write back positions, m, of the particles that were shifted, and round the copies."""
    for n in range(len(now)):
        if shifted[n]:
            i = np.uint64(flat[n])
            for axis in range(3):
                position[axis, i] = now[n, axis]
                now[n, axis] = position[axis, i]
