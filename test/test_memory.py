"""How much memory a scene takes is known before it is taken."""

import subprocess
import sys
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from ros import ROOT
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from cloth_ros import Scene
from cloth_ros.model import memory

MEASURE = """
import sys
from cloth_ros import Cloth, Scene
def peak():
    with open('/proc/self/status') as status:
        return 1024 * int(status.read().split('VmHWM:')[1].split()[0])
def work(size):
    scene = Scene(
        sheet={'rows': size, 'columns': size},
        solver={'precision': sys.argv[1]},
        sphere={'radius': float(sys.argv[2]), 'position': [0.0, 0.0, 1.25]},
    )
    cloth = Cloth(scene)
    cloth.compile()
    cloth.advance(2 * cloth.substep)
    cloth.positions, cloth.velocities, cloth.energy(), cloth.largest_strain()
work(8)
before = peak()
work(384)
print(peak() - before)
"""


@pytest.mark.parametrize(
    ('precision', 'radius'), [('single', 0.0), ('double', 0.0), ('single', 0.2)]
)
def test_the_memory_of_a_cloth_is_foreseen(precision, radius):
    command = [sys.executable, '-c', MEASURE, precision, str(radius)]
    result = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=True)
    scene = Scene(
        sheet={'rows': 384, 'columns': 384},
        solver={'precision': precision},
        sphere={'radius': radius},
    )
    assert 0.7 < float(result.stdout) / memory.of_cloth(scene) < 1.05


def test_the_memory_of_a_node_is_foreseen(start_cloth, probe):
    """At its peak, with all that it publishes subscribed to."""
    peaks = []
    for size in (8, 256):
        node = start_cloth(sheet__rows=size, sheet__columns=size, solver__tolerance=1.0)
        particles, markers, reports = [], [], []
        subscriptions = [
            probe.create_subscription(
                PointCloud2, '/cloth/particles', particles.append, 5, raw=True
            ),
            probe.create_subscription(MarkerArray, '/cloth/markers', markers.append, 5, raw=True),
            probe.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 5),
        ]
        probe.spin_until(
            lambda: min(len(particles), len(markers), 4 * len(reports)) > 10  # noqa: B023
        )
        status = Path(f'/proc/{node.process.pid}/status').read_text()
        peaks.append(1024 * int(status.split('VmHWM:')[1].split()[0]))
        for subscription in subscriptions:
            probe.destroy_subscription(subscription)
        node.stop()
    scene = Scene(sheet={'rows': 256, 'columns': 256})
    assert 0.6 < (peaks[1] - peaks[0]) / memory.of_node(scene) < 1.1


def test_a_scene_that_needs_more_than_half_of_the_memory_is_refused():
    scene = Scene(sheet={'rows': 1024, 'columns': 1024})
    needed = memory.of_node(scene)
    memory.check(scene, needed, 2 * needed)
    with pytest.raises(
        ValueError, match=r'1024 × 1024 particles in MB is \d+, but must be at most'
    ):
        memory.check(scene, needed, 2 * needed - 2)


LIMITED = """
import resource
resource.setrlimit(resource.RLIMIT_AS, (800_000_000, 800_000_000))
from cloth_ros import Cloth, Scene
scene = Scene(sheet={'rows': 1024, 'columns': 1024}, solver={'precision': 'double'})
try:
    Cloth(scene)
except ValueError as error:
    print(error)
"""


def test_a_cloth_is_refused_before_its_memory_is_taken():
    """In a process that may use 0.8 GB; the scene alone takes none."""
    command = [sys.executable, '-c', LIMITED]
    result = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=False)
    assert 'at most 400, half of what there is' in result.stdout, result.stderr[-500:]


def test_a_node_takes_more_than_a_cloth_and_more_with_springs_shown():
    scene = Scene()
    format_value = scene.with_parameters({'markers.springs': True})
    assert memory.of_cloth(scene) < memory.of_node(scene) < memory.of_node(format_value)


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
    (tmp_path / 'proc/self').mkdir(parents=True)
    (tmp_path / 'proc/meminfo').write_text('MemTotal:        8192 kB\nMemFree: 1 kB\n')
    (tmp_path / 'proc/self/cgroup').write_text(line + '\n')
    path = tmp_path / 'sys/fs/cgroup' / file
    path.parent.mkdir(parents=True)
    path.write_text(limit + '\n')
    assert memory.available(str(tmp_path)) == expected


def test_this_machine_has_memory():
    assert 1e8 < memory.available() < 1e14
