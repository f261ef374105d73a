"""A change that needs kernels which were never compiled on the machine."""

import subprocess
import sys

from ros import ROOT, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2


def test_the_cloth_goes_on_while_they_are_compiled(start_cloth, probe, tmp_path, monkeypatch):
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    node = start_cloth(wind__air_density=0.0)
    assert 'preparing the kernels of motion' in node.output
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: particles)
    results = set_parameters(probe, springs__damping=1e-3, rate=120.0)
    assert all(result.successful for result in results)
    node.wait_for_output('compiling kernels')
    particles.clear()
    # The solution is said at the start, and when the change takes effect.
    probe.spin_until(lambda: node.output.count('stability limit') == 2)
    assert len(particles) > 20
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))


ENDING = """
import time
from cloth_ros.live.kernel_compiler import Background

def make():
    time.sleep(0.5)
    print('made')

Background(make)
print('the end')
"""


def test_a_process_ends_when_what_is_compiled_beside_it_is_done():
    """Python's own end takes what LLVM uses from under the thread."""
    found = subprocess.run(
        [sys.executable, '-c', ENDING], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert found.stdout == 'the end\nmade\n'
