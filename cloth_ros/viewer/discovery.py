"""Find cloths in the ROS graph: whatever publishes a PointCloud2 on a topic `…/particles`."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

_TYPE = 'sensor_msgs/msg/PointCloud2'
_SUFFIX = '/particles'
MAX_CLOTHS = 8  # of which particles are received and drawn


@dataclass(frozen=True, order=True)
class ClothName:
    """
    Name of a cloth, and the names of its topics, services and node.

    Attributes
    ----------
    node
        Full name of the node, such as '/lab/cloth'; its topic is '/lab/cloth/particles'.

    """

    node: str

    @property
    def namespace(self) -> str:
        """Namespace of the node, without a slash at the end; empty for the root."""
        return self.node.rpartition('/')[0]

    def resolve(self, name: str) -> str:
        """Return the full name of `~/name`, `/name`, or `name` relative to the namespace."""
        if name.startswith('~/'):
            return f'{self.node}/{name[2:]}'
        return name if name.startswith('/') else f'{self.namespace}/{name}'


def find_cloths(node: Node) -> list[ClothName]:
    """Return the cloths that have a publisher of particles, at most `MAX_CLOTHS`, sorted."""
    found = [
        ClothName(topic.removesuffix(_SUFFIX))
        for topic, types in node.get_topic_names_and_types()
        if topic.endswith(_SUFFIX) and _TYPE in types and topic != _SUFFIX
        if node.count_publishers(topic)
    ]
    return sorted(found)[:MAX_CLOTHS]
