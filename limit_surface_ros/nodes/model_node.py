# SPDX-License-Identifier: Apache-2.0
"""What the nodes of this package share: models, guarded services and topics, diagnostics.

A node built on `ModelNode` adds services and inputs with handlers that convert, call the core and
convert back. Handlers raise the package's errors freely: here they become error codes, counts, and
lines in the log that do not flood it; none leaves a callback.
"""

from __future__ import annotations

import functools
import time
import traceback
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_srvs.srv import Trigger

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.files.model_set import Model, Named
from limit_surface_ros.nodes import answers, diagnostics, spin
from limit_surface_ros.nodes.health import Health, InputAge
from limit_surface_ros.nodes.model_host import ModelHost
from limit_surface_ros.nodes.parameters import Parameters
from limit_surface_ros.nodes.peers import Peers

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from rclpy.publisher import Publisher

    from limit_surface_ros.nodes.settings import Setting

# Models of a second kind.
Model2 = TypeVar("Model2", bound=Named)

LOG_PERIOD = 5.0
DEPTH = 10
# Requests that wait while one is answered: of more than the usual 10 the oldest would be lost.
WAITING = 1000
COMMON_SETTINGS = (*diagnostics.SETTINGS, spin.EXECUTOR)


class ModelNode(Node, Generic[Model]):
    """A node that serves models.

    Attributes:
        values: Its parameters.
        models: Its models.
        health: What it has seen.

    Args:
        name: Name of the node.
        settings: Its parameter table, beside `COMMON_SETTINGS`.
        read: Reader of one model file.
        options: Passed on to `rclpy.node.Node`.

    Raises:
        LimitSurfaceError: A parameter or a model file is not accepted.
        ParameterException: A parameter has the wrong type or lies outside its range.
    """

    def __init__(
        self,
        name: str,
        settings: Iterable[Setting],
        read: Callable[[Path], Model],
        **options: Any,
    ) -> None:
        """Declare parameters, read models, start diagnostics."""
        super().__init__(name, **options)
        try:
            self.values = Parameters(self, [*settings, *COMMON_SETTINGS])
            self.models = ModelHost(self.values, read, self.get_logger().warning)
            self._hosts: list[ModelHost[Any]] = [self.models]
        except Exception:
            self.destroy_node()
            raise
        self.health = Health()
        self.create_service(Trigger, "~/reload", self._reload)
        self._peers = Peers(self)
        self._diagnostics = diagnostics.Diagnostics(
            self, self.values, self.health, self._peers, self.describe
        )
        self.get_logger().info(self.models.summary)

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say beside counts and times."""
        return {"model": self.models.models.default, "models": str(len(self.models.models))}

    def add_models(
        self, read: Callable[[Path], Model2], files: str, default: str, noun: str
    ) -> ModelHost[Model2]:
        """Serve models of a second kind, reloaded together with the first.

        Args:
            read: Reader of one file.
            files: Name of the parameter that names the files.
            default: Name of the parameter that names the default model.
            noun: What a request calls such a model, for messages.

        Raises:
            LimitSurfaceError: A file is not accepted.
        """
        try:
            host = ModelHost(self.values, read, self.get_logger().warning, files, default, noun)
        except Exception:
            self.destroy_node()
            raise
        self._hosts.append(host)
        self.get_logger().info(host.summary)
        return host

    def add_service(
        self, service_type: Any, name: str, handler: Callable[[Any, Any], None]
    ) -> None:
        """Serve `~/name`; the response ends in `error_code` and `error_msg`.

        Args:
            service_type: Type of the service.
            name: Its name, without `~/`.
            handler: Fills the response for a request, or raises.
        """
        self.create_service(
            service_type,
            f"~/{name}",
            functools.partial(self._answer, name, handler),
            qos_profile=QoSProfile(depth=WAITING),
        )

    def add_input(
        self,
        message_type: Any,
        name: str,
        handler: Callable[[Any], None],
        *,
        stream: bool = True,
    ) -> None:
        """Subscribe to `~/name`.

        Args:
            message_type: Type of the messages.
            name: Name of the topic, without `~/`.
            handler: Takes a message, or raises to drop it.
            stream: Whether messages come steadily: best effort then, so that any publisher
                matches, and silence is reported. Otherwise each counts, and none may be lost.
        """
        if stream:
            self.health.inputs[name] = InputAge()
        reliability = ReliabilityPolicy.BEST_EFFORT if stream else ReliabilityPolicy.RELIABLE

        def take(message: Any) -> None:
            self._take(name, handler, message)
            # An executor takes one message each time that it waits, and waiting costs it more than
            # a message: under load the queue would stay full, and each message wait for all of it.
            for _ in range(DEPTH - 1):
                taken = subscription.handle.take_message(message_type, False)
                if taken is None:
                    break
                self._take(name, handler, taken[0])

        subscription = self.create_subscription(
            message_type,
            f"~/{name}",
            take,
            QoSProfile(depth=DEPTH, reliability=reliability),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._peers.watch_input(f"~/{name}", subscription)

    def add_output(
        self, message_type: Any, name: str, *, latched: bool = False, depth: int = DEPTH
    ) -> Publisher:
        """Publish `~/name`, reliable.

        Args:
            message_type: Type of the messages.
            name: Name of the topic, without `~/`.
            latched: Whether who subscribes later gets the last message.
            depth: Number of messages that are kept for slow subscribers; 1 if latched.
        """
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        publisher = self.create_publisher(
            message_type,
            f"~/{name}",
            QoSProfile(depth=1 if latched else depth, durability=durability),
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._peers.watch_output(f"~/{name}", publisher)
        return publisher

    def report(self, what: str, sentence: str) -> None:
        """Count something that is accepted but worth a look, and log it with a throttle."""
        self.health.reported[what] += 1
        self.get_logger().warning(sentence, throttle_duration_sec=LOG_PERIOD)

    def _answer(
        self, name: str, handler: Callable[[Any, Any], None], request: Any, response: Any
    ) -> Any:
        start = time.perf_counter()
        try:
            handler(request, response)
            self.health.accepted[name] += 1
        except Exception as error:
            # Nothing of a half-filled answer may be taken for one.
            response = type(response)(
                error_code=answers.error_code(error), error_msg=self._refuse(name, error)
            )
        self.health.times.add(time.perf_counter() - start)
        return response

    def _take(self, name: str, handler: Callable[[Any], None], message: Any) -> None:
        start = time.perf_counter()
        try:
            handler(message)
            self.health.accepted[name] += 1
            if name in self.health.inputs:
                self.health.inputs[name].last = self.get_clock().now().nanoseconds
        except Exception as error:
            self._refuse(name, error)
        self.health.times.add(time.perf_counter() - start)

    def _refuse(self, name: str, error: Exception) -> str:
        sentence = answers.sentence(error)
        self.health.refuse(name, answers.code_name(error), sentence)
        if isinstance(error, LimitSurfaceError):
            self.get_logger().warning(f"{name}: {sentence}", throttle_duration_sec=LOG_PERIOD)
        else:
            lines = "".join(traceback.format_exception(error))
            self.get_logger().error(f"{name}: {lines}", throttle_duration_sec=LOG_PERIOD)
        return sentence

    def _reload(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        start = time.perf_counter()
        try:
            self.values.renew([name for host in self._hosts for name in host.names])
            response.message = "; ".join(host.summary for host in self._hosts)
            response.success = True
            self.get_logger().info(response.message)
        except Exception as error:
            response.message = f"{self._refuse('reload', error)}; the old models keep serving"
        self.health.times.add(time.perf_counter() - start)
        return response
