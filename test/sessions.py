"""Sessions of a real node with everything that may change a cloth, recorded from DDS."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from builders import ROOT
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rcl_interfaces.srv import SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros import Probe, Process, environment, parameter_request, pose, wind
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from cloth_ros import Scene
from cloth_ros.live.compile_kernels import kinds_of, warm_up
from cloth_ros.live.error_estimate import double_precision

sys.path.insert(0, str(ROOT / 'examples'))
from robot_arm import link_poses, pose_message

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CHANGES = {'drag': 0.7, 'springs.shear': 200.0}
_RECORD = (sys.executable, str(ROOT / 'examples/record.py'))
_PERIOD = 0.02  # s, of the commands
# Numbers of the commands after which parameters change, the cloth pauses, and is reset.
_CONFIGURED, _PAUSED, _RESET = 20, 30, 40
_STROKE = 4.0  # s, from the start of a sphere beside a pinned sheet through the sheet, and back


def poses(path: Path, scene: Scene, seconds: float) -> dict[str, PoseStamped]:
    """
    Return poses to which the colliders of a scene are moved so many s after a reset.

    An arm makes the motion of the example, a sphere beside a pinned sheet goes through the sheet,
    and what lies under a falling sheet moves a little.
    """
    if path.stem == 'robot_arm':
        return {name: pose_message(each) for name, each in link_poses(seconds).items()}
    moved = {}
    for each in scene.all_colliders():
        x, y, z = each.position
        if each.name == 'sphere' and scene.pinned().any():
            share = 1.8 * math.sin(math.pi * seconds / _STROKE) ** 2
            goal = scene.sheet.position
            x, y, z = (a + share * (b - a) for a, b in zip((x, y, z), goal, strict=True))
        elif each.type != 'plane':
            x += 0.05 * math.sin(3.5 * seconds)
            z += 0.02 * math.sin(2.0 * seconds) ** 2
        if not each.frame_id:
            moved[each.name] = pose(x, y, z)
            moved[each.name].pose.orientation.x = each.orientation[0]
            moved[each.name].pose.orientation.y = each.orientation[1]
            moved[each.name].pose.orientation.z = each.orientation[2]
            moved[each.name].pose.orientation.w = each.orientation[3]
    return moved


def compile_kernels(scene_file: Path) -> None:
    """Compile what a node needs for a scene, so that the cloth is not held at first."""
    scene = Scene.from_yaml(scene_file)
    for each in (scene, double_precision(scene)):
        warm_up(each, kinds_of(each))


@contextmanager
def recorder(domain: int, path: Path, *arguments: str) -> Iterator[Process]:
    """Start a recorder, which is given time to be discovered."""
    process = Process((*_RECORD, str(path), *arguments), environment(domain))
    try:
        process.wait_for_output('waiting for')
        yield process
    finally:
        process.end()


def record_session(probe: Probe, domain: int, scene_file: Path, path: Path, ticks: int) -> None:
    """
    Record a session of so many ticks of a node that runs a scene.

    Wind and poses are commanded all the time; parameters change, and the cloth is paused and
    reset, each once.
    """
    scene = Scene.from_yaml(scene_file)
    particles = probe.collect(PointCloud2, '/cloth/particles', 1000)
    scenes: list[String] = []
    probe.create_subscription(String, '/cloth/scene', scenes.append, LATCHED)
    blow = probe.publisher(Vector3Stamped, '/wind')
    movers = {
        name: probe.publisher(PoseStamped, '/sphere_pose' if name == 'sphere' else f'/{name}/pose')
        for name in poses(scene_file, scene, 0.0)
    }
    names = [name for name in movers if name != 'sphere']
    with recorder(domain, path, '--poses', *names) as process:
        process.wait_for_output('recording; from here on')
        probe.handle_all(lambda: False)  # what came meanwhile
        begin, count, start = len(particles), 0, 0
        # The change of parameters takes effect when its kernels are compiled.
        while len(particles) < begin + ticks or count <= _RESET or len(scenes) < 2:
            blow.publish(wind(y=2.0 * math.sin(5.0 * _PERIOD * count)))
            for name, target in poses(scene_file, scene, _PERIOD * (count - start)).items():
                movers[name].publish(target)
            count += 1
            probe.spin_for(_PERIOD)
            if count == _CONFIGURED:
                request = parameter_request(CHANGES)
                probe.call(SetParameters, '/cloth/set_parameters', request)
            if count == _PAUSED:
                for paused in (True, False):
                    probe.call(SetBool, '/cloth/pause', SetBool.Request(data=paused))
            if count == _RESET:
                probe.call(Trigger, '/cloth/reset', Trigger.Request())
                start = count
        assert process.stop() == 0
