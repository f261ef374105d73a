"""
PyBullet: a soft body of springs in its deformable world.

As in PyBullet's cloth examples (`deformable_anchor.py`), a mesh from a file, anchored at two
vertices, with bending springs between second neighbours.  Undamped springs are integrated
explicitly, damped ones by conjugate gradients: damping costs more than the substeps that it saves.
The number of substeps is the least that was stable.
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

import numpy as np

NAME = 'PyBullet'

_TICK = 1 / 60

# A mesh has one diagonal per cell, as stiff as the sides: equal to the sum of our two.
_STIFFNESS = 500.0
_BENDING = 50.0


def version() -> str:
    """Return the version of PyBullet."""
    from importlib.metadata import version

    return version('pybullet')


def _mesh(size: int) -> str:
    """Return a square of 1 m around the origin in Wavefront's format."""
    line = np.linspace(-0.5, 0.5, size)
    lines = [f'v {x:.9f} {y:.9f} 0' for y in line for x in line]
    for row in range(size - 1):
        for column in range(size - 1):
            a = row * size + column + 1
            b, c, d = a + 1, a + size + 1, a + size
            lines += [f'f {a} {b} {c}', f'f {a} {c} {d}']
    return '\n'.join(lines) + '\n'


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int) -> None:
        import pybullet

        self._substeps = -(-9 * size // 8)
        self.settings = f'mass-spring, explicit, {self._substeps} substeps a tick'
        self._bullet = pybullet
        self._client = client = pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, physicsClientId=client)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setTimeStep(_TICK / self._substeps, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'sheet.obj')
            with open(path, 'w') as file:
                file.write(_mesh(size))
            self._body = pybullet.loadSoftBody(
                path,
                basePosition=[0, 0, 1.5],
                scale=1,
                mass=0.2,
                useMassSpring=1,
                useBendingSprings=1,
                useNeoHookean=0,
                useSelfCollision=0,
                useFaceContact=0,
                springElasticStiffness=_STIFFNESS,
                springBendingStiffness=_BENDING,
                springDampingStiffness=0,
                collisionMargin=0.001,
                physicsClientId=client,
            )
        # Bullet renumbers the vertices.
        start = self._vertices()
        places = np.rint((start[:, :2] + 0.5) * (size - 1)).astype(int)
        self._order = np.empty((size, size), int)
        self._order[places[:, 1], places[:, 0]] = np.arange(len(start))
        for corner in (self._order[0, 0], self._order[0, -1]):
            pybullet.createSoftBodyAnchor(self._body, int(corner), -1, -1, physicsClientId=client)

    def __del__(self) -> None:
        # Otherwise the world stays in memory until the process ends.
        if hasattr(self, '_client') and self._bullet.isConnected(self._client):
            self._bullet.disconnect(self._client)

    def _vertices(self) -> Any:
        _, vertices = self._bullet.getMeshData(
            self._body,
            -1,
            flags=self._bullet.MESH_DATA_SIMULATION_MESH,
            physicsClientId=self._client,
        )
        return np.array(vertices)

    def advance(self) -> None:
        """Simulate 1/60 s."""
        for _ in range(self._substeps):
            self._bullet.stepSimulation(physicsClientId=self._client)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        return self._vertices()[self._order]
