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
    elif target is not None:
        axes.plot(times, target(times), color=SKY, linewidth=4, label="response")
    axes.plot(times, model.sum(times), color=VERMILION, label="model")
    axes.set(title="response and model", xlabel="t [s]", ylabel="x", xlim=(0.0, times[-1]))
    axes.legend()


def _draw_error(axes: Axes, model: DecayModel, target: Target | None, times: Floats) -> None:
    if target is not None:
        # Of a record nothing is known between its samples.
        known = _samples(target, times[-1]) if isinstance(target, Record) else times
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


def _samples(record: Record, end: float) -> Floats:
    times: Floats = record.knots[record.knots <= end]
    return times


def _draw_rates(axes: Axes, model: DecayModel) -> None:
    rates = model.sum.rates
    sizes = 12.0 + 60.0 * np.abs(model.sum.coefficients) / np.abs(model.sum.coefficients).max()
    pairs = rates.imag > 0.0
    for sign in (1.0, -1.0):
        axes.scatter(
            rates.real[pairs], sign * rates.imag[pairs], s=sizes[pairs], color=BLUE, alpha=0.8
        )
    axes.scatter(rates.real[~pairs], rates.imag[~pairs], s=sizes[~pairs], color=VERMILION)
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
    axes.set(title="projection", xlabel="t [s]", ylabel="|x|", xlim=(0.0, times[-1]))
    axes.legend(loc="upper right")


def _known_until(target: Target, end: float) -> float:
    """Return up to where a response is known: a record that does not end at 0 ends with itself."""
    if isinstance(target, PiecewiseLinear) and target.values[-1] != 0.0:
        return float(target.knots[-1])
    return end
