"""Poses of the colliders of a cloth, and the topics that command them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial

from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from .discovery import ClothName
from .pose import Pose

ECHO = 0.5  # s, in which the viewer's own commands come back to it


class ColliderPoses:
    """
    Follow the commands of everybody to the colliders, and command them.

    Parameters
    ----------
    node
        Owner of subscriptions and publishers.
    name
        Of the cloth.

    Attributes
    ----------
    present
        Newest pose of each collider by its name.
    moved
        Names of the colliders that others have moved; whoever draws them empties it.
    frame_id
        Frame of these poses; commands in other frames are not followed.

    """

    def __init__(self, node: Node, name: ClothName) -> None:
        self.present: dict[str, Pose] = {}
        self.moved: set[str] = set()
        self.frame_id = ''
        self._node, self._name = node, name
        self._topics: dict[str, tuple[Subscription, Publisher]] = {}
        self._sent: dict[str, float] = {}

    def topic(self, collider: str) -> str:
        """Return the full name of the topic that commands a collider."""
        return self._name.resolve('sphere_pose' if collider == 'sphere' else f'{collider}/pose')

    def follow(self, poses: Mapping[str, Pose]) -> None:
        """Take the colliders that there are, and their poses."""
        for collider in self._topics.keys() - poses.keys():
            subscription, publisher = self._topics.pop(collider)
            self._node.destroy_subscription(subscription)
            self._node.destroy_publisher(publisher)
        for collider in poses.keys() - self._topics.keys():
            topic, receive = self.topic(collider), partial(self._receive, collider)
            self._topics[collider] = (
                self._node.create_subscription(PoseStamped, topic, receive, 5),
                self._node.create_publisher(PoseStamped, topic, 5),
            )
        self.present = dict(poses)
        self.moved &= poses.keys()

    def _receive(self, collider: str, message: PoseStamped) -> None:
        own = time.monotonic() < self._sent.get(collider, -ECHO) + ECHO
        if not own and message.header.frame_id in ('', self.frame_id):
            self.present[collider] = Pose.of_message(message.pose)
            self.moved.add(collider)

    def move(self, collider: str, pose: Pose) -> None:
        """Command a collider to a pose."""
        if collider not in self._topics:
            return
        self.present[collider], self._sent[collider] = pose, time.monotonic()
        message = PoseStamped(pose=pose.message())
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._topics[collider][1].publish(message)
