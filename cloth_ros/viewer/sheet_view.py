"""The sheet of one cloth in the scene: two-sided, or coloured by stretch or speed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import viser

from .colour_scale import VIRIDIS, ColourScale, legend
from .particles import Sheet
from .sheet_mesh import (
    Part,
    cell_speed,
    cell_stretch,
    edge_lengths,
    every,
    largest_of_cells,
    split_by_level,
    triangles,
)

UPPER, LOWER = (204, 56, 51), (214, 158, 71)
TWO_SIDES = 'two sides'
# Of larger sheets every second row and column is drawn, or fewer: without a graphics processor the
# time for a picture grows with the triangles, and on a page smaller ones are not seen.
_MOST_DRAWN = 10_000  # particles


# A triangle without area: a mesh that shows nothing.
_NOTHING = Part(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32))


class Colouring(NamedTuple):
    """A quantity that a sheet can be coloured by."""

    title: str
    unit: str
    least_scale: float  # least greatest value of the scale, in the unit


COLOURINGS = {
    'stretch': Colouring('largest stretch of the edges of a cell', '%', 0.1),
    'speed': Colouring('speed', 'm/s', 0.1),
}


class SheetView:
    """
    Draw the newest state of a sheet.

    viser sends the arrays that were assigned and nothing else: of a plain sheet the positions
    only, once per side.

    Parameters
    ----------
    scene
        Of the page.
    path
        Of the parent in the scene tree.

    Attributes
    ----------
    spacing
        Lengths at rest along a row and along a column, m; None: those of the first state drawn.

    """

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        self.spacing: tuple[float, float] | None = None
        self._scene, self._path = scene, path
        self._colouring = TWO_SIDES
        self._every_particle = False
        self._shape = (0, 0)
        self._meshes: list[viser.MeshHandle] = []
        self._scale = ColourScale(1.0)
        self._first_spacing = (1.0, 1.0)

    @property
    def colouring(self) -> str:
        """`TWO_SIDES`, or a key of `COLOURINGS`."""
        return self._colouring

    @colouring.setter
    def colouring(self, name: str) -> None:
        if name != self._colouring:
            self._colouring = name
            self._remove()
            if name in COLOURINGS:
                self._scale = ColourScale(COLOURINGS[name].least_scale)

    @property
    def is_empty(self) -> bool:
        """True while nothing is drawn."""
        return not self._meshes

    @property
    def is_large(self) -> bool:
        """True if not every particle is drawn unless `every_particle` is set."""
        return math.prod(self._shape) > _MOST_DRAWN

    @property
    def every_particle(self) -> bool:
        """True to draw every particle of large sheets, too."""
        return self._every_particle

    @every_particle.setter
    def every_particle(self, wanted: bool) -> None:
        self._every_particle = wanted
        self._choose_particles()

    @property
    def legend(self) -> str:
        """HTML that explains the colours; empty for a plain sheet."""
        if self._colouring not in COLOURINGS:
            return ''
        shown = COLOURINGS[self._colouring]
        return legend(shown.title, shown.unit, self._scale.greatest, VIRIDIS)

    def draw(self, sheet: Sheet) -> None:
        """Draw a state; a single row or column of particles has no triangles."""
        if min(sheet.shape) < 2:
            self._remove()
            return
        if sheet.shape != self._shape:
            self._shape = sheet.shape
            self._choose_particles()
            along_rows, along_columns = edge_lengths(sheet.positions)
            self._first_spacing = float(np.median(along_rows)), float(np.median(along_columns))
        if self._colouring in COLOURINGS:
            self._draw_levels(sheet)
        else:
            self._draw_plain(sheet)

    def _choose_particles(self) -> None:
        self._remove()
        if min(self._shape) < 2:
            return
        draw_all = self._every_particle or not self.is_large
        self._step = 1 if draw_all else math.ceil(math.sqrt(math.prod(self._shape) / _MOST_DRAWN))
        rows, columns = (every(count, self._step) for count in self._shape)
        self._drawn = np.ix_(rows, columns)
        self._cells = triangles(len(rows), len(columns))

    def _draw_plain(self, sheet: Sheet) -> None:
        vertices = sheet.positions[self._drawn].reshape(-1, 3)
        if not self._meshes:
            faces = self._cells.reshape(-1, 3)
            sides = [('upper', UPPER, 'front'), ('lower', LOWER, 'back')]
            self._meshes = [
                self._mesh(name, Part(vertices, faces), colour, side)
                for name, colour, side in sides
            ]
            return
        for mesh in self._meshes:
            mesh.vertices = vertices

    def _draw_levels(self, sheet: Sheet) -> None:
        if self._colouring == 'speed':
            values = cell_speed(sheet.velocities)
        else:
            values = 100 * cell_stretch(sheet.positions, self.spacing or self._first_spacing)
        self._scale.follow(float(values.max()))
        parts = split_by_level(
            sheet.positions[self._drawn],
            self._cells,
            largest_of_cells(values, self._step),
            self._scale.greatest,
            len(VIRIDIS),
        )
        if not self._meshes:
            self._meshes = [
                self._mesh(f'level_{level}', _NOTHING, colour, 'double')
                for level, colour in enumerate(VIRIDIS)
            ]
        for mesh, part in zip(self._meshes, parts, strict=True):
            mesh.vertices, mesh.faces = part or _NOTHING

    def _mesh(
        self, name: str, part: Part, colour: tuple[int, int, int], side: str
    ) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            f'{self._path}/{name}',
            part.vertices,
            part.faces,
            color=colour,
            side=side,  # type: ignore[arg-type]
            # One of both sides casts the shadow, in which the other one would lie itself.
            cast_shadow=side != 'back',
            receive_shadow=side == 'front',
        )

    def _remove(self) -> None:
        for mesh in self._meshes:
            mesh.remove()
        self._meshes = []
