#!/usr/bin/env bash
# Start the node on a scene, and say how to command it.  Usage: run.sh VENV SCENE
set -euo pipefail

venv=$1
scene=$2
if [ ! -r "$scene" ]; then
    echo "cloth_ros: there is no scene $scene; these are ready:" config/*.yaml >&2
    exit 1
fi
cat << END
A live cloth from $scene, on ROS domain ${ROS_DOMAIN_ID:-0}.  Ctrl-C ends it.
  watch it:   ros2 topic hz /cloth/particles      or rviz2 -d config/cloth.rviz
  wind:       ros2 topic pub --once /wind geometry_msgs/msg/Vector3Stamped '{vector: {y: 3.0}}'
  sphere:     ros2 topic pub --once /sphere_pose geometry_msgs/msg/PoseStamped '{pose: {position: {z: 1.0}}}'
  again:      ros2 service call /cloth/reset std_srvs/srv/Trigger
  without the ros2 command, from another terminal here:
              $venv/bin/python examples/command.py --wind 0 3 0      (--help shows the rest)
END
exec "$venv/bin/cloth_node" --ros-args --params-file "$scene"
