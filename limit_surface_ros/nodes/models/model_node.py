# SPDX-License-Identifier: Apache-2.0
"""What the nodes of this package share: parameters, models, guarded endpoints, diagnostics.

A node built on `ModelNode` declares services (`endpoints.Service`) and adds inputs and outputs
with handlers that convert, call the core and convert back.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rclpy.node import Node
from std_srvs.srv import Trigger

from limit_surface_ros.files.model_set import Model, Named
from limit_surface_ros.nodes.models.model_host import ModelHost
from limit_surface_ros.nodes.serving import diagnostics, parameters, spin
from limit_surface_ros.nodes.serving.endpoints import LOG_PERIOD, Endpoints
from limit_surface_ros.nodes.serving.parameters import Parameters
from limit_surface_ros.nodes.serving.peers import Peers
from limit_surface_ros.nodes.serving.waiting import Waiting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from limit_surface_ros.nodes.serving.settings import Setting

# Models of a second kind.
Model2 = TypeVar("Model2", bound=Named)

COMMON_SETTINGS = (*diagnostics.SETTINGS, *parameters.SETTINGS, spin.EXECUTOR)


class ModelNode(Node, Generic[Model]):
    """A node that serves models.

    Attributes:
        values: Its parameters.
        host: Its models.
        health: Counts what comes and what is refused.
        endpoints: Its services and topics.

    Args:
        name: Name of the node.
        settings: Its parameter table, beside `COMMON_SETTINGS`.
        read: Reader of one model file.
        prepare: Does ahead for a model what its first requests would have to wait for.
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
        prepare: Callable[[Model], object] | None = None,
        **options: Any,
    ) -> None:
        """Declare parameters, read models, start diagnostics."""
        super().__init__(name, **options)
        self._hosts: list[ModelHost[Any]] = []
        self.health = diagnostics.Health()
        try:
            self.values = Parameters(self, [*settings, *COMMON_SETTINGS])
            warn = self.get_logger().warning
            self.host = ModelHost(self.values, read, warn, prepare=prepare, stand_in=self.stand_in)
        except Exception:
            self.destroy_node()
            raise
        self._hosts.append(self.host)
        # Reloads asked for, how many of them the models that are served cover, and who waits.
        self._asked = self._covered = 0
        self._reloading = False
        self._for_reload: list[Waiting] = []
        peers = Peers(self)
        self.endpoints = Endpoints(self, self.health, peers)
        self.endpoints.serve_trigger("reload", self._reload, "the old models keep serving")
        self._diagnostics = diagnostics.Diagnostics(
            self, self.values, self.health, peers, self.describe
        )
        self.get_logger().info(self.host.summary)

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say beside counts and times."""
        return {"model": self.host.models.default, "models": str(len(self.host.models))}

    def stand_in(self, default: str) -> str:
        """Return which model stands for a default model that is made only later; "": none."""
        return ""

    def add_models(
        self,
        read: Callable[[Path], Model2],
        files: str,
        default: str,
        noun: str,
        prepare: Callable[[Model2], object] | None = None,
    ) -> ModelHost[Model2]:
        """Serve models of a second kind, reloaded together with the first.

        Args:
            read: Reader of one file.
            files: Name of the parameter that names the files.
            default: Name of the parameter that names the default model.
            noun: What a request calls such a model, for messages.
            prepare: Does ahead for a model what its first requests would have to wait for.

        Raises:
            LimitSurfaceError: A file is not accepted.
        """
        warn = self.get_logger().warning
        try:
            host = ModelHost(self.values, read, warn, files, default, noun, prepare)
        except Exception:
            self.destroy_node()
            raise
        self._hosts.append(host)
        self.get_logger().info(host.summary)
        return host

    def report(self, what: str, sentence: str) -> None:
        """Count something that is accepted but worth a look, and log it with a throttle."""
        self.health.reported[what] += 1
        self.get_logger().warning(sentence, throttle_duration_sec=LOG_PERIOD)

    def destroy_node(self) -> None:
        """Stop what runs beside the node, and the node."""
        for part in (*self._hosts, *self.health.lost.values()):
            part.close()
        super().destroy_node()

    async def _reload(self, _: Trigger.Request, response: Trigger.Response) -> None:
        """Read and prepare the models anew in a thread, then swap all of them in one step.

        One at a time: those who ask meanwhile, as an impatient client does, share the next one.
        """
        self._asked += 1
        asked = self._asked
        while self._covered < asked:
            if self._reloading:
                turn = Waiting()
                self._for_reload.append(turn)
                await turn
            else:
                await self._reload_for_all()
        response.message = "; ".join(host.summary for host in self._hosts)
        response.success = True

    async def _reload_for_all(self) -> None:
        self._reloading, covered = True, self._asked
        try:
            version = None
            while version != self.values.version:
                # A parameter that is set meanwhile counts, too.
                version = self.values.version
                apply = await self._in_a_thread(self._read_anew)
            apply()
            self._covered = covered
            self.get_logger().info("; ".join(host.summary for host in self._hosts))
        finally:
            self._reloading = False
            waiting, self._for_reload = self._for_reload, []
            for turn in waiting:
                turn.settle()

    def _read_anew(self) -> Callable[[], None]:
        apply = self.values.reapply([name for host in self._hosts for name in host.names])
        for host in self._hosts:
            host.prepare_what_was_read()
        return apply

    async def _in_a_thread(self, work: Callable[[], Any]) -> Any:
        """Return what `work` returns, or raise what it raises; others are served meanwhile."""
        done = Waiting()
        results: list[Any] = []

        def run() -> None:
            error = None
            try:
                results.append(work())
            except Exception as raised:
                error = raised
            # In the node's thread, which this wakes.
            self.executor.create_task(done.settle, error)

        threading.Thread(target=run, daemon=True).start()
        await done
        return results[0]
