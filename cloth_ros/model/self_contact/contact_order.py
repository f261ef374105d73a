"""Order in which the contacts of a sheet with itself are treated, and groups for two threads."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .sheet_contacts import LACK, REST

# Contacts of so many parts of a group are treated in turn: the processor then works at several at
# once, where each would wait for the one before if both had a particle in common.
_PARTS = 2
# What is missing to the distance at rest, as a share of it, from which on contacts are treated
# last.
_MUCH = 0.6


@exact_inlined
def _place_in_turn(number, size):  # type: ignore[no-untyped-def]
    """Return the place of one of `size` contacts, if those of parts of equal size take turns."""
    each = (size + _PARTS - 1) // _PARTS
    part, rank = number // each, number % each
    place = 0
    for other in range(_PARTS):
        before = rank + 1 if other < part else rank
        place += min(max(size - other * each, 0), each, before)
    return place


@exact_inlined
def _find_plane(contacts, count, position):  # type: ignore[no-untyped-def]
    """Return the axis along which contacts extend farthest, and their mean coordinate, m."""
    widest, axis, middle = -1.0, 0, 0.0
    for direction in range(3):
        low, high, total = np.inf, -np.inf, 0.0
        for contact in range(count):
            i = np.uint64(contacts[np.uint64(contact), 0])
            x = np.float64(position[direction, i])
            low, high, total = min(low, x), max(high, x), total + x
        if high - low > widest:
            widest, axis, middle = high - low, direction, total / count
    return axis, middle


@exact
def arrange(  # type: ignore[no-untyped-def]
    contacts, rows, count, divided, position, out_contacts, out_rows, starts
):
    """
    Sort contacts into two groups that share no particle, and a third one of all others.

    Contacts of the first two are on both sides of a plane; those of the third are near it, or of
    features that are much too near.  The latter come last: a sweep meets the last contact in full,
    and others may press the features of an earlier one together again, in each sweep.

    Parameters
    ----------
    contacts, rows, count
        From `write_contacts`.
    divided
        False to leave the second group empty, and the order within the first one as it is: layers
        of a small sheet come to rest better.
    position
        Flat array, m.
    out_contacts, out_rows
        Receive the contacts.
    starts
        Receives where groups begin, and the number of contacts: shape (4,).

    """
    axis, middle = 0, np.inf
    if divided:
        axis, middle = _find_plane(contacts, count, position)
    # Below the plane, above it, on both sides, and last.
    begins, ranks = np.zeros(5, np.int64), np.zeros(4, np.int64)
    for write in range(2):
        for contact in range(count):
            c = np.uint64(contact)
            below = 0
            for n in range(4):
                if position[axis, np.uint64(contacts[c, n])] < middle:
                    below += 1
            kind = 0 if below == 4 else (1 if below == 0 else 2)
            if rows[c, LACK] > _MUCH * rows[c, REST]:
                kind = 3
            if write:
                place = ranks[kind]
                if divided and kind < 2:
                    place = _place_in_turn(place, begins[kind + 1] - begins[kind])
                to = np.uint64(begins[kind] + place)
                for n in range(4):
                    out_contacts[to, n] = contacts[c, n]
                for n in range(rows.shape[1]):
                    out_rows[to, n] = rows[c, n]
                ranks[kind] += 1
            else:
                begins[kind + 1] += 1
        if not write:
            for kind in range(4):
                begins[kind + 1] += begins[kind]
    starts[0], starts[1], starts[2], starts[3] = begins[0], begins[1], begins[2], begins[4]
