"""How much memory a scene takes is known before it is taken."""

import pytest
from builders import run_python, scene_of

from cloth_ros.model import memory

PEAK = """
import sys
from cloth_ros import Cloth, Scene
def peak():
    with open('/proc/self/status') as status:
        return 1024 * int(status.read().split('VmHWM:')[1].split()[0])
def work(size):
    sphere = {'radius': float(sys.argv[2]), 'position': [0.0, 0.0, 1.25]}
    sheet = {'rows': size, 'columns': size}
    cloth = Cloth(Scene(sheet=sheet, solver={'precision': sys.argv[1]}, sphere=sphere))
    list(cloth.warm_up())
    cloth.advance(2 * cloth.substep)
    cloth.positions, cloth.velocities, cloth.energy(), cloth.strain()
work(8)
before = peak()
work(int(sys.argv[3]))
print(peak() - before)
"""


@pytest.mark.parametrize(('precision', 'radius'), [('double', 0.0), ('single', 0.2)])
def test_the_peak_of_a_cloth_is_at_most_what_is_foreseen_and_not_much_less(precision, radius):
    # Kernels are compiled by another process: memory that the compiler frees is used again.
    run_python(PEAK, precision, radius, 8)
    found = run_python(PEAK, precision, radius, 384)
    sheet = {'rows': 384, 'columns': 384}
    scene = scene_of(sheet=sheet, solver__precision=precision, sphere__radius=radius)
    assert 0.7 < float(found.stdout) / memory.of_cloth(scene) < 1.05, found.stderr


LIMITED = """
import resource
resource.setrlimit(resource.RLIMIT_AS, (700_000_000, 700_000_000))
from cloth_ros import Cloth, Scene
scene = Scene(sheet={'rows': 1024, 'columns': 1024}, solver={'precision': 'double'})
try:
    Cloth(scene)
except ValueError as error:
    print(error)
"""


def test_a_scene_that_needs_more_than_half_of_the_memory_is_refused_before_it_is_taken():
    scene = scene_of(sheet__rows=1024, sheet__columns=1024)
    needed = memory.of_node(scene)
    memory.check(scene, needed, 2 * needed)
    with pytest.raises(ValueError, match=r'1024 × 1024 particles in MB is .* at most'):
        memory.check(scene, needed, 2 * needed - 2)
    assert memory.of_cloth(scene) < needed
    assert needed < memory.of_node(scene.with_parameters({'markers.springs': True}))
    assert needed > memory.of_node(scene.with_parameters({'particles.velocities': False}))
    # In a process that may use 0.7 GB.
    found = run_python(LIMITED)
    assert 'at most 350, half of the memory' in found.stdout, found.stderr[-500:]
    assert 1e8 < memory.available() < 1e14


@pytest.mark.parametrize(
    ('line', 'file', 'limit', 'expected'),
    [
        ('0::/box', 'box/memory.max', '1000000', 1_000_000),
        ('0::/box/inner', 'box/memory.max', '1000000', 1_000_000),
        ('0::/box', 'memory.max', '3000000', 3_000_000),
        ('0::/box', 'box/memory.max', 'max', 8192 * 1024),
        ('4:memory:/box', 'memory/box/memory.limit_in_bytes', '2000000', 2_000_000),
        ('4:cpu,memory:/box', 'memory/memory.limit_in_bytes', '2000000', 2_000_000),
        ('4:memory:/', 'memory/memory.limit_in_bytes', str(2**63 - 4096), 8192 * 1024),
        ('3:cpu:/box', 'memory/box/memory.limit_in_bytes', '2000000', 8192 * 1024),
    ],
)
def test_a_limit_of_a_control_group_is_found(tmp_path, line, file, limit, expected):
    path = tmp_path / 'sys/fs/cgroup' / file
    for folder in (tmp_path / 'proc/self', path.parent):
        folder.mkdir(parents=True)
    (tmp_path / 'proc/meminfo').write_text('MemTotal:        8192 kB\nMemFree: 1 kB\n')
    (tmp_path / 'proc/self/cgroup').write_text(line + '\n')
    path.write_text(limit + '\n')
    assert memory.available(str(tmp_path)) == expected
