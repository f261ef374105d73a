"""Quality of service of topics: its overrides, and the memory that queues may take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from ..model import memory
from ..scene import Scene
from ..scene.parameter import ParameterSpec, convert, invalid_value_error
from ..scene.suggestion import closest_number

# RViz subscribes reliably and with this depth; so does rosbag2 to a reliable publisher.
DEPTH = 5
_DEEPEST = 1000
# Policies of a topic that may be overridden: their default, and what they may be.
_POLICIES: dict[str, tuple[object, ParameterSpec]] = {
    'depth': (0, ParameterSpec('', low=0, high=_DEEPEST)),
    'history': ('keep_last', ParameterSpec('', choices=('keep_last', 'system_default'))),
    'reliability': (
        'reliable',
        ParameterSpec('', choices=('reliable', 'best_effort', 'system_default')),
    ),
}


def overridable_qos(profile: QoSProfile | None = None) -> dict[str, Any]:
    """Return the arguments for a publisher or subscription whose queue users may override."""
    # A profile of its own for each: rclpy writes the overrides into it.
    return {
        'qos_profile': profile or QoSProfile(depth=DEPTH),
        'qos_overriding_options': QoSOverridingOptions.with_default_policies(),
    }


def check_policy(name: str, value: object) -> None:
    """Raise ValueError for an override that rclpy would fail on, or that has no memory limit."""
    policy = name.rpartition('.')[2]
    if not name.startswith('qos_overrides.') or policy not in _POLICIES:
        return
    given = value.lower() if isinstance(value, str) else value
    if policy == 'depth' and (isinstance(value, bool) or not isinstance(value, int)):
        whole = closest_number(value, DEPTH, 0, _DEEPEST)
        raise invalid_value_error(
            name, value, 'a whole number without point and exponent', f'write {whole}'
        )
    if policy == 'history' and given == 'keep_all':
        # For a subscriber that hangs the queue would grow without limit, and then block each tick.
        remedy = 'write keep_last, and how many in depth'
        raise invalid_value_error(
            name, value, 'keep_last or system_default, for all need memory', remedy
        )
    convert(name, given, *_POLICIES[policy])


class QueueDepths:
    """
    Depths of the queues of large messages, for subscribers that are slow or hang.

    Parameters
    ----------
    depths
        Of the queues that are overridden, by topic: name of the override, and its value.

    """

    def __init__(self, depths: Mapping[str, tuple[str, int]]) -> None:
        self._depths = depths

    @classmethod
    def of(cls, node: Node) -> QueueDepths:
        """Return those that the overrides of a node make."""
        depths = {}
        for topic in ('particles', 'markers'):
            resolved = node.resolve_topic_name(f'~/{topic}')
            name = f'qos_overrides.{resolved}.publisher.depth'
            if node.has_parameter(name):
                depths[topic] = (name, node.get_parameter(name).value)
        return cls(depths)

    def check(self, scene: Scene) -> None:
        """Raise ValueError if a scene takes too much memory, with full queues."""
        needed = memory.of_node(scene)
        memory.check(scene, needed)
        for topic, (name, depth) in self._depths.items():
            size = memory.of_message(scene, topic)
            needed += max(depth - DEPTH, 0) * size  # the usual depth is counted already
            try:
                memory.check(scene, needed)
            except ValueError:
                allowed = f'such that so many messages of {size / 1e6:.3g} MB fit into memory'
                raise invalid_value_error(name, depth, allowed, 'lower it') from None
