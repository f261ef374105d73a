"""Which scenes can be simulated: their time step, their memory and the meshes in them."""

from __future__ import annotations

import math

import numpy as np

from ..scene import Scene
from ..scene.parameter import PARAMETERS, invalid_value_error
from . import memory
from .contact.shapes import shape_of
from .precision import precision_for
from .self_contact import scene_check as self_contact
from .time_step import check_time_step


def check_scene(scene: object) -> None:
    """
    Refuse a scene that cannot be simulated.

    Raises
    ------
    ValueError
        Names the parameter, its value, the allowed range and a remedy.

    """
    if not isinstance(scene, Scene):
        raise invalid_value_error(
            'scene', scene, 'a cloth_ros.Scene', 'use Scene(...) or Scene.from_yaml'
        )
    check_time_step(scene)
    dtype = np.float64 if precision_for(scene) == 'double' else np.float32
    self_contact.check(scene, float(np.finfo(dtype).eps))
    memory.check(scene, memory.of_cloth(scene))
    for each in scene.colliders:
        shape_of(each, circumradius(scene))


def changed_fixed(before: Scene, after: Scene) -> list[str]:
    """Return the names of the parameters that differ, of those fixed while a cloth runs."""
    first, second = before.flat(), after.flat()
    fixed = (name for name, known in PARAMETERS.items() if known.fixed)
    return [name for name in fixed if first[name] != second[name]]


def check_change(before: Scene, after: Scene) -> None:
    """
    Refuse a scene that cannot be simulated in place of another while a cloth runs.

    Raises
    ------
    ValueError
        A parameter that is fixed differs, or see `check_scene`.

    """
    check_scene(after)
    for name in changed_fixed(before, after):
        value, allowed = after.flat()[name], f'{before.flat()[name]!r} as before'
        raise invalid_value_error(name, value, allowed, 'make a new Cloth')


def circumradius(scene: Scene) -> float:
    """Return the circumradius, m, of the triangles of the undeformed sheet."""
    return 0.5 * math.hypot(*scene.sheet.spacing)
