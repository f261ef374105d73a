"""
Compile the kernels that many tests need: ``python test/kernels.py``, before pytest starts.

Each precision has a process, which compiles the parts that its kernels share once.  The tests and
their nodes, which are processes of their own, load them from Numba's cache on disk; two that
needed the same kernel at the same time would both compile it.  Kernels that few tests need are
compiled by these.
"""

from __future__ import annotations

import subprocess
import sys
import time

from builders import NEGLIGIBLE_AIR, ROOT, scene_of
from colliders import FAR

from cloth_ros import Scene
from cloth_ros.live.compile_kernels import kinds_of, warm_up

_SPHERE = {'sphere__radius': 0.1, 'sphere__position': (0, 0, 9)}
_NO_AIR = {'wind__air_density': 0.0}


def _with_collider(**parameters: object) -> dict[str, object]:
    return {'collider': {'names': ['solid'], 'solid': {**parameters, 'position': (0, 0, -9)}}}


_BOTH = (
    _SPHERE,
    {**_SPHERE, 'springs__damping': 1e-3},
    {**_SPHERE, **NEGLIGIBLE_AIR, 'collider': {'names': list(FAR), **FAR}},
    {'springs__damping': 1e-3, **_NO_AIR},
    {'gripper': {'names': ['hand']}},
)
# Those that only the tests of one precision need.  Tests of nodes use double precision.
SCENES: dict[str, tuple[Scene, ...]] = {
    'single': (
        *(scene_of(**each) for each in _BOTH),
        *(Scene.from_yaml(ROOT / f'config/{name}.yaml') for name in ('table', 'box', 'towel')),
        scene_of(self_contact__thickness=4e-3, **_NO_AIR, **_with_collider(type='plane')),
    ),
    'double': (
        *(scene_of(**each) for each in _BOTH),
        scene_of(**_SPHERE, **_NO_AIR),
        scene_of(**_SPHERE, gripper={'names': ['hand']}),
        scene_of(**_SPHERE, **_with_collider(type='sphere', radius=0.1)),
        scene_of(**_SPHERE, **_with_collider(type='box', size=(0.1, 0.1, 0.1))),
    ),
}


def main() -> None:
    """Compile in a process for each precision, or those of the precision in the arguments."""
    for scene in SCENES.get(sys.argv[-1], ()):
        ready = scene.with_parameters({'solver.precision': sys.argv[-1]})
        warm_up(ready, kinds_of(ready))
    if sys.argv[-1] in SCENES:
        return
    start = time.monotonic()
    print('compiling the kernels that many tests need, unless they are kept from before')
    children = [subprocess.Popen([sys.executable, __file__, each], cwd=ROOT) for each in SCENES]
    failed = [child.wait() for child in children]
    print(f'done in {time.monotonic() - start:.0f} s')
    sys.exit(max(map(abs, failed)))


if __name__ == '__main__':
    main()
