"""
Continuous contact between the sheet and a moving sphere.

The sphere is swept through each substep together with the cloth.  Three stages, each only as
wide as it must be:

1. While the sphere is too far from the sheet to reach it at present speeds, a clearance is
   counted down and nothing else is done.
2. `BroadPhase` finds the cells of the grid whose swept bounds meet the swept sphere, among
   candidates that last for some substeps.
3. `sweep` moves the particles of these cells and the sphere together through the substep, in
   strides short enough that no triangle can get from one side of the sphere to the other.

A sphere that appears inside the sheet, at the start or by a change from outside, would throw it
out at once.  It therefore begins as large as there is room for it, and grows at `GROWTH`.

Every cell is taken as four triangles, both diagonals: the contact has no preferred direction, and
holds for whatever triangles a user draws.  A row of particles is a row of segments, and a single
particle a point.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...scene import Sphere
from ..grid import Array, Grid
from ..kernels.jit import exact
from ..state import State, max_speed
from .broad_phase import BroadPhase
from .continuous_collision import max_penetration, resolve_contact

# Depth that is left uncorrected, as a share of the radius and in m: a tenth of what is promised,
# which costs nothing, and lets shorter steps bring contact nearer to the truth.
_TOLERANCE_SHARE = 1e-3
_TOLERANCE = 1e-5
# Depth, as a multiple of that, from which on a sphere has appeared in the sheet, and which a
# particle is moved by in one substep where that is long.
_INSIDE = 10
# Speed, m/s, at which a sphere grows that has appeared in the sheet, and what it begins with, m.
GROWTH = 1.0
_SMALLEST = 1e-4


@exact
def _load(position, velocity, free, particles, h, start, drift, points, speeds, moves):  # type: ignore[no-untyped-def]
    """Write the particles as they were before the substep, seen from the sphere."""
    for n in range(len(particles)):
        i = particles[n]
        moves[n] = free[i]
        for axis in range(3):
            speed = np.float64(velocity[axis, i])
            points[n, axis] = np.float64(position[axis, i]) - h * speed - start[axis]
            speeds[n, axis] = speed - drift[axis]


@exact
def _store(position, velocity, particles, end, drift, points, speeds, moves, least):  # type: ignore[no-untyped-def]
    """
    Write back what moves.

    Return by how much, in velocities and positions, summed over all, and the farthest in
    positions, m.  In the sum positions count where they differ by more than `least`, m.
    """
    u, v, w = 0.0, 0.0, 0.0
    x, y, z = 0.0, 0.0, 0.0
    farthest = 0.0
    for n in range(len(particles)):
        if moves[n] > 0:
            i = particles[n]
            u += speeds[n, 0] + drift[0] - velocity[0, i]
            v += speeds[n, 1] + drift[1] - velocity[1, i]
            w += speeds[n, 2] + drift[2] - velocity[2, i]
            a = points[n, 0] + end[0] - position[0, i]
            b = points[n, 1] + end[1] - position[1, i]
            c = points[n, 2] + end[2] - position[2, i]
            squared = a * a + b * b + c * c
            farthest = max(farthest, squared)
            if squared > least * least:
                x, y, z = x + a, y + b, z + c
            for axis in range(3):
                position[axis, i] = points[n, axis] + end[axis]
                velocity[axis, i] = speeds[n, axis] + drift[axis]
    return (u, v, w), (x, y, z), np.sqrt(farthest)


@exact
def _resolve_substep(  # type: ignore[no-untyped-def]
    position, velocity, free, particles, triangles, h, start, end, drift, gravity, radius,
    friction, tolerance,
):  # fmt: skip
    """
    Carry a sphere past a part of the sheet, which gives way.

    Parameters
    ----------
    position, velocity, free
        Flat arrays after the substep, of which the first two are corrected.
    particles, triangles
        From `BroadPhase.find`.
    h
        Length of the substep, s.
    start, end, drift
        Where the centre of the sphere was and is, m, and its velocity, m/s, shape (3,).
    gravity
        m/s², shape (3,).
    radius, friction, tolerance
        As in `sweep`.

    Returns
    -------
    (float, bool, bool, bool, float, float)
        Depth, touch and force as from `sweep`; whether there were pins; the work of the sphere, J
        for particles of 1 kg; and how far any particle was moved, m.

    """
    number = len(particles)
    points, speeds, moves = np.empty((number, 3)), np.empty((number, 3)), np.empty(number)
    _load(position, velocity, free, particles, h, start, drift, points, speeds, moves)
    depth, touched, forced = resolve_contact(
        points, speeds, moves, triangles, radius, friction, h, tolerance
    )
    work, farthest = 0.0, 0.0
    if touched:
        impulse, lifted, farthest = _store(
            position, velocity, particles, end, drift, points, speeds, moves, _INSIDE * tolerance
        )
        along, up = 0.0, 0.0
        for axis in range(3):
            along += drift[axis] * impulse[axis]
            up -= gravity[axis] * lifted[axis]
        work = along + max(up, 0.0)
    return depth, touched, forced, moves.min() == 0.0, work, farthest


# Centre, radius, and greatest depth of a triangle, m.
Placing = tuple[Array, float, float]


class SphereCollider:
    """
    The sphere of a scene and its contact with the sheet.

    Attributes
    ----------
    centre, velocity
        Of the sphere, in the world, m and m/s, shape (3,).
    radius
        Of the sphere now, m.
    touched
        True if it has touched the sheet since the last `take_work`.
    deepest
        Greatest depth, m, of a triangle in the sphere at the end of the last `resolve`, where it
        is above the tolerance: pins hold the sheet in the sphere.

    """

    def __init__(self, sphere: Sphere, lattice: Grid, centre: Array, gravity: Array) -> None:
        self.centre = centre
        self._gravity = gravity
        self.velocity = np.zeros(3)
        self.max_penetration = 0.0
        self.radius = self._radius = sphere.radius
        self._friction = sphere.friction
        self._tolerance = min(_TOLERANCE_SHARE * sphere.radius, _TOLERANCE)
        self._broad_phase = BroadPhase(lattice)
        self._fastest = 0.0  # m/s, of the particles when they were last looked at
        self._work = 0.0
        self._new = True
        self.touched = False

    def place(self, centre: Array) -> None:
        """Have the sphere be at `centre`, m, where the last advance has brought it."""
        self._broad_phase.reduce_clearance(float(np.linalg.norm(centre - self.centre)))
        self.centre = centre

    def invalidate(self) -> None:
        """Look at the whole sheet: its velocities were set from outside."""
        self._broad_phase.forget()

    def respawn(self) -> None:
        """Look for room in the sheet: it, or the sphere, was set from outside."""
        self._broad_phase.forget()
        self.max_penetration = 0.0
        self._new = True

    def go_on_from(self, other: SphereCollider) -> None:
        """Take over how large another sphere of the same radius has grown, and how deep it is."""
        if other._radius == self._radius:
            self.radius, self._new, self.max_penetration = (
                other.radius,
                other._new,
                other.max_penetration,
            )

    @property
    def placing(self) -> Placing:
        """Where the sphere is now."""
        return self.centre, self.radius, self.max_penetration

    def go_back(self, placing: Placing) -> None:
        """Return to where the sphere was."""
        self.centre, self.radius, self.max_penetration = placing
        self._broad_phase.forget()

    def take_work(self) -> float:
        """
        Return the work that the sphere can have done since the last call, J for particles of 1 kg.

        Seen from the sphere, contact adds no energy; seen from the world, an impulse J then adds
        u·J at most, with u the velocity of the sphere, and what it lifts against gravity in a
        substep that is too long for an impulse to tell.  What a sphere does that grows in touch
        with the sheet, or that the sheet cannot get out of the way of, is not known: it is given
        as infinite.
        """
        work, self._work, self.touched = self._work, 0.0, False
        return work

    def is_clear(self, state: State, seconds: float, sphere_speed: float) -> bool:
        """
        Tell if the sphere is so far away that it cannot reach the sheet within `seconds`.

        Not even if the sheet became twice as fast meanwhile; `resolve` looks at that afterwards.
        """
        if self.radius < self._radius:  # it grows
            return False
        self._fastest = max_speed(state)
        return self._broad_phase.is_clear(seconds * (2 * self._fastest + sphere_speed))

    def resolve(self, state: State, h: float) -> None:
        """
        Carry the sphere through a substep that `state` has just made, and the contact with it.

        Corrects positions and velocities of the particles that the sphere meets on the way.
        """
        start = self.centre - state.origin
        end = start + h * self.velocity
        self.centre = self.centre + h * self.velocity
        before = self.radius
        growing = before < self._radius
        if growing:
            self.radius = min(before + h * GROWTH, self._radius)
            self._broad_phase.forget()
        sphere_speed = math.hypot(*self.velocity)
        former, self._fastest = self._fastest, max_speed(state)
        way = h * (max(self._fastest, former) + sphere_speed)  # NaN if it is that now
        self._broad_phase.reduce_clearance(way)
        self.max_penetration = 0.0
        if self._broad_phase.clearance > 0:
            return
        particles, triangles = self._broad_phase.find(state, h, start, end, self.radius, way)
        if not len(particles):
            return
        self.max_penetration, touched, forced, pinned, work, farthest = _resolve_substep(
            state.position, state.velocity, state.free, particles, triangles, h, start, end,
            self.velocity, self._gravity, self.radius, self._friction, self._tolerance,
        )  # fmt: skip
        if touched:
            self.touched = True
            self._work += math.inf if forced or growing else work
            self._broad_phase.reduce_clearance(farthest)
        if forced and self.max_penetration > 0.0:
            # What is too fast to be forced out of the way has the room that it leaves; pins have
            # none to give.
            least = before if pinned else min(_SMALLEST, self._radius)
            room = max(self.radius - self.max_penetration, least)
            self.max_penetration = max(self.max_penetration - (self.radius - room), 0.0)
            self.radius = room

    def shrink_to_fit(self, state: State) -> None:
        """Shrink the sphere to what there is room for, if it has appeared in the sheet."""
        if not self._new:
            return
        self._new = False
        self.radius = self._radius
        centre = self.centre - state.origin
        particles, triangles = self._broad_phase.find(state, 0.0, centre, centre, self.radius, 0.0)
        if len(particles):
            points = state.position[:, particles].T.astype(float) - centre
            depth = max_penetration(points, triangles, self.radius)
            if depth > _INSIDE * self._tolerance:
                self.radius = max(self.radius - depth, min(_SMALLEST, self._radius))
                depth -= self._radius - self.radius
                self.max_penetration = depth if depth > 2 * self._tolerance else 0.0


def warm_up(dtype: Any) -> None:
    """Compile the kernels before they are needed; the first contact then causes no stall."""
    lattice = Grid(2, 2)
    state = State(lattice, np.dtype(dtype).type)
    contact = SphereCollider(Sphere(radius=1.0), lattice, np.zeros(3), np.zeros(3))
    contact.resolve(state, 1e-3)
