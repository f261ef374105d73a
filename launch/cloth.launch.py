"""Start the cloth, and RViz beside it if asked to."""

from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch cloth_ros cloth.launch.py` runs."""
    share = FindPackageShare('cloth_ros')
    arguments = [
        DeclareLaunchArgument(
            'scene',
            default_value=PathJoinSubstitution([share, 'config', 'gust.yaml']),
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
    cloth = Node(
        package='cloth_ros',
        executable='cloth_node',
        name='cloth',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            LaunchConfiguration('scene'),
            {'use_sim_time': LaunchConfiguration('use_sim_time')},
        ],
        output='screen',
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        namespace=LaunchConfiguration('namespace'),
        arguments=['-d', PathJoinSubstitution([share, 'config', 'cloth.rviz'])],
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    return LaunchDescription([*arguments, cloth, rviz])
