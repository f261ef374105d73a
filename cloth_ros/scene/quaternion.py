"""Quaternions x y z w: validation, product, and rotation of vectors."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .conversion import ParameterSpec, invalid_value_error, vector

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


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
    remedy = 'write [0.0, 0.0, 0.0, 1.0] for none'
    try:
        numbers = vector(name, value, IDENTITY, ParameterSpec(''), text=False)
    except ValueError:
        allowed = 'four finite numbers x y z w'
        raise invalid_value_error(name, value, allowed, remedy) from None
    largest = max(map(abs, numbers))
    if largest == 0:
        allowed = 'a quaternion x y z w other than zero'
        raise invalid_value_error(name, list(numbers), allowed, remedy)
    # Scaled first: the squares of tiny and of huge numbers are not finite, or zero.
    x, y, z, w = (number / largest for number in numbers)
    length = math.hypot(x, y, z, w)
    return (x / length, y / length, z / length, w / length)


def rotated(quaternion: Quaternion, point: Vector) -> Vector:
    """Return a vector, rotated by a unit quaternion."""
    axis, w = np.array(quaternion[:3]), quaternion[3]
    twice = 2.0 * np.cross(axis, point)
    x, y, z = (np.array(point) + w * twice + np.cross(axis, twice)).tolist()
    return (x, y, z)


def product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the rotation by `second`, followed by that by `first`."""
    a, s = np.array(first[:3]), first[3]
    b, t = np.array(second[:3]), second[3]
    x, y, z = (s * b + t * a + np.cross(a, b)).tolist()
    return (x, y, z, s * t - float(a @ b))
