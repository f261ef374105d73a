"""The text that `cloth_node --help` prints."""

from __future__ import annotations

from ..scene import Scene
from ..scene.parameter import PARAMETERS

_TEXT = """\
usage: cloth_node [--ros-args --params-file SCENE -p NAME:=VALUE … -r FROM:=TO …]

Simulate a cloth in real time, as the ROS 2 node 'cloth'.  SCENE is a ROS parameter file, such as
those in the folder config/ of this package.  Ctrl-C ends the node.

  cloth_node --ros-args --params-file SCENE
  cloth_node --ros-args -p sheet.rows:=64 -p wind.velocity:='[0.0, 3.0, 0.0]' -r __ns:=/lab

topics and services:
  wind          in   geometry_msgs/Vector3Stamped       velocity of the air, m/s
  sphere_pose   in   geometry_msgs/PoseStamped          where the sphere moves to, m
  NAME/pose     in   geometry_msgs/PoseStamped          where a collider or gripper moves to, m
  ~/particles   out  sensor_msgs/PointCloud2            position and velocity of each particle
  ~/markers     out  visualization_msgs/MarkerArray     what RViz shows
  ~/ticks       out  std_msgs/String                    what each tick has taken in, for replays
  ~/keyframes   out  std_msgs/UInt8MultiArray           the exact state, where a replay can begin
  ~/scene       out  std_msgs/String                    the scene as it runs, a parameter file
  /diagnostics  out  diagnostic_msgs/DiagnosticArray    real-time factor, load, rejected inputs …
  NAME/wrench   out  geometry_msgs/WrenchStamped        force and torque on a collider or gripper
  ~/reset            std_srvs/Trigger                   return to the initial state
  ~/pause            std_srvs/SetBool                   stop or continue
  ~/step             std_srvs/Trigger                   one tick, while paused
  ~/save, ~/load     std_srvs/Trigger                   write and read the whole state
  NAME/grasp         std_srvs/SetBool                   gripper NAME takes or releases the sheet
  /clock        out  rosgraph_msgs/Clock                simulated time, with clock.publish

main parameters, with their defaults:
{parameters}

all parameters: ros2 param list /cloth, ros2 param describe /cloth NAME, docs/parameters.md
documentation: README.md and docs/ in the repository of cloth_ros
"""
MAIN_PARAMETERS = (
    *('rate', 'sheet.rows', 'sheet.columns', 'sheet.size', 'sheet.mass', 'sheet.position', 'pins'),
    *('springs.structural', 'springs.shear', 'springs.bending', 'drag', 'gravity'),
    *('wind.velocity', 'sphere.radius', 'sphere.position', 'collider.names', 'gripper.names'),
    *('solver.tolerance', 'solver.threads', 'solver.overload'),
)


def usage() -> str:
    """Return how to start the node, what it communicates by, and its main parameters."""
    defaults, lines = Scene().flat(), []
    for name in MAIN_PARAMETERS:
        spec, value = PARAMETERS[name], defaults[name]
        default = str(list(value)) if isinstance(value, tuple) else str(value)
        unit = f' [{spec.unit}]' if spec.unit else ''
        lines.append(f'  {name:19s} {default:17s} {spec.text}{unit}')
    return _TEXT.format(parameters='\n'.join(lines))
