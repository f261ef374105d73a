"""Copies of the particles of a sheet, in double precision and by particle, for self-contact."""

from __future__ import annotations

from ..kernels.jit import exact


@exact
def load_vectors(field, begin, stride, columns, vectors):  # type: ignore[no-untyped-def]
    """Copy the vectors of a flat array to an array of shape (n, 3)."""
    for row in range(len(vectors) // columns):
        for column in range(columns):
            n, i = row * columns + column, begin + row * stride + column
            for axis in range(3):
                vectors[n, axis] = field[axis, i]


@exact
def load_inverse_masses(mobility, begin, stride, columns, inverse_masses):  # type: ignore[no-untyped-def]
    """Copy the inverse masses of particles, in units of that of a cell; 0 for held ones."""
    for row in range(len(inverse_masses) // columns):
        for column in range(columns):
            n, i = row * columns + column, begin + row * stride + column
            inverse_masses[n] = mobility[0, i] * mobility[1, i]


@exact
def store_positions(now, inverse_masses, begin, stride, columns, position):  # type: ignore[no-untyped-def]
    """Write back positions, m, of the particles that are not held, and round the copies."""
    for row in range(len(now) // columns):
        for column in range(columns):
            n, i = row * columns + column, begin + row * stride + column
            for axis in range(3):
                if inverse_masses[n] > 0.0:
                    position[axis, i] = now[n, axis]
                now[n, axis] = position[axis, i]


@exact
def add_velocities(changes, begin, stride, columns, velocity):  # type: ignore[no-untyped-def]
    """Add changes of velocity, m/s; those of zero change no bit."""
    for row in range(len(changes) // columns):
        for column in range(columns):
            n, i = row * columns + column, begin + row * stride + column
            for axis in range(3):
                if changes[n, axis] != 0.0:
                    velocity[axis, i] = velocity[axis, i] + changes[n, axis]
