"""
Compile the kernels of a scene: ``python -m cloth_ros.live.compile_kernels``, a child process.

The process reads one line of JSON from its standard input: ``parameters`` of the scene by name,
``kinds`` of kernels and ``nice``, the increment of its niceness.  It fills Numba's cache on disk,
from which the parent process then loads the kernels.  It ends when its standard input is closed,
which happens when the parent ends for any reason.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import warnings
from collections.abc import Collection
from typing import Any

import numpy as np

from ..model import Cloth
from ..model.precision import precision_for
from ..model.resample import interpolate
from ..scene import Scene
from .triangles import write_triangles


def _small(scene: Scene) -> Scene:
    """Return a scene with the same kernels, whose sheet is small."""
    sheet, springs, wind = scene.sheet, scene.springs, scene.wind
    return scene.with_parameters(
        {
            'sheet.rows': min(sheet.rows, 3),
            'sheet.columns': min(sheet.columns, 3),
            'solver.precision': precision_for(scene),
            'solver.substeps': 0,
            'pins': [''],
            # Moderate values of what changes no kernel, so that single precision is good enough.
            'rate': 60.0,
            'drag': 0.0,
            'gravity': (0.0, 0.0, -9.81),
            'sheet.size': (1.0, 1.0),
            'sheet.mass': 1.0,
            'solver.tolerance': 1e-3,
            'springs.structural': min(springs.structural, 1.0),
            'springs.shear': min(springs.shear, 1.0),
            'springs.bending': min(springs.bending, 1.0),
            'springs.damping': min(springs.damping, 1e-3),
            'wind.velocity': (0.0, 0.0, 0.0),
            'wind.air_density': min(wind.air_density, 1.0),
            'wind.drag_coefficient': min(wind.drag_coefficient, 1.0),
            'wind.gust.period': 0.0,
            'self_contact.thickness': min(scene.self_contact.thickness, 0.1) and 0.1,
            'solver.overload': 'slow_motion',
        }
    )


def kinds_of(scene: Scene) -> tuple[str, ...]:
    """Return the kinds of kernels of a scene, in the order in which a cloth needs them."""
    return ('motion', 'contact') if scene.all_colliders() else ('motion',)


def warm_up(scene: Scene, kinds: Collection[str]) -> None:
    """
    Call every kernel of a scene once, so that Numba loads it from its cache or compiles it.

    Parameters
    ----------
    scene
        As it is simulated, on its own or on a coarser grid.
    kinds
        Those of `kinds_of` that are wanted.  Kernels that publish the sheet count as motion.

    """
    if 'motion' in kinds:
        write_triangles(np.zeros((2, 2, 3)), np.empty((1, 6, 3)))
        interpolate(np.zeros((1, 1, 1, 3)), 1, 1)
    small = _small(scene)
    if 'contact' not in kinds:
        small = small.with_parameters({'sphere.radius': 0.0, 'collider.names': ['']})
    for _ in Cloth(small).warm_up(kinds):
        pass


def _exit_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)  # returns when the other end of the pipe is closed
    os._exit(1)


def main() -> None:
    """Compile the kernels named on the standard input."""
    job: dict[str, Any] = json.loads(sys.stdin.readline())
    # The parent logs what is printed: the text alone is enough.
    warnings.showwarning = lambda message, *_, **__: print(message, file=sys.stderr)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    os.nice(job['nice'])
    warm_up(Scene.from_parameters(job['parameters']), job['kinds'])


if __name__ == '__main__':
    main()
