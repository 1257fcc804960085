"""What comes in: subscriptions whose reliability follows their publishers, and the thread that serves them."""
from __future__ import annotations

import threading
from typing import Callable

from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy

KINDS = {"reliable": ReliabilityPolicy.RELIABLE, "best_effort": ReliabilityPolicy.BEST_EFFORT}
MATCH_S = 0.5
KEPT_MESSAGES = 60  # by the middleware while this process gets no processor: two seconds of a camera


class Input:
    """Messages as bytes. Best effort hears both kinds of publishers, but a large image comes in many parts, of which
    one is easily lost; reliable hears reliable ones alone. So `auto` is reliable where all publishers are.

    @param wanted parameter `reliability`. @param take called with each message. @param kept messages, see KEPT_MESSAGES.
    match() is to be called from time to time."""

    def __init__(self, node, kind, topic: str, wanted: str, take: Callable[[bytes], None], kept: int = KEPT_MESSAGES):
        self._node, self._kind, self._topic, self._take, self._kept = node, kind, topic, take, kept
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
            self._kind, self._topic, self._take, QoSProfile(depth=self._kept, reliability=reliability), raw=True)


class Receiver:
    """A node, which lists of nodes hide, and a thread that does nothing but take its messages: services, timers and
    conversions of the other one keep no image waiting.

    @param node whose names and remapping hold. @param on_end (error), in the thread, which ends with it."""

    def __init__(self, node, on_end: Callable[[Exception], None]):
        self._of, self._on_end = node, on_end
        self._node = Node(f"_{node.get_name()}_images", namespace=node.get_namespace(), context=node.context,
                          use_global_arguments=False, start_parameter_services=False, enable_rosout=False,
                          parameter_overrides=[Parameter("start_type_description_service", value=False)])
        self._inputs: list[Input] = []
        # Of its own clock: with use_sim_time nothing comes while /clock stands still.
        self._node.create_timer(MATCH_S, self._match, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(self._node)
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="images", daemon=True)

    def subscribe(self, kind, topic: str, take: Callable[[bytes], None], kept: int = KEPT_MESSAGES) -> None:
        """Before start(). @param take called in the thread."""
        self._inputs.append(Input(self._node, kind, self._of.resolve_topic_name(topic), self._of.own["reliability"],
                                  take, kept))

    def start(self) -> None:
        self._thread.start()

    def end(self) -> None:
        self._ends = True
        self._executor.wake()
        if self._thread.ident is not None:
            self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()

    def _match(self) -> None:
        for source in self._inputs:
            source.match()

    def _run(self) -> None:
        try:
            while not self._ends:
                self._executor.spin_once(timeout_sec=0.5)
        except ExternalShutdownException:
            pass
        except Exception as error:  # noqa: BLE001 - without images the node is of no use
            self._on_end(error)
