"""
Memory that a scene needs, and memory that is available.

Counted from the arrays, per particle, and confirmed by the peak of resident memory of real
processes (`test_memory.py`).  Python, Numba and rclpy need some 200 MB themselves, which are the
same for every scene and not counted.
"""

from __future__ import annotations

import functools
import os
import resource
from pathlib import Path, PurePosixPath

from ..scene import Scene
from ..scene.parameter import invalid_value_error
from .forces.springs import spring_families
from .grid import Grid
from .precision import precision_for

# Share of the memory that one scene may take.
_SHARE = 0.5
# Temporary bytes per particle: energies, strains and contacts are computed in double precision.
_WORKING = 180
# Bytes per particle in messages: a position, and a velocity; six corners of two triangles, of
# three doubles each; and both ends of each spring.
_VECTOR, _TRIANGLES, _SPRING = 12, 144, 48
# Copies of a message at one time: as arrays, as bytes, and in the queues of DDS.
_COPIES = 10


def _kept(scene: Scene, precision: str) -> int:
    """Return the permanent bytes per particle of a cloth."""
    damped = scene.springs.damping > 0
    # Of `State`, of the snapshot at the start of a batch, of `KickDrift`.
    components = 15 + 6 + 3 * (scene.has_air or damped) + 3 * damped
    # Three lists of indices, the velocities before a kick, and the size of the triangles.
    contact = (12 + 5 * 8) * bool(scene.all_colliders())
    # Numbers about each held particle, at most all of them.
    grips = 8 * 32 * bool(scene.grippers)
    # Copies of particles, bounds of features and blocks, and 40 pairs of features: four layers.
    own = (8 * 70 + 8 * 60 + 36 * 40) * (scene.self_contact.thickness > 0)
    return components * (8 if precision == 'double' else 4) + contact + grips + own


def of_cloth(scene: Scene) -> int:
    """Return the bytes that a `Cloth` of the scene takes at most."""
    size = Grid(scene.sheet.rows, scene.sheet.columns).size
    return size * (_kept(scene, precision_for(scene)) + _WORKING)


def of_message(scene: Scene, topic: str) -> int:
    """Return the bytes of a message on `particles` or `markers`, but for some kB."""
    sheet = scene.sheet
    per_particle = _VECTOR * (2 if scene.particles.velocities else 1)
    if topic == 'markers':
        triangles = min(sheet.rows, sheet.columns) > 1
        per_particle = _TRIANGLES * triangles
        if scene.markers.springs or not triangles:
            per_particle += _SPRING * len(list(spring_families(scene)))
        per_particle *= scene.markers.rate > 0
    return per_particle * sheet.rows * sheet.columns


def of_node(scene: Scene) -> int:
    """Return the bytes that a live node takes at most for the scene, its messages included."""
    size = Grid(scene.sheet.rows, scene.sheet.columns).size
    messages = of_message(scene, 'particles') + of_message(scene, 'markers')
    fine = _kept(scene, 'double') + _WORKING // 2  # solution of the error estimate
    return of_cloth(scene) + _COPIES * messages + size * fine


def check(scene: Scene, needed: int, memory: int | None = None) -> None:
    """
    Refuse a scene for which there is not enough memory.

    Parameters
    ----------
    scene
        Names the size of the sheet in the error.
    needed
        Bytes; see `of_cloth` and `of_node`.
    memory
        Available bytes; None: what this process may use.

    Raises
    ------
    ValueError
        More than half of the memory is needed.

    """
    most = _SHARE * (available() if memory is None else memory)
    if needed > most:
        sheet = scene.sheet
        raise invalid_value_error(
            f'the memory for {sheet.rows} × {sheet.columns} particles in MB',
            round(needed / 1e6),
            f'at most {most / 1e6:.0f}, half of the memory',
            'lower sheet.rows or sheet.columns',
        )


@functools.cache
def available(root: str = '/') -> int:
    """
    Return the memory that this process may use, bytes.

    That of the machine, or less where a control group or `ulimit -v` limits it.

    Parameters
    ----------
    root
        Folder of `proc` and `sys`.

    """
    proc, groups = Path(root, 'proc'), Path(root, 'sys/fs/cgroup')
    try:
        total = (proc / 'meminfo').read_text().split('MemTotal:')[1].split()[0]
        limits = [1024 * int(total)]
    except OSError:  # another system than Linux
        limits = [os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE')]
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    if most != resource.RLIM_INFINITY:
        limits.append(most)
    try:
        lines = (proc / 'self/cgroup').read_text().splitlines()
    except OSError:  # a kernel without control groups
        lines = []
    for line in lines:
        _, controllers, name = line.split(':', 2)
        if not controllers:
            folder, file = groups, 'memory.max'
        elif 'memory' in controllers.split(','):
            folder, file = groups / 'memory', 'memory.limit_in_bytes'
        else:
            continue
        # A limit applies to all groups below, and the group of a container is at the top.
        path = PurePosixPath(name.lstrip('/'))
        for group in (path, *path.parents):
            try:
                text = (folder / group / file).read_text().strip()
            except OSError:
                continue
            if text.isdigit():  # not "max"
                limits.append(int(text))
    return min(limits)
