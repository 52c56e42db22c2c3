# SPDX-License-Identifier: Apache-2.0
"""A model that the `limit_surface` node learns from measured wrenches and twists while it serves.

Measurements are paired by their stamps and cut into segments in the node's thread; each segment is
learnt in a thread of its own, which holds no request, and the model that it makes is swapped in.
"""

from __future__ import annotations

import collections
import datetime
import math
import queue
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import TwistStamped, WrenchStamped

from limit_surface_ros import __version__
from limit_surface_ros.errors import FileError, LimitSurfaceError, UnavailableError
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from std_srvs.srv import Trigger

    from limit_surface_ros.fitting.few_pushes.online import OnlineSurface, Update

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
SUFFIX = "_learnt"
# Measurements of both kinds whose stamps differ by no more are of one time [ns].
_SAME_TIME = 20_000_000
# Wrenches that wait for their twist, segments that wait to be learnt.
_WRENCHES, _SEGMENTS = 100, 100


class Learner:
    """Learns one model of a node.

    Attributes:
        name: Of the model that is learnt.
        count: Pushes that were learnt.

    Args:
        node: A `LimitSurfaceNode`, whose parameters include `SETTINGS`.

    Raises:
        UnknownModelError: The prior is not loaded.
        FileError: The file to go on from is not valid.
    """

    def __init__(self, node: Any) -> None:
        """Subscribe and start the thread."""
        # Not needed by nodes that do not learn, and slow to import.
        from limit_surface_ros.fitting.few_pushes.online import OnlineSurface
        from limit_surface_ros.fitting.few_pushes.segments import Segments

        self._node = node
        self._prior: SurfaceModel = node.host.models[node.values["learn_prior"]]
        self.name = self._prior.name + SUFFIX
        self._path = node.values["learn_file"]
        forgetting = "blend" if node.values["learn_forgetting"] == "blend" else 1.0
        state = self._stored_state()
        self._begin = lambda: (
            OnlineSurface(self._prior.surface, forgetting=forgetting)
            if state is None
            else OnlineSurface.restored(state, self._prior.surface, forgetting=forgetting)
        )
        self._segments = Segments(self._prior.surface.scaling)
        self._wrenches: collections.deque[tuple[int, Any]] = collections.deque(maxlen=_WRENCHES)
        self._work: queue.Queue[tuple[Any, Any] | None] = queue.Queue(_SEGMENTS)
        self._model: SurfaceModel | None = None
        self._last: Update | None = None
        self.count = 0
        self._refused = 0
        node.endpoints.add_input(WrenchStamped, "measured_wrench", self._take_wrench)
        node.endpoints.add_input(TwistStamped, "measured_twist", self._take_twist)
        node.endpoints.serve_trigger("save_learnt", self._save, "nothing was written")
        self._thread = threading.Thread(target=self._learn, daemon=True)
        self._thread.start()

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say of it."""
        told = {"learning": f"{self.name}, {self.count} pushes, {self._refused} refused"}
        if self._last is not None:
            before, prior = (
                math.degrees(angle) for angle in (self._last.angle_before, self._last.prior_angle)
            )
            told["last push"] = f"predicted within {before:.1f} deg, by the prior {prior:.1f} deg"
        return told

    def close(self) -> None:
        """End the thread after the push that it is at."""
        while not self._work.empty():
            try:
                self._work.get_nowait()
            except queue.Empty:
                break
        self._work.put(None)

    async def _take_wrench(self, message: WrenchStamped) -> None:
        stamp = convert.nanoseconds(message.header.stamp)
        surface, wrench, _ = await self._node.input.wrench(self._prior, message)
        # As it would be at the normal force that the model holds at.
        pressed = surface.scaling.friction_force / self._prior.surface.scaling.friction_force
        self._wrenches.append((stamp, wrench / pressed))

    async def _take_twist(self, message: TwistStamped) -> None:
        stamp = convert.nanoseconds(message.header.stamp)
        _, twist, _ = await self._node.input.twist(self._prior, message)
        nearest = min(self._wrenches, key=lambda each: abs(each[0] - stamp), default=(None, None))
        if nearest[0] is None or abs(nearest[0] - stamp) > _SAME_TIME:
            return
        segment = self._segments.feed(1e-9 * stamp, nearest[1], twist)
        if segment is None:
            return
        try:
            self._work.put_nowait(segment)
        except queue.Full:
            self._node.report("push not learnt", "pushes come faster than they are learnt")

    def _learn(self) -> None:
        """Learn what the queue holds until it says to end; in a thread of its own."""
        try:
            online = self._begin()
        except LimitSurfaceError as error:
            self._tell(f"what was learnt before is left out: {error}")
            return
        if online.count:
            self._finish(online, None)
        while True:
            segment = self._work.get()
            if segment is None:
                return
            try:
                update = online.add(*segment)
                if update.accepted:
                    self._finish(online, update)
                else:
                    self._refused += 1
            except LimitSurfaceError as error:
                self._refused += 1
                self._tell(f"a push was not learnt: {error}")

    def _finish(self, online: OnlineSurface, update: Update | None) -> None:
        """Make the model of what is learnt, and have the node's thread serve it."""
        model = SurfaceModel(
            name=self.name,
            surface=online.surface(),
            frame_id=self._prior.frame_id,
            reference_point=self._prior.reference_point,
            normal_force=self._prior.normal_force,
            fit={
                "objective": f"learnt push by push, {online.count} pushes",
                "prior": self._prior.name,
                "online": online.state(),
                "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
                "version": __version__,
            },
        )
        count = online.count

        def serve() -> None:
            self._model, self.count = model, count
            self._last = update or self._last
            self._node.host.add(model)

        if self._node.executor is not None:
            self._node.executor.create_task(serve)

    def _tell(self, sentence: str) -> None:
        if self._node.executor is not None:
            self._node.executor.create_task(self._node.report, "learning", sentence)

    def _stored_state(self) -> Any:
        """Return the state of the file to go on from, None where there is none."""
        if not self._path or not Path(self._path).exists():
            return None
        stored = read_surface_model(self._path).fit.get("online")
        if stored is None:
            raise FileError(f"{self._path}: is no learnt model; learn_file names it")
        return stored

    def _save(self, _: Trigger.Request, response: Trigger.Response) -> None:
        """Answer `~/save_learnt`."""
        if not self._path:
            raise UnavailableError("learn_file names no file")
        if self._model is None:
            raise UnavailableError("nothing has been learnt yet")
        write_surface_model(self._model, self._path, header="Written by limit_surface_node")
        response.success = True
        response.message = f"{self._path}: {self.name}, {self.count} pushes"
