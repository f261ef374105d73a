"""Save the state of the running cloth to a file, and load one."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

from ..model import atomic_file, snapshot_file
from ..model.scene_check import changed_fixed
from ..scene import Scene
from ..scene.node_groups import KEPT_BY_THE_NODE
from ..scene.parameter import format_value
from ..scene.yaml_text import write
from .context import Context

_SIGNATURE = 8  # bytes, with which all saved states begin


def state_path(context: Context) -> str:
    """Return the path of the file: `snapshot.file`, or one in the folder of ROS, which is made."""
    if file := context.parameters.scene.snapshot.file:
        return os.path.abspath(os.path.expanduser(file))
    folder = Path(os.environ.get('ROS_HOME') or '~/.ros').expanduser().absolute()
    folder.mkdir(parents=True, exist_ok=True)
    # A name of its own for each node: lab.cloth.snapshot for the node /lab/cloth.
    name = context.node.get_fully_qualified_name().strip('/').replace('/', '.')
    return str(folder / f'{name}.snapshot')


def save_state(context: Context) -> str:
    """
    Save the state; return what was written, in words.

    Raises
    ------
    ValueError, OSError
        The file cannot be written.

    """
    live, path = context.live, state_path(context)
    snapshot = live.snapshot()
    changing = snapshot.scene != live.requested
    snapshot = snapshot.of_scene(context.frames.in_frames(snapshot.scene))
    data = snapshot_file.encode(snapshot)
    _check_replaced(path, data)
    atomic_file.write(path, data)
    text = f'saved {path}: {len(data)} bytes, simulated time {snapshot.time:.6g} s'
    if live.reduction:
        text += f'; because of overload ({live.reduction}) it is converted to the scene requested'
    if changing:
        text += '; parameters whose kernels are being compiled are not in it yet'
    return text


def _check_replaced(path: str, data: bytes) -> None:
    """Raise ValueError if a file is to be replaced that is not a saved state."""
    if not os.path.isfile(path):
        return
    with open(path, 'rb') as file:
        if file.read(_SIGNATURE) != data[:_SIGNATURE]:
            raise ValueError(
                f'{path}: this file is not a saved state, and is not replaced; remove it, or set '
                'snapshot.file to another'
            )


def load_state(context: Context) -> str:
    """
    Load the state; return what was loaded, in words.

    Parameters of the node become those of the saved scene, but for `clock` and `snapshot`.

    Raises
    ------
    ValueError
        The file is not a saved state, or one that this node cannot continue from.
    OSError
        The file cannot be read.

    """
    live, path = context.live, state_path(context)
    snapshot = snapshot_file.read(path)
    before = context.parameters.scene
    _check_fixed(path, before, snapshot.scene)
    now, saved = before.flat(), snapshot.scene.flat()
    changes = {
        name: value
        for name, value in saved.items()
        if not name.startswith(KEPT_BY_THE_NODE) and (name not in now or now[name] != value)
    }
    context.parameters.set_values(changes)
    restored = live.restore(snapshot.of_scene(live.requested))
    text = f'loaded {path}: {os.path.getsize(path)} bytes, simulated time {snapshot.time:.6g} s'
    return text if restored else f'{text}; it is restored once its kernels are compiled'


def _check_fixed(path: str, before: Scene, saved: Scene) -> None:
    """Raise ValueError if a parameter that is fixed differs."""
    names = [
        name for name in changed_fixed(before, saved) if not name.startswith(KEPT_BY_THE_NODE)
    ]
    if not names:
        return
    now, values = before.flat(), saved.flat()
    rules = ' '.join(f'-p {shlex.quote(f"{name}:={write(values[name])}")}' for name in names)
    raise ValueError(
        f'{names[0]} is {format_value(now[names[0]])}, but {format_value(values[names[0]])} in '
        f'{path}, and cannot change while the node runs; start the node with {rules}'
    )
