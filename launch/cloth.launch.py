"""Start the cloth, and if asked to, a viewer, RViz and a recording beside it."""

from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from cloth_ros.node.launch_checks import check_launch, recorded_topics
from launch import LaunchContext, LaunchDescription

SHARE = FindPackageShare('cloth_ros')
SWITCH = {'default_value': 'false', 'choices': ['true', 'false']}


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch cloth_ros cloth.launch.py` runs."""
    arguments = [
        DeclareLaunchArgument(
            'scene',
            default_value=PathJoinSubstitution([SHARE, 'config', 'gust.yaml']),
            description='Path of the ROS parameter file of the scene.',
        ),
        DeclareLaunchArgument(
            'namespace',
            default_value='',
            description='Namespace of the node; cloths in different ones run side by side.',
        ),
        DeclareLaunchArgument(
            'use_sim_time',
            **SWITCH,
            description='Follow /clock instead of the wall clock.',
        ),
        DeclareLaunchArgument(
            'viewer',
            **SWITCH,
            description='Start cloth_viewer, which shows the cloth in a browser.',
        ),
        DeclareLaunchArgument(
            'rviz',
            **SWITCH,
            description='Start RViz, where it is installed, with the view of this package.',
        ),
        DeclareLaunchArgument(
            'record',
            **SWITCH,
            description='Record particles, commands and diagnostics to a bag.',
        ),
        DeclareLaunchArgument(
            'bag',
            default_value='',
            description='Folder of the bag, which must not exist; empty: rosbag2_ and the time.',
        ),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=checked_nodes)])


def checked_nodes(context: LaunchContext) -> list[Node | ExecuteProcess]:
    """Return what is to be started; raise ValueError, before anything has, if one cannot."""

    def text(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    def switched_on(name: str) -> bool:
        return IfCondition(LaunchConfiguration(name)).evaluate(context)

    scene, namespace, bag = text('scene'), text('namespace'), text('bag')
    wanted = [name for name in ('viewer', 'rviz', 'record') if switched_on(name)]
    check_launch(scene, wanted, bag)
    use_sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
    common = {'namespace': namespace, 'output': 'screen'}
    started = [
        Node(
            package='cloth_ros',
            executable='cloth_node',
            name='cloth',
            parameters=[scene, use_sim_time],
            **common,
        )
    ]
    if 'viewer' in wanted:
        started.append(
            Node(
                package='cloth_ros',
                executable='cloth_viewer',
                parameters=[use_sim_time],
                **common,
            )
        )
    if 'rviz' in wanted:
        view = PathJoinSubstitution([SHARE, 'config', 'cloth.rviz'])
        started.append(
            Node(package='rviz2', executable='rviz2', namespace=namespace, arguments=['-d', view])
        )
    if 'record' in wanted:
        folder = ['--output', bag] if bag else []
        topics = recorded_topics(scene, namespace)
        command = ['ros2', 'bag', 'record', *folder, '--topics', *topics]
        started.append(ExecuteProcess(cmd=command, name='record', output='screen'))
    return started
