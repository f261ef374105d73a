"""Parameters at the start of the node, and kernels that cannot be compiled."""

import sys

from ros import regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2


def test_qos_can_be_overridden(start_cloth, probe):
    start_cloth(**{'qos_overrides./cloth/particles.publisher.reliability': 'best_effort'})
    probe.spin_until(lambda: probe.count_publishers('/cloth/particles'))
    (info,) = probe.get_publishers_info_by_topic('/cloth/particles')
    assert info.qos_profile.reliability.name == 'BEST_EFFORT'
    (info,) = probe.get_publishers_info_by_topic('/cloth/markers')
    assert info.qos_profile.reliability.name == 'RELIABLE'


def test_a_scene_that_is_not_valid_is_refused_in_one_line(start):
    node = start(sys.executable, '-m', 'cloth_ros.node.main', '--ros-args', '-p', 'sheet.rows:=0')
    assert node.stop(0, patience=30.0) == 2
    assert 'sheet.rows is 0, but must be 1 to 1024' in node.output
    assert 'Traceback' not in node.output


def test_names_that_no_scene_has_and_values_in_another_unit_are_pointed_out(start_cloth):
    node = start_cloth(**{'spring.shear': 3.0, 'sheet.mass': 200.0})
    assert "did you mean 'springs.shear'" in node.output
    assert node.output.count('an areal density of 200 kg/m²') == 1


NOT_COMPILED = """
import sys
from cloth_ros import Cloth
from cloth_ros.node.main import main

warm_up = Cloth.warm_up

def failing(self, *kinds):
    if self.scene.drag == 3:
        raise OSError('no space left on device')
    return warm_up(self, *kinds)

Cloth.warm_up = failing
sys.exit(main())
"""


def test_kernels_that_cannot_be_compiled_leave_the_cloth_as_it_is(start, probe):
    node = start(sys.executable, '-c', NOT_COMPILED, '--ros-args', '-p', 'drag:=0.5')
    node.wait_for_output('publishing')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    (result,) = set_parameters(probe, drag=3.0)
    assert result.successful
    node.wait_for_output('no space left on device')
    particles.clear()
    probe.spin_until(lambda: len(particles) > 60)
    assert node.output.count('no space left on device') == 1, 'it is not tried again and again'
    results = set_parameters(probe, drag=2.0, rate=120.0)  # which is
    assert all(result.successful for result in results)
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))
    assert node.output.count('no space left on device') == 1
