"""Check a scene and print how to command it, before the node starts: usage.py PYTHON SCENE."""

import os
import shutil
import sys
from pathlib import Path

from cloth_ros import Scene
from cloth_ros.model import check_scene

WIND = "ros2 topic pub --once /wind geometry_msgs/msg/Vector3Stamped '{{vector: {{y: 3.0}}}}'"
SPHERE = (
    'ros2 topic pub --once /sphere_pose geometry_msgs/msg/PoseStamped '
    "'{{pose: {{position: {{z: {z:.1f}}}}}}}'"
)


def main() -> None:
    """Print the commands, or one line that says what is wrong with the scene."""
    python, path = sys.argv[1:]
    try:
        scene = Scene.from_yaml(path)
        check_scene(scene)
    except (OSError, ValueError) as error:
        raise SystemExit(f'cloth_ros: {error}') from None
    domain = os.environ.get('ROS_DOMAIN_ID', '0')
    z = scene.sheet.position[2]
    print(f'A live cloth from {path}, on ROS domain {domain}.  Ctrl-C ends it.')
    print('Command it from another terminal, with the same ROS_DOMAIN_ID:')
    commands = [
        ('watch', f'{python} examples/watch.py'),
        ('wind', f'{python} examples/command.py --wind 0 3 0'),
    ]
    if scene.sphere.radius > 0:
        start = ' '.join(f'{x:g}' for x in scene.sphere.position)
        end = ' '.join(f'{x:g}' for x in scene.sheet.position)
        move = f'examples/command.py --from {start} --sphere {end} --over 1'
        commands.append(('sphere', f'{python} {move}'))
    if Path(path).name == 'robot_arm.yaml':
        commands.append(('arm', f'{python} examples/robot_arm.py'))
    if Path(path).name == 'towel.yaml':
        commands.append(('fold', f'{python} examples/fold_towel.py'))
    for collider in scene.colliders[:1]:
        x, y, z = collider.position
        turned = ' '.join(f'{each:g}' for each in collider.orientation)
        move = f'--collider {collider.name} {x:g} {y:g} {z + 0.1:g} --orientation {turned}'
        commands.append((collider.name[:7], f'{python} examples/command.py {move}'))
    commands.append(('reset', f'{python} examples/command.py --reset'))
    if shutil.which('ros2'):
        commands += [
            ('watch', 'rviz2 -d config/cloth.rviz'),
            ('wind', WIND.format()),
        ]
        if scene.sphere.radius > 0:
            commands.append(('sphere', SPHERE.format(z=z)))
    for name, command in commands:
        print(f'  {name:7s} {command}')
    sys.stdout.flush()


if __name__ == '__main__':
    main()
