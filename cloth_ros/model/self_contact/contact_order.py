"""Packets of contacts of a sheet with itself, and their groups for two threads."""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .sheet_contacts import CORNERS, LACK, LANES, PARTICLE, REST, SUPPORT, SUPPORTED

# What is missing to the distance at rest, as a share of it, from which on contacts are treated
# last.
_MUCH = 0.6
# Lanes without a contact.
_EMPTY = -1


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


@exact_inlined
def _sort(contacts, rows, count, divided, position, order, begins):  # type: ignore[no-untyped-def]
    """Write contacts below a plane, above it, on both sides, and last; and where they begin."""
    axis, middle = 0, np.inf
    if divided:
        axis, middle = _find_plane(contacts, count, position)
    kinds = np.empty(count, np.uint8)
    ranks = np.zeros(5, np.int64)
    for contact in range(count):
        c = np.uint64(contact)
        below = 0
        for n in range(CORNERS):
            if position[axis, np.uint64(contacts[c, n])] < middle:
                below += 1
        kinds[c] = 0 if below == CORNERS else (1 if below == 0 else 2)
        if rows[c, LACK] > _MUCH * rows[c, REST]:
            kinds[c] = 3
        ranks[kinds[c] + 1] += 1
    for kind in range(4):
        ranks[kind + 1] += ranks[kind]
        begins[kind] = ranks[kind]
    begins[4] = count
    for contact in range(count):
        kind = kinds[np.uint64(contact)]
        order[np.uint64(ranks[kind])] = contact
        ranks[kind] += 1


@exact_inlined
def _first_with_room(following, packet):  # type: ignore[no-untyped-def]
    """Return the first packet that has room, from one on; shorten the way to it."""
    while following[packet] != packet:
        following[packet] = following[following[packet]]
        packet = following[packet]
    return packet


@exact
def pack(contacts, rows, count, divided, position, after, following, filled, slots, starts):  # type: ignore[no-untyped-def]
    """
    Make packets of contacts, in two groups that share no particle, and a third one of all others.

    The result of a sweep is that of one contact after the other, in their order within each group:
    one that shares a particle with others is in the first packet after theirs that has room (list
    scheduling).

    Contacts of the first two groups are on both sides of a plane; those of the third are near it,
    or of features that are much too near.  The latter come last: a sweep meets the last contact in
    full, and others may press the features of an earlier one together again, in each sweep.

    Parameters
    ----------
    contacts, rows, count
        From `write_contacts`.
    divided
        False to leave the second group empty.
    position
        Flat array, m.
    after
        Scratch, by flat index: int32, zeros before and after.
    following, filled
        Scratch: int32, shape (n,), n > count.
    slots
        Receives the contact in each lane of each packet, -1 if there is none: int32, shape
        (m, LANES), m ≥ count.
    starts
        Receives where groups begin, and the number of packets: shape (4,).

    """
    order, begins = np.empty(count, np.int64), np.empty(5, np.int64)
    _sort(contacts, rows, count, divided, position, order, begins)
    packets = np.int64(0)
    starts[0] = 0
    for group in range(3):
        start = packets
        following[start] = start
        for place in range(begins[group], begins[group + 1 if group < 2 else 4]):
            c = np.uint64(order[np.uint64(place)])
            earliest = start
            for n in range(CORNERS):
                earliest = max(earliest, np.int64(after[np.uint64(contacts[c, n])]))
            packet = _first_with_room(following, earliest)
            if packet == packets:
                packets += 1
                following[packets] = packets
                filled[packet] = 0
                for lane in range(LANES):
                    slots[packet, lane] = _EMPTY
            slots[packet, filled[packet]] = c
            filled[packet] += 1
            if filled[packet] == LANES:
                following[packet] = packet + 1
            for n in range(CORNERS):
                after[np.uint64(contacts[c, n])] = packet + 1
        starts[group + 1] = packets
    for contact in range(count):
        for n in range(CORNERS):
            after[np.uint64(contacts[np.uint64(contact), n])] = 0


@exact
def write_packets(  # type: ignore[no-untyped-def]
    contacts, rows, slots, starts, supports, known, places, out_rows, particles, firsts, copies
):
    """
    Write the packets of contacts, and list their particles in the order of the packets.

    Parameters
    ----------
    contacts, rows, slots, starts
        From `write_contacts` and `pack`.
    supports
        From `find_supports`.
    known
        Scratch, by flat index: int32, zeros before and after.
    places, out_rows, particles, firsts, copies
        Receive what a `SheetContacts` has as its places, rows, particles and firsts, and what
        supports these particles.

    """
    none = PARTICLE * (len(copies) - 1)
    count = 0
    for group in range(3):
        firsts[group] = count
        for packet in range(starts[group], starts[group + 1]):
            q = np.uint64(packet)
            supported = np.uint64(LANES * SUPPORTED)
            out_rows[q, supported] = 0
            for lane in range(LANES):
                contact = slots[q, np.uint64(lane)]
                if contact == _EMPTY:
                    for n in range(CORNERS):
                        places[q, np.uint64(LANES * n + lane)] = none
                    for n in range(SUPPORTED):
                        out_rows[q, np.uint64(LANES * n + lane)] = 0
                    continue
                c = np.uint64(contact)
                for n in range(CORNERS):
                    i = np.uint64(contacts[c, n])
                    if known[i] == 0:
                        p = np.uint64(count)
                        particles[p] = i
                        for axis in range(4):
                            copies[p, np.uint64(SUPPORT + axis)] = supports[i, np.uint64(axis)]
                        count += 1
                        known[i] = count
                    places[q, np.uint64(LANES * n + lane)] = PARTICLE * (known[i] - 1)
                for n in range(SUPPORTED):
                    out_rows[q, np.uint64(LANES * n + lane)] = rows[c, np.uint64(n)]
                out_rows[q, supported] = max(out_rows[q, supported], rows[c, SUPPORTED])
    firsts[3] = count
    for place in range(count):
        known[np.uint64(particles[np.uint64(place)])] = 0
