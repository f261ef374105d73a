"""Copies of the particles of a sheet, in double precision and by particle, for self-contact."""

from __future__ import annotations

from ..kernels.jit import exact


@exact
def load(  # type: ignore[no-untyped-def]
    position, velocity, mobility, begin, stride, columns, now, velocities, inverse_masses
):
    """Copy positions, m, velocities, m/s, and inverse masses of the flat arrays of a state."""
    for n in range(len(now)):
        i = begin + n // columns * stride + n % columns
        for axis in range(3):
            now[n, axis] = position[axis, i]
            velocities[n, axis] = velocity[axis, i]
        inverse_masses[n] = mobility[0, i] * mobility[1, i]


@exact
def load_vectors(field, begin, stride, columns, vectors):  # type: ignore[no-untyped-def]
    """Copy the vectors of a flat array."""
    for n in range(len(vectors)):
        i = begin + n // columns * stride + n % columns
        for axis in range(3):
            vectors[n, axis] = field[axis, i]


@exact
def store_positions(now, inverse_masses, begin, stride, columns, position):  # type: ignore[no-untyped-def]
    """Write back positions, m, of the particles that are not held, and round the copies."""
    for n in range(len(now)):
        i = begin + n // columns * stride + n % columns
        for axis in range(3):
            if inverse_masses[n] > 0.0:
                position[axis, i] = now[n, axis]
            now[n, axis] = position[axis, i]


@exact
def add_velocities(changes, begin, stride, columns, velocity):  # type: ignore[no-untyped-def]
    """Add changes of velocity, m/s; those of zero change no bit."""
    for n in range(len(changes)):
        i = begin + n // columns * stride + n % columns
        for axis in range(3):
            if changes[n, axis] != 0.0:
                velocity[axis, i] = velocity[axis, i] + changes[n, axis]
