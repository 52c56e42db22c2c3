# SPDX-License-Identifier: Apache-2.0
"""Pictures of decay models: response and fit, error, rates in the complex plane, projection."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.targets import PiecewiseLinear, Record
from limit_surface_ros.plots.canvas import BLACK, BLUE, SKY, VERMILION, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.targets import Target
    from limit_surface_ros.files.decay_file import DecayModel

# The projection goes this many times as far as the fit, about as the thesis's from 6 to 19.
PROJECTION = 3.0
_POINTS = 4001


def draw_decay(model: DecayModel, target: Target | None = None) -> Figure:
    """Draw a decay model in four panels.

    Args:
        model: The model.
        target: The response that it stands for, if it is known; without it there is no error to
            draw, and the bound that the model states is shown alone.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    end = model.time_span[1]
    times = np.linspace(0.0, end, _POINTS)
    with new_figure(9.0, 6.4) as figure:
        figure.suptitle(
            f"{model.name}: {model.sum.terms} real terms, largest error {model.max_error:.3g} "
            f"up to {end:g} s"
        )
        ((above, rates), (below, projection)) = figure.subplots(2, 2)
        _draw_fit(above, model, target, times)
        _draw_error(below, model, target, times)
        _draw_rates(rates, model)
        _draw_projection(projection, model, target)
    return figure


def _draw_fit(axes: Axes, model: DecayModel, target: Target | None, times: Floats) -> None:
    if isinstance(target, Record):
        samples = _samples(target, times[-1])
        axes.plot(samples, target(samples), ".", color=SKY, markersize=8, label="samples")
        outliers = _outliers(model, samples)
        if len(outliers):
            axes.plot(outliers, target(outliers), "x", color=BLACK, label="taken as outliers")
    elif target is not None:
        axes.plot(times, target(times), color=SKY, linewidth=4, label="response")
    axes.plot(times, model.sum(times), color=VERMILION, label="model")
    if model.sum.constant:
        axes.axhline(
            model.sum.constant, color=VERMILION, linewidth=0.8, linestyle="--", label="constant"
        )
    axes.set(title="response and model", xlabel="t [s]", ylabel="x", xlim=(0.0, times[-1]))
    axes.legend()


def _draw_error(axes: Axes, model: DecayModel, target: Target | None, times: Floats) -> None:
    if target is not None:
        # Of a record nothing is known between its samples.
        known = times
        if isinstance(target, Record):
            samples = _samples(target, times[-1])
            known = samples[~np.isin(samples, _outliers(model, samples))]
        style = ".-" if isinstance(target, Record) else "-"
        error = model.sum(known) - target(known)
        axes.plot(known, error, style, color=BLUE, linewidth=1, markersize=4, label="error")
    for sign, label in ((1.0, "bound in the file"), (-1.0, None)):
        axes.axhline(
            sign * model.max_error, color=BLACK, linewidth=0.8, linestyle="--", label=label
        )
    axes.set(
        title="model minus response"
        if target is not None
        else "error (the response is not known)",
        xlabel="t [s]",
        ylabel="error, in the unit of x",
        xlim=(0.0, times[-1]),
        ylim=(-1.6 * model.max_error or -1.0, 1.6 * model.max_error or 1.0),
    )
    axes.legend(loc="upper right", ncols=2)


def _outliers(model: DecayModel, samples: Floats) -> Floats:
    """Return the samples' times that the model file names as outliers."""
    # What stands in a file's `fit` may be anything.
    stated = model.fit.get("outlier_times", [])
    times = stated if isinstance(stated, list) else []
    named = np.array([time for time in times if isinstance(time, (int, float))], dtype=np.float64)
    nearest = np.abs(np.subtract.outer(named, samples)) if len(named) else np.zeros((0, 1))
    # Times from a file may have gone through text.
    outliers: Floats = samples[np.unique(nearest.argmin(axis=1))] if len(named) else named
    return outliers


def _samples(record: Record, end: float) -> Floats:
    times: Floats = record.knots[record.knots <= end]
    return times


def _draw_rates(axes: Axes, model: DecayModel) -> None:
    rates = model.sum.rates
    sizes = 12.0 + 60.0 * np.abs(model.sum.coefficients) / np.abs(model.sum.coefficients).max()
    pairs = rates.imag > 0.0
    for sign in (1.0, -1.0) if pairs.any() else ():
        axes.scatter(
            rates.real[pairs],
            sign * rates.imag[pairs],
            s=sizes[pairs],
            color=BLUE,
            alpha=0.8,
            label="pair of rates" if sign > 0.0 else None,
        )
    if not pairs.all():
        axes.scatter(
            rates.real[~pairs],
            rates.imag[~pairs],
            s=sizes[~pairs],
            color=VERMILION,
            label="real rate",
        )
    axes.legend()
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    axes.axhline(0.0, color=BLACK, linewidth=0.5)
    axes.set(title="rates (larger: larger coefficient)", xlabel="Re λ [1/s]", ylabel="Im λ [1/s]")


def _draw_projection(axes: Axes, model: DecayModel, target: Target | None) -> None:
    end = model.time_span[1]
    times = np.linspace(0.0, PROJECTION * end, _POINTS)
    size = abs(float(model.sum(0.0))) or 1.0
    floor = 1e-9 * size
    if target is not None:
        known = times[times <= _known_until(target, times[-1])]
        response = np.maximum(np.abs(target(known)), floor)
        axes.semilogy(known, response, color=SKY, linewidth=4, label="|response|")
    axes.semilogy(
        times,
        np.maximum(np.abs(model.sum(times)), floor),
        color=VERMILION,
        linewidth=1,
        label="|model|",
    )
    axes.axvline(end, color=BLACK, linewidth=0.8, linestyle=":", label="end of the fit")
    if model.tail is not None:
        constant = abs(model.sum.constant)
        later = [end, times[-1]]
        for height, style, label in (
            (model.tail.bound, "-", "proven bound of the model"),
            (model.tail.envelope, "--", "assumed of the response"),
        ):
            level = max(constant + height, floor)
            axes.plot(later, [level, level], color=BLUE, linewidth=1, linestyle=style, label=label)
    axes.set(title="projection", xlabel="t [s]", ylabel="|x|", xlim=(0.0, times[-1]))
    axes.legend(loc="upper right", fontsize="small")


def _known_until(target: Target, end: float) -> float:
    """Return up to where a response is known: a record that does not end at 0 ends with itself."""
    if isinstance(target, PiecewiseLinear) and target.values[-1] != 0.0:
        return float(target.knots[-1])
    return end
