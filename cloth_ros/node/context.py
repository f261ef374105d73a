"""Context that outputs, inputs and services of the node share: node, cloth, counters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from rclpy.node import Node

from ..live.live_cloth import LiveCloth
from .body_frames import BodyFrames
from .parameters import SceneParameters
from .rejected_inputs import RejectedInputs
from .sender import Sender
from .transforms import Transforms


@dataclass(frozen=True)
class Context:
    """
    Objects that an output, an input or a service is made with.

    Attributes
    ----------
    node
        Owner of publishers, subscriptions, services and timers.
    live
        The running cloth.
    transforms
        Brings vectors and points of other frames into the frame of the node.
    rejected
        Counts and reports messages that are rejected.
    frames
        Moves colliders and grippers that follow a frame.
    parameters
        Parameters of the node that make the scene.
    step
        Simulates and publishes one tick while the cloth is paused; raises ValueError.
    sender
        Thread that sends all messages, in their order.
    unsent
        Number of messages that could not be sent, by topic.

    """

    node: Node
    live: LiveCloth
    transforms: Transforms
    rejected: RejectedInputs
    frames: BodyFrames
    parameters: SceneParameters
    step: Callable[[], None]
    sender: Sender = field(default_factory=Sender)
    unsent: Counter[str] = field(default_factory=Counter)
