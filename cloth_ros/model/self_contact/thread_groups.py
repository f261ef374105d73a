"""Division of the contacts of a sheet with itself among two threads."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact


@exact
def divide(particles, rows, count, ordinary, position, out_particles, out_rows, starts):  # type: ignore[no-untyped-def]
    """
    Sort contacts into two groups that share no particle, and a third one of all others.

    Contacts are on both sides of a plane; those of the third group are near it, or treated last.

    Parameters
    ----------
    particles, rows, count, ordinary
        From `write_contacts`: those from `ordinary` on are treated last.
    position
        Flat array, m.
    out_particles, out_rows
        Receive the contacts; the order within a group stays.
    starts
        Receives where groups begin, and the number of contacts: shape (4,).

    """
    mean, widest, axis = np.zeros(3), 0.0, 0
    for direction in range(3):
        low, high, total = np.inf, -np.inf, 0.0
        for contact in range(count):
            i = np.uint64(particles[np.uint64(contact), 0])
            x = np.float64(position[direction, i])
            low, high, total = min(low, x), max(high, x), total + x
        mean[direction] = total / count
        if high - low > widest:
            widest, axis = high - low, direction
    starts[:] = 0
    place = np.zeros(3, np.int64)
    for write in range(2):
        for contact in range(count):
            c = np.uint64(contact)
            below = 0
            for n in range(4):
                if position[axis, np.uint64(particles[c, n])] < mean[axis]:
                    below += 1
            group = 0 if below == 4 else (1 if below == 0 else 2)
            if contact >= ordinary:
                group = 2
            if write:
                to = np.uint64(place[group])
                for n in range(4):
                    out_particles[to, n] = particles[c, n]
                for n in range(rows.shape[1]):
                    out_rows[to, n] = rows[c, n]
                place[group] += 1
            else:
                starts[group + 1] += 1
        if not write:
            for group in range(3):
                place[group] = starts[group]
                starts[group + 1] += starts[group]
