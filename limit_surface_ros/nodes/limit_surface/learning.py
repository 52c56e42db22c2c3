# SPDX-License-Identifier: Apache-2.0
"""A model that the `limit_surface` node learns from measured wrenches and twists while it serves.

Measurements are paired by their stamps and cut into segments in the node's thread. A process of
its own learns each segment and makes the model, so that no request waits for Python's lock; a
thread hands the segments over, and the node's thread swaps the models in.
"""

from __future__ import annotations

import collections
import contextlib
import queue
import threading
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import TwistStamped, WrenchStamped

from limit_surface_ros.errors import DataError, FileError, LimitSurfaceError, UnavailableError
from limit_surface_ros.files.atomic_write import check_writable
from limit_surface_ros.files.regular_file import read_bytes
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.files.yaml_reader import MAX_BYTES
from limit_surface_ros.nodes.limit_surface.measurement_pairs import SAME_TIME, MeasurementPairs
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.messages.planar_input import LEARNT
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Iterable
    from concurrent.futures import Executor, Future

    from std_srvs.srv import Trigger

    from limit_surface_ros.fitting.few_pushes.online import Update
    from limit_surface_ros.nodes.serving.parameters import Parameters

SETTINGS = (
    Setting(
        "learn",
        False,
        "Learn a model from `~/measured_wrench` and `~/measured_twist`, and serve it beside the "
        "others as the name of its prior with `_learnt` behind",
        read_only=True,
    ),
    Setting(
        "learn_prior",
        "",
        "Name of the model that learning begins with; empty: the default model",
        read_only=True,
    ),
    Setting(
        "learn_forgetting",
        "blend",
        "Whether to follow changes of friction: `blend` trusts old pushes as long as they "
        "predict, `none` keeps the last fifty alike",
        choices=("blend", "none"),
        read_only=True,
    ),
    Setting(
        "learn_file",
        "",
        "Model file that `~/save_learnt` writes; if it is there at start, learning goes on from "
        "it",
        read_only=True,
    ),
)
# Segments that wait to be learnt.
_SEGMENTS = 100
# Pushes of which diagnostics tell how well they were predicted.
_TOLD = 10
# Ends of the process, without a push that was learnt in between, after which it is let be.
_MOST_ENDS = 3
# Between looks whether the node is run, or ends [s].
_PAUSE = 0.02


def prior_of(name: str, values: Parameters) -> str:
    """Return the prior of the model that the parameters have learnt, if it is `name`; else ""."""
    prior = name.removesuffix(LEARNT)
    named = values["learn_prior"]
    return prior if values["learn"] and prior != name and named in ("", prior) else ""


class _ClosedError(Exception):
    """The node ends: leaving with an error ends the process at once, whatever it does."""


class Learner:
    """Learns one model of a node.

    Attributes:
        name: Of the model that is learnt.
        count: Pushes that were learnt.

    Args:
        node: A `LimitSurfaceNode`, whose parameters include `SETTINGS`.

    Raises:
        UnknownModelError: The prior is not loaded.
        FileError: The file to go on from is not valid, or there is no folder to save it in.
    """

    def __init__(self, node: Any) -> None:
        """Serve the prior under the name of what is learnt, subscribe and start to learn."""
        # Not needed by nodes that do not learn, and slow to import.
        from limit_surface_ros.fitting.few_pushes.segments import Segments

        self._node = node
        self._prior: SurfaceModel = node.host.models[node.values["learn_prior"]]
        self.name = self._prior.name + LEARNT
        self._path = node.values["learn_file"]
        self._forgetting = "blend" if node.values["learn_forgetting"] == "blend" else 1.0
        # What the file held when this node read or wrote it last.
        self._known: bytes | None = None
        stored = self._stored()
        self._state = None if stored is None else stored.fit["online"]
        self._segments = Segments(self._prior.surface.scaling)
        self._pairs = MeasurementPairs(self._tell_of_a_twist_alone)
        self._work: queue.Queue[tuple[Any, Any] | None] = queue.Queue(_SEGMENTS)
        self._model = stored
        self._last: collections.deque[Update] = collections.deque(maxlen=_TOLD)
        self._stopped = ""
        self._closed = threading.Event()
        # By the thread, and by the node's.
        self._learnt = self.count = 0 if stored is None else len(stored.fit["online"]["pushes"])
        self._refused = 0
        # Before there is a push the name can be asked for, and made the default.
        node.host.add(replace(stored or self._prior, name=self.name))
        node.endpoints.add_input(WrenchStamped, "measured_wrench", self._take_wrench)
        node.endpoints.add_input(TwistStamped, "measured_twist", self._take_twist)
        node.endpoints.serve_trigger("save_learnt", self._save, "nothing was written")
        self._thread = threading.Thread(target=self._learn, daemon=True)
        self._thread.start()

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say of it."""
        lines = {"learning": f"{self.name}, {self.count} pushes, {self._refused} refused"}
        if self._stopped:
            lines["learning"] += f"; stopped: {self._stopped}"
        lines["pushes that wait"] = str(self._work.qsize())
        if self._last:
            before, prior = (
                np.degrees([getattr(update, name) for update in self._last])
                for name in ("angle_before", "prior_angle")
            )
            sentence = "predicted within {:.1f} deg, by the prior {:.1f} deg"
            lines["last push"] = sentence.format(before[-1], prior[-1])
            mean = f"{sentence}, mean of {len(before)}"
            lines["last pushes"] = mean.format(float(before.mean()), float(prior.mean()))
        return lines

    def close(self) -> None:
        """End the thread and its process."""
        self._closed.set()
        while not self._work.empty():
            try:
                self._work.get_nowait()
            except queue.Empty:
                break
        self._work.put(None)

    async def _take_wrench(self, message: WrenchStamped) -> None:
        stamp = self._time(message)
        surface, wrench, _ = await self._node.input.wrench(self._prior, message)
        # As it would be at the normal force that the model holds at.
        pressed = surface.scaling.friction_force / self._prior.surface.scaling.friction_force
        self._feed(self._pairs.add_wrench(stamp, wrench / pressed))

    async def _take_twist(self, message: TwistStamped) -> None:
        stamp = self._time(message)
        _, twist, _ = await self._node.input.twist(self._prior, message)
        self._feed(self._pairs.add_twist(stamp, twist))

    def _time(self, message: WrenchStamped | TwistStamped) -> int:
        """Return the time of a measurement [ns]: without a stamp the present."""
        stamp = convert.nanoseconds(message.header.stamp)
        return stamp or int(self._node.get_clock().now().nanoseconds)

    def _tell_of_a_twist_alone(self) -> None:
        self._node.report(
            "measured twist without a wrench",
            "a twist on ~/measured_twist has no wrench of its time, at most "
            f"{SAME_TIME // 1_000_000} ms apart, and teaches nothing",
        )

    def _feed(self, pairs: Iterable[tuple[int, Any, Any]]) -> None:
        """Cut pairs of one time into segments, and have those learnt."""
        for stamp, wrench, twist in pairs:
            segment = self._segments.feed(1e-9 * stamp, wrench, twist)
            if segment is None or self._stopped:
                continue
            try:
                self._work.put_nowait(segment)
            except queue.Full:
                self._node.report("push not learnt", "pushes come faster than they are learnt")

    def _learn(self) -> None:
        """Have the queue learnt until it says to end; in a thread of its own."""
        from limit_surface_ros.fitting.workers import worker_processes

        ends = 0
        while ends < _MOST_ENDS:
            known = self._learnt
            try:
                with worker_processes(1) as process:
                    self._learn_in(process)
                return
            except _ClosedError:
                return
            except Exception as error:
                # It was killed, could not be started, or met a defect, after which what it holds
                # is not known.
                ends = 1 if self._learnt > known else ends + 1
                self._tell(f"the process that learns has ended: {error or type(error).__name__}")
        self._stop("its process ends again and again")

    def _learn_in(self, process: Executor) -> None:
        """Hand the queue over to a process until learning is stopped.

        Raises:
            _ClosedError: The node ends.
            Exception: The process has ended, or must not go on.
        """
        # The process imports this anew: it must not import ROS.
        from limit_surface_ros.nodes.limit_surface import learning_process

        begin = (replace(self._prior, fit={}), self.name, self._forgetting, self._state)
        try:
            model = self._result(process.submit(learning_process.begin, *begin))
        except LimitSurfaceError as error:
            self._stop(str(error))
            return
        if model is not None:
            self._finish(model, None)
        while True:
            segment = self._work.get()
            if segment is None:
                raise _ClosedError
            try:
                learnt = self._result(process.submit(learning_process.learn, *segment))
            except LimitSurfaceError as error:
                self._refused += 1
                self._tell(f"a push was not learnt: {error}")
                continue
            if learnt.model is None:
                self._refused += 1
            else:
                self._finish(learnt.model, learnt.update)

    def _result(self, future: Future[Any]) -> Any:
        """Return what the process answers.

        Raises:
            _ClosedError: The node ends, which does not wait for a process that may have stopped.
            Exception: What the process raised.
        """
        while not self._closed.is_set():
            with contextlib.suppress(FutureTimeout):
                return future.result(_PAUSE)
        raise _ClosedError

    def _finish(self, model: SurfaceModel, update: Update | None) -> None:
        """Have the node's thread serve what is learnt."""
        self._state = model.fit["online"]
        self._learnt = len(self._state["pushes"]) if update is None else self._learnt + 1
        count = self._learnt

        def serve() -> None:
            self._model, self.count = model, count
            if update is not None:
                self._last.append(update)
            self._node.host.add(model)

        self._in_the_node(serve)

    def _stop(self, reason: str) -> None:
        self._stopped = reason
        self._tell(f"learning has stopped: {reason}")

    def _tell(self, sentence: str) -> None:
        self._in_the_node(self._node.report, "learning", sentence)

    def _in_the_node(self, call: Any, *arguments: Any) -> None:
        """Call something in the node's thread, which begins some time after the node is made."""
        while (executor := self._node.executor) is None:
            if self._closed.wait(_PAUSE):
                return
        # An executor that has ended meanwhile has no guard condition to trigger.
        with contextlib.suppress(AttributeError):
            executor.create_task(call, *arguments)

    def _stored(self) -> SurfaceModel | None:
        """Return the model of the file to go on from, None where there is none."""
        # At the end of an hour of pushes it would be too late to be told.
        if not self._path or not check_writable(self._path).exists():
            return None
        from limit_surface_ros.fitting.few_pushes.online import pushes_of_state

        self._known = self._content()
        model = read_surface_model(self._path)
        stored = model.fit.get("online")
        if stored is None:
            raise FileError(f"{self._path}: is no learnt model; learn_file names it")
        try:
            pushes_of_state(stored)
        except DataError as error:
            raise FileError(f"{self._path}: fit: online: {error}") from None
        about = (self._prior.frame_id, self._prior.reference_point)
        if (model.frame_id, model.reference_point) != about:
            raise FileError(
                f"{self._path}: was learnt in frame {model.frame_id!r} about "
                f"{model.reference_point}, and {self._prior.name!r} is in {about[0]!r} about "
                f"{about[1]}: name another learn_file"
            )
        return model

    def _content(self) -> bytes | None:
        """Return what the file holds, None where there is none."""
        return read_bytes(self._path, MAX_BYTES) if Path(self._path).exists() else None

    def _save(self, _: Trigger.Request, response: Trigger.Response) -> None:
        """Answer `~/save_learnt`."""
        if not self._path:
            raise UnavailableError("learn_file names no file")
        if self._model is None:
            raise UnavailableError("nothing has been learnt yet")
        if self._content() not in (None, self._known):
            raise FileError(
                f"{self._path}: somebody else has written it since this node read or wrote it: "
                "move it away to save what this node has learnt"
            )
        write_surface_model(self._model, self._path, header="Written by limit_surface_node")
        self._known = self._content()
        response.success = True
        response.message = f"{self._path}: {self.name}, {self.count} pushes"
