"""
Response of a sheet to contacts with itself: impulses and friction.

Contacts are treated one after the other, in the order of the list, forwards and backwards in turn
(Gauss-Seidel), with normal impulses that only push and friction after Coulomb.

A part lasts much longer than the vibrations of the springs.  So only velocities are changed: a
displacement by δ at once would store the energy of a spring, k δ²/2, where a velocity that leads
to it within the part takes the much smaller m (δ/Δ)²/2.

Between two impulses what rests on a layer is accelerated, by its weight for example.  It rests if
it is thrown up by half of the velocity that it gains in a part, and slides back on an incline if
it is thrown uphill so; the acceleration is taken from the last part, as far as gravity could be
its cause, or (r/d)² times that where layers are pressed to a distance d less than r at rest.

Where a collider supports a particle the solution includes that, without an impulse on the
particle: the collider gives it in the next substep, and accounts for it.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact, exact_inlined
from .contact_search import BLOCKED, DISTANCE, NORMAL, REST, WEIGHTS

# Time, s, in which a distance that is too small is restored.
_RESTORING = 0.02
_VELOCITY_SWEEPS = 4
# Numbers about a contact: half of the velocity along the surface that it gained in the part, the
# least velocity along the normal, the mass of the relative motion, the impulses so far,
# and whether a collider supports one of the particles.
GAIN, LEAST, MASS, PUSHED, DRAGGED, SUPPORTED = 0, 3, 4, 5, 6, 7
ROW = 8
_BLOCKED_SWEEPS = 8
# Share of its distance at rest below which a pair is not pushed apart any harder.
_NEAREST = 0.05
# Share of its distance at the start that a blocked pair keeps.
_KEPT = 0.7


@exact_inlined
def _relative(field, particles, contacts, c, axis):  # type: ignore[no-untyped-def]
    """Return a component of the weighted sum of a field, at both points of a contact."""
    return (
        contacts[c, WEIGHTS] * field[particles[c, 0], axis]
        + contacts[c, WEIGHTS + 1] * field[particles[c, 1], axis]
        + contacts[c, WEIGHTS + 2] * field[particles[c, 2], axis]
        + contacts[c, WEIGHTS + 3] * field[particles[c, 3], axis]
    )


@exact_inlined
def _inverse_mass(inverse_masses, particles, contacts, c):  # type: ignore[no-untyped-def]
    """Return the inverse mass of the relative motion of a contact."""
    total = 0.0
    for n in range(4):
        w = contacts[c, WEIGHTS + n]
        total += w * w * inverse_masses[particles[c, n]]
    return total


@exact_inlined
def _add(field, inverse_masses, particles, contacts, c, x, y, z):  # type: ignore[no-untyped-def]
    """Add an impulse, or a displacement times a mass, at both points of a contact."""
    for n in range(4):
        i = particles[c, n]
        w = contacts[c, WEIGHTS + n] * inverse_masses[i]
        field[i, 0] += w * x
        field[i, 1] += w * y
        field[i, 2] += w * z


@exact_inlined
def _support(velocities, changes, supports, particles, c):  # type: ignore[no-untyped-def]
    """Stop the particles of a contact that approach a collider faster than they may."""
    for n in range(4):
        i = particles[c, n]
        x, y, z = supports[i, 0], supports[i, 1], supports[i, 2]
        lack = supports[i, 3] - (
            x * velocities[i, 0] + y * velocities[i, 1] + z * velocities[i, 2]
        )
        if lack > 0.0:
            velocities[i, 0] += lack * x
            velocities[i, 1] += lack * y
            velocities[i, 2] += lack * z
            changes[i, 0] -= lack * x
            changes[i, 1] -= lack * y
            changes[i, 2] -= lack * z


@exact
def apply_impulses(  # type: ignore[no-untyped-def]
    velocities, changes, former, supports, inverse_masses, particles, contacts, count, seconds,
    gravity, friction, rows,
):  # fmt: skip
    """
    Stop what approaches, and apply friction.

    Parameters
    ----------
    velocities
        m/s, shape (n, 3), double precision; includes the effect of supports afterwards.
    changes
        Receives the changes of velocity by the impulses alone, m/s, shape (n, 3).
    former
        Velocities at the start of the last part, m/s, shape (n, 3).
    supports
        Normal of the collider next to each particle, and the least velocity along it, m/s, shape
        (n, 4); -inf: no collider.
    inverse_masses
        Of the particles, 0 for those that are held, shape (n,).
    particles, contacts, count
        From `search`.
    seconds, gravity, friction
        Duration of a part, s; m/s²; coefficient.
    rows
        Scratch: shape (m, ROW).

    """
    gained = 0.5 * gravity * seconds
    changes[...] = -velocities
    for c in range(count):
        mass = _inverse_mass(inverse_masses, particles, contacts, c)
        # Half of the velocity that was gained in the part, to be given back.
        for axis in range(3):
            rows[c, GAIN + axis] = 0.5 * (
                _relative(velocities, particles, contacts, c, axis)
                - _relative(former, particles, contacts, c, axis)
            )
        nx, ny, nz = contacts[c, NORMAL], contacts[c, NORMAL + 1], contacts[c, NORMAL + 2]
        rise = nx * rows[c, GAIN] + ny * rows[c, GAIN + 1] + nz * rows[c, GAIN + 2]
        rows[c, GAIN] -= rise * nx
        rows[c, GAIN + 1] -= rise * ny
        rows[c, GAIN + 2] -= rise * nz
        spare = contacts[c, DISTANCE] - contacts[c, REST]
        least = -spare / (seconds if spare > 0.0 else _RESTORING)
        # What presses layers together harder than gravity: the more so, the nearer they are.
        pressed = contacts[c, REST] / max(contacts[c, DISTANCE], _NEAREST * contacts[c, REST])
        most = gained * max(pressed, 1.0) ** 2
        rows[c, LEAST] = least + min(max(-rise, 0.0), most)
        rows[c, MASS] = 1.0 / mass if mass > 0.0 else 0.0
        rows[c, PUSHED] = rows[c, DRAGGED] = rows[c, SUPPORTED] = 0.0
        for n in range(4):
            if supports[particles[c, n], 3] > -np.inf:
                rows[c, SUPPORTED] = 1.0
    for sweep in range(_VELOCITY_SWEEPS):
        for each in range(count):
            c = each if sweep % 2 == 0 else count - 1 - each
            nx, ny, nz = contacts[c, NORMAL], contacts[c, NORMAL + 1], contacts[c, NORMAL + 2]
            x = _relative(velocities, particles, contacts, c, 0)
            y = _relative(velocities, particles, contacts, c, 1)
            z = _relative(velocities, particles, contacts, c, 2)
            along = nx * x + ny * y + nz * z
            push = max(rows[c, LEAST] - along, 0.0) * rows[c, MASS]
            rows[c, PUSHED] += push
            most = friction * rows[c, PUSHED] - rows[c, DRAGGED]
            if not (push > 0.0 or most > 0.0):
                continue
            x, y, z = x - along * nx, y - along * ny, z - along * nz
            p, q, r = rows[c, GAIN], rows[c, GAIN + 1], rows[c, GAIN + 2]
            allowed = min(gained, np.sqrt(x * x + y * y + z * z))
            drift = np.sqrt(p * p + q * q + r * r)
            share = allowed / drift if drift > allowed else 1.0
            x, y, z = x + share * p, y + share * q, z + share * r
            slip = np.sqrt(x * x + y * y + z * z)
            drag = 0.0
            if slip > 0.0 and most > 0.0:
                impulse = min(slip * rows[c, MASS], most)
                rows[c, DRAGGED] += impulse
                drag = impulse / slip
            x, y, z = push * nx - drag * x, push * ny - drag * y, push * nz - drag * z
            _add(velocities, inverse_masses, particles, contacts, c, x, y, z)
            if rows[c, SUPPORTED] > 0.0:
                _support(velocities, changes, supports, particles, c)
    changes += velocities


@exact
def push_back(now, inverse_masses, particles, contacts, count):  # type: ignore[no-untyped-def]
    """Move pairs whose path is not accepted back to the sides of each other where they were."""
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
            missing = _KEPT * min(contacts[c, DISTANCE], _KEPT * contacts[c, REST]) - along
            if missing > 0.0:
                push = missing / inverse_mass
                _add(
                    now, inverse_masses, particles, contacts, c,
                    push * nx, push * ny, push * nz,
                )  # fmt: skip


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
