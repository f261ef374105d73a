"""A collider: its shape, its motion in an advance, and the contact forces on it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...scene.collider import ColliderParameters
from ...scene.quaternion import Quaternion, rotation_matrix
from ..grid import Array
from ..inputs import Inputs, Pose, Vector
from ..kinematic_path import KinematicPath, motion_rows
from .particle_contact import (
    ALLOWANCE,
    FRICTION,
    GROWTH,
    INSET,
    LIMIT,
    POINT,
    ROTATION,
    ROW,
    SHAPE,
    SLOP,
    SPIN,
)
from .shapes import shape_of
from .shapes.capsule import capsule
from .shapes.shape import COMMON, CONSTANTS

# Share of its inner radius by which collider and sheet may approach each other in a substep.
_TRAVEL = 0.25
# A collider is small, if its blunt radius is below so many circumradii of the triangles.
_SMALL = 1.5
# Speed, m/s, at which a collider grows that was placed inside the sheet.
GROWTH_SPEED = 0.5
# Inset, m, below which a collider has reached its size: times are rounded.
_GROWN = 1e-9
# m/s; a faster collider is not moved through the sheet, but placed where it is commanded to be.
_FASTEST = 1e6
# Depth that triangles are left in a collider, as a share of its inner radius, and in m.
_TOLERANCE_SHARE, _TOLERANCE = 1e-3, 1e-5
# Depth that particles are left in the offset surface, as a share of the blunt radius, and in m.
_ALLOWANCE_SHARE, _ALLOWANCE = 1e-3, 2e-5
# m; a depth that is not reached.
_NEVER = 1e9
# Roundings of a coordinate within which a particle counts as touching.
_ROUNDINGS = 8


class ColliderSnapshot(NamedTuple):
    """Everything about a collider that later results depend on; see `RigidCollider`."""

    parameters: ColliderParameters
    pose: Pose
    inset: float
    max_penetration: float
    clearance: float
    total: tuple[float, ...]
    work: float
    touching: int


class RigidCollider:
    """
    A rigid body that moves as commanded; a `Collider`.

    Attributes
    ----------
    parameters
        From the scene.
    shape
        Its shape.
    pose
        Origin in the world, m, and orientation, x y z w.
    inset
        How far inside of the surface the sheet meets it, m: 0, or more while it grows.
    max_penetration
        Greatest depth, m, of a triangle after the last substep, where it is above the tolerance:
        pins hold the sheet inside the collider.
    tolerance
        Depth, m, that is not corrected.
    work
        Most work that it has done on the sheet since this was reset, J for cells of 1 kg.
    touching
        Number of particles that touched it in the last substep.
    small
        True if it may get between particles: only triangles are enough to stop it.
    clearance
        Distance, m, by which collider and sheet can still approach each other without a touch; 0
        or less if it is unknown.

    """

    def __init__(
        self, parameters: ColliderParameters, rho: float, extent: float, dtype: type
    ) -> None:
        self.parameters = parameters
        self.name, self.type = parameters.name, parameters.type
        self.shape = shape_of(parameters, rho)
        self._extent = extent
        # About the origin: a sphere has no other reference point than on its surface.
        self._triangle_shape = self.shape
        self._centre, self._turn = np.zeros(3), np.eye(3)
        if parameters.type == 'sphere':
            self._triangle_shape = capsule(parameters.radius, 0.0)
        self.small = self.shape.blunt_radius < _SMALL * rho
        if self.small and self.shape.enclosing is not None:
            radius, length, self._centre, self._turn = self.shape.enclosing
            self._triangle_shape = capsule(radius, length)
        self.tolerance = min(_TOLERANCE_SHARE * self.shape.inner_radius, _TOLERANCE)
        self.inset = self.max_penetration = 0.0
        self.clearance = 0.0
        self.pose: Pose = parameters.pose
        self.path = KinematicPath([self.pose], 0.0, 1.0, 1.0)
        self._size = min(self.shape.bounding_radius, extent)
        self._slop = _ROUNDINGS * float(np.finfo(dtype).eps) * (self._size + extent)
        # Of a plane particles are the deepest points; between them others have triangles.
        plane = math.isinf(self.shape.inner_radius)
        self._limit = _ALLOWANCE if plane else _NEVER
        self._allowance = min(_ALLOWANCE_SHARE * self.shape.blunt_radius, _ALLOWANCE)
        # Of particles and of triangles: what the row was made for, and the row.
        self._at_rest: list[tuple[Any, Array] | None] = [None, None]
        self._seconds = 0.0
        self.work, self.touching = 0.0, 0
        self._total = [0.0] * 6  # impulse, and moment about the origin, in this advance

    def is_sharp(self, travel: float) -> bool:
        """Return whether contact of particles lets triangles in, in a step of `travel` m."""
        inner_radius = self.shape.inner_radius
        if math.isinf(inner_radius):  # a plane never does
            return False
        # True for NaN.
        slow = travel < _TRAVEL * inner_radius
        return self.small or self.inset > 0.5 * inner_radius or not slow

    @property
    def position(self) -> Vector:
        """Origin in the world, m."""
        return self.pose[:3]

    @property
    def orientation(self) -> Quaternion:
        """Orientation in the world, quaternion x y z w."""
        return self.pose[3:]

    @property
    def normal(self) -> Array:
        """Direction of its local z axis, shape (3,): the normal of a plane."""
        axis: Array = rotation_matrix(self.orientation)[:, 2]
        return axis

    @property
    def mesh_triangles(self) -> Array | None:
        """Triangles of a mesh in its own frame, m, shape (n, 3, 3); None for other types."""
        return self.shape.triangles

    @property
    def kind(self) -> int:
        """Number of the branch in the kernels."""
        return self.shape.kind

    @property
    def triangle_radii(self) -> tuple[float, float]:
        """Of balls about the reference point that contain, and are in, what triangles meet, m."""
        return self._triangle_shape.bounding_radius, self._triangle_shape.inner_radius

    @property
    def triangle_kind(self) -> int:
        """The same, in the kernels of triangles."""
        return self._triangle_shape.kind

    @property
    def grows(self) -> bool:
        """True if it was placed inside the sheet, and has not reached its size."""
        return self.inset > 0

    @property
    def speed(self) -> float:
        """Greatest speed, m/s, of its origin in this advance."""
        return self.path.length / self._seconds if self._seconds else 0.0

    @property
    def spin(self) -> float:
        """Rate at which it turns in this advance, rad/s."""
        return self.path.turned / self._seconds if self._seconds else 0.0

    def surface_speed(self, origin: Array) -> float:
        """Return a bound of the speed, m/s, of its points near a sheet with this origin, m."""
        if not self.path.moves:
            return 0.0
        away = float(np.linalg.norm(origin - np.array(self.position))) + 3 * self._extent
        return self.speed + self.spin * min(self.shape.bounding_radius, away)

    def reaches(self, points: Array, margin: float) -> bool:
        """Return False if a sheet at points in the world, m, (3, n), is beyond its bounds."""
        points = points - np.array(self.position)[:, None]
        if math.isinf(self.shape.bounding_radius):
            return not (self.normal @ points).min() > margin  # True for NaN
        low, high = points.min(axis=1), points.max(axis=1)
        apart = np.maximum(np.maximum(low, -high), 0.0)
        return not float(np.linalg.norm(apart)) > self.shape.bounding_radius + margin

    def may_reach(self, points: Array, margin: float, inputs: Inputs) -> bool:
        """Return the same for the motion that is commanded."""
        path = np.array([self.pose, *inputs.collider_paths.get(self.name, ())])
        moved = float(np.linalg.norm(np.diff(path[:, :3], axis=0), axis=1).sum())
        turned = len(path) > 1 and math.isinf(self.shape.bounding_radius)
        return turned or self.grows or self.reaches(points, margin + moved)

    # Motion

    def begin_advance(self, time: float, seconds: float, inputs: Inputs) -> bool:
        """Start on the path that is commanded; return False if it is too fast to be followed."""
        commanded = inputs.collider_paths.get(self.name, ())
        self._seconds = seconds
        self._total = [0.0] * 6
        if not commanded and not self.path.moves:
            return True
        self.path = KinematicPath([self.pose, *commanded], time, seconds, self._size)
        if self.path.length <= _FASTEST * seconds:
            return True
        self.pose = self._last()
        self.path = KinematicPath([self.pose], time, seconds, self._size)
        return False

    def _last(self) -> Pose:
        x, y, z, a, b, c, d = self.path.end.tolist()
        return (x, y, z, a, b, c, d)

    def move_to(self, time: float) -> None:
        """Take the pose at a time in the advance, s."""
        if self.path.moves:
            x, y, z, a, b, c, d = self.path.poses(np.array([time]))[0].tolist()
            self.pose = (x, y, z, a, b, c, d)

    def end_advance(self) -> None:
        """Take the pose at the end of the path."""
        if self.path.moves:
            self.pose = self._last()
            self.path = KinematicPath([self.pose], 0.0, 1.0, self._size)

    def grow(self, seconds: float) -> None:
        """Let the surface move out for some time, s, if it is not where it should be."""
        left = float(self.inset - GROWTH_SPEED * seconds)
        self.inset = left if left > _GROWN else 0.0

    # What the kernels take

    def rows(self, origin: Array, times: Array, *, triangles: bool = False) -> Array:
        """
        Return the rows for the kernels, see `particle_contact`.

        Parameters
        ----------
        origin
            Of the state, m.
        times
            At the start, and after each drift, s.
        triangles
            True for rows about the origin of the collider, as kernels of triangles take them.

        Returns
        -------
        array
            One row for each drift, shape (len(times) - 1, ROW); only one if nothing changes.

        """
        at_rest = self.row_at_rest(origin, triangles=triangles)
        if at_rest is not None:
            return at_rest
        rows = self._make_rows(origin, times, triangles=triangles)
        if not self.path.moves and not self.grows:
            self._at_rest[triangles] = ((self.pose, origin.tobytes()), rows)
        return rows

    def row_at_rest(self, origin: Array, *, triangles: bool = False) -> Array | None:
        """Return the row of a collider that does not change, if it is known; see `rows`."""
        known = self._at_rest[triangles]
        if known is None or self.path.moves or self.grows:
            return None
        return known[1] if known[0] == (self.pose, origin.tobytes()) else None

    def _make_rows(self, origin: Array, times: Array, *, triangles: bool) -> Array:
        still = not self.path.moves
        count = 1 if still and not self.grows else len(times) - 1
        rows = np.zeros((count, ROW))
        poses = (
            self.path.poses(times[: count + 1]) if not still else np.array([self.pose, self.pose])
        )
        shape = self._triangle_shape if triangles else self.shape
        reference, turn = self._centre, None
        if not triangles:
            away = rotation_matrix(poses[0, 3:]).T @ (origin - poses[0, :3])
            reference = shape.reference(away)
        else:  # about the centre of what they meet, and along its axes
            turn = self._turn
        rows[:, ROTATION:INSET] = motion_rows(
            poses, None if still else times[: count + 1], origin, reference, turn
        )
        if triangles:
            reference = np.zeros(3)
        elapsed = times[1 : count + 1] - times[0]
        if self.grows:
            rows[:, INSET] = np.maximum(self.inset - GROWTH_SPEED * elapsed, 0.0)
            rows[:, GROWTH] = GROWTH_SPEED * (rows[:, INSET] > 0)
        rows[:, FRICTION], rows[:, SLOP] = self.parameters.friction, self._slop
        rows[:, ALLOWANCE], rows[:, LIMIT] = self._allowance, self._limit
        constants = shape.constants(reference)
        rows[:, SHAPE : SHAPE + len(constants)] = constants
        rows[:, SHAPE + CONSTANTS :] = COMMON
        return rows

    def take(self, row: Array, origin: list[float], sums: list[float]) -> None:
        """
        Add the sums of a batch to those so far.

        Parameters
        ----------
        row
            The last one of the batch, shape (ROW,).
        origin
            Of the state, m, three numbers.
        sums
            Of the batch, `SUMS` numbers.

        """
        jx, jy, jz, lx, ly, lz, work, _, touching = sums
        # From the origin to the reference point, as both are at the end of the batch.
        point = row[POINT:SPIN].tolist()
        x, y, z = [point[k] + (origin[k] - self.pose[k]) for k in range(3)]
        self._total[0] += jx
        self._total[1] += jy
        self._total[2] += jz
        self._total[3] += lx + y * jz - z * jy
        self._total[4] += ly + z * jx - x * jz
        self._total[5] += lz + x * jy - y * jx
        self.work += work
        self.touching = int(touching)

    def wrench(self, cell_mass: float) -> tuple[Vector, Vector]:
        """Return force, N, and torque about the origin, N m, of the sheet on it: their means."""
        if not self._seconds:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        # The impulses are those on the sheet.
        a, b, c, d, e, f = [-cell_mass / self._seconds * each for each in self._total]
        return (a, b, c), (d, e, f)

    # Snapshots

    def snapshot(self) -> ColliderSnapshot:
        """Return everything that later results depend on."""
        return ColliderSnapshot(
            self.parameters, self.pose, self.inset, self.max_penetration, self.clearance,
            tuple(self._total), self.work, self.touching,
        )  # fmt: skip

    def restore(self, snapshot: ColliderSnapshot, *, exact: bool) -> bool:
        """Return to a snapshot; return False if it is one of another shape."""
        self.pose = snapshot.pose
        self.clearance = snapshot.clearance if exact else 0.0
        self._total, self.work = list(snapshot.total), snapshot.work
        self.touching = snapshot.touching
        before, now = snapshot.parameters, self.parameters
        names = ('type', 'size', 'radius', 'length', 'mesh')
        same = [getattr(before, each) for each in names] == [getattr(now, each) for each in names]
        if same:
            self.inset, self.max_penetration = snapshot.inset, snapshot.max_penetration
        return same
