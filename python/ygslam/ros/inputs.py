"""A subscription whose reliability follows its publishers."""
from __future__ import annotations

from typing import Callable

from rclpy.qos import QoSProfile, ReliabilityPolicy

KINDS = {"reliable": ReliabilityPolicy.RELIABLE, "best_effort": ReliabilityPolicy.BEST_EFFORT}


class Input:
    """Messages as bytes. Best effort hears both kinds of publishers, but a large image comes in many parts, of which
    one is easily lost; reliable hears reliable ones alone. So `auto` is reliable where all publishers are.

    @param take called with each message. match() is to be called from time to time."""

    def __init__(self, node, kind, topic: str, take: Callable[[bytes], None]):
        self._node, self._kind, self._topic, self._take = node, kind, topic, take
        wanted = node.own["reliability"]
        if wanted != "auto" and wanted not in KINDS:
            raise ValueError(f"parameter reliability: '{wanted}': must be auto, reliable or best_effort")
        self._is_auto = wanted == "auto"
        self._subscription, self._reliability = None, None
        self._use(KINDS.get(wanted, ReliabilityPolicy.BEST_EFFORT))

    def match(self) -> None:
        if not self._is_auto:
            return
        publishers = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
        if publishers:
            are_reliable = all(p.qos_profile.reliability == ReliabilityPolicy.RELIABLE for p in publishers)
            self._use(KINDS["reliable" if are_reliable else "best_effort"])

    def _use(self, reliability) -> None:
        if self._reliability == reliability:
            return
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._reliability = reliability
        self._subscription = self._node.create_subscription(
            self._kind, self._topic, self._take,
            QoSProfile(depth=max(10, self._node.own["queue_size"]), reliability=reliability), raw=True)
