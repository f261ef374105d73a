"""All grippers of a scene: what they take and release, and how they move it through batches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from ...scene import Scene
from ...scene.parameter import format_value
from ..grid import Array, Grid
from ..inputs import Inputs
from ..kinematic_path import MOTION, motion_rows
from ..state import State
from .gripper import Gripper, GripperSnapshot
from .held_particles import IMPULSE, MOMENT, PULL, SUMS, WORK, GripTable

# Of all grippers by name; see `Grippers`.
GrippersSnapshot = Mapping[str, GripperSnapshot]


class Drift(Protocol):
    """A step of an integrator, as far as grippers are concerned."""

    @property
    def drift(self) -> float:
        """Duration of the drift, s."""
        ...


class Grippers:
    """
    Grippers of a scene, and the particles that they hold.

    A particle is held by one gripper at most, and not if it is pinned.

    Parameters
    ----------
    scene, grid
        Grippers, and the sheet that they hold.

    Attributes
    ----------
    by_name
        The grippers.

    """

    def __init__(self, scene: Scene, grid: Grid) -> None:
        self.by_name = {each.name: Gripper(each) for each in scene.grippers}
        self._all = list(self.by_name.values())
        self._slips = any(each.parameters.slip_force > 0 for each in self._all)
        self._grid, self._cell_mass = grid, scene.sheet.cell_mass
        self._free = ~scene.pinned().ravel()
        self._masses = grid.tributary_areas.ravel()
        self._time = 0.0
        self._reached = np.zeros((len(self._all), 7))  # poses after the last steps
        self._at_rest: tuple[Any, Array] | None = None
        self._collect_held()

    def _held_changed(self, state: State) -> None:
        """Take account of other particles that are held."""
        self._collect_held()
        state.hold(self._table.particles)

    def _collect_held(self) -> None:
        """Collect the particles that are held, in their order in the sheet."""
        held = np.concatenate([each.held for each in self._all])
        owner = np.repeat(np.arange(len(self._all)), [len(each.held) for each in self._all])
        local = np.concatenate([each.local for each in self._all])
        order = np.argsort(held)
        numbers = held[order]
        row, column = np.divmod(numbers, self._grid.columns)
        self._table = GripTable(
            self._grid.begin + row * self._grid.stride + column,
            owner[order],
            local[order],
            self._masses[numbers],
            np.zeros((1, len(self._all), MOTION)),
            np.zeros((len(numbers), 3)),
            np.zeros((len(numbers), SUMS)),
            np.zeros((len(numbers), 2, 3)),
        )
        # Impulses of the sheet on each particle in the present batch, kg m/s for cells of 1 kg.
        self._pulled = np.zeros((len(numbers), 3))

    # Grasp and release

    def _holder(self) -> Array:
        """Return the number of the gripper of each particle; -1: free; -2: pinned."""
        holder = np.where(self._free, -1, -2)
        for number, each in enumerate(self._all):
            holder[each.held] = number
        return holder

    def _apply(self, commands: Sequence[tuple[str, bool]], state: State) -> Array:
        """Return which gripper holds each particle after commands to grasp or release."""
        holder = self._holder()
        points = state.world_positions.reshape(3, -1).T
        for name, closes in commands:
            number = list(self.by_name).index(name)
            if closes:
                near = self._all[number].distances(points) <= self._all[number].parameters.radius
                holder[near & (holder == -1)] = number
            else:
                holder[holder == number] = -1
        return holder

    def preview(self, name: str, commands: tuple[tuple[str, bool], ...], state: State) -> int:
        """
        Return the number of particles that a gripper holds after commands.

        Raises
        ------
        ValueError
            It holds none, although the last command is to close it; says how far the nearest is.

        """
        number = list(self.by_name).index(name)
        holder = self._apply(commands, state)
        count = int((holder == number).sum())
        if count or commands[-1:] != ((name, True),):
            return count
        gripper = self._all[number]
        where = f'gripper.{name}.radius'
        free = holder == -1
        if not free.any():
            raise ValueError(
                f'{format_value(name)} takes nothing: all particles are pinned or held by others; '
                'release some'
            )
        points = state.world_positions.reshape(3, -1).T[free]
        distance = float(gripper.distances(points).min())
        radius = gripper.parameters.radius
        raise ValueError(
            f'the distance of {format_value(name)} from the nearest particle that it can take is '
            f'{distance:.4g} m, but must be at most {where}, {radius:g} m; move it nearer'
        )

    def _grasp_and_release(self, commands: Sequence[tuple[str, bool]], state: State) -> None:
        before, after = self._holder(), self._apply(commands, state)
        if np.array_equal(before, after):
            return
        points = state.world_positions.reshape(3, -1).T
        for number, each in enumerate(self._all):
            each.keep(after[each.held] == number)
            taken = np.flatnonzero((after == number) & (before != number))
            if len(taken):
                each.take(taken, points[taken])
        self._held_changed(state)

    def place(self, state: State) -> None:
        """Hold the same particles where they are now: their positions were assigned."""
        points = state.world_positions.reshape(3, -1).T
        for each in self._all:
            each.place(points[each.held])
        self._held_changed(state)

    # An advance

    def begin_advance(self, state: State, time: float, seconds: float, inputs: Inputs) -> None:
        """
        Grasp and release as commanded, and start on the paths for `seconds` from `time`, s.

        The particles get their velocities now: step control and contact must know them.
        """
        self._collect()
        self._grasp_and_release(inputs.grips, state)
        for each in self._all:
            each.begin_advance(time, seconds, inputs.gripper_paths.get(each.name, ()))
        table, velocities = self._table, np.zeros((len(self._table.particles), 3))
        for number, each in enumerate(self._all):
            velocities[table.owner == number] = each.velocities_at(time)
        before = state.velocity[:, table.particles].T.astype(float)
        after = velocities.astype(state.dtype).astype(float)
        state.velocity[:, table.particles] = after.T
        impulse = table.mass[:, None] * (after - before)
        arms = state.position[:, table.particles].T + state.origin - self._origins()
        table.sums[:, IMPULSE:MOMENT] += impulse
        table.sums[:, MOMENT:WORK] += np.cross(arms, impulse)
        table.sums[:, WORK] += 0.5 * np.sum(impulse * (after + before), axis=1)
        self._collect()  # a roll-back of the first batch must not undo it

    def _origins(self) -> Array:
        """Return the origin of the gripper of each held particle, m, shape (n, 3)."""
        origins = np.array([each.position for each in self._all])
        placed: Array = origins[self._table.owner]
        return placed

    def end_advance(self) -> None:
        """Place the grippers at the ends of their paths."""
        self._collect()
        for each in self._all:
            each.end_advance()

    def begin_steps(self, state: State, time: float) -> None:
        """Prepare for steps that begin at a time, s."""
        self._time = time
        self._table.former[...] = state.velocity[:, self._table.particles].T

    def table(self, state: State, steps: Sequence[Drift]) -> GripTable:
        """Return what the kernel takes for the next steps."""
        times = self._time + np.cumsum([0.0, *[step.drift for step in steps]])
        self._time = float(times[-1])
        if not any(each.path.moves for each in self._all):
            return self._table._replace(rows=self._rows_at_rest(state.origin))
        poses = np.empty((len(times), len(self._all), 7))
        for number, each in enumerate(self._all):
            poses[:, number] = each.poses(times)
        self._reached = poses[-1]
        return self._table._replace(rows=motion_rows(poses, times, state.origin))

    def _rows_at_rest(self, origin: Array) -> Array:
        """Return the motion of grippers that rest, which is found once."""
        key = ([each.pose for each in self._all], origin.tobytes())
        if self._at_rest is None or self._at_rest[0] != key:
            poses = np.array([[each.pose for each in self._all]] * 2)
            self._at_rest = (key, motion_rows(poses, None, origin))
        return self._at_rest[1]

    @property
    def unmoved(self) -> GripTable:
        """A table for operations without a drift."""
        return self._table

    def mark(self) -> tuple[float, Array, Array]:
        """Return what steps change, for `go_back`."""
        return self._time, self._table.former.copy(), self._table.sums.copy()

    def go_back(self, mark: tuple[float, Array, Array]) -> None:
        """Undo steps since `mark`."""
        self._time, self._table.former[...], self._table.sums[...] = mark

    def end_steps(self) -> None:
        """Take the poses that the last steps have reached."""
        for number, each in enumerate(self._all):
            if each.path.moves:
                each.move_to(self._reached[number])

    # Work, forces and slip

    def _collect(self) -> None:
        """Add the sums of particles to those of their grippers."""
        table = self._table
        for number, each in enumerate(self._all):
            sums = table.sums[table.owner == number]
            total = sums.sum(axis=0)
            each.add(total[IMPULSE:MOMENT], total[MOMENT:WORK], float(total[WORK]))
        self._pulled += table.sums[:, PULL:]
        table.sums[...] = 0

    def take_work(self) -> float:
        """Return the work of the grippers since the last call, J."""
        self._collect()
        work = sum(each.work for each in self._all)
        for each in self._all:
            each.work = 0.0
        return self._cell_mass * work

    def slip(self, state: State, seconds: float) -> None:
        """Let particles slip out of grips that were pulled too hard in a batch of `seconds`."""
        self._collect()
        if self._slips:
            owner, pulled = self._table.owner, self._pulled
            slipped = [
                each.slip(pulled[owner == number], seconds, self._cell_mass)
                for number, each in enumerate(self._all)
                if each.parameters.slip_force > 0
            ]
            if any(slipped):
                self._held_changed(state)
        self._pulled[...] = 0

    # Snapshots

    def snapshot(self) -> GrippersSnapshot:
        """Return everything that later results depend on."""
        return {name: each.snapshot() for name, each in self.by_name.items()}

    def restore(self, snapshot: GrippersSnapshot, state: State) -> None:
        """Return to a snapshot; grippers that it lacks are as at first, and no pin is held."""
        for name, each in self.by_name.items():
            known = snapshot.get(name)
            each.restore(Gripper(each.parameters).snapshot() if known is None else known)
            if not self._free[each.held].all():
                each.keep(self._free[each.held])
        self._held_changed(state)


def on_other_grid(
    snapshot: GrippersSnapshot, before: Grid, after: Grid, positions: Array, pinned: Array
) -> GrippersSnapshot:
    """
    Return grippers that hold the same part of a sheet on another grid.

    A gripper holds the particles whose nearest one on the former grid, in the undeformed sheet, it
    has held; at least the one that is nearest to the middle of these.

    Parameters
    ----------
    snapshot
        Of the former grid.
    before, after
        The grids.
    positions
        In the world, on the new grid, m, shape (3, rows, columns).
    pinned
        Which particles are on the new grid, bool, shape (rows, columns).

    """
    rows = _nearest(after.rows, before.rows)[:, None]
    columns = _nearest(after.columns, before.columns)
    former = (rows * before.columns + columns).ravel()
    points, free = positions.reshape(3, -1).T, ~pinned.ravel()
    result: dict[str, GripperSnapshot] = {}
    for name, each in snapshot.items():
        held = np.isin(former, each.held)
        if len(each.held) and not held.any():
            places = np.divmod(each.held, before.columns)
            row = _scaled(places[0].mean(), before.rows, after.rows)
            column = _scaled(places[1].mean(), before.columns, after.columns)
            held[row * after.columns + column] = True
        numbers = np.flatnonzero(held & free)
        free[numbers] = False
        gripper = Gripper(each.parameters)
        gripper.restore(
            each._replace(held=numbers[:0], local=np.zeros((0, 3)), pull=np.zeros((0, 3)))
        )
        gripper.take(numbers, points[numbers])
        result[name] = gripper.snapshot()
    return result


def _scaled(place: float, count: int, other: int) -> int:
    """Return the index along a side of `other` particles that is nearest to one of `count`."""
    return round(place * (other - 1) / max(count - 1, 1))


def _nearest(count: int, other: int) -> Array:
    """Return the nearest of `other` indices along a side for each of `count`."""
    places = np.arange(count) * ((other - 1) / max(count - 1, 1))
    nearest: Array = np.rint(places).astype(int)
    return nearest
