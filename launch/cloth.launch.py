"""Start the cloth, and RViz beside it if asked to."""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from cloth_ros.node.launch_checks import check_launch
from launch import LaunchContext, LaunchDescription

SHARE = FindPackageShare('cloth_ros')


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
            default_value='false',
            choices=['true', 'false'],
            description='Follow /clock instead of the wall clock.',
        ),
        DeclareLaunchArgument(
            'rviz',
            default_value='false',
            choices=['true', 'false'],
            description='Start RViz, where it is installed, with the view of this package.',
        ),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=checked_nodes)])


def checked_nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes to start; raise ValueError, before any has started, if one cannot."""
    scene = LaunchConfiguration('scene')
    with_rviz = IfCondition(LaunchConfiguration('rviz'))
    check_launch(scene.perform(context), rviz=with_rviz.evaluate(context))
    cloth = Node(
        package='cloth_ros',
        executable='cloth_node',
        name='cloth',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            scene,
            {'use_sim_time': LaunchConfiguration('use_sim_time')},
        ],
        output='screen',
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        namespace=LaunchConfiguration('namespace'),
        arguments=['-d', PathJoinSubstitution([SHARE, 'config', 'cloth.rviz'])],
        condition=with_rviz,
    )
    return [cloth, rviz]
