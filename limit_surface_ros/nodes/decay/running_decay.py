# SPDX-License-Identifier: Apache-2.0
"""Services of the decay node that answer for its models and for the running onset alike."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from limit_surface_interfaces.srv import EvaluateDecay, FitRunning, TimeToLevel

from limit_surface_ros.checks import as_floats
from limit_surface_ros.decay.tail import tail_of
from limit_surface_ros.errors import DataError, FileError, RangeError, UnavailableError
from limit_surface_ros.files.decay_file import DecayModel, write_decay_model
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving.batches import empty_rows
from limit_surface_ros.nodes.serving.endpoints import Service
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from limit_surface_ros.nodes.decay.onset import Onset

# A model's name is a part of its file's: nothing that leads out of the folder.
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}")
# Fewer measurements teach nothing that is worth a file.
LEAST_SAMPLES = 10
MOST_RUNNING_TIMES = 10_000
# Times at which the largest error of what was learnt is looked for.
_POINTS = 1001

SETTINGS = (
    Setting(
        "max_times",
        1_000_000,
        "Times that ~/evaluate answers; others are served between its slices",
        minimum=1,
        maximum=10_000_000,
    ),
    Setting(
        "learnt_folder",
        "",
        "Folder into which ~/fit_running writes models; empty: it writes none",
    ),
)


async def evaluate(
    node: Any, request: EvaluateDecay.Request, response: EvaluateDecay.Response
) -> None:
    """Answer `~/evaluate`."""
    most = node.values["max_times"]
    if request.running:
        # What is known of it may change between slices, so that it is answered in one.
        most = min(most, MOST_RUNNING_TIMES)
    if len(request.times) > most:
        raise RangeError(
            f"times holds {len(request.times)} times; at most {most} are accepted"
            + (" of the running onset" if request.running else ", see max_times")
        )
    times = as_floats("times", request.times)
    if request.running:
        onset = running_onset(node, request.model)
        model = onset.model
        if (times < 0.0).any():
            raise RangeError(f"times must be at least 0, got {float(times.min())}")
        response.values = convert.flat_of(onset.response.x(times))
        response.bounds = convert.flat_of(onset.response.bounds(times))
    else:
        model = node.host.models[request.model]
        flat_values, values = empty_rows(len(times), 1)
        flat_bounds, bounds = empty_rows(len(times), 1)

        def work(part: slice) -> None:
            values[part] = model.sum(times[part])
            bounds[part] = model.bounds(times[part])

        await node.batches.run("evaluate", model.sum, len(times), work)
        response.values, response.bounds = flat_values, flat_bounds
    response.bound = model.max_error
    response.bound_from, response.bound_until = model.time_span


def time_to_level(node: Any, request: TimeToLevel.Request, response: TimeToLevel.Response) -> None:
    """Answer `~/time_to_level`."""
    if request.running:
        response.time = running_onset(node, request.model).response.x.time_to_level(request.level)
    else:
        response.time = node.host.models[request.model].sum.time_to_level(request.level)
    response.reached = bool(np.isfinite(response.time))


def fit_running(node: Any, request: FitRunning.Request, response: FitRunning.Response) -> None:
    """Answer `~/fit_running`."""
    folder = node.values["learnt_folder"]
    if not folder:
        raise UnavailableError(
            "no models are written: set the parameter learnt_folder to a folder for them"
        )
    if not _NAME.fullmatch(request.name):
        raise RangeError(
            "name must hold 1 to 100 letters, digits, - and _, and begin with a letter or a "
            f"digit, got {request.name[:100]!r}"
        )
    path = Path(folder) / f"{request.name}.yaml"
    if path.exists() and not request.replace:
        raise FileError(f"{path}: exists; set replace, or give another name")
    onset = running_onset(node, "")
    model = learnt_model(onset, request.name)
    write_decay_model(model, path, header="Made by: the decay node's ~/fit_running")
    verdict = onset.response.verdict
    response.path = str(path)
    response.family = verdict.family
    response.amplitude, response.rate = verdict.amplitude, verdict.rate
    response.delay = verdict.delay
    response.max_error = model.max_error
    response.samples = onset.response.samples


def running_onset(node: Any, model: str) -> Onset:
    """Return the node's last onset, running or over.

    Raises:
        UnavailableError: There was none yet.
        RangeError: A model is named, and it is not the onset's.
    """
    onset = node.onset
    if onset is None:
        raise UnavailableError("no onset has come yet, so that none is running")
    if model and model != onset.model.name:
        raise RangeError(
            f"running stands for the last onset, which follows the model {onset.model.name!r}; "
            f"leave model empty, got {model[:100]!r}"
        )
    return onset


def learnt_model(onset: Onset, name: str) -> DecayModel:
    """Return what measurements have taught of an onset's response, as a model of its own.

    Its time span begins at the delay, if there is one, and reaches as far as something is known;
    its error is the largest bound there.

    Raises:
        DataError: There are too few measurements, or no response near the model follows them.
    """
    learnt, verdict, response = onset.response.x, onset.response.verdict, onset.response
    if response.samples < LEAST_SAMPLES:
        raise DataError(
            f"{response.samples} measurements have come; at least {LEAST_SAMPLES} teach a model"
        )
    if not verdict.fits:
        raise DataError(f"nothing was learnt: {verdict.reason}")
    start = max(learnt.delay, 0.0)
    end = min(onset.model.time_span[1], response.known_until)
    if not start < end:
        raise DataError("nothing was learnt: no measurement is later than the delay")
    bounds = response.bounds(np.linspace(start, end, _POINTS))
    tail = None
    if onset.model.tail is not None and end == onset.model.time_span[1]:
        envelope = max(1.0, abs(verdict.amplitude)) * onset.model.tail.envelope
        tail = tail_of(learnt.sum, end, envelope)
    provenance = {
        "source": "measurements of a running onset",
        "model": onset.model.name,
        "family": verdict.family,
        "amplitude": verdict.amplitude,
        "rate": verdict.rate,
        "delay": verdict.delay,
        "measurements": response.samples,
        "outliers": response.outliers,
        "chi2_per_sample": verdict.chi2_per_sample,
    }
    return DecayModel(
        name,
        learnt.sum,
        (start, end),
        "2",
        float(bounds.max()),
        fit=provenance,
        tail=tail,
        noise=response.noise,
    )


SERVICES = (
    Service(EvaluateDecay, "evaluate", evaluate, unbounded=("bounds",)),
    Service(TimeToLevel, "time_to_level", time_to_level, unbounded=("time",)),
    Service(FitRunning, "fit_running", fit_running),
)
