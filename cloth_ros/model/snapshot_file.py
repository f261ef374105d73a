"""
A snapshot as bytes, exact to the bit, and as a file.

The bytes begin with a header: a signature, the version of the format, the length of the content,
and the SHA-256 of all that.  The content is MessagePack: the version of this package, the
parameters of the scene by their dotted names, and the fields of the `Snapshot`.  Floating point
numbers and arrays are in binary.  Nothing that is read is trusted: types, sizes and values are
checked before there is a `Snapshot`.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import os
import struct
from typing import Any

import msgspec
import numpy as np

from ..scene import Scene
from ..scene.parameter import one_line
from ..scene.parameter_file import format_path, read_limited
from . import atomic_file
from .contact.contact_snapshot import ContactSnapshot
from .energy_monitor import DIVISIONS, EnergyAccount
from .grid import GHOST, Array, Grid
from .grippers.gripper import GripperSnapshot
from .inputs import Inputs, Pose, Vector
from .kinematic_path import MAX_WAYPOINTS
from .self_contact.self_contact import MAX_DIVISION
from .snapshot import Snapshot
from .step_control import StepAccount

# The line ends show whether the file was changed as if it were text.
_SIGNATURE = b'\x89cloth\r\n'
_FORMAT = 2
# Signature, version of the format, length of the content; then the SHA-256 of these and of it.
_HEADER = struct.Struct('<8sIQ')
_DIGEST = hashlib.sha256().digest_size
_BEGIN = _HEADER.size + _DIGEST

# Of arrays, little-endian.
_REAL, _INTEGER = ('<f4', '<f8'), '<i8'
# Deviation of the length of a unit quaternion.
_ROUNDING = 1e-6

# Bytes; the snapshot of the largest sheet, in double precision, has 60 million.
_LARGEST = 100_000_000
_REMEDY = 'use another file that `save` has written'


class _Content(msgspec.Struct, forbid_unknown_fields=True):
    """What is in the content."""

    cloth_ros: str
    scene: dict[str, Any]
    origin: Array
    position: Array
    velocity: Array
    time: float
    work: float
    contact: ContactSnapshot | None
    account: EnergyAccount | None
    wind: Vector
    collider_paths: dict[str, tuple[Pose, ...]]
    # Absent in files of format 1.
    gripper_paths: dict[str, tuple[Pose, ...]] = {}
    grips: tuple[tuple[str, bool], ...] = ()
    grippers: dict[str, GripperSnapshot] | None = None
    steps: StepAccount | None = None
    pace: tuple[int, int] = (1, 0)


class _ArrayData(msgspec.Struct, array_like=True):
    """An array in the content."""

    dtype: str
    shape: tuple[int, ...]
    data: bytes | memoryview


def _from_array(value: object) -> object:
    if isinstance(value, np.ndarray):
        little = np.ascontiguousarray(value, value.dtype.newbyteorder('<'))
        data = little.data.cast('B') if little.size else b''
        return _ArrayData(little.dtype.str, little.shape, data)
    if isinstance(value, np.float64):
        return float(value)
    raise TypeError(f'{type(value)} is not part of a snapshot')


def _to_array(kind: type, value: Any) -> Any:
    dtype, shape, data = msgspec.convert(value, tuple[str, tuple[int, ...], bytes])
    if dtype not in (*_REAL, _INTEGER):
        raise ValueError(f'an array of type {dtype!r:.20}')
    return np.frombuffer(data, dtype).astype(dtype[1:], copy=False).reshape(shape)


_encoder = msgspec.msgpack.Encoder(enc_hook=_from_array)
_decoder = msgspec.msgpack.Decoder(_Content, dec_hook=_to_array)


@functools.cache
def _package_version() -> str:
    try:
        return importlib.metadata.version('cloth_ros')
    except importlib.metadata.PackageNotFoundError:  # a source tree that is not installed
        return 'unknown'


def encode(snapshot: Snapshot) -> bytes:
    """Return a snapshot as bytes, from which `decode` makes one that is equal to the bit."""
    inputs = snapshot.inputs
    content = _Content(
        _package_version(),
        snapshot.scene.flat(),
        snapshot.origin,
        snapshot.position,
        snapshot.velocity,
        snapshot.time,
        snapshot.work,
        snapshot.contact,
        snapshot.account,
        inputs.wind,
        dict(inputs.collider_paths),
        dict(inputs.gripper_paths),
        inputs.grips,
        None if snapshot.grippers is None else dict(snapshot.grippers),
        snapshot.steps,
        snapshot.pace,
    )
    data = bytearray()
    _encoder.encode_into(content, data, _BEGIN)
    _HEADER.pack_into(data, 0, _SIGNATURE, _FORMAT, len(data) - _BEGIN)
    data[_HEADER.size : _BEGIN] = _digest(data)
    return bytes(data)


def decode(data: bytes) -> Snapshot:
    """
    Return the snapshot that `encode` has made these bytes of.

    Raises
    ------
    ValueError
        They are damaged or incomplete, of a newer format, or not of a snapshot.

    """
    if data[: len(_SIGNATURE)] != _SIGNATURE[: len(data)] or not data:
        raise ValueError(f'not a snapshot of a cloth: it does not begin as one; {_REMEDY}')
    if len(data) < _BEGIN:
        raise ValueError(f'incomplete: {len(data)} bytes, less than its header; {_REMEDY}')
    _, version, length = _HEADER.unpack_from(data)
    if version > _FORMAT:
        raise ValueError(
            f'a snapshot of format {version}, but this cloth_ros reads formats up to {_FORMAT}; '
            'update cloth_ros'
        )
    if len(data) < _BEGIN + length:
        raise ValueError(f'incomplete: {len(data)} of {_BEGIN + length} bytes; {_REMEDY}')
    if len(data) > _BEGIN + length or data[_HEADER.size : _BEGIN] != _digest(data):
        raise ValueError(f'damaged: the checksum is not that of the content; {_REMEDY}')
    try:
        content = _decoder.decode(memoryview(data)[_BEGIN:])
        return _snapshot(content)
    except (msgspec.MsgspecError, ValueError, MemoryError, RecursionError) as error:
        # With a correct checksum: written by another program.
        raise ValueError(f'not a snapshot of a cloth: {one_line(str(error))}; {_REMEDY}') from None


def _digest(data: bytes | bytearray) -> bytes:
    """Return the checksum of everything but the checksum itself."""
    with memoryview(data) as view:
        digest = hashlib.sha256(view[: _HEADER.size])
        digest.update(view[_BEGIN:])
    return digest.digest()


def write(path: str | os.PathLike[str], snapshot: Snapshot) -> None:
    """Write a snapshot to a file; see `atomic_file`."""
    atomic_file.write(path, encode(snapshot))


def read(path: str | os.PathLike[str]) -> Snapshot:
    """
    Return the snapshot in a file.

    Raises
    ------
    ValueError
        See `decode`; names the file.
    OSError
        The file cannot be read.

    """
    try:
        return decode(read_limited(path, _LARGEST, 'a snapshot of the largest sheet has less'))
    except ValueError as error:
        raise ValueError(f'{format_path(path)}: {error}') from None


# Checks of what is read


def _check(valid: object, name: str, value: object) -> None:
    """Raise ValueError if a value is not valid."""
    if not valid:
        raise ValueError(f'{name} is {value!r:.40}, which no cloth of its scene has')


def _snapshot(content: _Content) -> Snapshot:
    """Return the snapshot of a content; raises ValueError if it fits no cloth of its scene."""
    scene = Scene.from_parameters(content.scene)
    grid = Grid(scene.sheet.rows, scene.sheet.columns)
    origin, position, velocity = content.origin, content.position, content.velocity
    _check(origin.shape == (3,), 'the shape of origin', origin.shape)
    _check(origin.dtype.str == _REAL[1] and np.isfinite(origin).all(), 'origin', origin)
    for name, array, ghost in (('position', position, GHOST), ('velocity', velocity, 0.0)):
        _check(array.shape == (3, grid.size), f'the shape of {name}', array.shape)
        _check(np.isfinite(array).all(), name, 'not finite')
        # Kernels tell ghosts by their distance, and never move them.
        expected = grid.field(array.dtype, ghost)
        grid.interior(expected)[...] = grid.interior(array)
        _check(np.array_equal(array, expected), f'the {name} of ghosts', 'another')
    _check(position.dtype.str in _REAL, 'the type of position', position.dtype)
    _check(position.dtype == velocity.dtype, 'the type of velocity', velocity.dtype)
    _check(0 <= content.time < np.inf, 'time', content.time)
    _check(not np.isnan(content.work), 'work', content.work)
    _check_contact(content.contact, scene, position)
    _check_grippers(content.grippers, scene)
    if content.account is not None:
        account = content.account
        _check(account.division in DIVISIONS, 'division', account.division)
    steps = content.steps
    if steps is not None:
        least, most = 0.01 * steps.stable, 100 * steps.stable
        _check(least < steps.substep < most, 'the length of substeps', steps.substep)
        _check(least < steps.longest, 'the longest substep', steps.longest)
        _check(steps.patience > 0, 'patience', steps.patience)
    division, free = content.pace
    _check(1 <= division <= MAX_DIVISION and free >= 0, 'pace', content.pace)
    return Snapshot(
        scene,
        grid,
        origin.astype(float, copy=False),
        position,
        velocity,
        content.time,
        content.work,
        content.contact,
        content.account,
        _inputs(content, scene),
        content.grippers,
        content.steps,
        content.pace,
    )


def _check_contact(contact: ContactSnapshot | None, scene: Scene, position: Array) -> None:
    """Raise ValueError if a state of contact is not one of the colliders of a scene."""
    parameters = {each.name: each for each in scene.all_colliders()}
    if contact is None or not parameters:
        _check((contact is None) == (not parameters), 'contact', contact)
        return
    _check(list(contact.colliders) == list(parameters), 'contact', list(contact.colliders))
    shape = position.shape[1:]
    _check(contact.rho.shape == shape, 'the shape of rho', contact.rho.shape)
    _check(contact.rho.dtype == position.dtype, 'the type of rho', contact.rho.dtype)
    _check((contact.rho >= 0).all(), 'rho', 'negative')
    _check(contact.patience >= 0, 'patience', contact.patience)
    _check(0 <= contact.excess < np.inf, 'excess', contact.excess)
    _check(0 <= contact.left < np.inf, 'left', contact.left)
    _check(set(contact.known) <= set(parameters), 'known', list(contact.known))
    for name, each in contact.colliders.items():
        _check(each.parameters == parameters[name], 'a collider', each.parameters)
        _check_pose(each.pose)
        _check(len(each.total) == 6, 'the impulse on a collider', each.total)
        _check(0 <= each.inset < np.inf, 'inset', each.inset)
        _check(each.touching >= 0, 'touching', each.touching)


def _check_grippers(grippers: dict[str, GripperSnapshot] | None, scene: Scene) -> None:
    """Raise ValueError if states of grippers are not those of a scene."""
    parameters = {each.name: each for each in scene.grippers}
    if grippers is None:
        _check(not parameters, 'grippers', grippers)
        return
    _check(list(grippers) == list(parameters) != [], 'grippers', list(grippers))
    free, count = ~scene.pinned().ravel(), scene.sheet.rows * scene.sheet.columns
    for name, each in grippers.items():
        _check(each.parameters == parameters[name], 'a gripper', each.parameters)
        _check_pose(each.pose)
        held = each.held
        _check(held.dtype.str == _INTEGER and held.ndim == 1, 'held', held)
        _check(((held >= 0) & (held < count)).all() and (np.diff(held) > 0).all(), 'held', held)
        _check(free[held].all(), 'a held particle', 'pinned, or held twice')
        free[held] = False
        for array in (each.local, each.pull):
            _check(array.dtype.str == _REAL[1], 'the type of a grip', array.dtype)
            _check(array.shape == (len(held), 3), 'the shape of a grip', array.shape)
            _check(np.isfinite(array).all(), 'a grip', 'not finite')
        _check(len(each.total) == 6, 'the impulse on a gripper', each.total)


def _check_pose(pose: Pose) -> None:
    _check(np.isfinite(pose).all(), 'a pose', pose)
    _check(abs(np.linalg.norm(pose[3:]) - 1) < _ROUNDING, 'an orientation', pose[3:])


def _inputs(content: _Content, scene: Scene) -> Inputs:
    """Return the commands; checked, and with the numbers as they are: they are not rounded."""
    Inputs(content.wind, content.collider_paths, content.gripper_paths, content.grips)
    inputs = Inputs(grips=content.grips).with_wind(content.wind)
    colliders = [each.name for each in scene.all_colliders()]
    grippers = [each.name for each in scene.grippers]
    for name, path in content.collider_paths.items():
        _check_path(name, path, colliders)
        inputs = inputs.with_path(name, path)
    for name, path in content.gripper_paths.items():
        _check_path(name, path, grippers)
        inputs = inputs.with_gripper_path(name, path)
    for name, _ in content.grips:
        _check(name in grippers, 'a gripper', name)
    return inputs


def _check_path(name: str, path: tuple[Pose, ...], names: list[str]) -> None:
    _check(name in names, 'a moved body', name)
    _check(len(path) <= MAX_WAYPOINTS, 'the number of waypoints', len(path))
    for pose in path:
        _check_pose(pose)
