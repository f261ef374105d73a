"""
Interface of shapes: a signed distance for the kernels of contact, and a few lengths.

Particles are kept out of an offset surface, so far from the true one that flat triangles whose
corners lie on it do not cut the shape.  Let ρ be the circumradius of a triangle.  Of a ball of
radius R, the offset is √(R² + ρ²) − R: a point p of the triangle at the least distance d
from the centre has a corner within ρ of it, on the far side of the plane through p across that
direction, so that d² ≥ R² + ρ² − ρ².  A plane needs no offset.
Beside a convex edge of 90 degrees it is ρ, and decreases along each face to 0 at `RAMP` ρ from the
edge: a chord of length 2 ρ that touches the edge has at least one end below such a ramp.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...grid import Array
from ...kernels.jit import Kernel, inlined

# Width of the ramp beside an edge, as a multiple of ρ.  2.42 is just enough for a chord that
# crosses the edge at 45 degrees from both faces; other chords need less.
RAMP = 2.5
# Numbers that describe a shape to a kernel, and where these common ones follow them: literals
# would turn single precision into double.
CONSTANTS = 11
ZERO, ONE, HALF, TINY, FAR, SLOPE, TILTED, TILTED_TWICE = range(CONSTANTS, CONSTANTS + 8)
COMMON = (
    0.0,
    1.0,
    0.5,
    1e-12,
    1e9,
    1 / RAMP,
    # Length of the unit normal of a ramp along that of its face: of one, and of two that meet.
    1 / math.hypot(1, 1 / RAMP),
    1 / math.hypot(1, 1 / RAMP, 1 / RAMP),
)


class Enclosing(NamedTuple):
    """
    A capsule that contains a shape.

    Attributes
    ----------
    radius, length
        Of the capsule, m.
    centre
        In the frame of the shape, m, shape (3,).
    rotation
        From the frame of the capsule, whose axis is z, to that of the shape, shape (3, 3).

    """

    radius: float
    length: float
    centre: Array
    rotation: Array


def enclosing_capsule(points: Array) -> Enclosing:
    """Return a capsule about the longest side of the bounding box of points, m, shape (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    # Cyclic permutations of the axes: the last one becomes the longest.
    rotation = np.roll(np.eye(3), int(np.argmax(high - low)) - 2, axis=0)
    local = (points - centre) @ rotation
    away = np.hypot(local[:, 0], local[:, 1])
    radius = float(away.max())
    half = float((np.abs(local[:, 2]) - np.sqrt(np.maximum(radius**2 - away**2, 0.0))).max())
    return Enclosing(radius, 2 * max(half, 0.0), centre, rotation)


@dataclass(frozen=True)
class Shape:
    """
    A shape in its own frame.

    Attributes
    ----------
    kind
        Number of its branch in the kernels.
    bounding_radius
        Of a ball about the origin that contains the shape, m; inf for a plane.
    inner_radius
        Of the largest ball within the shape, m.
    blunt_radius
        Least radius, m, that the sheet feels where it is not an edge of two broad faces: of a
        rod its radius, whatever its length.
    constants
        Returns up to `CONSTANTS` numbers for the kernels.  They describe the shape about a
        reference point in its frame, m, which is near the sheet: then single precision resolves
        the contact and not the size of the shape.
    reference
        Returns that point, for a point near the sheet, both m in the frame of the shape.
    fields
        Of a mesh: distances at the nodes of a grid, m, and offsets there as shares of ρ, flat.
    triangles
        Of a mesh: corners, m, shape (n, 3, 3).
    enclosing
        What the triangles meet instead of the shape where it is small; None: the shape itself.

    """

    kind: int
    bounding_radius: float
    inner_radius: float
    blunt_radius: float
    constants: Callable[[Array], Sequence[float]]
    reference: Callable[[Array], Array]
    fields: tuple[Array, Array] | None = None
    triangles: Array | None = None
    enclosing: Enclosing | None = None


@inlined
def to_local(rotation, x, y, z):  # type: ignore[no-untyped-def]
    """Return a direction in the frame of the shape; `rotation` is to the world, row by row."""
    return (
        rotation[0] * x + rotation[3] * y + rotation[6] * z,
        rotation[1] * x + rotation[4] * y + rotation[7] * z,
        rotation[2] * x + rotation[5] * y + rotation[8] * z,
    )


@inlined
def to_world(rotation, x, y, z):  # type: ignore[no-untyped-def]
    """Return a direction in the world, given in the frame of the shape."""
    return (
        rotation[0] * x + rotation[1] * y + rotation[2] * z,
        rotation[3] * x + rotation[4] * y + rotation[5] * z,
        rotation[6] * x + rotation[7] * y + rotation[8] * z,
    )


@inlined
def reciprocal_root(one, squared):  # type: ignore[no-untyped-def]
    """
    Return 1/√x and √x for x = `squared` > 0; `one` is 1 in their precision.

    Processors estimate and refine the first much faster than they take a root or divide.
    """
    reciprocal = one / np.sqrt(squared)
    return reciprocal, squared * reciprocal


# Distance of a point from the offset surface, and its normal there: takes (x, y, z, rotation,
# constants, ρ, fields), the point from the reference point in the axes of the world, and returns
# (distance, nx, ny, nz).  With ρ = 0 the surface is the true one.
Distance = Kernel
