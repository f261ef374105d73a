"""
PyBullet: a soft body of springs in its deformable world.

As in PyBullet's cloth examples (`deformable_anchor.py`), a mesh from a file, anchored at two
vertices, with bending springs between second neighbours.  Undamped springs are integrated
explicitly, damped ones by conjugate gradients: damping costs more than the substeps that it saves.
The number of substeps is the least that was stable.

The dropped sheet needs the same number: at 16 × 16, 12 and 15 substeps flew apart and 18 did not,
at 32 × 32, 30 did and 36 did not; with damping, 4 and 8 at 16 × 16 did.  A margin of 1 mm,
contacts of faces (`useFaceContact`), another size of the voxels of the distance field and fewer
iterations of the solver were not faster; nothing sank in with any of them, for the undamped sheet
does not come to rest on the box.  The table is a large box: on a plane, the sheet took twice as
long and stayed 0.1 m above.  PyBullet suspends a sheet that has been at rest for 2 s; this is
switched off.
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

import numpy as np

from ..drop import BOX_EDGE, FRICTION, HEIGHT

NAME = 'PyBullet'

_TICK = 1 / 60

# A mesh has one diagonal per cell, as stiff as the sides: equal to the sum of our two.
_STIFFNESS = 500.0
_BENDING = 50.0

# Of the dropped sheet, m.
_MARGIN = 0.005


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

    def __init__(self, size: int, support: str = 'corners') -> None:
        import pybullet

        hanging = support == 'corners'
        self._substeps = -(-9 * size // 8)
        self.settings = f'mass-spring, explicit, {self._substeps} substeps a tick'
        if not hanging:
            self.settings += f', margin {1e3 * _MARGIN:g} mm'
        self._bullet = pybullet
        self._client = client = pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, physicsClientId=client)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setTimeStep(_TICK / self._substeps, physicsClientId=client)
        if support == 'table':
            self._place([2.0, 2.0, 0.5])
        if support == 'box':
            self._place([BOX_EDGE / 2] * 3)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'sheet.obj')
            with open(path, 'w') as file:
                file.write(_mesh(size))
            self._body = pybullet.loadSoftBody(
                path,
                basePosition=[0, 0, 1.5 if hanging else HEIGHT],
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
                frictionCoeff=FRICTION,
                collisionMargin=0.001 if hanging else _MARGIN,
                physicsClientId=client,
            )
        # Bullet renumbers the vertices.
        start = self._vertices()
        places = np.rint((start[:, :2] + 0.5) * (size - 1)).astype(int)
        self._order = np.empty((size, size), int)
        self._order[places[:, 1], places[:, 0]] = np.arange(len(start))
        if not hanging:
            pybullet.changeDynamics(
                self._body,
                -1,
                activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
                physicsClientId=client,
            )
            return
        for corner in (self._order[0, 0], self._order[0, -1]):
            pybullet.createSoftBodyAnchor(self._body, int(corner), -1, -1, physicsClientId=client)

    def __del__(self) -> None:
        # Otherwise the world stays in memory until the process ends.
        if hasattr(self, '_client') and self._bullet.isConnected(self._client):
            self._bullet.disconnect(self._client)

    def _place(self, half: list[float]) -> None:
        """Make a box of these half lengths with its upper face at z = 0."""
        bullet, client = self._bullet, self._client
        shape = bullet.createCollisionShape(
            bullet.GEOM_BOX, halfExtents=half, physicsClientId=client
        )
        body = bullet.createMultiBody(
            0, shape, basePosition=[0, 0, -half[2]], physicsClientId=client
        )
        # Bullet multiplies the friction of both.
        bullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=client)

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
