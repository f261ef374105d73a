"""Triangles of solids for the tests of mesh colliders, and their file formats."""

from __future__ import annotations

import itertools

import numpy as np

from cloth_ros.model.contact.shapes.mesh import Mesh, closed_mesh


def prism(outline: list[tuple[float, float]], parts: list[tuple[int, ...]], height: float):
    """
    Return the corners of a prism, m, shape (n, 3, 3).

    Parameters
    ----------
    outline
        x and y of its corners, counter-clockwise, m.
    parts
        Triangles that divide the outline, as indices.
    height
        Along z, m, centred.

    """
    low = np.array([(x, y, -height / 2) for x, y in outline])
    high = low + np.array([0, 0, height])
    corners = [high[list(part)] for part in parts] + [low[list(part[::-1])] for part in parts]
    for i, j in itertools.pairwise((*range(len(outline)), 0)):
        corners += [np.array([low[i], low[j], high[j]]), np.array([low[i], high[j], high[i]])]
    return np.array(corners)


def revolved(profile: list[tuple[float, float]], sections: int) -> np.ndarray:
    """Return the corners of a body of revolution; profile: radius and z, counter-clockwise, m."""
    angles = 2 * np.pi * np.arange(sections) / sections
    rings = [
        np.stack([r * np.cos(angles), r * np.sin(angles), np.full(sections, z)], axis=1)
        for r, z in profile
    ]
    corners = []
    for one, two in itertools.pairwise((*rings, rings[0])):
        next_one, next_two = np.roll(one, -1, axis=0), np.roll(two, -1, axis=0)
        corners += [np.stack([one, next_one, next_two], axis=1)]
        corners += [np.stack([one, next_two, two], axis=1)]
    return np.concatenate(corners)


def box(x: float, y: float, z: float) -> np.ndarray:
    """Return the corners of a box with these edges, m."""
    outline = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]
    return prism(outline, [(0, 1, 2), (0, 2, 3)], z)


def sphere(radius: float, sections: int) -> np.ndarray:
    """Return the corners of a sphere, m; half as many rings as sections."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, sections // 2 + 1)
    profile = [(radius * np.cos(angle), radius * np.sin(angle)) for angle in angles]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return revolved(profile, sections)


def cylinder(radius: float, length: float, sections: int) -> np.ndarray:
    """Return the corners of a cylinder, m."""
    z = length / 2
    return revolved([(0.0, -z), (radius, -z), (radius, z), (0.0, z)], sections)


def angle_section(size: float, thickness: float, height: float) -> np.ndarray:
    """Return the corners of an L-shaped solid, m."""
    outline = [
        (0, 0), (size, 0), (size, thickness), (thickness, thickness), (thickness, size), (0, size),
    ]  # fmt: skip
    return prism(outline, [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)], height)


def cup(radius: float, height: float, wall: float, sections: int) -> np.ndarray:
    """Return the corners of a cup, open at the top, m."""
    z = height / 2
    inner = radius - wall
    profile = [(0, -z), (radius, -z), (radius, z), (inner, z), (inner, -z + wall), (0, -z + wall)]
    return revolved(profile, sections)


SOLIDS: dict[str, Mesh] = {
    'box': closed_mesh(box(0.12, 0.1, 0.08)),
    'sphere': closed_mesh(sphere(0.05, 24)),
    'cylinder': closed_mesh(cylinder(0.03, 0.1, 24)),
    'L': closed_mesh(angle_section(0.12, 0.04, 0.08)),
    'cup': closed_mesh(cup(0.04, 0.1, 0.006, 20)),
    'wedge': closed_mesh(prism([(0, 0), (0.1, -0.02), (0.1, 0.02)], [(0, 1, 2)], 0.1)),
}


def ascii_stl(corners: np.ndarray) -> str:
    """Return the text of an STL file."""
    lines = ['solid test']
    for triangle in corners.tolist():
        lines += ['facet normal 0 0 0', 'outer loop']
        lines += [f'vertex {x!r} {y!r} {z!r}' for x, y, z in triangle]
        lines += ['endloop', 'endfacet']
    return '\n'.join([*lines, 'endsolid test', ''])


def binary_stl(corners: np.ndarray) -> bytes:
    """Return the bytes of an STL file."""
    content = bytes(80) + np.uint32(len(corners)).tobytes()
    for triangle in corners:
        content += bytes(12) + triangle.astype('<f4').tobytes() + bytes(2)
    return content


def obj(corners: np.ndarray) -> str:
    """Return the text of an OBJ file with separate corners for each triangle."""
    lines = ['mtllib none.mtl', 'o test']
    for n, triangle in enumerate(corners.tolist()):
        lines += [f'v {x!r} {y!r} {z!r}' for x, y, z in triangle]
        lines += [f'f {3 * n + 1} {3 * n + 2} {3 * n + 3}']
    return '\n'.join([*lines, ''])
