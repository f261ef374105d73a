"""A change that needs kernels which were never compiled on the machine."""

from ros_messages import regular, set_parameters, stamp
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
