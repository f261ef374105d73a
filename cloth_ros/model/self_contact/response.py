"""
Response of a sheet to contacts with itself: impulses, friction and displacements.

Contacts are treated one after the other, in the order of the list, forwards and backwards in turn
(Gauss-Seidel), with normal impulses that only push and friction after Coulomb.  Each impulse
takes energy or leaves it as it is.  An impulse that stops what fell during the part acted, on
average, in its middle; so the displacement of half a part that friction would have prevented is
taken back as well, and a layer on an incline does not creep.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_subroutine
from .contact_search import BLOCKED, DISTANCE, NORMAL, REST, WEIGHTS

# Share of the missing distance that is restored in a part.
_RESTORED = 0.3
_VELOCITY_SWEEPS = 4
_POSITION_SWEEPS = 2
_BLOCKED_SWEEPS = 8


@exact_subroutine
def _relative(field, particles, contacts, c, axis):  # type: ignore[no-untyped-def]
    """Return a component of the weighted sum of a field, at both points of a contact."""
    return (
        contacts[c, WEIGHTS] * field[particles[c, 0], axis]
        + contacts[c, WEIGHTS + 1] * field[particles[c, 1], axis]
        + contacts[c, WEIGHTS + 2] * field[particles[c, 2], axis]
        + contacts[c, WEIGHTS + 3] * field[particles[c, 3], axis]
    )


@exact_subroutine
def _inverse_mass(inverse_masses, particles, contacts, c):  # type: ignore[no-untyped-def]
    total = 0.0
    for n in range(4):
        w = contacts[c, WEIGHTS + n]
        total += w * w * inverse_masses[particles[c, n]]
    return total


@exact_subroutine
def _push(field, inverse_masses, particles, contacts, c, x, y, z):  # type: ignore[no-untyped-def]
    """Apply an impulse, or a displacement times a mass, at both points of a contact."""
    for n in range(4):
        i = particles[c, n]
        w = contacts[c, WEIGHTS + n] * inverse_masses[i]
        field[i, 0] += w * x
        field[i, 1] += w * y
        field[i, 2] += w * z


@exact
def apply_impulses(  # type: ignore[no-untyped-def]
    velocities, inverse_masses, particles, contacts, count, seconds, friction, impulses
):
    """
    Stop what approaches, and apply friction.

    Parameters
    ----------
    velocities
        m/s, shape (n, 3), double precision; changed.
    inverse_masses
        Of the particles, 0 for those that are held, shape (n,).
    particles, contacts, count
        From `search`.
    seconds
        Duration of the next part, s.
    friction
        Coefficient.
    impulses
        Receives the impulses along the normal and by friction, shape (m, 2).

    """
    impulses[:count] = 0.0
    for sweep in range(_VELOCITY_SWEEPS):
        for each in range(count):
            c = each if sweep % 2 == 0 else count - 1 - each
            inverse_mass = _inverse_mass(inverse_masses, particles, contacts, c)
            if not inverse_mass > 0.0:
                continue
            nx, ny, nz = contacts[c, NORMAL], contacts[c, NORMAL + 1], contacts[c, NORMAL + 2]
            x = _relative(velocities, particles, contacts, c, 0)
            y = _relative(velocities, particles, contacts, c, 1)
            z = _relative(velocities, particles, contacts, c, 2)
            along = nx * x + ny * y + nz * z
            spare = max(contacts[c, DISTANCE] - contacts[c, REST], 0.0)
            push = 0.0
            if along < -spare / seconds:
                push = (-spare / seconds - along) / inverse_mass
                impulses[c, 0] += push
            tx, ty, tz = x - along * nx, y - along * ny, z - along * nz
            slip = np.sqrt(tx * tx + ty * ty + tz * tz)
            drag = 0.0
            if slip > 0.0:
                most = friction * impulses[c, 0] - impulses[c, 1]
                impulse = min(slip / inverse_mass, max(most, 0.0))
                impulses[c, 1] += impulse
                drag = impulse / slip
            if push > 0.0 or drag > 0.0:
                _push(
                    velocities, inverse_masses, particles, contacts, c,
                    push * nx - drag * tx, push * ny - drag * ty, push * nz - drag * tz,
                )  # fmt: skip


@exact
def displace(  # type: ignore[no-untyped-def]
    displacements, moved, inverse_masses, particles, contacts, count, seconds, friction, impulses
):
    """
    Restore a share of the distance that layers lack, and take back what friction prevents.

    Parameters
    ----------
    displacements
        m, shape (n, 3), zero at first; changed.
    moved
        Displacements in the last part, m, shape (n, 3).
    inverse_masses, particles, contacts, count, seconds, friction, impulses
        As in `apply_impulses`, which has computed the impulses.

    """
    for sweep in range(_POSITION_SWEEPS):
        for each in range(count):
            c = each if sweep % 2 == 0 else count - 1 - each
            missing = contacts[c, REST] - contacts[c, DISTANCE]
            if missing < 0.0:
                continue
            inverse_mass = _inverse_mass(inverse_masses, particles, contacts, c)
            if not inverse_mass > 0.0:
                continue
            nx, ny, nz = contacts[c, NORMAL], contacts[c, NORMAL + 1], contacts[c, NORMAL + 2]
            x = _relative(displacements, particles, contacts, c, 0)
            y = _relative(displacements, particles, contacts, c, 1)
            z = _relative(displacements, particles, contacts, c, 2)
            push = max(_RESTORED * missing - (nx * x + ny * y + nz * z), 0.0) / inverse_mass
            x += _relative(moved, particles, contacts, c, 0)
            y += _relative(moved, particles, contacts, c, 1)
            z += _relative(moved, particles, contacts, c, 2)
            along = nx * x + ny * y + nz * z
            tx, ty, tz = x - along * nx, y - along * ny, z - along * nz
            slip = np.sqrt(tx * tx + ty * ty + tz * tz)
            drag = 0.0
            if slip > 0.0 and sweep == 0:
                most = 0.5 * seconds * friction * impulses[c, 0]
                drag = min(slip / inverse_mass, most) / slip
            if push > 0.0 or drag > 0.0:
                _push(
                    displacements, inverse_masses, particles, contacts, c,
                    push * nx - drag * tx, push * ny - drag * ty, push * nz - drag * tz,
                )  # fmt: skip


@exact
def push_back(now, before, inverse_masses, particles, contacts, count):  # type: ignore[no-untyped-def]
    """Move the pairs whose path is not accepted to the sides of each other where they were."""
    for _ in range(_BLOCKED_SWEEPS):
        for c in range(count):
            if contacts[c, BLOCKED] == 0.0:
                continue
            inverse_mass = _inverse_mass(inverse_masses, particles, contacts, c)
            if not inverse_mass > 0.0:
                continue
            nx, ny, nz = contacts[c, NORMAL], contacts[c, NORMAL + 1], contacts[c, NORMAL + 2]
            along = (
                nx * _relative(now, particles, contacts, c, 0)
                + ny * _relative(now, particles, contacts, c, 1)
                + nz * _relative(now, particles, contacts, c, 2)
            )
            missing = min(contacts[c, DISTANCE], contacts[c, REST]) - along
            if missing > 0.0:
                push = missing / inverse_mass
                _push(
                    now, inverse_masses, particles, contacts, c, push * nx, push * ny, push * nz
                )


@exact
def shorten(now, before, share, particles, contacts, count):  # type: ignore[no-untyped-def]
    """Shorten the paths of the particles of pairs whose path is not accepted, to a share."""
    done = np.zeros(len(now), np.bool_)
    for c in range(count):
        if contacts[c, BLOCKED] == 0.0:
            continue
        for n in range(4):
            i = particles[c, n]
            if not done[i]:
                done[i] = True
                for axis in range(3):
                    now[i, axis] = before[i, axis] + share * (now[i, axis] - before[i, axis])


@exact
def limit(displacements, room):  # type: ignore[no-untyped-def]
    """Shorten displacements to the room of each particle; return the longest, m."""
    longest = 0.0
    for i in range(len(displacements)):
        x, y, z = displacements[i, 0], displacements[i, 1], displacements[i, 2]
        squared = x * x + y * y + z * z
        if squared > room[i] * room[i]:
            share = room[i] / np.sqrt(squared)
            displacements[i, 0], displacements[i, 1] = share * x, share * y
            displacements[i, 2] = share * z
            squared = room[i] * room[i]
        longest = max(longest, squared)
    return np.sqrt(longest)
