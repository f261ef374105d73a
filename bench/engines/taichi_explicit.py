"""
Taichi: a kernel that gathers the twelve neighbours, on one thread of the CPU.

Position Verlet in single precision, with substeps that are stable in every state.  As in Taichi's
cloth tutorial, positions and velocities are fields of vectors, and the offsets of the neighbours
are constants of the kernel (`ti.static`), so that their loop is unrolled.  Unlike there, one
launch makes all substeps of a tick, which is 3.7 times as fast at 16 × 16 and 1.2 times at
64 × 64.  Masses and springs at the edges are as inside.

The tutorial stops particles that are inside a sphere.  Here a particle may approach a table or box
only as far as to its thickness in the next substep, with Coulomb friction.  Particles alone are
tested, and the thickness, 0.45 spacings, keeps what is between them out: over an edge of 90°, the
diagonal of a cell needs half a spacing.
"""

# No `from __future__ import annotations`: Taichi reads the annotations of kernels.
from typing import Any

import numpy as np

from .. import sheets
from ..drop import BOX_EDGE, FRICTION

NAME = 'Taichi explicit'

_TICK = 1 / 60
# Distance kept from a support, in spacings.
_THICKNESS = 0.45


def version() -> str:
    """Return the version of Taichi."""
    import taichi

    return '.'.join(map(str, taichi.__version__))


def _kernel(
    position: Any,
    velocity: Any,
    neighbours: list[Any],
    h: float,
    gravity: float,
    support: str,
    height: float,
) -> Any:
    """
    Compile a tick of `substeps` substeps of `h` seconds.

    `neighbours` are di, dj, k/m and k L/m; `height` is that of the origin of the positions above
    the support.
    """
    import taichi as ti

    size = position.shape[0]
    thickness = _THICKNESS / (size - 1)
    half = BOX_EDGE / 2

    @ti.func
    def distance(place):
        """Return the distance to the support, m, and its direction."""
        gap = place.z + height
        normal = ti.Vector([0.0, 0.0, 1.0])
        if ti.static(support == 'box'):
            centred = ti.Vector([place.x, place.y, gap + half])
            beyond = abs(centred) - half
            outside = ti.max(beyond, 0.0)
            gap = outside.norm()
            if gap > 0:
                normal = outside / gap
            else:
                gap = beyond.max()
                for axis in ti.static(range(3)):
                    normal[axis] = ti.cast(beyond[axis] == gap, ti.f32)
                normal = normal.normalized()
            for axis in ti.static(range(3)):
                if centred[axis] < 0:
                    normal[axis] = -normal[axis]
        return gap, normal

    @ti.func
    def with_contact(place, speed):
        """Return the velocity of a particle, so that it keeps its distance in a substep."""
        gap, normal = distance(place)
        along = speed.dot(normal)
        push = -(gap - thickness) / h - along
        if push > 0:
            sliding = speed - along * normal
            rest = ti.max(0.0, 1 - FRICTION * push / ti.max(sliding.norm(), 1e-9))
            speed = rest * sliding + (along + push) * normal
        return speed

    @ti.kernel
    def tick(substeps: int):
        for i, j in position:
            position[i, j] += 0.5 * h * velocity[i, j]
        # Substeps are sequential, and one thread runs them: nothing is parallel.
        ti.loop_config(serialize=True)
        for substep in range(substeps):
            for i, j in ti.ndrange(size, size):
                here = position[i, j]
                pull = ti.Vector([0.0, 0.0, gravity])
                for di, dj, stiffness, tension in ti.static(neighbours):
                    k, m = i + di, j + dj
                    if 0 <= k < size and 0 <= m < size:
                        along = here - position[k, m]
                        pull += (tension / along.norm() - stiffness) * along
                if ti.static(support == 'corners'):
                    if not (i == 0 and (j == 0 or j == size - 1)):
                        velocity[i, j] += h * pull
                else:
                    velocity[i, j] = with_contact(here, velocity[i, j] + h * pull)
            # Two half drifts between kicks are made as one.
            drift = h
            if substep == substeps - 1:
                drift = 0.5 * h
            for i, j in ti.ndrange(size, size):
                position[i, j] += drift * velocity[i, j]

    return tick


class Sheet:
    """The benchmark's sheet of `size` × `size` particles."""

    def __init__(self, size: int, support: str = 'corners') -> None:
        import taichi as ti

        from cloth_ros.model.forces.springs import spring_families
        from cloth_ros.model.time_step import substep_length

        scene = sheets.scene(size) if support == 'corners' else sheets.dropped(size)
        self.substeps = round(_TICK / substep_length(scene))
        self.settings = (
            f'position Verlet, float32, fast math, 1 thread, {self.substeps} substeps a tick'
        )
        if support != 'corners':
            self.settings += f', {_THICKNESS:g} spacings thick'
        # Discards the fields of all earlier sheets: one sheet at a time.
        ti.init(
            arch=ti.cpu,
            cpu_max_num_threads=1,
            default_fp=ti.f32,
            fast_math=True,
            log_level=ti.ERROR,
        )
        mass = scene.sheet.cell_mass
        neighbours = [
            (
                sign * f.rows,
                sign * f.columns,
                f.stiffness / mass,
                f.stiffness / mass * f.rest_length,
            )
            for f in spring_families(scene)
            for sign in (1, -1)
        ]
        self._position = ti.Vector.field(3, ti.f32, (size, size))
        self._velocity = ti.Vector.field(3, ti.f32, (size, size))
        line = np.linspace(-0.5, 0.5, size)
        start = np.zeros((size, size, 3), np.float32)
        # Centred on the origin: single precision would lose digits at a height of 1.5 m.
        self._centre = np.array(scene.sheet.position, np.float32)
        start[..., 0], start[..., 1] = np.meshgrid(line, line)
        self._position.from_numpy(start)
        h = _TICK / self.substeps
        self._tick = _kernel(
            self._position,
            self._velocity,
            neighbours,
            h,
            scene.gravity[2],
            support,
            scene.sheet.position[2],
        )

    def advance(self) -> None:
        """Simulate 1/60 s."""
        self._tick(self.substeps)

    def positions(self) -> Any:
        """Return the positions, m, shape (size, size, 3)."""
        return self._position.to_numpy() + self._centre
