"""
Contacts of a sheet with itself in the kernel of kicks and drifts: impulses and friction.

After each kick and drift the contacts of the part are treated one after the other (Gauss-Seidel),
always in the same order: what a sweep leaves depends on the order, and one that changed would
shake layers that rest.  Two features that would come nearer than their distance at rest get the
impulse that stops them there, and friction after Coulomb.  The drift is corrected by the change of
velocity, as if the impulse had acted before it: a pair at rest does not sink between two substeps.
Features that were too near at the start of the part are pressed apart by a force in proportion to
what is missing, and slowly.  So they come to rest where that force is no less than the load;
without a bound, contacts of a fold that exclude each other would drive it for ever.

An impulse to stop a pair, or its sliding, must add no energy to what a kick and a drift conserve;
see `contact.particle_contact`.  A sheet that rests on itself is shaken otherwise.

Where a collider supports a particle, the sheet on it rests on the collider: a contact takes the
particle as too heavy to be pushed into it, and counts its velocity as that of the surface.  The
impulse on the particle is the full one nevertheless, which the collider takes up in the next
substep, and accounts for.

Normals and weights are those at the start of the part.

Contacts are treated four at a time, in packets: each lane of a vector is of another contact.
Those of a packet share no particle, so that the result is that of one after the other.  The
particles in contact are copied to an array of their own, in the order of the packets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contact.particle_contact import TURNED
from ..grid import Array
from ..kernels.jit import inlined
from ..kernels.vector import (
    SIZE,
    filled,
    gather,
    greatest,
    least,
    load,
    root,
    scatter,
    where_positive,
)

# Contacts in a packet, and particles in a contact.
LANES, CORNERS = SIZE, 4
# Numbers about a contact: the weights of all particles but the first, which is minus their sum;
# the weights of all times their inverse masses; the normal; the distance at rest, m; the mass of
# the relative motion; by how much the distance is too small at the start of the part, m; a factor
# of what parts the features then; and 1 if a collider supports one of the particles.
WEIGHTS, INVERSE_MASSES, NORMAL = 0, 3, 7
REST, MASS, LACK, HARDNESS, SUPPORTED, ROW = 10, 11, 12, 13, 14, 15
# Numbers about a packet: each of these of all its contacts, and the last one of any.
PACKET = LANES * SUPPORTED + 1
# Vectors about a particle: position before the drift, and 0; velocity, and by how much a collider
# has changed it, along its normal, m/s; velocity before the kick, and 0; and the normal and the
# least velocity along it, m/s, of a collider that supports the particle.
_START, _VELOCITY, _FORMER, _SUPPORT = 0, 1, 2, 3
# Their numbers.
LIFT, SUPPORT, PARTICLE = SIZE * _VELOCITY + 3, SIZE * _SUPPORT, SIZE * (_SUPPORT + 1)
# Time, s, in which what is missing is restored at the fastest; and the one whose inverse
# square is the stiffness of the force that does, for a mass of 1.
_RESTORING, _STIFFENING = 0.02, 1e-3
# Length of a drift, s, below which nothing is foreseen in it; and the square of the least speed,
# (m/s)², of what slides.
_SHORTEST, _SLOWEST_SQUARED = 1e-12, 1e-24


class SheetContacts(NamedTuple):
    """
    Contacts of a sheet with itself, as the kernel of kicks and drifts takes them.

    Attributes
    ----------
    places
        Where the particles of each packet are among all numbers of `copies`: the first one of each
        contact, then the second, and so on; uint32, shape (n, CORNERS * LANES).
    rows
        Numbers about each packet, in the precision of the sheet, shape (n, PACKET).
    starts
        Where groups of packets begin, of which the first two share no particle, and the number of
        packets: int64, shape (4,).
    particles
        Flat indices of those in contact, uint32, shape (m,).
    firsts
        Where those begin that are in each group, but in none before, and their number: int64,
        shape (4,).
    copies
        About these particles, shape (m + 1, PARTICLE); a sweep needs what supports them.  Lanes
        without a contact have the last row, of zeros, as their particles, and zeros in `rows`.
    friction
        Coefficient.

    """

    places: Array
    rows: Array
    starts: Array
    particles: Array
    firsts: Array
    copies: Array
    friction: float


@inlined
def copy_particles(group, length, position, velocity, former, contacts):  # type: ignore[no-untyped-def]
    """Copy the particles of a group of packets for its sweep, after a drift for `length` s."""
    _, _, _, particles, firsts, copies, _ = contacts
    second, third = np.uint64(SIZE * _VELOCITY), np.uint64(SIZE * _FORMER)
    for place in range(firsts[group], firsts[group + 1]):
        p = np.uint64(place)
        i = np.uint64(particles[p])
        for axis in range(np.uint64(3)):
            copies[p, axis] = position[axis, i] - length * velocity[axis, i]
            copies[p, second + axis] = velocity[axis, i]
            copies[p, third + axis] = former[axis, i]
        copies[p, np.uint64(LIFT)] = 0


@inlined
def write_back(group, length, position, velocity, contacts):  # type: ignore[no-untyped-def]
    """Write new velocities, and positions as if they had changed before the drift."""
    _, _, _, particles, firsts, copies, _ = contacts
    second, fourth = np.uint64(SIZE * _VELOCITY), np.uint64(SUPPORT)
    for place in range(firsts[group], firsts[group + 1]):
        p = np.uint64(place)
        i = np.uint64(particles[p])
        lift = copies[p, np.uint64(LIFT)]
        for axis in range(np.uint64(3)):
            changed = copies[p, second + axis]
            position[axis, i] += length * (changed - velocity[axis, i])
            # The collider itself does so in the next substep.
            velocity[axis, i] = changed - lift * copies[p, fourth + axis]


@inlined
def _corner(places, first):  # type: ignore[no-untyped-def]
    """Return where one particle of each contact of a packet is."""
    return (
        np.int64(places[first]),
        np.int64(places[first + np.uint64(1)]),
        np.int64(places[first + np.uint64(2)]),
        np.int64(places[first + np.uint64(3)]),
    )


@inlined
def _load(copies, what, corners):  # type: ignore[no-untyped-def]
    """Return a vector about each particle: components, of all contacts of a packet."""
    i, j, k, h = corners
    x, y, z, _ = gather(copies, i, what)
    u, v, w, _ = gather(copies, j, what)
    p, q, r, _ = gather(copies, k, what)
    a, b, c, _ = gather(copies, h, what)
    return (x, y, z), (u, v, w), (p, q, r), (a, b, c)


@inlined
def _add(first, second):  # type: ignore[no-untyped-def]
    (x, y, z), (u, v, w) = first, second
    return x + u, y + v, z + w


@inlined
def _scale(factor, vectors):  # type: ignore[no-untyped-def]
    x, y, z = vectors
    return factor * x, factor * y, factor * z


@inlined
def _dot(first, second):  # type: ignore[no-untyped-def]
    (x, y, z), (u, v, w) = first, second
    return x * u + y * v + z * w


@inlined
def _relative(weights, vectors):  # type: ignore[no-untyped-def]
    """Return the difference of a vector between both points of each contact."""
    a, b, c = weights
    # Differences from one particle: those of coordinates far from the origin are more exact.
    (x, y, z), (u, v, w), (p, q, r), (k, m, n) = vectors
    return (
        a * (u - x) + b * (p - x) + c * (k - x),
        a * (v - y) + b * (q - y) + c * (m - y),
        a * (w - z) + b * (r - z) + c * (n - z),
    )


@inlined
def _push(copies, corner, velocity, change):  # type: ignore[no-untyped-def]
    """Change the velocities of a particle of each contact."""
    x, y, z = _add(velocity, change)
    scatter(copies, corner, _VELOCITY, (x, y, z, filled(copies.dtype.type(0))))


@inlined
def _push_supported(copies, corner, velocity, change, acting):  # type: ignore[no-untyped-def]
    """Do the same where `acting` > 0, but colliders keep particles from moving into them."""
    _, _, _, lift = gather(copies, corner, _VELOCITY)
    x, y, z, slowest = gather(copies, corner, _SUPPORT)
    changed = _add(velocity, change)
    more = slowest - _dot((x, y, z), changed)
    more = where_positive(acting, where_positive(more, more))
    u, v, w = _add(changed, _scale(more, (x, y, z)))
    scatter(copies, corner, _VELOCITY, (u, v, w, lift + more))


@inlined
def _impulses(rows, first, length, friction, normal, start, velocity, former):  # type: ignore[no-untyped-def]
    """
    Return a vector that is positive where a contact of a packet acts, and the impulses.

    Parameters
    ----------
    rows, first
        Where the packet begins among all numbers of the rows.
    length
        Of the drift that has been made, s.
    friction
        Coefficient.
    normal, start, velocity, former
        Normals, and differences between both points of each contact: of positions before the
        drift, of velocities, and of those before the kick.

    """
    real = rows.dtype.type
    zero, one = filled(real(0)), filled(real(1))
    approach, restored = real(1) / max(length, real(_SHORTEST)), real(1) / real(_RESTORING)
    stiffness = length / real(_STIFFENING * _STIFFENING)  # for a mass of 1, times the kick
    along, was = _dot(normal, velocity), _dot(normal, former)
    # By how much the pair is too near before the drift, and too slow along the normal.
    lack = load(rows, first + np.uint64(LANES * REST)) - _dot(normal, start)
    parted = load(rows, first + np.uint64(LANES * HARDNESS)) * least(
        greatest(lack, zero), load(rows, first + np.uint64(LANES * LACK))
    )
    force = stiffness * parted
    aim = greatest(along + force, approach * least(lack, zero))
    # No branch where nothing is missing: the processor could not predict it.
    missing = greatest(least(aim, greatest(restored * parted, along)) - along, zero)
    most = greatest(zero - along - greatest(was, zero), zero) + force
    missing = least(most, missing)
    sliding = _add(velocity, _scale(zero - along, normal))
    squared = _dot(sliding, sliding)
    # Friction stops the sliding, or is in proportion to the push.
    mass = load(rows, first + np.uint64(LANES * MASS))
    speed = root(greatest(squared, filled(real(_SLOWEST_SQUARED))))
    share = mass * least(friction * missing / speed, one)
    share = where_positive(_dot(former, sliding) + real(TURNED) * squared, share)
    return missing, _add(_scale(mass * missing, normal), _scale(zero - share, sliding))


@inlined
def sweep(group, length, contacts):  # type: ignore[no-untyped-def]
    """
    Stop what comes too near in a drift, and apply friction: change the copies of velocities.

    Parameters
    ----------
    group
        Of packets of contacts, which are treated.
    length
        Of the drift, s, in the precision of the sheet.
    contacts
        A `SheetContacts`.

    """
    places, rows, starts, _, _, copies, friction = contacts
    friction = copies.dtype.type(friction)
    flat = places.reshape(-1)
    for packet in range(starts[group], starts[group + 1]):
        n = np.uint64(packet)
        corner = n * np.uint64(CORNERS * LANES)
        i, j = _corner(flat, corner), _corner(flat, corner + np.uint64(LANES))
        k = _corner(flat, corner + np.uint64(2 * LANES))
        h = _corner(flat, corner + np.uint64(3 * LANES))
        corners = (i, j, k, h)
        first = n * np.uint64(PACKET)
        weights = (
            load(rows, first), load(rows, first + np.uint64(LANES)),
            load(rows, first + np.uint64(2 * LANES)),
        )  # fmt: skip
        direction = first + np.uint64(LANES * NORMAL)
        normal = (
            load(rows, direction), load(rows, direction + np.uint64(LANES)),
            load(rows, direction + np.uint64(2 * LANES)),
        )  # fmt: skip
        velocities = _load(copies, _VELOCITY, corners)
        acting, impulse = _impulses(
            rows, first, length, friction, normal,
            _relative(weights, _load(copies, _START, corners)), _relative(weights, velocities),
            _relative(weights, _load(copies, _FORMER, corners)),
        )  # fmt: skip
        shares = first + np.uint64(LANES * INVERSE_MASSES)
        a = _scale(load(rows, shares), impulse)
        b = _scale(load(rows, shares + np.uint64(LANES)), impulse)
        c = _scale(load(rows, shares + np.uint64(2 * LANES)), impulse)
        d = _scale(load(rows, shares + np.uint64(3 * LANES)), impulse)
        p, q, r, s = velocities
        if rows[n, np.uint64(LANES * SUPPORTED)] > 0:
            _push_supported(copies, i, p, a, acting)
            _push_supported(copies, j, q, b, acting)
            _push_supported(copies, k, r, c, acting)
            _push_supported(copies, h, s, d, acting)
        else:
            _push(copies, i, p, a)
            _push(copies, j, q, b)
            _push(copies, k, r, c)
            _push(copies, h, s, d)
