"""
A file of VTK for each time (VTU) and a list of them (PVD), which ParaView opens.

Not XDMF: in the time series of meshio the points do not move.
"""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import meshio

from .mesh_writer import Frame, Sheet


class Writer:
    """
    Write a mesh over time as `NAME.pvd` and `NAME_vtu/000000.vtu` and so on.

    Parameters
    ----------
    path, sheet
        See `MeshWriter`.

    Raises
    ------
    ValueError
        There is a folder NAME_vtu already.
    OSError
        It cannot be made.

    """

    def __init__(self, path: Path, sheet: Sheet) -> None:
        self._folder = path.with_name(f'{path.stem}_vtu')
        try:
            self._folder.mkdir()
        except FileExistsError:
            raise ValueError(f'{self._folder} exists already; give {path} another name') from None
        self._cells = [('quad', sheet.quads())]
        self._list = path.open('w', encoding='utf-8')
        self._list.write('<VTKFile type="Collection" version="0.1">\n<Collection>\n')
        self._count = 0

    def write(self, frame: Frame) -> None:
        """Write a frame."""
        file = self._folder / f'{self._count:06}.vtu'
        data = {} if frame.velocities is None else {'velocity': frame.velocities}
        mesh = meshio.Mesh(frame.positions, self._cells, point_data=data)
        # Compression would take ten times as long, for a file two thirds as large.
        meshio.write(file, mesh, compression=None)
        name = quoteattr(f'{self._folder.name}/{file.name}')
        self._list.write(f'<DataSet timestep="{frame.time:.9f}" file={name}/>\n')
        self._count += 1

    def close(self) -> None:
        """Complete the list."""
        self._list.write('</Collection>\n</VTKFile>\n')
        self._list.close()
