"""Sessions of a real node, recorded from DDS by a second process, are repeated to the bit."""

import sys

import numpy as np
import pytest
from builders import ROOT, SCENE_FILES
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.srv import SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros import Process, environment, parameter_request, pose, wind
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from cloth_ros import Scene
from cloth_ros.recording import run
from cloth_ros.recording.bag import Bag, deserialise

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
RECORD = (sys.executable, str(ROOT / 'examples/record.py'))


def progress(*_):
    """Report to nobody."""


@pytest.fixture
def record(domain):
    """Start the recorder; it has begun, because it is given time to be discovered."""
    recorders = []

    def start(path, *arguments):
        recorders.append(Process((*RECORD, str(path), *arguments), environment(domain)))
        recorders[-1].wait_for_output('waiting for')
        return recorders[-1]

    yield start
    for each in recorders:
        each.end()


def session(start_cloth, probe, record, scene, path, ticks):
    """Record a session with everything that may change a cloth; return the node."""
    node = start_cloth('--params-file', str(scene))
    particles = probe.collect(PointCloud2, '/cloth/particles', 1000)
    scenes: list[String] = []
    probe.create_subscription(String, '/cloth/scene', scenes.append, LATCHED)
    blow = probe.publisher(Vector3Stamped, '/wind')
    colliders = {each.name: each for each in Scene.from_yaml(scene).all_colliders()}
    names = {name: 'sphere_pose' if name == 'sphere' else f'{name}/pose' for name in colliders}
    movers = {
        name: probe.publisher(PoseStamped, f'/{topic}')
        for name, topic in names.items()
        if not colliders[name].frame_id
    }
    recorder = record(path, '--poses', *(name for name in movers if name != 'sphere'))
    recorder.wait_for_output('recording; from here on')
    probe.handle_all(lambda: False)  # what came meanwhile
    begin = len(particles)

    def act(count):
        blow.publish(wind(y=2.0 * np.sin(0.1 * count)))
        for name, publisher in movers.items():
            x, y, z = colliders[name].position
            publisher.publish(pose(x + 0.05 * np.sin(0.07 * count), y, z + 0.02))

    count = 0
    # The change of parameters takes effect when its kernels are compiled.
    while len(particles) < begin + ticks or count < 60 or len(scenes) < 2:
        act(count)
        count += 1
        probe.spin_for(0.02)
        if count == 20:
            request = parameter_request({'drag': 0.7, 'springs.shear': 200.0})
            probe.call(SetParameters, '/cloth/set_parameters', request)
        if count == 30:
            probe.call(SetBool, '/cloth/pause', SetBool.Request(data=True))
            probe.call(SetBool, '/cloth/pause', SetBool.Request(data=False))
        if count == 40:
            probe.call(Trigger, '/cloth/reset', Trigger.Request())
    assert recorder.stop() == 0
    return node


def check(path):
    outcome = run.repeat(path, None, progress)
    assert outcome.identical, outcome.lines
    assert not outcome.result['gaps'] + outcome.result['defects']
    return outcome.result


def test_a_session_is_repeated_to_the_bit(start_cloth, probe, record, tmp_path):
    scene = ROOT / 'config/drop_on_sphere.yaml'
    ran = Scene.from_yaml(scene)
    session(start_cloth, probe, record, scene, tmp_path / 'bag', 120)
    result = check(tmp_path / 'bag')
    assert result['states'] > 60
    # The scene as it ran, for people, and for a node.
    texts = [each for each in Bag(tmp_path / 'bag').messages() if each.topic == '/cloth/scene']
    assert len(texts) >= 2  # that at the start, which was published before, and after the change
    for text, drag in ((texts[0], 0.5), (texts[-1], 0.7)):
        (tmp_path / 'scene.yaml').write_text(deserialise(text).data)
        changes = {'drag': drag, 'springs.shear': 200.0} if drag == 0.7 else {}
        assert Scene.from_yaml(tmp_path / 'scene.yaml') == ran.with_parameters(changes)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize('scene', SCENE_FILES, ids=lambda path: path.stem)
def test_ten_seconds_of_each_scene_are_repeated_to_the_bit(
    scene, start_cloth, probe, record, tmp_path
):
    session(start_cloth, probe, record, scene, tmp_path / 'bag', 600)
    result = check(tmp_path / 'bag')
    assert result['states'] > 300
