"""
Contact of the sheet with itself, between parts of a batch of substeps.

After each part, the paths of all pairs of features that are near each other are examined.  Pairs
that would have passed through each other are moved back, and where that is not enough the paths of
their particles are shortened, in the last resort to nothing: at the end of each part no feature
has passed another.  Then impulses stop layers that approach, and part those that are too near.

Results are a function of the positions and velocities at the start and at the end of a part.
Lists, gaps and normals that are kept from one part to the next only save time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...scene import Scene
from ..contact.contact import Contact
from ..contact.surface import Surface
from ..grid import Array, Grid
from ..state import State
from .contact_search import CONTACT, LAST, REACH, search
from .intersections import check_free_of_intersections
from .neighbours import Neighbours
from .particle_arrays import add_velocities, load_inverse_masses, load_vectors, store_positions
from .response import ROW, apply_impulses, push_back, shorten
from .supports import find_supports

# Share of the thickness by which gravity may press layers together in a part.
_SAG = 0.03
# Motion, in thicknesses, up to which only pairs near contact are looked at again.
_CALM = 0.12
# Halvings of the paths of blocked pairs, after which they are not moved at all; and attempts after
# which nothing is.
_HALVINGS, _ATTEMPTS = 6, 24
_LEAST_ROOM = 256
# Largest divisor of parts, and parts without a blocked path after which it is halved.
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
    contacts
        Number of pairs of features in contact after the last part.
    distance
        Least distance of a pair, m, of those that were near contact; inf: none was.
    touched
        True if there was contact since it was last set to False.
    division
        Divisor of the longest part.
    shortened
        Number of times that paths of particles were shortened.

    """

    def __init__(self, scene: Scene, grid: Grid, dtype: type) -> None:
        sheet, parameters = scene.sheet, scene.self_contact
        self._thickness, self._friction = parameters.thickness, parameters.friction
        self._gravity = math.hypot(*scene.gravity)
        self._longest = math.inf
        if self._gravity:
            self._longest = math.sqrt(2 * _SAG * self._thickness / self._gravity)
        self._layout = (grid.begin, grid.stride, grid.columns)
        # Longest motion in a part that is resolved, and in which contact is foreseen, m.
        self._farthest, self._most = sheet.diagonal, 0.5 * sheet.shortest_spacing
        self._reach = 0.0
        number = grid.rows * grid.columns
        self._neighbours = Neighbours(grid, dtype, self._thickness, 0.5 * sheet.shortest_spacing)
        # Flat arrays: positions and velocities at the start of a part; positions when all pairs
        # were looked at, and those expected after the next part.
        self._start, self._start_velocity, self._seen, self._expected = (
            grid.field(dtype) for _ in range(4)
        )
        self._before, self._now, self._ahead = np.zeros((3, number, 3))
        self._former, self._velocities, self._changes = np.zeros((3, number, 3))
        self._supports = np.zeros((number, 4))
        self._inverse_masses = np.zeros(number)
        self._last = np.zeros((number, LAST))
        self._chosen: Array = np.zeros(0, np.uint32)
        self._allocate(_LEAST_ROOM)
        self.contacts, self.distance, self.touched, self.shortened = 0, math.inf, False, 0
        self._origin: Array | None = None
        self.division, self._free = 1, 0

    def _allocate(self, count: int) -> None:
        self._particles: Array = np.zeros((count, 4), np.uint32)
        self._contacts: Array = np.zeros((count, CONTACT))
        self._rows: Array = np.zeros((count, ROW))

    def check(self, name: str, positions: Array) -> None:
        """Refuse positions, m, shape (3, rows, columns), of a sheet that passes through itself."""
        check_free_of_intersections(name, positions, self._thickness)

    def restart(self, pace: tuple[int, int] = (1, 0)) -> None:
        """Start again from the positions of the next part, which were assigned, at a pace."""
        self._origin = None
        self.division, self._free = pace

    def part(self, count: int, h: float, most: int) -> int:
        """Return how many of the next `count` substeps of `h` s make a part, at most `most`."""
        longest = self._longest / self.division
        parts = max(math.ceil(count / most), math.ceil(min(count * h / longest, count)), 1)
        return math.ceil(count / parts)

    @property
    def pace(self) -> tuple[int, int]:
        """Divisor of parts, and parts in a row in which no path was blocked."""
        return self.division, self._free

    def _adapt(self, *, blocked: bool) -> None:
        """Divide parts further where paths were blocked: to move particles back adds energy."""
        self._free = 0 if blocked else self._free + 1
        if blocked:
            self.division = min(2 * self.division, MAX_DIVISION)
        elif self._free >= _PATIENCE and self.division > 1:
            self.division, self._free = self.division // 2, 0

    def begin_part(self, state: State) -> None:
        """Note the state at the start of a part, which is accepted."""
        self._start[...], self._start_velocity[...] = state.position, state.velocity
        if self._origin is not state.origin:
            self._origin = state.origin
            self._neighbours.invalidate()

    def end_part(
        self, state: State, seconds: float, colliders: Contact | None, time: float
    ) -> None:
        """
        Resolve the contact of a sheet at the end of a part of `seconds`, at a time, s.

        Positions and velocities are changed; colliders may support the sheet.
        """
        near = self._neighbours
        ahead = seconds * near.speed(state.velocity)
        if not ahead <= self._farthest:
            ahead = self._farthest  # as for NaN
        self._reach = self._thickness + min(
            max((REACH - 1) * self._thickness, 2 * ahead), self._most
        )
        if near.stays_empty(state.position, ahead, self._reach):
            self._note_no_contact()
            return
        if not near.motion(self._start, state.position) <= self._farthest:
            # Too far, or not finite: the sheet stays as it was, and moves as a whole at most.
            mean = np.where(np.isfinite(near.mean), near.mean, 0.0).astype(state.dtype)
            state.position[...] = self._start + mean[:, None] * state.free
            self._origin = None
            return
        np.multiply(state.velocity, state.dtype(seconds), out=self._expected)
        self._expected += state.position
        new = near.update(self._start, state.position, self._expected, self._reach)
        if len(near.pairs) == 0:
            self._note_no_contact()
            return
        load_inverse_masses(state.contact_mobility, *self._layout, self._inverse_masses)
        for field, vectors in (
            (self._start, self._before),
            (state.position, self._now),
            (self._expected, self._ahead),
        ):
            load_vectors(field, *self._layout, vectors)
        count = self._accept_paths(state, new=new)
        self.contacts = count
        if count:
            self.touched = True
            surfaces = () if colliders is None else colliders.surfaces(state, time)
            self._respond(state, count, seconds, surfaces)

    def _note_no_contact(self) -> None:
        self.contacts, self.distance = 0, math.inf
        self._adapt(blocked=False)

    def _accept_paths(self, state: State, *, new: bool) -> int:
        """Move back what has passed through the sheet; return the number of contacts."""
        margin = _CALM * self._thickness
        calm = (
            not new
            and max(
                self._neighbours.motion(self._seen, each)
                for each in (self._start, state.position, self._expected)
            )
            < 0.5 * margin
        )
        if not calm:
            self._seen[...] = state.position
            self._chosen = np.empty(len(self._neighbours.pairs), np.uint32)
        count, blocked = self._search(every=not calm, again=False, slack=0.0 if new else margin)
        self._adapt(blocked=blocked > 0)
        attempt = 0
        while blocked and attempt <= _ATTEMPTS:
            found = (self._particles, self._contacts, count)
            if attempt == 0:
                push_back(self._now, self._inverse_masses, *found)
            elif attempt < _ATTEMPTS:
                share = 0.5 if attempt <= _HALVINGS else 0.0
                shorten(self._now, self._before, share, *found)
                self.shortened += 1
            else:
                self._now[...] = self._before
            store_positions(self._now, self._inverse_masses, *self._layout, state.position)
            self._seen[...] = state.position
            count, blocked = self._search(every=True, again=True, slack=0.0)
            attempt += 1
        return count

    def _search(self, *, every: bool, again: bool, slack: float) -> tuple[int, int]:
        """Return the number of contacts, and of those whose path is not accepted."""
        near = self._neighbours
        if every:
            self._chosen = np.empty(len(near.pairs), np.uint32)
        while True:
            count, blocked, chosen, self.distance = search(
                self._before, self._now, self._ahead, near.pairs, near.normals, near.gaps,
                near.vertices, self._chosen, every, slack, again, self._thickness,
                self._reach, _CALM * self._thickness, self._last, self._particles, self._contacts,
            )  # fmt: skip
            if count <= len(self._particles):
                self._chosen = self._chosen[:chosen]
                return count, blocked
            self._allocate(int(1.3 * count))
            again = True

    def _respond(
        self, state: State, count: int, seconds: float, surfaces: Sequence[Surface]
    ) -> None:
        load_vectors(state.velocity, *self._layout, self._velocities)
        load_vectors(self._start_velocity, *self._layout, self._former)
        self._find_supports(surfaces, seconds)
        apply_impulses(
            self._velocities, self._changes, self._former, self._supports, self._inverse_masses,
            self._particles, self._contacts, count, seconds, self._gravity, self._friction,
            self._rows,
        )  # fmt: skip
        add_velocities(self._changes, *self._layout, state.velocity)

    def _find_supports(self, surfaces: Sequence[Surface], seconds: float) -> None:
        self._supports[:, :3], self._supports[:, 3] = 0.0, -math.inf
        for each in surfaces:
            find_supports(
                self._now, each.rho, *self._layout, each.kind, each.row, each.fields, seconds,
                self._supports,
            )  # fmt: skip

    # Compilation

    def warm_up(self, state: State) -> None:
        """Compile the kernels, for a state that none of them changes."""
        self.begin_part(state)
        self._neighbours.warm_up(state.position)
        self._search(every=True, again=False, slack=0.0)
        found = (self._particles, self._contacts, 0)
        load_inverse_masses(state.contact_mobility, *self._layout, self._inverse_masses)
        load_vectors(state.position, *self._layout, self._now)
        push_back(self._now, self._inverse_masses, *found)
        shorten(self._now, self._now, 1.0, *found)
        store_positions(self._now, self._inverse_masses, *self._layout, state.position)
        self._respond(state, 0, 1.0, ())
        self.check('positions', state.grid.interior(state.position))
        self._origin = None

    def warm_up_supports(self, surfaces: Sequence[Surface]) -> None:
        """Compile the kernel of colliders that support the sheet."""
        self._find_supports(surfaces, 1.0)


def self_contact_of(scene: Scene, grid: Grid, dtype: type) -> SelfContact | None:
    """Return the self-contact of a scene; None: it has none."""
    return SelfContact(scene, grid, dtype) if scene.self_contact.thickness > 0 else None
