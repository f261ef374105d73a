"""What a kind of file is: a writer of a mesh whose vertices move; and which there are."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

# Modules of this package, by the extension of the file; each has a class `Writer`.
FORMATS = {
    '.usd': 'usd',
    '.usdc': 'usd',
    '.usda': 'usd',
    '.pvd': 'vtu_series',
}


class Sheet(NamedTuple):
    """
    What does not change over time.

    Attributes
    ----------
    name
        Of the mesh.
    rows, columns
        Particles; each is a vertex, row by row.
    rate
        Frames per second, as a unit of time for files that count in frames.

    """

    name: str
    rows: int
    columns: int
    rate: float

    def quads(self) -> NDArray[np.int32]:
        """Return the vertices of each face, counter-clockwise about its normal, shape (n, 4)."""
        vertices = np.arange(self.rows * self.columns, dtype=np.int32)
        first = vertices.reshape(self.rows, self.columns)[:-1, :-1].ravel()
        # Columns follow each other along +x and rows along +y, so that +z is the upper side.
        return first[:, None] + np.array([0, 1, self.columns + 1, self.columns], np.int32)

    def texture_coordinates(self) -> NDArray[np.float32]:
        """Return u along the columns and v along the rows, 0 to 1, shape (rows * columns, 2)."""
        v, u = np.mgrid[: self.rows, : self.columns].reshape(2, -1)
        return np.stack([u / (self.columns - 1), v / (self.rows - 1)], axis=-1).astype(np.float32)


class Frame(NamedTuple):
    """
    The mesh at one time.

    Attributes
    ----------
    time
        Since the first frame, s.
    positions, velocities
        Of the vertices, m and m/s, float32, shape (rows * columns, 3); no velocities: None.

    """

    time: float
    positions: NDArray[np.float32]
    velocities: NDArray[np.float32] | None


class MeshWriter(Protocol):
    """
    Writer of a file; what has been written is complete after `close`.

    Parameters
    ----------
    path
        File to make.
    sheet
        What does not change over time.

    """

    def __init__(self, path: Path, sheet: Sheet) -> None: ...

    def write(self, frame: Frame) -> None:
        """Write a frame; its time is after that of the frame before."""

    def close(self) -> None:
        """Complete the file."""


def writer_for(path: Path) -> type[MeshWriter]:
    """
    Return the writer for a file by its extension.

    Raises
    ------
    ValueError
        The extension is not one of `FORMATS`.
    ModuleNotFoundError
        The library that it needs is not installed.

    """
    name = FORMATS.get(path.suffix.lower())
    if name is None:
        raise ValueError(
            f'{path} must end in one of {", ".join(FORMATS)}; write {path.stem}.usdc, which '
            f'Blender opens, or {path.stem}.pvd, which ParaView opens'
        )
    writer: type[MeshWriter] = importlib.import_module(f'{__package__}.{name}').Writer
    return writer
