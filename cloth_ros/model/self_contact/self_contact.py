"""
Contact of the sheet with itself, between parts of a batch of substeps.

After each part, the paths of all pairs of features that are near each other are examined.  Pairs
that would have passed through each other are moved back, and where that is not enough the paths of
their particles are shortened, in the last resort to nothing: at the end of each part no feature
has passed another.  Then impulses stop layers that approach, and part those that are too
near.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...scene import Scene
from ..contact.surface import Surface
from ..grid import Array, Grid
from ..state import State
from .contact_search import CONTACT, search
from .neighbours import Neighbours
from .particle_arrays import add_velocities, load, load_vectors, store_positions
from .response import apply_impulses, push_back, shorten
from .supports import find_supports

# Share of the thickness by which gravity may press layers together in a part.
_SAG = 0.03
# Halvings of the paths of blocked pairs, after which they are not moved at all; and attempts after
# which nothing is.
_HALVINGS, _ATTEMPTS = 6, 24
_LEAST_ROOM = 256


class SelfContact:
    """
    Contact of a sheet with itself.

    Parameters
    ----------
    scene, grid
        Thickness, friction, and the sheet.

    Attributes
    ----------
    contacts
        Number of pairs of features in contact after the last part.
    distance
        Least distance of a pair, m, of those that were looked at; inf: none was.
    touched
        True if there was contact since it was last set to False.
    shortened
        Number of times that paths of particles were shortened.

    """

    def __init__(self, scene: Scene, grid: Grid) -> None:
        sheet, parameters = scene.sheet, scene.self_contact
        self._thickness, self._friction = parameters.thickness, parameters.friction
        self._gravity = gravity = math.hypot(*scene.gravity)
        self._longest = math.sqrt(2 * _SAG * self._thickness / gravity) if gravity else math.inf
        self._layout = (grid.begin, grid.stride, grid.columns)
        number = grid.rows * grid.columns
        self._neighbours = Neighbours(
            grid.rows, grid.columns, self._thickness, sheet.shortest_spacing
        )
        self._before, self._now, self._ahead = np.zeros((3, number, 3))
        self._former, self._velocities, self._changes = np.zeros((3, number, 3))
        self._supports = np.zeros((number, 4))
        self._inverse_masses = np.zeros(number)
        self._allocate(_LEAST_ROOM)
        self.contacts, self.distance, self.touched, self.shortened = 0, math.inf, False, 0
        self._origin: Array | None = None

    def _allocate(self, count: int) -> None:
        self._particles: Array = np.zeros((count, 4), np.int32)
        self._contacts: Array = np.zeros((count, CONTACT))
        self._impulses: Array = np.zeros((count, 2))

    def invalidate(self) -> None:
        """Start again from the positions of the next part: they were assigned."""
        self._origin = None

    def interval(self, count: int, h: float, most: int) -> int:
        """Return the length of equal parts, at most `most`, of a number of substeps of `h` s."""
        parts = max(math.ceil(count / most), math.ceil(count * h / self._longest), 1)
        return math.ceil(count / parts)

    def begin_part(self, state: State) -> None:
        """Take the positions at the start of a part as accepted, if they are not known."""
        load_vectors(state.velocity, *self._layout, self._former)
        if self._origin is not state.origin:
            self._origin = state.origin
            load_vectors(state.position, *self._layout, self._before)
            self._neighbours.invalidate()

    def end_part(self, state: State, seconds: float, surfaces: Sequence[Surface]) -> None:
        """
        Resolve the contact of a sheet at the end of a part of `seconds`.

        Positions and velocities are changed.  `surfaces` are those of colliders near the sheet.
        """
        load(
            state.position, state.velocity, state.mobility, *self._layout, self._now,
            self._velocities, self._inverse_masses,
        )  # fmt: skip
        if not self._neighbours.update(self._before, self._now):
            self.invalidate()
            return
        if len(self._neighbours.pairs) == 0:
            self.contacts, self.distance = 0, math.inf
            self._before, self._now = self._now, self._before
            return
        np.multiply(self._velocities, seconds, out=self._ahead)
        self._ahead += self._now
        count = self._accept_paths(state)
        self.contacts = count
        if count:
            self.touched = True
            self._respond(state, count, seconds, surfaces)
        self._before, self._now = self._now, self._before

    def _accept_paths(self, state: State) -> int:
        """Move back what has passed through the sheet; return the number of contacts."""
        count, blocked = self._search(again=False)
        attempt = 0
        while blocked:
            blocked_pairs = (self._particles, self._contacts, count)
            if attempt == 0:
                push_back(self._now, self._inverse_masses, *blocked_pairs)
            elif attempt < _ATTEMPTS:
                share = 0.5 if attempt <= _HALVINGS else 0.0
                shorten(self._now, self._before, share, *blocked_pairs)
                self.shortened += 1
            else:
                self._now[...] = self._before
            store_positions(self._now, self._inverse_masses, *self._layout, state.position)
            count, blocked = self._search(again=True)
            attempt += 1
            if attempt > _ATTEMPTS + 1:
                break
        return count

    def _search(self, *, again: bool) -> tuple[int, int]:
        """Return the number of contacts, and of those whose path is not accepted."""
        near = self._neighbours
        while True:
            count, blocked, self.distance = search(
                self._before, self._now, self._ahead, near.pairs, near.normals, near.gaps,
                near.vertices, again, self._thickness, self._particles, self._contacts,
            )  # fmt: skip
            if count <= len(self._particles):
                return count, blocked
            self._allocate(int(1.3 * count))
            again = True

    def _respond(
        self, state: State, count: int, seconds: float, surfaces: Sequence[Surface]
    ) -> None:
        self._supports[:, :3], self._supports[:, 3] = 0.0, -math.inf
        for each in surfaces:
            find_supports(
                self._now, each.rho, *self._layout, each.kind, each.row, each.fields, seconds,
                self._supports,
            )  # fmt: skip
        self._changes[...] = 0.0
        apply_impulses(
            self._velocities, self._changes, self._former, self._supports, self._inverse_masses,
            self._particles, self._contacts, count, seconds, self._gravity, self._friction,
            self._impulses,
        )  # fmt: skip
        add_velocities(self._changes, *self._layout, state.velocity)
