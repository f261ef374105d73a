"""Parameters at the start of the node, and kernels that cannot be compiled."""

import re
import sys
import time

from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from ros import NODE, SPHERE, dumped, regular, set_parameters, stamp
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from cloth_ros import Scene


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


def test_help_names_the_topics_of_a_node(start, start_cloth):
    announced = start_cloth().output.partition('] [cloth]: publishing ')[2].splitlines()[0]
    node = start(*NODE, '--help')
    assert node.stop(0, patience=30.0) == 0
    assert node.output.startswith('usage: cloth_node [--ros-args --params-file SCENE')
    words = set(node.output.split())
    topics = re.findall(r'/[\w/]+', announced)
    assert len(topics) == 8
    for topic in topics:
        assert {topic, topic[1:], topic.replace('/cloth/', '~/')} & words


def test_coordinates_that_are_coarser_than_the_tolerance_are_pointed_out_once(start_cloth, probe):
    node = start_cloth(sheet__position='[5.0e5, 0.0, 1.0]')
    assert 'in steps of 0.0312 m, coarser than solver.tolerance (0.001 m)' in node.output
    assert "--x 500000 --y 0 --z 1 --frame-id 'world' --child-frame-id FRAME_ID" in node.output
    particles = probe.collect(PointCloud2, '/cloth/particles')
    probe.spin_until(lambda: len(particles) > 5)
    assert node.output.count('published in single precision') == 1
    node.stop()
    node = start_cloth(sheet__position='[8.0e3, 0.0, 1.0]')
    particles.clear()
    probe.spin_until(lambda: len(particles) > 5)
    assert 'published in single precision' not in node.output
    (result,) = set_parameters(probe, solver__tolerance=1e-4)
    assert result.successful
    node.wait_for_output('in steps of 0.000488 m, coarser than solver.tolerance (0.0001 m)')


def test_viewers_delete_the_markers_of_a_node_that_another_replaces(start_cloth, probe):
    """The first message to a viewer deletes all, and the next one shows the present markers."""
    markers: list[MarkerArray] = []
    probe.create_subscription(MarkerArray, '/cloth/markers', markers.append, 100)
    for parameters, count in ((SPHERE, 9), ({'markers__rate': 0.0}, 1), ({}, 9)):
        began = time.time()
        node = start_cloth(**parameters)

        def received() -> list[Marker]:
            """Return the markers of this node, which was started after the others had ended."""
            return [
                marker
                for message in markers
                for marker in message.markers
                if stamp(marker) > began  # noqa: B023
            ]

        probe.spin_until(lambda: len(received()) >= count)  # noqa: B023
        first, *others = received()
        assert (first.action, first.ns) == (Marker.DELETEALL, '')
        assert Marker.DELETEALL not in [each.action for each in others]
        node.stop()


def test_a_state_set_live_is_dumped_and_started_again(start_cloth, probe, tmp_path):
    first = start_cloth('-p', 'gravity:=[0, 0, -1.5]', sheet__rows=5)
    assert all(result.successful for result in set_parameters(probe, rate=50, drag='2e-1'))
    no_pins = Parameter('pins', Parameter.Type.STRING_ARRAY, []).to_parameter_msg()
    request = SetParameters.Request(parameters=[no_pins])
    assert probe.call(SetParameters, '/cloth/set_parameters', request).results[0].successful

    def values() -> dict[str, object]:
        listed = probe.call(ListParameters, '/cloth/list_parameters', ListParameters.Request())
        names = sorted(listed.result.names)
        request = GetParameters.Request(names=names)
        found = probe.call(GetParameters, '/cloth/get_parameters', request).values
        return dict(zip(names, map(parameter_value_to_python, found), strict=True))

    before = values()
    assert (before['pins'], before['rate'], before['drag']) == ([], 50.0, 0.2)
    path = tmp_path / 'dump.yaml'
    path.write_text(dumped(before))
    scene = Scene.from_yaml(path)
    assert (scene.pins, scene.gravity, scene.sheet.rows) == ((), (0.0, 0.0, -1.5), 5)
    first.end()
    probe.spin_until(lambda: not probe.count_publishers('/cloth/particles'))
    second = start_cloth('--params-file', str(path))
    assert 'ignored' not in second.output
    assert values() == before | {'pins': ['']}


def test_a_file_for_another_node_is_pointed_out_once(start_cloth, tmp_path):
    path = tmp_path / 'lab.yaml'
    path.write_text('/lab/cloth: {ros__parameters: {sheet: {rows: 7}}}\n')
    node = start_cloth('--params-file', str(path))
    line = f'{path} has parameters for /lab/cloth, but none for this node, /cloth; '
    node.wait_for_output(line)
    assert node.output.count(line) == 1
    assert '32 × 32 particles' in node.output
    told = start_cloth('--params-file', str(path), '-r', '__ns:=/lab')
    assert 'none for this node' not in told.output
    assert '7 × 32 particles' in told.output


NOT_COMPILED = """
import sys
from cloth_ros import Cloth
from cloth_ros.node.main import main

warm_up = Cloth.warm_up

def failing(self, *kinds):
    if self.scene.springs.damping > 0:
        raise OSError('no space left on device')
    return warm_up(self, *kinds)

Cloth.warm_up = failing
sys.exit(main())
"""


def test_kernels_that_cannot_be_compiled_leave_the_cloth_as_it_is(start, probe):
    node = start(sys.executable, '-c', NOT_COMPILED, '--ros-args', '-p', 'drag:=0.5')
    node.wait_for_output('publishing')
    particles = probe.collect(PointCloud2, '/cloth/particles')
    (result,) = set_parameters(probe, springs__damping=1e-4)
    assert result.successful
    node.wait_for_output('no space left on device')
    particles.clear()
    probe.spin_until(lambda: len(particles) > 60)
    assert node.output.count('no space left on device') == 1, 'it is not tried again and again'
    results = set_parameters(probe, springs__damping=0.0, rate=120.0)
    assert all(result.successful for result in results)
    probe.spin_until(lambda: regular([stamp(message) for message in particles], 1 / 120))
    assert node.output.count('no space left on device') == 1
