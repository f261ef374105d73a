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
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contact.particle_contact import TURNED
from ..grid import Array
from ..kernels.jit import inlined

# Numbers about a contact: the weights of its particles, those times their inverse masses, the
# normal, the distance at rest, m, the mass of the relative motion, whether a collider supports one
# of the particles, by how much the distance is too small at the start of the part, m, and a factor
# of what parts the features then.
WEIGHTS, INVERSE_MASSES, NORMAL, REST, MASS, SUPPORTED = 0, 4, 8, 11, 12, 13
LACK, HARDNESS, ROW = 14, 15, 16
# Time, s, in which what is missing is restored at the fastest; and the one whose inverse
# square is the stiffness of the force that does, for a mass of 1.
_RESTORING, _STIFFENING = 0.02, 1e-3
# Length of a drift, s, below which nothing is foreseen in it.
_SHORTEST = 1e-12


class SheetContacts(NamedTuple):
    """
    Contacts of a sheet with itself, as the kernel of kicks and drifts takes them.

    Attributes
    ----------
    particles
        Flat indices, int64, shape (n, 4).
    rows
        In the precision of the sheet, shape (n, ROW).
    starts
        Where groups of contacts begin, of which the first two share no particle, and their number:
        int64, shape (4,).
    supports, supported
        Normal of the collider at each particle, and least velocity along it, m/s: shape (4, size);
        and flat indices of the particles that one supports, int64, shape (m,).
    lifts
        Scratch: shape (3, size).
    friction
        Coefficient.

    """

    particles: Array
    rows: Array
    starts: Array
    supports: Array
    supported: Array
    lifts: Array
    friction: float


@inlined
def _relative(field, axis, rows, c, i, j, k, h):  # type: ignore[no-untyped-def]
    """Return a component of the difference of a field between both points of a contact."""
    origin = field[axis, i]
    # Differences from one particle: those of coordinates far from the origin are more exact.
    return (
        rows[c, WEIGHTS + 1] * (field[axis, j] - origin)
        + rows[c, WEIGHTS + 2] * (field[axis, k] - origin)
        + rows[c, WEIGHTS + 3] * (field[axis, h] - origin)
    )


@inlined
def _push(position, velocity, i, inverse, length, x, y, z):  # type: ignore[no-untyped-def]
    """Give an impulse to a particle, before a drift that has been made."""
    u, v, w = inverse * x, inverse * y, inverse * z
    velocity[0, i] += u
    velocity[1, i] += v
    velocity[2, i] += w
    position[0, i] += length * u
    position[1, i] += length * v
    position[2, i] += length * w


@inlined
def _lift(position, velocity, lifts, supports, i, length):  # type: ignore[no-untyped-def]
    """Let a collider keep a particle that was pushed from moving into it."""
    zero = velocity.dtype.type(0)
    x, y, z = supports[0, i], supports[1, i], supports[2, i]
    speed = (
        x * (velocity[0, i] + lifts[0, i])
        + y * (velocity[1, i] + lifts[1, i])
        + z * (velocity[2, i] + lifts[2, i])
    )
    lack = max(supports[3, i] - speed, zero)
    lifts[0, i] += lack * x
    lifts[1, i] += lack * y
    lifts[2, i] += lack * z
    back = length * lack
    position[0, i] += back * x
    position[1, i] += back * y
    position[2, i] += back * z


@inlined
def sweep(group, length, position, velocity, former, contacts):  # type: ignore[no-untyped-def]
    """
    Stop what comes too near in a drift, and apply friction.

    Parameters
    ----------
    group
        Of contacts, which are treated.
    length
        Of the drift, s, in the precision of the sheet.
    position, velocity
        After the drift, m and m/s, flat arrays; changed.
    former
        Velocities before the kick, m/s.
    contacts
        A `SheetContacts`.

    """
    particles, rows, starts, supports, _, lifts, friction = contacts
    number = velocity.dtype.type
    zero, one = number(0), number(1)
    friction = number(friction)
    approach, restored = one / max(length, number(_SHORTEST)), one / number(_RESTORING)
    stiffness = length / number(_STIFFENING * _STIFFENING)  # for a mass of 1, times the kick
    for contact in range(starts[group], starts[group + 1]):
        c = np.uint64(contact)
        i, j = np.uint64(particles[c, 0]), np.uint64(particles[c, 1])
        k, h = np.uint64(particles[c, 2]), np.uint64(particles[c, 3])
        nx, ny, nz = rows[c, NORMAL], rows[c, NORMAL + 1], rows[c, NORMAL + 2]
        x = _relative(velocity, 0, rows, c, i, j, k, h)
        y = _relative(velocity, 1, rows, c, i, j, k, h)
        z = _relative(velocity, 2, rows, c, i, j, k, h)
        lifted = rows[c, SUPPORTED] > zero
        if lifted:
            x += _relative(lifts, 0, rows, c, i, j, k, h)
            y += _relative(lifts, 1, rows, c, i, j, k, h)
            z += _relative(lifts, 2, rows, c, i, j, k, h)
        along = nx * x + ny * y + nz * z
        # By how much the pair is too near before the drift, and too slow along the normal.
        lack = (
            rows[c, REST]
            + length * along
            - (
                nx * _relative(position, 0, rows, c, i, j, k, h)
                + ny * _relative(position, 1, rows, c, i, j, k, h)
                + nz * _relative(position, 2, rows, c, i, j, k, h)
            )
        )
        parted = rows[c, HARDNESS] * min(max(lack, zero), rows[c, LACK])
        force = stiffness * parted
        aim = max(along + force, min(lack, zero) * approach)
        missing = min(aim, max(restored * parted, along)) - along
        if not missing > zero:
            continue
        u = _relative(former, 0, rows, c, i, j, k, h)
        v = _relative(former, 1, rows, c, i, j, k, h)
        w = _relative(former, 2, rows, c, i, j, k, h)
        was = u * nx + v * ny + w * nz
        missing = min(missing, max(-along - max(was, zero), zero) + force)
        x, y, z = x - along * nx, y - along * ny, z - along * nz
        squared = x * x + y * y + z * z
        slip = np.sqrt(squared)
        # Friction stops the sliding, or is in proportion to the push.
        mass, most = rows[c, MASS], friction * missing
        share = mass if slip <= most else mass * most / slip
        share = share if u * x + v * y + w * z >= -number(TURNED) * squared else zero
        push = mass * missing
        x, y, z = push * nx - share * x, push * ny - share * y, push * nz - share * z
        a, b = rows[c, INVERSE_MASSES], rows[c, INVERSE_MASSES + 1]
        d, e = rows[c, INVERSE_MASSES + 2], rows[c, INVERSE_MASSES + 3]
        _push(position, velocity, i, a, length, x, y, z)
        _push(position, velocity, j, b, length, x, y, z)
        _push(position, velocity, k, d, length, x, y, z)
        _push(position, velocity, h, e, length, x, y, z)
        if lifted:
            _lift(position, velocity, lifts, supports, i, length)
            _lift(position, velocity, lifts, supports, j, length)
            _lift(position, velocity, lifts, supports, k, length)
            _lift(position, velocity, lifts, supports, h, length)


@inlined
def end_sweep(contacts):  # type: ignore[no-untyped-def]
    """Forget what colliders have taken up in a sweep."""
    _, _, _, _, supported, lifts, _ = contacts
    for n in range(len(supported)):
        i = np.uint64(supported[n])
        lifts[0, i] = lifts[1, i] = lifts[2, i] = lifts.dtype.type(0)
