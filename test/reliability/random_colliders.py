"""Random colliders and their motion, as hypothesis strategies."""

from __future__ import annotations

import functools
import math
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from meshes import angle_section, binary_stl, cup, prism, sphere

from cloth_ros import Cloth
from cloth_ros.scene.collider import SHAPE_PARAMETERS

Vector = tuple[float, float, float]
MOST = 6  # colliders that are near the sheet
FAR = 'far_'  # prefix of the names of others
_AWAY = 5e5  # m
_LEAST, _GREATEST = 1e-4, 1e3  # m, of lengths
_STEP = 1.0  # rad, turned between two waypoints
_FOLDER = tempfile.TemporaryDirectory(prefix='cloth_ros_meshes_')

# Of a size of 1 m.  Each mesh with each sheet has a distance grid of its own, which takes a second
# to make: there are few sizes, as multiples of the circumradius of the triangles of the sheet.
SOLIDS = {
    'block': lambda: prism([(-0.5, -0.4), (0.5, -0.4), (0.0, 0.5)], [(0, 1, 2)], 0.7),
    'ball': lambda: sphere(0.5, 10),
    'L': lambda: angle_section(1.0, 0.3, 0.6) - np.array([0.3, 0.3, 0.0]),
    'cup': lambda: cup(0.5, 1.0, 0.2, 8),
}
MESH_SIZES = (1.5, 6.0, 30.0)  # of these radii
RADII = (1e-3, 0.03, 0.5)  # m


@functools.cache
def mesh_file(solid: str, size: float) -> str:
    """Return the path of an STL file with a solid of some size, m; written once."""
    path = Path(_FOLDER.name) / f'{solid}_{size:.6g}.stl'
    path.write_bytes(binary_stl(size * SOLIDS[solid]()))
    return str(path)


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    """Return a strategy of numbers of every magnitude in a range."""
    exponents = st.floats(math.log10(low), math.log10(high))
    return exponents.map(lambda exponent: min(max(10.0**exponent, low), high))


def vectors(*lengths: float) -> st.SearchStrategy[Vector]:
    """Return a strategy of vectors of these sizes."""
    parts = st.tuples(*[st.floats(-1, 1)] * 3)
    return st.builds(
        lambda length, parts: tuple(length * part for part in parts),
        st.sampled_from(lengths),
        parts,
    )


QUATERNIONS = st.one_of(
    st.sampled_from([(0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.8)]),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1),
)


class Motion(NamedTuple):
    """Motion of a collider in one advance."""

    velocity: Vector | None  # m/s; None: it is placed elsewhere at once
    place: Vector  # then, from the centre of the sheet, by its diagonal and the collider's radius
    spin: Vector  # rad/s

    def command(self, cloth: Cloth, name: str, seconds: float) -> None:
        """Give the waypoints of a motion that takes so long, s, to a cloth."""
        collider = cloth.colliders[name]
        start, turned = np.array(collider.position), np.array(collider.orientation)
        if self.velocity is not None:
            end = start + seconds * np.array(self.velocity)
        else:
            radius = min(collider.shape.bounding_radius, 10 * cloth.scene.sheet.diagonal)
            reach = cloth.scene.sheet.diagonal + radius
            end = np.median(cloth.positions, axis=(0, 1)) + reach * np.array(self.place)
        angle = seconds * math.hypot(*self.spin)
        count = min(max(math.ceil(angle / _STEP), 1), 60)
        part = min(angle / count, 3.0)
        axis = np.array(self.spin) / (math.hypot(*self.spin) or 1.0)
        step = (*(math.sin(part / 2) * axis), math.cos(part / 2))
        with suppress(ValueError):  # too far away
            for n in range(1, count + 1):
                turned = product(step, turned)
                place = start + (end - start) * (n / count)
                cloth.move_collider(name, place.tolist(), turned.tolist())


def product(p: Any, q: Any) -> np.ndarray:
    """Return the product of two quaternions x y z w."""
    u, v, a, b = np.array(p[:3]), np.array(q[:3]), p[3], q[3]
    return np.array([*(a * v + b * u + np.cross(u, v)), a * b - u @ v])


MOTIONS = st.builds(
    Motion,
    velocity=st.none() | vectors(0.0, 0.1, 3.0, 50.0, 1000.0),
    place=vectors(0.0, 0.5, 3.0),
    spin=vectors(0.0, 0.0, 1.0, 100.0),
)


@st.composite
def colliders(
    draw: st.DrawFn, *, position: Vector, lengths: Vector, radius: float
) -> dict[str, Any]:
    """
    Draw the parameters of colliders near a sheet, and of one of each type far away.

    These make all such scenes share the kernels, of which each set of types has its own.

    Parameters
    ----------
    draw
        See hypothesis.
    position
        Of the sheet, m.
    lengths
        Spacing and diagonal of the sheet, and the largest size of a collider, m.
    radius
        Circumradius of the triangles of the sheet, m.

    """
    spacing, diagonal, largest = lengths
    least = min(max(0.3 * spacing, _LEAST), _GREATEST)
    sizes = logarithmic(least, max(min(max(largest, 10 * _LEAST), _GREATEST), least))
    values: dict[str, Any] = {}
    names = []
    for n in range(draw(st.integers(0, MOST))):
        name = f'{"abcdef"[n]}'
        kind = draw(st.sampled_from(sorted(SHAPE_PARAMETERS)))
        it: dict[str, Any] = {'type': kind, 'friction': draw(st.sampled_from([0.0, 0.3, 10.0]))}
        for field in SHAPE_PARAMETERS[kind]:
            if field == 'mesh':
                size = draw(st.sampled_from(MESH_SIZES)) * radius
                it[field] = mesh_file(draw(st.sampled_from(sorted(SOLIDS))), size)
            else:
                it[field] = [draw(sizes) for _ in range(3)] if field == 'size' else draw(sizes)
        size = 0.0 if kind == 'plane' else size_of(it, radius)
        away, turn = draw(vectors(0.0, 0.3, 0.3, 2.0)), draw(QUATERNIONS)
        it['position'] = [a + (diagonal + size) * b for a, b in zip(position, away, strict=True)]
        it['orientation'] = list(turn)
        values |= {f'collider.{name}.{field}': value for field, value in it.items()}
        names.append(name)
    for n, kind in enumerate(sorted(SHAPE_PARAMETERS)):
        name = f'{FAR}{kind}'
        given = {'size': [1.0] * 3, 'radius': 1.0, 'length': 1.0}
        given['mesh'] = mesh_file('block', 6.0 * radius)
        it = {field: given[field] for field in SHAPE_PARAMETERS[kind]}
        x, y, z = position
        it |= {'type': kind, 'position': [x + n * 100.0, y, z - _AWAY]}
        values |= {f'collider.{name}.{field}': value for field, value in it.items()}
        names.append(name)
    values['collider.names'] = names
    return values


def size_of(parameters: dict[str, Any], radius: float) -> float:
    """Return about the greatest distance of a shape's surface from its centre, m."""
    edges = [each / 2 for each in parameters.get('size', [])]
    parts = [parameters.get('radius', 0.0), parameters.get('length', 0.0) / 2, *edges]
    return math.hypot(*parts) or 10 * radius
