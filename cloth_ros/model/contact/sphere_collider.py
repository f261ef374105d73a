"""
Continuous contact between the sheet and a moving sphere.

The sphere moves through each substep together with the cloth.  Three stages, each only as wide as
it must be:

1. While the sphere is too far from the sheet to reach it at present speeds, a clearance is
   counted down and nothing else is done.
2. `BroadPhase` finds the cells of the grid whose swept bounds meet the swept sphere, among
   candidates that remain valid for several substeps.
3. `resolve_contact` moves the particles of these cells and the sphere together through the
   substep, in advances short enough that no triangle can get from one side of the sphere to the
   other.

A sphere that is placed inside the sheet, at the start or by a change from outside, would eject it
at once.  It therefore starts as large as there is room for it, and grows at `GROWTH`.

Every cell is taken as four triangles, both diagonals: the contact has no preferred direction, and
holds for the triangles of either diagonal.  A row of particles is a row of segments, and a single
particle a point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...scene import ColliderParameters, Scene
from ..grid import Array, Grid
from ..inputs import Inputs, Vector
from ..kernels.jit import exact, exact_subroutine
from ..state import State, max_speed
from .broad_phase import BroadPhase, Candidates
from .continuous_collision import max_penetration, resolve_contact
from .kinematic_path import KinematicPath, checked_target

# Depth that is left uncorrected, as a share of the radius and in m: a tenth of what is guaranteed,
# which costs nothing; shorter steps then approach the exact contact further.
_TOLERANCE_SHARE = 1e-3
_TOLERANCE = 1e-5
# Depth, as a multiple of the tolerance, from which on a sphere counts as placed inside the sheet,
# and a displacement of a particle counts as work against gravity.
_INSIDE = 10
# Speed, m/s, at which a sphere grows that was placed inside the sheet, and its least radius, m.
GROWTH = 1.0
_SMALLEST = 1e-4
# m/s; a faster sphere is not swept, but placed where it is commanded to be.
_FASTEST = 1e6


@exact_subroutine
def _load(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, h, start, drift, points, velocities,
    inverse_masses,
):  # fmt: skip
    """Write the particles as they were before the substep, relative to the sphere."""
    for n in range(len(particles)):
        i = particles[n]
        inverse_masses[n] = mobility[0, i] * mobility[1, i]
        for axis in range(3):
            speed = np.float64(velocity[axis, i])
            points[n, axis] = np.float64(position[axis, i]) - h * speed - start[axis]
            velocities[n, axis] = speed - drift[axis]


@exact_subroutine
def _store(  # type: ignore[no-untyped-def]
    position, velocity, particles, end, drift, points, velocities, inverse_masses, least
):
    """
    Write back the particles that move.

    Return the sums of the changes of velocity and of position, times the masses, and the greatest
    change of a position, m.  Changes of position below `least`, m, do not count in the sum.
    """
    u, v, w = 0.0, 0.0, 0.0
    x, y, z = 0.0, 0.0, 0.0
    farthest = 0.0
    for n in range(len(particles)):
        if inverse_masses[n] > 0:
            i, mass = particles[n], 1.0 / inverse_masses[n]
            u += mass * (velocities[n, 0] + drift[0] - velocity[0, i])
            v += mass * (velocities[n, 1] + drift[1] - velocity[1, i])
            w += mass * (velocities[n, 2] + drift[2] - velocity[2, i])
            a = points[n, 0] + end[0] - position[0, i]
            b = points[n, 1] + end[1] - position[1, i]
            c = points[n, 2] + end[2] - position[2, i]
            squared = a * a + b * b + c * c
            farthest = max(farthest, squared)
            if squared > least * least:
                x, y, z = x + mass * a, y + mass * b, z + mass * c
            for axis in range(3):
                position[axis, i] = points[n, axis] + end[axis]
                velocity[axis, i] = velocities[n, axis] + drift[axis]
    return (u, v, w), (x, y, z), np.sqrt(farthest)


@exact
def _resolve_substep(  # type: ignore[no-untyped-def]
    position, velocity, mobility, particles, triangles, h, start, end, drift, gravity,
    radius, friction, tolerance,
):  # fmt: skip
    """
    Move a sphere and a part of the sheet through a substep.

    Parameters
    ----------
    position, velocity, mobility
        Flat arrays after the substep, of which the first two are corrected.
    particles, triangles
        From `BroadPhase.find`.
    h
        Length of the substep, s.
    start, end, drift
        Centre of the sphere before and after, m, and its velocity, m/s, shape (3,).
    gravity
        m/s², shape (3,).
    radius, friction, tolerance
        As in `resolve_contact`.

    Returns
    -------
    (float, bool, bool, bool, float, float)
        Depth, touch and force as from `resolve_contact`; whether there are pinned particles; the
        work of the sphere, J for cells of 1 kg; and the greatest correction of a position, m.

    """
    number = len(particles)
    points, velocities = np.empty((number, 3)), np.empty((number, 3))
    inverse_masses = np.empty(number)
    _load(
        position, velocity, mobility, particles, h, start, drift, points, velocities,
        inverse_masses,
    )  # fmt: skip
    depth, touched, forced = resolve_contact(
        points, velocities, inverse_masses, triangles, radius, friction, h, tolerance
    )
    work, farthest = 0.0, 0.0
    if touched:
        impulse, lifted, farthest = _store(
            position, velocity, particles, end, drift, points, velocities, inverse_masses,
            _INSIDE * tolerance,
        )  # fmt: skip
        along, up = 0.0, 0.0
        for axis in range(3):
            along += drift[axis] * impulse[axis]
            up -= gravity[axis] * lifted[axis]
        work = along + max(up, 0.0)
    pinned = False
    for n in range(number):
        pinned = pinned or inverse_masses[n] == 0.0
    return depth, touched, forced, pinned, work, farthest


class SphereSnapshot(NamedTuple):
    """Everything about a sphere that later results depend on; see `SphereCollider`."""

    centre: Array
    radius: float
    full_radius: float
    max_penetration: float
    placed: bool
    fastest: float
    candidates: Candidates


class SphereCollider:
    """
    A sphere that moves as commanded, and its contact with the sheet; an `Interaction`.

    Attributes
    ----------
    radius
        Present radius, m.
    touched
        True if it has touched the sheet since the last `take_work`.
    max_penetration
        Greatest depth, m, of a triangle in the sphere after the last substep, where it is above
        the tolerance: pins hold the sheet inside the sphere.

    """

    name = 'sphere'
    shape = 'sphere'

    def __init__(
        self, scene: Scene, grid: Grid, parameters: ColliderParameters | None = None
    ) -> None:
        sphere = scene.sphere if parameters is None else parameters
        if parameters is not None:
            self.name = parameters.name
        self.orientation = (0.0, 0.0, 0.0, 1.0) if parameters is None else parameters.orientation
        self.touched = False
        self.max_penetration = 0.0
        self.radius = self._full_radius = sphere.radius
        self.initial_position = sphere.position
        self._centre = np.array(sphere.position, float)
        self._path = KinematicPath([self._centre], 0.0, 1.0)
        self._friction, self._gravity = sphere.friction, np.array(scene.gravity)
        self._cell_mass = scene.sheet.cell_mass
        self._tolerance = min(_TOLERANCE_SHARE * sphere.radius, _TOLERANCE)
        self._broad_phase = BroadPhase(grid)
        self._fastest = 0.0  # m/s, of the particles when they were last compared
        self._work = 0.0
        self._placed = True

    @property
    def position(self) -> Vector:
        """Centre in the world, m."""
        x, y, z = self._centre.tolist()
        return (x, y, z)

    @property
    def size(self) -> Vector:
        """Diameter now, m, along each axis."""
        return (2 * self.radius, 2 * self.radius, 2 * self.radius)

    def checked_target(self, position: Sequence[float], sheet: Array) -> Vector:
        """Return a commanded centre, m, near a sheet at `sheet`, m; raises ValueError."""
        size = self._full_radius
        return checked_target(self.name, position, 'sphere.position', size, sheet)

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """Start on the path that is commanded for an advance."""
        points = [self._centre, *map(np.array, inputs.collider_paths.get(self.name, ()))]
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        if length > _FASTEST * seconds:
            self._centre = points[-1]
            self.respawn(state)
            points = [self._centre]
        self._path = KinematicPath(points, time, seconds)

    def may_act(self, state: State, seconds: float) -> bool:
        """
        Return False if the sphere is too far away to reach the sheet within `seconds`.

        Not even if the sheet becomes twice as fast in that time; `act` checks that afterwards.
        """
        if self.radius < self._full_radius:  # it grows
            return True
        self._fastest = max_speed(state)
        return not self._broad_phase.is_clear(seconds * (2 * self._fastest + self._path.speed))

    def contact_possible(self, state: State, seconds: float, inputs: Inputs) -> bool:
        """Return False if no contact is possible within `seconds`; compiles no kernel."""
        centre = self._centre - state.origin
        speed = float(np.linalg.norm(state.velocities, axis=0).max())
        points = [self._centre, *map(np.array, inputs.collider_paths.get(self.name, ()))]
        approach = np.linalg.norm(np.diff(points, axis=0), axis=1).sum() + seconds * 2 * speed
        # True for NaN.
        return not self._broad_phase.distance(state, centre, centre) > self._full_radius + approach

    def act(self, state: State, time: float, h: float) -> None:
        """Move the sphere through the substep that `state` has just made; resolve contact."""
        velocity = self._path.velocity(time, h)
        start = self._centre - state.origin
        end = start + h * velocity
        self._centre = self._centre + h * velocity
        before = self.radius
        growing = before < self._full_radius
        if growing:
            self.radius = min(before + h * GROWTH, self._full_radius)
            self._broad_phase.invalidate()
        former, self._fastest = self._fastest, max_speed(state)
        approach = h * (
            max(self._fastest, former) + math.hypot(*velocity)
        )  # NaN if it is that now
        self._broad_phase.reduce_clearance(approach)
        self.max_penetration = 0.0
        if self._broad_phase.clearance > 0:
            return
        particles, triangles = self._broad_phase.find(state, h, start, end, self.radius, approach)
        if not len(particles):
            return
        self.max_penetration, touched, forced, pinned, work, farthest = _resolve_substep(
            state.position, state.velocity, state.mobility, particles, triangles,
            h, start, end, velocity, self._gravity, self.radius, self._friction, self._tolerance,
        )  # fmt: skip
        if touched:
            self.touched = True
            self._work += math.inf if forced or growing else work
            self._broad_phase.reduce_clearance(farthest)
        if forced and self.max_penetration > 0.0:
            # Particles are too fast to be pushed out: the sphere shrinks to the room that is left.
            # Not where pins hold the sheet; they leave none.
            least = before if pinned else min(_SMALLEST, self._full_radius)
            room = max(self.radius - self.max_penetration, least)
            self.max_penetration = max(self.max_penetration - (self.radius - room), 0.0)
            self.radius = room

    def end_advance(self) -> None:
        """Place the sphere exactly at the end of its path, without the rounding of substeps."""
        self._broad_phase.reduce_clearance(float(np.linalg.norm(self._path.end - self._centre)))
        self._centre = self._path.end

    def take_work(self) -> float:
        """
        Return the most work, J, that the sphere can have done since the last call.

        In the frame of the sphere, contact adds no energy; in that of the world, an impulse J then
        adds u·J at most, with u the velocity of the sphere, and the work against gravity of
        particles that a long substep displaces without an impulse.  The work of a sphere that
        grows in touch with the sheet, or that the sheet cannot avoid, is unknown:
        inf.
        """
        work, self._work, self.touched = self._work, 0.0, False
        return self._cell_mass * work

    def invalidate(self) -> None:
        """Search the whole sheet again: its velocities were assigned."""
        self._broad_phase.invalidate()

    def respawn(self, state: State) -> None:
        """Shrink to the room that the sheet leaves: one of both was placed from outside."""
        self._broad_phase.invalidate()
        self.max_penetration = 0.0
        self._placed = True
        self._shrink_to_fit(state)

    def _shrink_to_fit(self, state: State) -> None:
        """Shrink a sphere that was placed inside the sheet to the room that is there."""
        if not self._placed:
            return
        self._placed = False
        self.radius = self._full_radius
        centre = self._centre - state.origin
        particles, triangles = self._broad_phase.find(state, 0.0, centre, centre, self.radius, 0.0)
        if len(particles):
            points = state.position[:, particles].T.astype(float) - centre
            depth = max_penetration(points, triangles, self.radius)
            if depth > _INSIDE * self._tolerance:
                self.radius = max(self.radius - depth, min(_SMALLEST, self._full_radius))
                depth -= self._full_radius - self.radius
                self.max_penetration = depth if depth > 2 * self._tolerance else 0.0

    def snapshot(self) -> SphereSnapshot:
        """Return everything about the sphere that later results depend on."""
        return SphereSnapshot(
            self._centre,
            self.radius,
            self._full_radius,
            self.max_penetration,
            self._placed,
            self._fastest,
            self._broad_phase.candidates(),
        )

    def warm_up(self, dtype: Any) -> None:
        """Compile the kernels of contact, so that the first contact causes no pause."""
        grid = Grid(2, 2)
        scene = Scene().with_parameters(
            {'sheet.rows': 2, 'sheet.columns': 2, 'pins': [''], 'sphere.radius': 1.0}
        )
        collider, state = SphereCollider(scene, grid), State(grid, dtype)
        collider.respawn(state)
        collider.act(state, 0.0, 1e-3)

    def restore(self, snapshot: SphereSnapshot, state: State, *, exact: bool) -> None:
        """Return to a snapshot; not `exact`: of a sphere or a sheet with other parameters."""
        self._centre = snapshot.centre
        if snapshot.full_radius == self._full_radius:
            self.radius, self._placed = snapshot.radius, snapshot.placed
            self.max_penetration = snapshot.max_penetration
        if exact:
            self._fastest = snapshot.fastest
            self._broad_phase.restore(snapshot.candidates)
        else:
            self._broad_phase.invalidate()
            self._shrink_to_fit(state)


def sphere_colliders(scene: Scene, grid: Grid) -> list[SphereCollider]:
    """Return the sphere of a scene, if it has one."""
    spheres = (each for each in scene.all_colliders() if each.type == 'sphere')
    return [SphereCollider(scene, grid, each) for each in spheres]
