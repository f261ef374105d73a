"""
Universal Scene Description: a mesh with points at each time, which Blender opens.

The file is saved now and then, which also frees the memory of what was written.
"""

from __future__ import annotations

import os
from pathlib import Path

from pxr import Gf, Sdf, Tf, Usd, UsdGeom, Vt

from ...scene.parameter import one_line
from .mesh_writer import Frame, Sheet

_SAVE = 32 << 20  # bytes of points, after which the file is saved


class Writer:
    """
    Write a mesh over time as USD; text (`.usda`) is made from a binary file in the end.

    Parameters
    ----------
    path, sheet
        See `MeshWriter`.

    Raises
    ------
    OSError
        The file cannot be written.

    """

    def __init__(self, path: Path, sheet: Sheet) -> None:
        self._path, self._rate = path, sheet.rate
        self._text = path.suffix.lower() == '.usda'
        self._binary = path.with_suffix('.partial.usdc') if self._text else path
        self._binary.open('xb').close()  # raises OSError with the reason, unlike USD
        stage = self._stage = Usd.Stage.CreateNew(str(self._binary))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        stage.SetTimeCodesPerSecond(sheet.rate)
        stage.SetFramesPerSecond(sheet.rate)
        stage.SetStartTimeCode(0.0)
        mesh = UsdGeom.Mesh.Define(stage, f'/{Tf.MakeValidIdentifier(sheet.name)}')
        stage.SetDefaultPrim(mesh.GetPrim())
        quads = sheet.quads()
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(quads), 4))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(quads.ravel()))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            'st', Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
        )
        st.Set(Vt.Vec2fArray.FromNumpy(sheet.texture_coordinates()))
        self._points = mesh.GetPointsAttr()
        self._velocities = mesh.GetVelocitiesAttr()
        self._extent = mesh.GetExtentAttr()
        self._unsaved, self._end = 0, 0.0

    def write(self, frame: Frame) -> None:
        """Write a frame."""
        # A whole number where the frames have the rate of the file.
        self._end = code = round(frame.time * self._rate, 6)
        with Sdf.ChangeBlock():
            self._points.Set(Vt.Vec3fArray.FromNumpy(frame.positions), code)
            if frame.velocities is not None:
                self._velocities.Set(Vt.Vec3fArray.FromNumpy(frame.velocities), code)
            corners = frame.positions.min(axis=0), frame.positions.max(axis=0)
            extent = Vt.Vec3fArray([Gf.Vec3f(*corner.tolist()) for corner in corners])
            self._extent.Set(extent, code)
        self._unsaved += 2 * frame.positions.nbytes
        if self._unsaved > _SAVE:
            self._save()

    def _save(self) -> None:
        self._stage.SetEndTimeCode(self._end)
        try:
            self._stage.Save()
        except Tf.ErrorException as error:
            raise OSError(f'{self._binary} cannot be written: {one_line(str(error))}') from None
        self._unsaved = 0

    def close(self) -> None:
        """Save the rest."""
        self._save()
        if self._text:
            self._stage.Export(str(self._path))
        del self._stage, self._points, self._velocities, self._extent
        if self._text:
            os.unlink(self._binary)
