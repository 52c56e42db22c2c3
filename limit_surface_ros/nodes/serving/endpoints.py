# SPDX-License-Identifier: Apache-2.0
"""Services and topics whose handlers may raise, wait and take long, without harm to the others.

A handler is a function or a coroutine. What it raises becomes an error code, a count and a line in
the log. It may wait (`waiting`) and, if it takes long, let the others have a turn
(`await endpoints.give_way()`).
"""

from __future__ import annotations

import collections
import math
import time
import traceback
from typing import TYPE_CHECKING, Any, NamedTuple

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_srvs.srv import Trigger

from limit_surface_ros.errors import LimitSurfaceError, UnavailableError, shortened
from limit_surface_ros.nodes.serving import answers, middleware
from limit_surface_ros.nodes.serving.diagnostics import Health, InputAge
from limit_surface_ros.nodes.serving.peers import LostMessages
from limit_surface_ros.nodes.serving.waiting import Handling, Waiting

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node
    from rclpy.publisher import Publisher

    from limit_surface_ros.nodes.serving.peers import Peers

LOG_PERIOD = 5.0
DEPTH = 10
# Messages of a stream, and answers to them, that wait while a long request comes in or a busy
# machine has no time: a second of 1 kHz. So many are taken in a turn.
STREAM_DEPTH = 1000
TAKEN_IN_A_TURN = 100
# Requests that wait while one is answered: of more than the usual 10 the oldest would be lost.
WAITING = 1000
# The same of services whose replies may be long, and how many replies they keep for clients that
# are slow to take them or have stopped. Where the middleware has one depth for both it is the
# first; a client keeps 10 replies itself, its own and those to others, unless it asks for more.
WAITING_LARGE, KEPT_LARGE = 64, 12
# Messages of one topic that wait, for a transform say; of more the oldest is refused.
MOST_WAITING = 500


class Service(NamedTuple):
    """A service of a node, as its module declares it.

    Attributes:
        type: Type of the service; its response ends in `error_code` and `error_msg`.
        name: Its name, without `~/`.
        handler: Function or coroutine function of the node, the request and the response: fills
            the response, or raises.
        unbounded: Fields of the response that may be infinite, by their dotted names.
        long: Whether its replies may be long even if they have no list.
        checked: Fields that the handler has filled by `convert.finite_rows`: they may be long, and
            are not looked at again.
    """

    type: Any
    name: str
    handler: Callable[[Any, Any, Any], Any]
    unbounded: tuple[str, ...] = ()
    long: bool = False
    checked: tuple[str, ...] = ()


class Output(NamedTuple):
    """A publisher whose messages are looked at before they leave.

    Attributes:
        publisher: The publisher.
        check: Raises if a number of a message is not finite.
    """

    publisher: Publisher
    check: answers.FiniteCheck

    def publish(self, message: Any) -> None:
        """Send a message.

        Raises:
            SolverError: A number in it is NaN or infinite; nothing is sent.
        """
        self.check(message)
        self.publisher.publish(message)

    def get_subscription_count(self) -> int:
        """Return how many listen."""
        return int(self.publisher.get_subscription_count())


class Endpoints:
    """The guarded services, inputs and outputs of one node.

    Attributes:
        under_way: Requests that have begun and are not answered yet.
        ending: Whether the node is about to end.
        when_ending: Called again and again with an error when the node ends, each time to refuse
            one of the requests that wait.
        last_large: Steady time at which a long batch was answered last [s].
        last_request: Steady time at which a request came or was answered last [s].

    Args:
        node: The node.
        health: Counts what comes and what is refused.
        peers: Watches the topics.
    """

    def __init__(self, node: Node, health: Health, peers: Peers) -> None:
        """Serve nothing yet."""
        self._node = node
        self._health = health
        self._peers = peers
        self.ending = False
        self._cut = False
        self._waiting: dict[str, collections.deque[Waiting]] = {}
        self.when_ending: list[Callable[[Exception], None]] = []
        self.under_way = 0
        self.last_request = 0.0
        self.last_large = -math.inf

    def serve(self, service: Service) -> None:
        """Serve `~/name`."""
        check = answers.FiniteCheck(service.type.Response, service.unbounded, service.checked)

        def refused(error: Exception, sentence: str) -> Any:
            # Nothing of a half-filled answer may be taken for one.
            code = answers.error_code(error)
            return service.type.Response(error_code=code, error_msg=sentence)

        def handler(request: Any, response: Any) -> Any:
            return service.handler(self._node, request, response)

        depth = WAITING
        if service.long or _has_lists(service.type.Response):
            depth = KEPT_LARGE if middleware.requests_wait_apart() else WAITING_LARGE
        self._serve(service.type, service.name, handler, refused, check, depth)

    def serve_trigger(self, name: str, handler: Callable[[Any, Any], Any], unchanged: str) -> None:
        """Serve `~/name` of type std_srvs/Trigger, whose answers hold no error code.

        Args:
            name: Its name, without `~/`.
            handler: Function or coroutine function; fills the response, or raises.
            unchanged: What is said of the node after a refusal.
        """

        def refused(_: Exception, sentence: str) -> Any:
            return Trigger.Response(message=f"{sentence}; {unchanged}")

        self._serve(Trigger, name, handler, refused, answers.FiniteCheck(Trigger.Response))

    def _serve(
        self,
        kind: Any,
        name: str,
        handler: Callable[[Any, Any], Any],
        refused: Callable[[Exception, str], Any],
        check: answers.FiniteCheck,
        depth: int = WAITING,
    ) -> None:
        def answer(call: tuple[Any, Any], header: Any) -> None:
            response = call[1]

            def ended(error: Exception | None) -> None:
                if error is None:
                    try:
                        check(response)
                    except LimitSurfaceError as not_finite:
                        error = not_finite
                if error is None:
                    self._health.accepted[name] += 1
                    answered = response
                else:
                    answered = refused(error, self.refuse(name, error))
                self.under_way -= 1
                self.last_request = time.monotonic()
                send(answered, header)

            self.under_way += 1
            if self.ending:
                ended(_ending_error())
            else:
                Handling(self._count_time, handler, call, ended).begin()

        # rclpy calls this with what the callback returns, once it has; the answer is sent later.
        service = self._node.create_service(
            kind, f"~/{name}", lambda *call: call, qos_profile=QoSProfile(depth=depth)
        )
        send, service.send_response = service.send_response, answer

    def add_input(
        self,
        message_type: Any,
        name: str,
        handler: Callable[[Any], Any],
        *,
        stream: bool = True,
    ) -> None:
        """Subscribe to `~/name`.

        Args:
            message_type: Type of the messages.
            name: Name of the topic, without `~/`.
            handler: Function or coroutine function; takes a message, or raises to drop it.
            stream: Whether messages come steadily: best effort then, so that any publisher
                matches, and silence is reported. Otherwise each counts, and none may be lost.
        """
        if stream:
            self._health.inputs[name] = InputAge()
        self._waiting[name] = collections.deque()
        reliability = ReliabilityPolicy.BEST_EFFORT if stream else ReliabilityPolicy.RELIABLE

        def take(message: Any) -> None:
            self._take(name, handler, message)
            # An executor takes one message each time that it waits, and waiting costs it more than
            # a message: under load the queue would stay full, and each message wait for all of it.
            for _ in range(TAKEN_IN_A_TURN - 1):
                taken = subscription.handle.take_message(message_type, False)
                if taken is None:
                    break
                self._take(name, handler, taken[0])

        subscription = self._node.create_subscription(
            message_type,
            f"~/{name}",
            take,
            QoSProfile(depth=STREAM_DEPTH if stream else DEPTH, reliability=reliability),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._health.lost[name] = LostMessages(subscription)
        self._peers.watch_input(f"~/{name}", subscription)

    def add_output(
        self,
        message_type: Any,
        name: str,
        *,
        latched: bool = False,
        depth: int = DEPTH,
        unbounded: tuple[str, ...] = (),
    ) -> Output:
        """Publish `~/name`, reliable.

        Args:
            message_type: Type of the messages.
            name: Name of the topic, without `~/`.
            latched: Whether who subscribes later gets the last message.
            depth: Number of messages that are kept for slow subscribers; 1 if latched.
            unbounded: Fields that may be infinite, by their dotted names.
        """
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        publisher = self._node.create_publisher(
            message_type,
            f"~/{name}",
            QoSProfile(depth=1 if latched else depth, durability=durability),
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._peers.watch_output(f"~/{name}", publisher)
        return Output(publisher, answers.FiniteCheck(message_type, unbounded))

    async def give_way(self) -> None:
        """Let whatever else is due have its turn.

        Raises:
            UnavailableError: The node ends, and there is no time to finish what has begun.
        """
        if self._cut:
            raise _ending_error()
        turn = Waiting()
        self._node.executor.create_task(turn.settle)
        await turn

    def end(self) -> None:
        """Refuse what comes from now on; answers that have begun are finished."""
        self.ending = True
        for queue in self._waiting.values():
            for waiting in list(queue):
                waiting.settle(_ending_error())

    def cut(self) -> None:
        """Refuse also what has begun, at its next pause."""
        self._cut = True

    def refuse_next(self) -> None:
        """Refuse one of the requests that wait, of a node that ends.

        All at once would push each other out of the queue of a client that made them all.
        """
        for refuse in self.when_ending:
            refuse(_ending_error())

    def refuse(self, name: str, error: Exception) -> str:
        """Count and log an error; return the sentence for who asked."""
        sentence = answers.sentence(error)
        self._health.refuse(name, answers.code_name(error), sentence)
        logger = self._node.get_logger()
        if isinstance(error, LimitSurfaceError):
            logger.warning(f"{name}: {sentence}", throttle_duration_sec=LOG_PERIOD)
        else:
            lines = shortened("".join(traceback.format_exception(error)), 20_000)
            logger.error(f"{name}: {lines}", throttle_duration_sec=LOG_PERIOD)
        return sentence

    def _take(self, name: str, handler: Callable[[Any], Any], message: Any) -> None:
        queue = self._waiting[name]

        def ended(error: Exception | None) -> None:
            if error is not None:
                self.refuse(name, error)
                return
            self._health.accepted[name] += 1
            if name in self._health.inputs:
                self._health.inputs[name].last = self._node.get_clock().now().nanoseconds

        Handling(self._count_time, handler, (message,), ended, queue).begin()
        if len(queue) > MOST_WAITING:
            queue[0].settle(
                UnavailableError(f"more than {MOST_WAITING} messages wait for transforms")
            )

    def _count_time(self, seconds: float) -> None:
        """Count a stretch of time [s] in which nobody else had a turn."""
        self._health.times.add(seconds)


def _has_lists(message_type: Any) -> bool:
    """Return whether a message has a list, so that it may be of any length."""
    kinds = message_type.get_fields_and_field_types().values()
    return any(kind.startswith("sequence<") or kind == "nav_msgs/Path" for kind in kinds)


def _ending_error() -> UnavailableError:
    return UnavailableError("the node is ending")
