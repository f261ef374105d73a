"""Poses of colliders that others command."""

from geometry_msgs.msg import PoseStamped
from ros import free_domain, probing

from cloth_ros.viewer.collider_poses import ColliderPoses
from cloth_ros.viewer.discovery import ClothName
from cloth_ros.viewer.pose import Pose


def test_what_has_moved_is_there():
    """Also after a collider that others have moved was removed before it was drawn."""
    with free_domain() as domain, probing(domain) as probe:
        poses = ColliderPoses(probe, ClothName('/cloth'))
        poses.follow({'box': Pose(), 'table': Pose()})
        publishers = [probe.publisher(PoseStamped, f'/{name}/pose') for name in ('box', 'table')]
        for publisher in publishers:
            publisher.publish(PoseStamped())
        probe.spin_until(lambda: len(poses.moved) == 2)
        poses.follow({'table': Pose()})
        assert poses.moved == {'table'} == poses.present.keys()
