# SPDX-License-Identifier: Apache-2.0
"""What goes wrong on a node's topics: duplicates, mismatches of type or QoS, lost messages.

Asked for once a diagnostics period. rclpy's event handlers would say it at once, but they take
part in every wait of an executor: with them a call of a service takes a tenth longer.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, NamedTuple

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Infinite
from rclpy.event_handler import (
    EventHandler,
    QoSSubscriptionEventType,
    UnsupportedEventTypeError,
)
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rclpy.node import Node
    from rclpy.publisher import Publisher
    from rclpy.subscription import Subscription
    from rclpy.topic_endpoint_info import TopicEndpointInfo


class Mismatch(NamedTuple):
    """A peer with which a topic cannot be shared.

    Attributes:
        topic: Name of the topic, as the node gave it.
        sentence: Who the peer is and what is wrong.
        identity: Of its end of the topic.
    """

    topic: str
    sentence: str
    identity: tuple[int, ...]


class _End(NamedTuple):
    """The node's own end of a topic, and how to find and judge the others'."""

    topic: str
    type_name: str
    others: Callable[[str], Sequence[TopicEndpointInfo]]
    reason: Callable[[QoSProfile], str]


class Peers:
    """Looks after the topics of a node.

    Args:
        node: The node.
    """

    def __init__(self, node: Node) -> None:
        """Look after no topic yet."""
        self._node = node
        self._ends: list[_End] = []

    def watch_input(self, topic: str, subscription: Subscription) -> None:
        """Look after the publishers of a topic, named as when it was subscribed to."""
        self._ends.append(
            _End(
                topic,
                _type_name(subscription.msg_type),
                self._node.get_publishers_info_by_topic,
                lambda theirs: _reason(theirs, _as_told(subscription.qos_profile)),
            )
        )

    def watch_output(self, topic: str, publisher: Publisher) -> None:
        """Look after the subscribers of a topic, named as when it was advertised."""
        self._ends.append(
            _End(
                topic,
                _type_name(publisher.msg_type),
                self._node.get_subscriptions_info_by_topic,
                lambda theirs: _reason(_as_told(publisher.qos_profile), theirs),
            )
        )

    def duplicates(self) -> int:
        """Return how many other nodes have this node's name: each call and input goes to all."""
        own = self._node.get_name(), self._node.get_namespace()
        return max(0, self._node.get_node_names_and_namespaces().count(own) - 1)

    def mismatches(self) -> Iterator[Mismatch]:
        """Yield the peers that are there now and cannot be heard or served."""
        for end in self._ends:
            for other in end.others(end.topic):
                if other.topic_type != end.type_name:
                    wrong = f"its type is {other.topic_type}, not {end.type_name}"
                else:
                    wrong = end.reason(other.qos_profile)
                if wrong:
                    yield Mismatch(
                        end.topic,
                        f"{_name_of(other)} cannot communicate on {end.topic}: {wrong}",
                        tuple(other.endpoint_gid),
                    )


class LostMessages:
    """The message-lost event of one subscription, asked for and not waited for.

    Args:
        subscription: The subscription.
    """

    def __init__(self, subscription: Subscription) -> None:
        """Attach to the event; a middleware that has none loses nothing that it tells of."""
        self._event: Any = None
        self._count = 0
        with contextlib.suppress(UnsupportedEventTypeError):
            self._event = EventHandler(
                callback_group=ReentrantCallbackGroup(),
                callback=lambda _: None,
                event_type=QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST,
                parent_impl=subscription.handle,
            )

    @property
    def count(self) -> int:
        """Messages lost since the subscription began."""
        if self._event is not None:
            self._event._ready_to_take_data = True
            status = self._event.take_data()
            if status is not None:
                self._count = int(status.total_count)
        return self._count

    def close(self) -> None:
        """Let go of the event, which would keep the subscription from being destroyed."""
        if self._event is not None:
            self._event.destroy()
            self._event = None


def _type_name(kind: Any) -> str:
    package, group, *_ = kind.__module__.split(".")
    return f"{package}/{group}/{kind.__name__}"


def _name_of(peer: TopicEndpointInfo) -> str:
    """Return the name of a peer's node, which the graph may learn only after its topics."""
    if "UNKNOWN" in peer.node_name:
        return "a peer that is not known as a ROS node"
    return f"{peer.node_namespace.rstrip('/')}/{peer.node_name}"


def _as_told(profile: QoSProfile) -> QoSProfile:
    """Return a profile as the graph tells it: a time that is not set is infinite, not 0."""
    times = {
        name: getattr(profile, name) if getattr(profile, name).nanoseconds else Infinite
        for name in ("lifespan", "deadline", "liveliness_lease_duration")
    }
    return QoSProfile(
        history=profile.history,
        depth=profile.depth,
        reliability=profile.reliability,
        durability=profile.durability,
        liveliness=profile.liveliness,
        **times,
    )


def _reason(publisher: QoSProfile, subscription: QoSProfile) -> str:
    """Return why two ends do not suit each other, empty if they do."""
    compatibility, reason = qos_check_compatible(publisher, subscription)
    if compatibility != QoSCompatibility.ERROR:
        return ""
    return "; ".join(part.removeprefix("ERROR: ") for part in reason.split(";") if part.strip())
