"""
Contact of the sheet with itself, in parts of a batch of substeps.

At the start of a part, the pairs of features are found that are near each other or approach; the
kernel of kicks and drifts keeps them apart after every kick (`sheet_contacts`).  At the end, the
paths of all pairs that are near each other are examined.  Pairs that would have passed through
each other are moved back, and where that is not enough the paths of their particles are shortened,
in the last resort to nothing: at the end of each part no feature has passed another.

Results are a function of the positions and velocities at the start and at the end of a part.
Lists, distances and directions that are kept from one part to the next only save time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...scene import Scene
from ..contact.surface import Surface
from ..grid import Array, Grid
from ..kernels.thread_pool import shared_thread_pool
from ..state import State, max_speed
from .contact_order import pack, write_packets
from .contact_rows import FACES, LAST, write_contacts
from .contact_search import FOUND, find_contacts
from .intersections import check_free_of_intersections
from .neighbours import Neighbours
from .pair_list import CHUNKS
from .particle_arrays import load_start, load_vectors, store_positions
from .path_search import find_blocked
from .response import push_back, shorten
from .sheet_contacts import CORNERS, LANES, PACKET, PARTICLE, ROW, SheetContacts
from .supports import UNSUPPORTED, find_supports

# Halvings of the paths of blocked pairs, after which they are not moved at all; and attempts after
# which nothing is.
_HALVINGS, _ATTEMPTS = 6, 24
_LEAST_ROOM = 16
# Share of a list's length that is added when it is too short.
_GROWTH = 1.3
# Motion, in thicknesses, after which distances are bounded by later positions.
_STALE = 0.05
# Particles from which on contacts are divided into groups for two threads, and others find them.
_MIN_DIVIDED = 4096
# Gap, in thicknesses, up to which a collider supports a particle.
_TOUCH = 0.1
# Largest divisor of parts, and parts without a blocked path after which it is halved, or
# without contact after which they may be longer.
MAX_DIVISION, _PATIENCE = 16, 16


class SelfContact:
    """
    Contact of a sheet with itself.

    Parameters
    ----------
    scene, grid, dtype
        Thickness, friction, and the sheet.

    Attributes
    ----------
    in_kernel
        Contacts of the part, for the kernel of kicks and drifts.
    contacts
        Number of pairs of features in contact in the last part.
    distance
        Least distance of these pairs at its start, m; inf: there was none.
    touched
        True if there was contact since it was last set to False.
    division
        Divisor of the longest part.
    shortened
        Number of times that paths of particles were shortened.

    """

    def __init__(self, scene: Scene, grid: Grid, dtype: type) -> None:
        sheet, parameters = scene.sheet, scene.self_contact
        self._dtype = dtype
        self._thickness, friction = parameters.thickness, parameters.friction
        self._flat, self._columns = grid.flat_indices, grid.columns
        # Longest motion in a part that is resolved, and in which contact is foreseen, m.
        self._farthest, self._foreseen = sheet.diagonal, 0.5 * sheet.shortest_spacing
        number = grid.rows * grid.columns
        self._divided = number >= _MIN_DIVIDED
        self._threads = shared_thread_pool(scene.solver.threads if self._divided else 1)
        self._neighbours = Neighbours(
            grid, dtype, self._thickness, sheet.shortest_spacing, self._foreseen, self._threads
        )
        self._start = grid.field(dtype)  # positions at the start of a part
        self._before, self._now, self._ahead = np.zeros((3, number, 3))
        self._inverse_masses = np.zeros(number)
        self._shifted = np.zeros(number, np.bool_)
        self._faces, self._last = np.zeros((number, FACES)), np.zeros((number, LAST))
        self._motions = np.zeros(number)
        # Distances are bounded by how far the particles of each cell have moved from positions of
        # reference, now and at the start of a part, and by how far these had moved before, m.
        self._reference = grid.field(dtype)
        self._moved: Array = np.zeros(number, dtype)
        self._former, self._passed = self._moved.copy(), np.zeros(number)
        # By flat index, as what follows.
        self._supports: Array = np.zeros((grid.size, 4), dtype)
        self._supports[:, 3] = UNSUPPORTED
        self._supported: Array = np.zeros(0, np.int64)  # flat indices
        self._none = SheetContacts(
            np.zeros((0, CORNERS * LANES), np.uint32), np.zeros((0, PACKET), dtype),
            np.zeros(4, np.int64), np.zeros(number, np.uint32), np.zeros(4, np.int64),
            np.zeros((number + 1, PARTICLE), dtype), friction,
        )  # fmt: skip
        self.in_kernel = self._none
        self._room = self._none._replace(starts=self._none.starts.copy())
        self._after, self._known = np.zeros((2, grid.size), np.int32)
        self._make_room(2 * CHUNKS * _LEAST_ROOM)
        self._make_room_for_packets(_LEAST_ROOM)
        self._blocked_particles: Array = np.zeros((CHUNKS, 4), np.int64)
        self._blocked: Array = np.zeros((CHUNKS, FOUND))
        self.contacts, self.distance, self.touched, self.shortened = 0, math.inf, False, 0
        self._origin: Array | None = None
        self.division, self._free = 1, 0

    def check(self, name: str, positions: Array) -> None:
        """Refuse positions, m, shape (3, rows, columns), of a sheet that passes through itself."""
        check_free_of_intersections(name, positions, self._thickness)

    def restart(self, pace: tuple[int, int] = (1, 0)) -> None:
        """Start again from the positions of the next part, which were assigned, at a pace."""
        self._origin = None
        self.division, self._free = pace

    def is_calm(self, state: State, seconds: float) -> bool:
        """Return whether there was no contact of late, and nothing moves far in `seconds`."""
        apart = self.division == 1 and self._free >= _PATIENCE
        return apart and seconds * max_speed(state) < self._thickness

    def part(self, count: int, most: int) -> int:
        """Return how many of the next `count` substeps make a part, at most `most`."""
        parts = math.ceil(count / most) * self.division
        return math.ceil(count / parts)

    @property
    def pace(self) -> tuple[int, int]:
        """Divisor of parts, and parts in a row with no path blocked, and undivided no contact."""
        return self.division, self._free

    def _adapt(self, *, blocked: bool) -> None:
        """Divide parts further where paths were blocked: to move particles back adds energy."""
        touched = self.division == 1 and self.contacts > 0
        self._free = 0 if blocked or touched else self._free + 1
        if blocked:
            self.division = min(2 * self.division, MAX_DIVISION)
        elif self._free >= _PATIENCE and self.division > 1:
            self.division, self._free = self.division // 2, 0

    # Start of a part

    def begin_part(self, state: State, seconds: float, surfaces: Sequence[Surface]) -> None:
        """
        Find the contacts of a part of `seconds` from a state that is accepted.

        Colliders may support the sheet by their surfaces.
        """
        self._start[...] = state.position
        near = self._neighbours
        if self._origin is not state.origin:
            self._origin = state.origin
            near.invalidate()
        if near.prepare(state.position, state.velocity, seconds):
            if near.whole:
                self._refer_to(state.position)
            near.list.offset(self._passed - self._moved)
        self.in_kernel = self._none
        self.contacts, self.distance = 0, math.inf
        if near.list.empty:
            return
        self._load_start(state, seconds, state.position)
        self._find_supports(state, surfaces)
        self._find_contacts(state)
        self.touched = self.touched or self.contacts > 0

    def _load_start(self, state: State, seconds: float, position: Array) -> None:
        load_start(
            position, state.velocity, state.contact_mobility, seconds, self._neighbours.mean,
            self._flat, self._neighbours.list.used, self._before, self._ahead, self._motions,
            self._inverse_masses,
        )  # fmt: skip

    def _refer_to(self, position: Array) -> None:
        """Bound the distances of a new list by motion from these positions, where it was made."""
        self._reference[...] = position
        self._moved[:] = self._passed[:] = 0.0

    def _find_supports(self, state: State, surfaces: Sequence[Surface]) -> None:
        supports, former = self._supports, self._supported
        supports[former] = 0.0, 0.0, 0.0, UNSUPPORTED
        used = self._flat[self._neighbours.list.used]
        for each in surfaces:
            find_supports(
                state.position, used, each.rho, each.kind, each.row, each.fields,
                _TOUCH * self._thickness, supports,
            )  # fmt: skip
        self._supported = np.flatnonzero(supports[:, 3] > UNSUPPORTED) if surfaces else former[:0]

    def _find_contacts(self, state: State) -> None:
        near, passed, moved = self._neighbours, self._passed, self._moved
        counts, least = np.empty(2 * CHUNKS, np.int64), np.empty(2 * CHUNKS)
        while True:
            self._threads.run(
                find_contacts, self._before, self._ahead, self._motions, *near.list.arrays,
                passed - moved, passed + moved, near.ahead, self._thickness, self._foreseen,
                self._columns, self._found, self._found_particles, counts, least,
            )  # fmt: skip
            if 2 * CHUNKS * counts.max() <= len(self._found):
                break
            self._make_room(2 * CHUNKS * int(_GROWTH * counts.max()))
        count = write_contacts(
            self._found, self._found_particles, counts, self._inverse_masses,
            self._supports, self._flat, self._faces, self._last, *self._written,
        )  # fmt: skip
        if count > len(self._slots):
            self._make_room_for_packets(int(_GROWTH * count))
        places, rows, starts, particles, firsts, copies, _ = self._room
        pack(
            *self._written, count, self._divided, state.position, self._after, self._following,
            self._filled, self._slots, starts,
        )  # fmt: skip
        write_packets(
            *self._written, self._slots, starts, self._supports, self._known, places, rows,
            particles, firsts, copies,
        )  # fmt: skip
        self.contacts, self.distance = count, float(least.min())
        self.in_kernel = self._room

    def _make_room(self, size: int) -> None:
        """Make room for so many contacts that are found."""
        self._found: Array = np.zeros((size, FOUND))
        self._found_particles: Array = np.zeros((size, CORNERS), np.uint32)
        self._written: tuple[Array, Array] = (
            np.zeros((size, CORNERS), np.int64),
            np.zeros((size, ROW), self._dtype),
        )

    def _make_room_for_packets(self, size: int) -> None:
        """Make room for packets of so many contacts, which may have none in common."""
        self._slots: Array = np.zeros((size, LANES), np.int32)
        self._following: Array = np.zeros(size + 1, np.int32)
        self._filled: Array = np.zeros(size + 1, np.int32)
        self._room = self._room._replace(
            places=np.zeros((size, CORNERS * LANES), np.uint32),
            rows=np.zeros((size, PACKET), self._dtype),
        )

    # End of a part

    def end_part(self, state: State) -> None:
        """Move back what has passed through the sheet in a part; its positions are changed."""
        near = self._neighbours
        new = near.follow(self._start, state.position, self._farthest)
        if new is None:
            # Too far, or not finite: the sheet stays as it was, and moves as a whole at most.
            mean = np.where(np.isfinite(near.mean), near.mean, 0.0).astype(state.dtype)
            state.position[...] = self._start + mean[:, None] * state.free
            self._origin = None
            return
        blocked = False
        if not near.list.empty:
            if new:  # pairs, of other particles
                self._load_start(state, 0.0, self._start)
            load_vectors(state.position, self._flat, near.list.used, self._now)
            self._former[:] = self._moved
            self._follow(state.position, new=new)
            blocked = self._accept_paths(state)
            if self._moved.max() > _STALE * self._thickness:
                self._passed += self._moved
                self._reference[...] = state.position
                self._moved[:] = 0.0
        self._adapt(blocked=blocked)

    def _follow(self, position: Array, *, new: bool) -> None:
        """Find how far the end of a part is from the reference; pairs may be new there."""
        near = self._neighbours
        if new and near.whole:
            self._refer_to(position)
            near.motion(self._start, position, self._former)
        else:
            near.motion(self._reference, position, self._moved)
        if new:
            near.list.offset(self._passed - self._moved)

    def _accept_paths(self, state: State) -> bool:
        """Move back what has passed through the sheet; return whether a path was blocked."""
        count = first = self._find_blocked(again=False)
        attempt = 0
        while count and attempt <= _ATTEMPTS:
            found = (self._blocked_particles, self._blocked, count)
            if attempt == 0:
                self._shifted[:] = False
                push_back(self._now, self._inverse_masses, *found, self._shifted)
            elif attempt < _ATTEMPTS:
                share = 0.5 if attempt <= _HALVINGS else 0.0
                shorten(self._now, self._before, share, found[0], count, self._shifted)
                self.shortened += 1
            else:
                state.position[...] = self._start
                self._now[...] = self._before
                self._shifted[self._neighbours.list.used] = True
            store_positions(self._now, self._shifted, self._flat, state.position)
            new = self._neighbours.follow(self._start, state.position, self._farthest)
            if new:
                self._load_start(state, 0.0, self._start)
                load_vectors(state.position, self._flat, self._neighbours.list.used, self._now)
            self._follow(state.position, new=bool(new))
            count = self._find_blocked(again=not new)
            attempt += 1
        return first > 0

    def _find_blocked(self, *, again: bool) -> int:
        """Return the number of pairs whose path is not accepted, which are listed."""
        near, passed, moved = self._neighbours, self._passed, self._moved
        odometers = passed + np.maximum(moved, self._former)
        while True:
            count: int = find_blocked(
                self._before, self._now, *near.list.arrays, passed - moved, odometers, again,
                self._shifted, self._thickness, self._blocked_particles, self._blocked,
            )  # fmt: skip
            if count <= len(self._blocked_particles):
                return count
            size = int(_GROWTH * count)
            self._blocked_particles, self._blocked = (
                np.zeros((size, 4), np.int64),
                np.zeros((size, FOUND)),
            )

    # Compilation

    def warm_up(self, state: State) -> None:
        """Compile the kernels, for a state that none of them changes."""
        self._neighbours.warm_up(state.position)
        self.begin_part(state, 0.0, ())
        self._load_start(state, 0.0, state.position)
        self._find_contacts(state)
        self._find_blocked(again=False)
        push_back(
            self._now, self._inverse_masses, self._blocked_particles, self._blocked, 0,
            self._shifted,
        )  # fmt: skip
        shorten(self._now, self._now, 1.0, self._blocked_particles, 0, self._shifted)
        store_positions(self._now, self._shifted, self._flat, state.position)
        self.check('positions', state.grid.interior(state.position))
        self.in_kernel, self._origin = self._none, None

    def warm_up_supports(self, state: State, surfaces: Sequence[Surface]) -> None:
        """Compile the kernel of colliders that support the sheet."""
        self._find_supports(state, surfaces)


def self_contact_of(scene: Scene, grid: Grid, dtype: type) -> SelfContact | None:
    """Return the self-contact of a scene; None: it has none."""
    return SelfContact(scene, grid, dtype) if scene.self_contact.thickness > 0 else None
