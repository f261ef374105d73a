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

A sweep is bound by the number of instructions.  So the particles in contact are copied, as vectors
of four numbers, to an array of their own, in the order in which the contacts come to them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contact.particle_contact import TURNED
from ..grid import Array
from ..kernels.jit import inlined
from ..kernels.vector import dot, load, number, store, vector3

# Vectors of four numbers about a contact: whether a collider supports one of the particles, and
# the weights of all but the first, which is minus their sum; the weights of all times their
# inverse masses; the normal.
WEIGHTS, INVERSE_MASSES, NORMAL = 0, 1, 2
# Numbers about it, the first of these vectors and four more: the distance at rest, m, the mass of
# the relative motion, by how much the distance is too small at the start of the part, m, and a
# factor of what parts the features then.
SUPPORTED, REST, MASS, LACK, HARDNESS, ROW = 0, 12, 13, 14, 15, 16
# Vectors about a particle: position, velocity, that before the kick, and by how much a collider
# changes the velocity.
_POSITION, _VELOCITY, _FORMER, _LIFT = 0, 1, 2, 3
# Their numbers, and those about what supports a particle: the normal, as a vector, and the least
# velocity along it, m/s.
PARTICLE, SUPPORT, LEAST = 16, 5, 4
# Time, s, in which what is missing is restored at the fastest; and the one whose inverse
# square is the stiffness of the force that does, for a mass of 1.
_RESTORING, _STIFFENING = 0.02, 1e-3
# Length of a drift, s, below which nothing is foreseen in it; and the least speed, m/s, of what
# slides.
_SHORTEST, _SLOWEST = 1e-12, 1e-12


class SheetContacts(NamedTuple):
    """
    Contacts of a sheet with itself, as the kernel of kicks and drifts takes them.

    Attributes
    ----------
    pairs
        Places of the four particles of each contact among the `particles`, uint32, shape (n, 4).
    rows
        In the precision of the sheet, shape (n, ROW).
    starts
        Where groups of contacts begin, of which the first two share no particle, and their number:
        int64, shape (4,).
    particles
        Flat indices of those in contact, uint32, shape (m,).
    firsts
        Where those begin that are in each group, but in none before, and their number: int64,
        shape (4,).
    copies
        Scratch: shape (m, PARTICLE).
    supports
        What supports these particles, shape (m, SUPPORT).
    friction
        Coefficient.

    """

    pairs: Array
    rows: Array
    starts: Array
    particles: Array
    firsts: Array
    copies: Array
    supports: Array
    friction: float


@inlined
def copy_particles(group, position, velocity, former, contacts):  # type: ignore[no-untyped-def]
    """Copy the particles of a group of contacts for its sweep."""
    _, _, _, particles, firsts, copies, _, _ = contacts
    zero = velocity.dtype.type(0)
    for place in range(firsts[group], firsts[group + 1]):
        p = np.uint64(place)
        i = np.uint64(particles[p])
        store(copies, p, _POSITION, vector3(position[0, i], position[1, i], position[2, i]))
        store(copies, p, _VELOCITY, vector3(velocity[0, i], velocity[1, i], velocity[2, i]))
        store(copies, p, _FORMER, vector3(former[0, i], former[1, i], former[2, i]))
        store(copies, p, _LIFT, vector3(zero, zero, zero))


@inlined
def write_back(group, position, velocity, contacts):  # type: ignore[no-untyped-def]
    """Write back what `copy_particles` has copied."""
    _, _, _, particles, firsts, copies, _, _ = contacts
    for place in range(firsts[group], firsts[group + 1]):
        p = np.uint64(place)
        i = np.uint64(particles[p])
        x, y, z, _ = _numbers(load(copies, p, _POSITION))
        position[0, i], position[1, i], position[2, i] = x, y, z
        x, y, z, _ = _numbers(load(copies, p, _VELOCITY))
        velocity[0, i], velocity[1, i], velocity[2, i] = x, y, z


@inlined
def _numbers(vector):  # type: ignore[no-untyped-def]
    return number(vector, 0), number(vector, 1), number(vector, 2), number(vector, 3)


@inlined
def _load(copies, what, i, j, k, h):  # type: ignore[no-untyped-def]
    """Return a vector of each particle of a contact."""
    return (
        load(copies, i, what),
        load(copies, j, what),
        load(copies, k, what),
        load(copies, h, what),
    )


@inlined
def _relative(weights, vectors):  # type: ignore[no-untyped-def]
    """Return the difference of a vector between both points of a contact."""
    first, second, third, fourth = vectors
    # Differences from one particle: those of coordinates far from the origin are more exact.
    return (
        number(weights, 1) * (second - first)
        + number(weights, 2) * (third - first)
        + number(weights, 3) * (fourth - first)
    )


@inlined
def _push(copies, i, position, velocity, length, change):  # type: ignore[no-untyped-def]
    """Change the velocity of a particle, before a drift that has been made."""
    store(copies, i, _POSITION, position + length * change)
    store(copies, i, _VELOCITY, velocity + change)


@inlined
def _push_supported(copies, supports, i, position, velocity, length, change):  # type: ignore[no-untyped-def]
    """Do the same where a collider keeps the particle from moving into it."""
    velocity = velocity + change
    normal, lift = load(supports, i, 0), load(copies, i, _LIFT)
    lack = max(supports[i, LEAST] - dot(normal, velocity + lift), copies.dtype.type(0))
    lifted = lack * normal
    store(copies, i, _LIFT, lift + lifted)
    store(copies, i, _POSITION, position + length * (change + lifted))
    store(copies, i, _VELOCITY, velocity)


@inlined
def sweep(group, length, contacts):  # type: ignore[no-untyped-def]
    """
    Stop what comes too near in a drift, and apply friction, in the copies of the particles.

    Parameters
    ----------
    group
        Of contacts, which are treated.
    length
        Of the drift, s, in the precision of the sheet.
    contacts
        A `SheetContacts`.

    """
    pairs, rows, starts, _, _, copies, supports, friction = contacts
    real = copies.dtype.type
    zero, one = real(0), real(1)
    friction = real(friction)
    approach, restored = one / max(length, real(_SHORTEST)), one / real(_RESTORING)
    stiffness = length / real(_STIFFENING * _STIFFENING)  # for a mass of 1, times the kick
    for contact in range(starts[group], starts[group + 1]):
        c = np.uint64(contact)
        i, j = np.uint64(pairs[c, 0]), np.uint64(pairs[c, 1])
        k, h = np.uint64(pairs[c, 2]), np.uint64(pairs[c, 3])
        normal, weights = load(rows, c, NORMAL), load(rows, c, WEIGHTS)
        lifted = rows[c, SUPPORTED] > zero
        velocities = _load(copies, _VELOCITY, i, j, k, h)
        velocity = _relative(weights, velocities)
        if lifted:
            velocity = velocity + _relative(weights, _load(copies, _LIFT, i, j, k, h))
        along = dot(normal, velocity)
        # By how much the pair is too near before the drift, and too slow along the normal.
        positions = _load(copies, _POSITION, i, j, k, h)
        lack = rows[c, REST] + length * along - dot(normal, _relative(weights, positions))
        parted = rows[c, HARDNESS] * min(max(lack, zero), rows[c, LACK])
        force = stiffness * parted
        aim = max(along + force, min(lack, zero) * approach)
        missing = min(aim, max(restored * parted, along)) - along
        if not missing > zero:
            continue
        former = _relative(weights, _load(copies, _FORMER, i, j, k, h))
        was = dot(normal, former)
        missing = min(missing, max(-along - max(was, zero), zero) + force)
        sliding = velocity - along * normal
        squared = dot(sliding, sliding)
        # Friction stops the sliding, or is in proportion to the push.  Which of both is no branch:
        # the processor could not predict it.
        mass, most = rows[c, MASS], friction * missing
        share = mass * min(most / max(np.sqrt(squared), real(_SLOWEST)), one)
        share = share if dot(former, sliding) >= -real(TURNED) * squared else zero
        impulse = (mass * missing) * normal - share * sliding
        a, b, d, e = _numbers(load(rows, c, INVERSE_MASSES))
        (p, q, r, s), (u, v, w, t) = positions, velocities
        # One function for both would count the arrays that one of them uses, in each contact.
        if lifted:
            _push_supported(copies, supports, i, p, u, length, a * impulse)
            _push_supported(copies, supports, j, q, v, length, b * impulse)
            _push_supported(copies, supports, k, r, w, length, d * impulse)
            _push_supported(copies, supports, h, s, t, length, e * impulse)
        else:
            _push(copies, i, p, u, length, a * impulse)
            _push(copies, j, q, v, length, b * impulse)
            _push(copies, k, r, w, length, d * impulse)
            _push(copies, h, s, t, length, e * impulse)
