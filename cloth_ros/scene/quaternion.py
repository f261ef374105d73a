"""Quaternions x y z w: validation, product, rotation matrix, and rotation of vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .conversion import ParameterSpec, invalid_value_error, unit_vector, vector

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)
# Largest component beyond which the squares may underflow or overflow.
_LEAST, _GREATEST = 1e-6, 1e6


def checked_orientation(name: str, value: Sequence[float]) -> Quaternion:
    """
    Return a quaternion of any finite length but zero as one of length one.

    Parameters
    ----------
    name
        Of the quaternion, for the error.
    value
        Four numbers x y z w.

    Raises
    ------
    ValueError
        There are not four numbers, one is not finite, or all are zero.

    """
    try:
        numbers = vector(name, value, IDENTITY, ParameterSpec(''), text=False)
    except ValueError:
        allowed, remedy = 'four finite numbers x y z w', 'write [0.0, 0.0, 0.0, 1.0] for none'
        raise invalid_value_error(name, value, allowed, remedy) from None
    largest = max(map(abs, numbers))
    if largest > 0 and not _LEAST < largest < _GREATEST:
        numbers = tuple(number / largest for number in numbers)
    x, y, z, w = unit_vector(name, numbers, 'quaternion', IDENTITY)
    return (x, y, z, w)


def rotation_matrix(quaternion: ArrayLike) -> NDArray[Any]:
    """Return the rotation matrices, shape (..., 3, 3), of unit quaternions, shape (..., 4)."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion), -1, 0)
    elements = (
        *(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        *(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        *(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack(elements, axis=-1).reshape(*x.shape, 3, 3)


def rotated(quaternion: Quaternion, point: Vector) -> Vector:
    """Return a vector, rotated by a unit quaternion."""
    x, y, z = (rotation_matrix(quaternion) @ point).tolist()
    return (x, y, z)


def product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the rotation by `second`, followed by that by `first`."""
    a, s = np.array(first[:3]), first[3]
    b, t = np.array(second[:3]), second[3]
    x, y, z = (s * b + t * a + np.cross(a, b)).tolist()
    return (x, y, z, s * t - float(a @ b))
