# SPDX-License-Identifier: Apache-2.0
"""The `decay` node: how a load dies away after its onset, and what slides and slips by it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from limit_surface_interfaces.msg import DecayForecast, NormalForce, TimeLeft
from limit_surface_interfaces.srv import DescribeModel, ListDecays

from limit_surface_ros.decay.estimation import EstimationOptions
from limit_surface_ros.errors import RangeError, UnavailableError
from limit_surface_ros.files.decay_file import DecayModel, read_decay_model
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.nodes.decay import running_decay, sliding_services
from limit_surface_ros.nodes.decay.onset import Onset
from limit_surface_ros.nodes.decay.onset_stream import OnsetStream
from limit_surface_ros.nodes.messages import convert, frames, planar_input
from limit_surface_ros.nodes.messages.convert import SECOND, nanoseconds
from limit_surface_ros.nodes.messages.planar_input import PlanarInput, prepare_surface
from limit_surface_ros.nodes.models import model_info
from limit_surface_ros.nodes.models.model_host import model_settings
from limit_surface_ros.nodes.models.model_info import ModelList
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS, ModelNode
from limit_surface_ros.nodes.serving import spin
from limit_surface_ros.nodes.serving.batches import Batches
from limit_surface_ros.nodes.serving.endpoints import STREAM_DEPTH, Service
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

NAME = "decay"
HELP = """\
services of decay:
  ~/evaluate, ~/time_to_level                  the load over time
  ~/predict_stop, ~/predict_slide              when and where a body rests
  ~/predict_slip, ~/required_normal_force      when a grasp slips, and what holds it
  ~/fit_running                                what measurements taught, as a model file
  ~/list_models, ~/describe_model, ~/reload    what is loaded
topics of decay:
  ~/onset -> ~/wrench, ~/value, ~/forecast, ~/time_left
  ~/measurement                                corrects the running onset
  ~/held_wrench -> ~/required_normal_force
  /diagnostics
"""
# A stamp later than this is no clock a little ahead [ns]: of a measurement it is wrong, an onset
# may be meant so.
LATEST_AHEAD = SECOND
# Measurements from one look at what they say of the model to the next.
VERDICT_EVERY = 10
SETTINGS = (
    *model_settings("config/decay", "decay models"),
    *model_settings(
        "config/models", "limit surfaces of bodies and grips", "surface_files", "default_surface"
    ),
    Setting("rate", 100.0, "Wrenches and values a second [Hz]", minimum=1e-3, maximum=1e4),
    Setting("horizon", 10.0, "How far forecasts reach [s]", minimum=1e-6, maximum=1e6),
    Setting("forecast_points", 201, "Number of times in a forecast", minimum=2, maximum=100_000),
    Setting(
        "forecast_period",
        0.1,
        "Shortest time from one corrected forecast to the next [s]",
        minimum=0.0,
        maximum=1e6,
    ),
    Setting(
        "stop_below",
        0.01,
        "Publishing ends when no more than this fraction of the onset is left for good",
        minimum=1e-12,
        maximum=1.0,
    ),
    Setting(
        "measurement_noise",
        0.01,
        "Standard deviation of a measurement, as a fraction of the onset",
        minimum=1e-9,
        maximum=1e3,
    ),
    Setting(
        "forgetting",
        0.999,
        "Weight of a measurement relative to the one after it; 1: none is forgotten",
        minimum=1e-3,
        maximum=1.0,
    ),
    Setting(
        "span_factor",
        3.0,
        "Bounds reach so many times as far as was measured, where the model itself does not fit",
        minimum=1.0,
        maximum=1e9,
    ),
    Setting(
        "outlier_gate",
        5.0,
        "A measurement further from its prediction than so many standard deviations is an outlier",
        minimum=1e-3,
        maximum=1e9,
    ),
    Setting(
        "torque_length",
        0.1,
        "Length by which torques are divided to be weighed against forces in measurements [m]",
        minimum=1e-9,
        maximum=1e9,
    ),
    *running_decay.SETTINGS,
    *sliding_services.SETTINGS,
    *frames.SETTINGS,
    *planar_input.SETTINGS,
)


class DecayNode(ModelNode[DecayModel]):
    """Publishes how an onset dies away, corrects it by measurements, and tells what slides by it.

    Attributes:
        surfaces: Limit surfaces of bodies that slide and of grips.
        input: Messages as these surfaces take them.
        batches: Runs what takes long.
        onset: The last onset that came, running or over; None before the first.

    Args:
        buffer: What transforms are looked up in, in place of a tf2 buffer of the node's own.
        options: Passed on to `rclpy.node.Node`.

    Raises:
        LimitSurfaceError: A parameter or a model file is not accepted.
        ParameterException: A parameter has the wrong type or lies outside its range.
    """

    def __init__(self, *, buffer: Any = None, **options: Any) -> None:
        """Read the models and start serving."""
        super().__init__(NAME, SETTINGS, read_decay_model, **options)
        self._list = ModelList(model_info.decay_info)
        self.surfaces = self.add_models(
            read_surface_model, "surface_files", "default_surface", "surface", prepare_surface
        )
        self._frames = frames.Frames(self, self.values, buffer)
        self.batches = Batches(self.endpoints)
        self.input = PlanarInput(self.values, self._frames, self.report, self.surfaces)
        self.onset: Onset | None = None
        self._forecast_time = 0
        self._forecast_samples = 0
        self._forecasts = self.endpoints.add_output(
            DecayForecast,
            "forecast",
            latched=True,
            unbounded=("bounds", "end_time", "known_until"),
        )
        self._stream = OnsetStream(
            self,
            self.endpoints.add_output(WrenchStamped, "wrench", depth=100),
            self.endpoints.add_output(Vector3Stamped, "value", depth=100),
            self._advance,
            self._forget_measurements,
            self.endpoints.refuse,
        )
        self._time_left = self.endpoints.add_output(
            TimeLeft, "time_left", depth=100, unbounded=("time_left", "end_time")
        )
        self.values.on_change(["rate", "stop_below"], self._prepare_stream)
        self.endpoints.add_input(WrenchStamped, "onset", self._begin, stream=False)
        self.endpoints.add_input(WrenchStamped, "measurement", self._measure)
        self._required = self.endpoints.add_output(
            NormalForce, "required_normal_force", depth=STREAM_DEPTH
        )
        self.endpoints.add_input(WrenchStamped, "held_wrench", self._hold)
        for service in SERVICES:
            self.endpoints.serve(service)

    def describe(self) -> dict[str, str]:
        """Return what diagnostics say beside counts and times."""
        lines = super().describe() | {"surface": self.surfaces.models.default}
        onset = self.onset
        if onset is None:
            return lines | {"onset": "none yet"}
        response = onset.response
        lines |= {
            "onset": f"{'running' if self._stream.running else 'over'}, model {onset.model.name}",
            "measurements": str(response.samples),
            "outliers": str(response.outliers),
        }
        if response.samples:
            verdict = response.verdict
            lines["verdict"] = verdict.reason or (
                f"{verdict.family}: amplitude {verdict.amplitude:.3g}, rate {verdict.rate:.3g}, "
                f"delay {verdict.delay:.3g} s" + ", sign reversed" * verdict.reversed
            )
            lines["residual"] = f"{response.residual:.3g} of the onset"
            lines["off_axis"] = f"{onset.off_axis:.3g} of the onset"
        return lines

    def _begin(self, message: WrenchStamped) -> None:
        if not nanoseconds(message.header.stamp) and not self._now():
            # As of time 0 it would be over when the clock comes.
            raise UnavailableError(
                "an onset without a stamp is of the present, which is not known yet: "
                "with use_sim_time, node time is 0 until /clock comes"
            )
        options = EstimationOptions(
            noise=self.values["measurement_noise"],
            forgetting=self.values["forgetting"],
            gate=self.values["outlier_gate"],
            span_factor=self.values["span_factor"],
        )
        onset = Onset(
            message, self.host.models[""], self._now(), options, self.values["torque_length"]
        )
        self.onset = onset
        self._publish_forecast()
        self._start_stream()
        self._report_odd_time()

    def _report_odd_time(self) -> None:
        """Tell of an onset that is long in coming or already over: a clock may be wrong.

        The one is waited for, of the other nothing is published; both are forecast.
        """
        age = (self._now() - self.onset.start) * 1e-9
        if -age * SECOND > LATEST_AHEAD:
            self.report(
                "onset in the future",
                f"an onset's stamp lies {-age:.3g} s in the future: its load is published from "
                "then on",
            )
        elif age > self._end():
            self.report(
                "onset over",
                f"an onset's stamp lies {age:.3g} s in the past, where its load has died away: "
                "only its forecast is published",
            )

    async def _measure(self, message: WrenchStamped) -> None:
        load = np.array(convert.wrench_components(message.wrench))
        onset = self.onset
        if onset is None or not self._stream.running:
            return
        now = self._now()
        stamp = nanoseconds(message.header.stamp) or now
        if stamp > now + LATEST_AHEAD:
            raise RangeError(
                f"a measurement's stamp lies {(stamp - now) * 1e-9:.3g} s in the future"
            )
        if stamp < onset.start:
            return
        transform = await self._frames.to_frame(onset.message.header.frame_id, message.header)
        if self.onset is not onset:
            # Another came while this one's measurement waited for its transform.
            return
        if transform is not None:
            load = transform.wrench(load)
        if not onset.response.learn((stamp - onset.start) * 1e-9, onset.fraction(load)):
            self.report(
                "outlier",
                f"a measurement is {onset.response.residual:.3g} of the onset off its prediction "
                "and counts for nothing",
            )
        self._report_verdict(onset)
        self._correct_forecast(now)

    def _report_verdict(self, onset: Onset) -> None:
        """Tell of measurements that no response near the model follows, and of a reversed sign."""
        if onset.response.samples % VERDICT_EVERY:
            return
        verdict = onset.response.verdict
        if verdict.reason:
            self.report("model does not fit", f"{verdict.reason} (model {onset.model.name})")
        elif verdict.reversed:
            self.report(
                "sign reversed",
                "measurements have the other sign than the onset "
                f"({verdict.amplitude:.3g} of it): is a sensor mounted the other way round?",
            )

    def _advance(self, now: int) -> None:
        """Publish how long the onset still takes beside each of its wrenches."""
        onset, end = self.onset, self._stream.end
        elapsed = (now - onset.start) * 1e-9
        message = TimeLeft(
            time_left=max(0.0, end - elapsed),
            end_time=end,
            fraction=float(onset.response.fractions(max(0.0, elapsed))),
            samples=onset.response.samples,
            fits=onset.response.verdict.fits,
        )
        message.header.frame_id = onset.message.header.frame_id
        convert.fill_stamp(message.header.stamp, now)
        self._time_left.publish(message)
        self._correct_forecast(now)

    async def _hold(self, message: WrenchStamped) -> None:
        self._required.publish(await sliding_services.on_held_wrench(self, message))

    def _correct_forecast(self, now: int) -> None:
        """Publish what has been learnt since the last forecast, but not too often."""
        if (now - self._forecast_time) * 1e-9 < self.values["forecast_period"]:
            return
        if self.onset.response.samples != self._forecast_samples:
            self._publish_forecast()
            self._stream.end_at(self._end())

    def _forget_measurements(self) -> None:
        """What was measured later than it is now has not happened yet."""
        response = self.onset.response
        corrected = response.samples > 0
        response.forget()
        if corrected:
            self._publish_forecast()
            self._stream.end_at(self._end())

    def _publish_forecast(self) -> None:
        onset, response = self.onset, self.onset.response
        times = np.linspace(0.0, self.values["horizon"], self.values["forecast_points"])
        span, verdict = onset.model.time_span, response.verdict
        self._forecasts.publish(
            DecayForecast(
                header=onset.message.header,
                model=onset.model.name,
                onset=onset.message.wrench,
                onset_value=response.start,
                times=convert.flat_of(times),
                values=convert.flat_of(response.x(times)),
                bounds=convert.flat_of(response.bounds(times)),
                bound_from=span[0],
                bound_until=span[1],
                end_time=self._end(),
                samples=response.samples,
                fits=verdict.fits,
                reason=verdict.reason,
                family=verdict.family,
                amplitude=verdict.amplitude,
                rate=verdict.rate,
                delay=verdict.delay,
                reversed=verdict.reversed,
                known_until=response.known_until,
            )
        )
        self._forecast_time, self._forecast_samples = self._now(), response.samples

    def _end(self) -> float:
        return self.onset.response.time_to_fraction(self.values["stop_below"])

    def _start_stream(self) -> None:
        if self.onset is not None:
            self._stream.start(self.onset, self.values["rate"], self._end())

    def _prepare_stream(self, values: Mapping[str, Any]) -> Callable[[], None]:
        return self._start_stream

    def list_models(self, _: ListDecays.Request, response: ListDecays.Response) -> None:
        """Answer `~/list_models`."""
        response.models = self._list.infos(self.host.models)

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)


def describe_model(
    node: DecayNode, request: DescribeModel.Request, response: DescribeModel.Response
) -> None:
    """Answer `~/describe_model`."""
    model = node.host.models[request.model]
    response.name = model.name
    response.summary = model_info.decay_summary(model)
    response.fit = model_info.provenance(model)


SERVICES = (
    Service(ListDecays, "list_models", DecayNode.list_models),
    Service(DescribeModel, "describe_model", describe_model, long=True),
    *running_decay.SERVICES,
    *sliding_services.SERVICES,
)


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    tables = {NAME: [*SETTINGS, *COMMON_SETTINGS]}
    return spin.run(lambda: [DecayNode()], tables, f"{__doc__}\n\n{HELP}", sys.argv)


if __name__ == "__main__":
    sys.exit(main())
