"""Closed triangle meshes from STL and OBJ files, and the checks that they are usable."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import urllib.parse
import warnings
from io import BytesIO
from pathlib import Path

import numpy as np

from ....scene.parameter import format_error, invalid_value_error
from ...grid import Array

FORMATS = ('.stl', '.obj')
MAX_TRIANGLES = 200_000
# Bytes; an ASCII STL file of as many triangles has fewer.
MAX_FILE_SIZE = 100_000_000
# m, of the longest edge of the bounding box.
MIN_SIZE, MAX_SIZE = 0.001, 20.0
# Of the area of a triangle over the square of its longest edge; below it is a sliver, whose
# normal is rounding.
_SLIVER = 1e-9
# Of the volume over the volume of the bounding box's diagonal cubed.
_MIN_VOLUME = 1e-9


@dataclasses.dataclass(frozen=True)
class Mesh:
    """
    A closed triangle mesh with the normals outwards.

    Attributes
    ----------
    vertices
        m, shape (n, 3), all different.
    triangles
        Corners as indices into `vertices`, shape (m, 3), counter-clockwise seen from outside.

    """

    vertices: Array
    triangles: Array

    @property
    def corners(self) -> Array:
        """Return the corners of each triangle, m, shape (m, 3, 3)."""
        return self.vertices[self.triangles]

    @property
    def lower(self) -> Array:
        """Return the least coordinates, m, shape (3,)."""
        return np.asarray(self.vertices.min(axis=0))

    @property
    def upper(self) -> Array:
        """Return the greatest coordinates, m, shape (3,)."""
        return np.asarray(self.vertices.max(axis=0))

    @property
    def digest(self) -> str:
        """Return a hash of the content."""
        digest = hashlib.sha256(np.ascontiguousarray(self.vertices, '<f8').tobytes())
        digest.update(np.ascontiguousarray(self.triangles, '<i8').tobytes())
        return digest.hexdigest()

    def normals(self) -> Array:
        """Return the unit normals, shape (m, 3); a sliver has that of a neighbour."""
        corners = self.corners
        edges = np.roll(corners, -1, axis=1) - corners
        normals = np.cross(edges[:, 0], edges[:, 1])
        lengths = np.linalg.norm(normals, axis=1)
        squared = np.sum(edges * edges, axis=2)
        slivers = lengths <= 2 * _SLIVER * squared.max(axis=1)
        normals /= np.where(slivers, 1.0, lengths)[:, None]
        normals[slivers] = 0.0
        if slivers.any():
            self._copy_normals(normals, slivers, squared)
        return normals

    def _copy_normals(self, normals: Array, slivers: Array, squared: Array) -> None:
        """Give each sliver the normal of the neighbour at its longest edge, or at another."""
        neighbours: dict[tuple[int, int], int] = {}
        for number, (a, b, c) in enumerate(self.triangles.tolist()):
            neighbours[a, b] = neighbours[b, c] = neighbours[c, a] = number
        open_ones = np.flatnonzero(slivers).tolist()
        while open_ones:
            left = []
            for number in open_ones:
                corners = self.triangles[number].tolist()
                for k in np.argsort(-squared[number], kind='stable').tolist():
                    other = neighbours.get((corners[(k + 1) % 3], corners[k]))
                    if other is not None and normals[other].any():
                        normals[number] = normals[other]
                        break
                else:
                    left.append(number)
            if len(left) == len(open_ones):
                return
            open_ones = left

    def bounding_radius(self) -> float:
        """Return the greatest distance of a vertex from the origin of the mesh, m."""
        return float(np.linalg.norm(self.vertices, axis=1).max())


def resolve(path: str, name: str = 'mesh') -> Path:
    """
    Return the file of a path or of a URL ``file://…`` or ``package://NAME/…``.

    Packages are searched in `AMENT_PREFIX_PATH`; the model imports nothing of ROS.

    Raises
    ------
    ValueError
        Another kind of URL, or a package that is not found.

    """
    scheme, separator, rest = path.partition('://')
    if not separator:
        return Path(path).expanduser()
    if scheme == 'file':
        return Path('/' + urllib.parse.unquote(rest).partition('/')[2])
    if scheme != 'package':
        raise invalid_value_error(
            name, path, 'a path, file://… or package://…', 'copy the file and write its path'
        )
    package, _, inside = urllib.parse.unquote(rest).partition('/')
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        if prefix and (Path(prefix) / 'share' / package / 'package.xml').is_file():
            return Path(prefix) / 'share' / package / inside
    raise invalid_value_error(
        name,
        path,
        'in a ROS package that is installed',
        "source the workspace of the package, or write the file's path",
    )


def load_mesh(path: str, name: str = 'mesh') -> Mesh:
    """
    Read a closed mesh from an STL (binary, ASCII) or OBJ file; a file inside out is turned.

    Parameters
    ----------
    path
        Of the file, or a URL, see `resolve`.
    name
        Of the parameter, for errors.

    Raises
    ------
    ValueError
        The file cannot be read, trimesh is not installed, or `closed_mesh` refuses the mesh.

    """
    file = resolve(path, name)
    form = file.suffix.lower()
    if form not in FORMATS:
        raise invalid_value_error(
            name, path, f'a file {" or ".join(FORMATS)}', 'export the mesh as binary STL'
        )
    try:
        size = file.stat().st_size
        if size > MAX_FILE_SIZE:
            raise _too_many(name, path, f'{size / 1e6:.0f} MB')
        content = file.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, ValueError) and 'embedded null' not in str(error):
            raise
        reason = getattr(error, 'strerror', None) or str(error)
        raise invalid_value_error(
            name, path, f'a file that can be read ({reason})', 'check the path'
        ) from None
    if form != '.stl' or len(content) != 84 + 50 * int.from_bytes(content[80:84], 'little'):
        # Text: trimesh needs another package to guess an encoding that is not UTF-8.
        content = content.decode(errors='replace').encode()
    try:
        import trimesh
    except ImportError:
        raise invalid_value_error(
            name, path, 'empty as long as trimesh is not installed', 'pip install trimesh'
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            loaded = trimesh.load_mesh(BytesIO(content), file_type=form[1:], process=False)
            corners = np.asarray(loaded.vertices, float)[np.asarray(loaded.faces, int)]
    except Exception as error:  # whatever trimesh meets in damaged content
        raise invalid_value_error(
            name,
            path,
            f'an intact {form[1:].upper()} file with triangles ({format_error(error)})',
            'export the mesh again, as binary STL',
        ) from None
    return closed_mesh(corners, name, path)


def _too_many(name: str, path: str, found: str) -> ValueError:
    return invalid_value_error(
        name,
        path,
        f'a mesh of at most {MAX_TRIANGLES} triangles, not of {found}',
        'simplify it, in Blender by the modifier Decimate',
    )


def closed_mesh(corners: Array, name: str = 'mesh', path: str = '') -> Mesh:
    """
    Return the mesh of some triangles.

    Equal corners are joined and collapsed triangles removed.  Bodies that are inside out are
    turned; a body inside out within another one is a cavity, and stays.

    Parameters
    ----------
    corners
        m, shape (m, 3, 3).
    name, path
        Parameter and file, for errors.

    Raises
    ------
    ValueError
        There are no triangles or too many, they are not finite, far too large or too small, not
        closed, not oriented alike, or enclose no volume.

    """

    def error(allowed: str, remedy: str) -> ValueError:
        return invalid_value_error(name, path, allowed, remedy)

    if len(corners) == 0:
        raise error('a mesh with triangles, and none can be read', 'export the mesh again')
    if len(corners) > MAX_TRIANGLES:
        raise _too_many(name, path, str(len(corners)))
    if not np.isfinite(corners).all():
        raise error('a mesh of finite coordinates', 'export the mesh again')
    extent = corners.max(axis=(0, 1)) - corners.min(axis=(0, 1))
    far = np.abs(corners).max()
    if not MIN_SIZE <= extent.max() <= MAX_SIZE or far > 10 * MAX_SIZE:
        size = ' × '.join(f'{edge:.4g}' for edge in extent)
        place = f' and {far:.4g} m from its origin' if far > 10 * MAX_SIZE else ''
        remedy = 'if it is in millimetres, scale it by 0.001'
        if extent.max() < MIN_SIZE:
            remedy = 'export it again in metres'
        raise error(
            f'{MIN_SIZE:g} to {MAX_SIZE:g} m large and near its origin, not {size} m{place}',
            remedy,
        )
    points, numbers = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    triangles = numbers.reshape(-1, 3)
    collapsed = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    triangles = np.ascontiguousarray(triangles[~collapsed], np.int64)
    used, numbers = np.unique(triangles, return_inverse=True)
    mesh = Mesh(np.ascontiguousarray(points[used]), numbers.reshape(-1, 3).astype(np.int64))
    if len(triangles) == 0:
        raise error('a mesh that encloses a volume, all triangles are degenerate', 'repair it')
    holes, turned = _edge_faults(mesh.triangles)
    if holes:
        raise error(
            f'a closed mesh, and {holes} edges have a triangle on one side only',
            'close its holes, in Blender by Mesh, Clean Up, Fill Holes, or write type: box',
        )
    if turned:
        raise error(
            f'a mesh whose triangles all face outwards, and at {turned} edges they disagree',
            'make its normals consistent, in Blender by Mesh, Normals, Recalculate Outside',
        )
    mesh = _facing_outwards(mesh)
    if _volumes(mesh.corners).sum() <= _MIN_VOLUME * float(extent @ extent) ** 1.5:
        raise error('a mesh that encloses a volume', 'give it a thickness')
    return mesh


def _edge_faults(triangles: Array) -> tuple[int, int]:
    """Return the number of edges with an odd number of triangles, and of those turned."""
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    keys = np.minimum(starts, ends) * (triangles.max() + 1) + np.maximum(starts, ends)
    _, numbers = np.unique(keys, return_inverse=True)
    # Each edge once in each direction; several times where bodies touch in it.
    surplus = np.abs(np.bincount(numbers, np.where(starts < ends, 1.0, -1.0)).astype(int))
    odd = np.bincount(numbers) % 2 == 1
    return int(odd.sum()), int((surplus[~odd] > 0).sum())


def _volumes(corners: Array) -> Array:
    """Return the volume that each triangle adds, m³; they are summed over a closed body."""
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    volumes: Array = np.sum(a * np.cross(b, c), axis=1) / 6
    return volumes


def _bodies(mesh: Mesh) -> Array:
    """Return the number of the connected body of each triangle, shape (m,)."""
    labels = np.arange(len(mesh.vertices))
    while True:
        before = labels
        least = labels[mesh.triangles].min(axis=1)
        labels = labels.copy()
        for k in range(3):
            np.minimum.at(labels, mesh.triangles[:, k], least)
        labels = labels[labels]
        if (labels == before).all():
            return np.asarray(np.unique(labels[mesh.triangles[:, 0]], return_inverse=True)[1])


def winding_number(corners: Array, point: Array) -> float:
    """
    Return how often triangles surround a point: 1 in a body, 0 outside, -1 if inside out.

    A sum of solid angles (A. van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle",
    IEEE Transactions on Biomedical Engineering 30, 1983).
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    above = np.sum(a * np.cross(b, c), axis=1)
    below = la * lb * lc + (
        np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    )
    return float(np.arctan2(above, below).sum() / (2 * np.pi))


def _facing_outwards(mesh: Mesh) -> Mesh:
    """Turn the mesh if it is inside out, then each body that no other one surrounds."""
    triangles = mesh.triangles
    if _volumes(mesh.corners).sum() < 0:
        triangles = triangles[:, ::-1].copy()
    corners = mesh.vertices[triangles]
    bodies = _bodies(mesh)
    volumes = np.bincount(bodies, _volumes(corners))
    result = triangles.copy()
    for body in np.flatnonzero(volumes < 0).tolist():
        chosen = np.flatnonzero(bodies == body)
        normals = np.cross(*np.moveaxis(np.diff(corners[chosen], axis=1), 1, 0))
        areas = np.sum(normals * normals, axis=1)
        largest = int(areas.argmax())
        if areas[largest] == 0:
            continue
        normal = normals[largest] / np.sqrt(areas[largest])
        # In front of it: inside the body, where a cavity has 0 and a turned body -1.
        front = corners[chosen[largest]].mean(axis=0) + 1e-4 * areas[largest] ** 0.25 * normal
        if winding_number(corners, front) < -0.5:
            result[chosen] = triangles[chosen][:, ::-1]
    return Mesh(mesh.vertices, np.ascontiguousarray(result))
