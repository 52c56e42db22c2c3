# SPDX-License-Identifier: Apache-2.0
"""Recorded pushes: which motions and loads they cover, and when the body moved and rested."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.recordings.pushes import IN_PLANE
from limit_surface_ros.plots.canvas import BLUE, GREEN, ORANGE, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limit_surface_ros.files.recordings.pushes import RecordedPushes
    from limit_surface_ros.surface.pairs import Pairs

_LARGEST_DOT = 40.0
_MOST_SAMPLES = 6000


def draw_pushes(pairs: Pairs, length: float, recorded: RecordedPushes | None = None) -> Figure:
    """Draw pairs, and the recording that they are from.

    Args:
        pairs: Wrenches and twists.
        length: Makes turns and moments comparable with translations and forces [m].
        recorded: If they are from a recording over time.
    """
    with new_figure(9.0, 4.2 if recorded is None else 6.6) as figure:
        rows = figure.add_gridspec(1 if recorded is None else 2, 2)
        dots = _LARGEST_DOT * np.sqrt(pairs.weights / pairs.weights.max())
        _draw_motions(figure.add_subplot(rows[0, 0]), pairs, length, dots)
        _draw_loads(figure, figure.add_subplot(rows[0, 1]), pairs, dots)
        if recorded is not None and recorded.recording is not None:
            _draw_time(figure.add_subplot(rows[1, :]), recorded)
        return figure


def _draw_motions(axes: Axes, pairs: Pairs, length: float, dots: object) -> None:
    """Draw each twist as the direction of its velocity and how much of it is turning."""
    scaled = pairs.twists * np.array([1.0, 1.0, length])
    scaled = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    directions = np.degrees(np.arctan2(scaled[:, 1], scaled[:, 0]))
    turning = np.degrees(np.arcsin(np.clip(scaled[:, 2], -1.0, 1.0)))
    axes.scatter(directions, turning, s=dots, color=BLUE, alpha=0.6, linewidths=0.0)
    axes.set(
        title=f"Motions of {len(pairs)} pairs: dots all over",
        xlabel="direction of velocity [deg]",
        ylabel="turning: 90 on the spot, to the left [deg]",
        xlim=(-180.0, 180.0),
        ylim=(-90.0, 90.0),
        xticks=range(-180, 181, 90),
        yticks=range(-90, 91, 45),
    )


def _draw_loads(figure: Figure, axes: Axes, pairs: Pairs, dots: object) -> None:
    forces, moments = pairs.wrenches[:, :2], pairs.wrenches[:, 2]
    most = max(float(np.abs(moments).max()), 1e-300)
    shown = axes.scatter(
        *forces.T, s=dots, c=moments, cmap="coolwarm", vmin=-most, vmax=most, edgecolors="none"
    )
    figure.colorbar(shown, ax=axes, label="moment [N m]")
    axes.set(title="Loads: of all directions, moments of both signs", xlabel="f_x [N]")
    axes.set_ylabel("f_y [N]")
    axes.set_aspect("equal", adjustable="datalim")


def _draw_time(axes: Axes, recorded: RecordedPushes) -> None:
    """Draw the force over time, the windows of the pairs and the rests."""
    recording = recorded.recording
    assert recording is not None
    stride = max(1, len(recording.wrench_times) // _MOST_SAMPLES)
    times = recording.wrench_times[::stride]
    offset = recorded.clock_offset
    if offset is not None and offset.applied:
        times = times - offset.delay
    wrenches = recording.wrenches[::stride]
    if recorded.tare is not None:
        wrenches = wrenches - recorded.tare.at(times)
    forces = np.linalg.norm(wrenches[:, IN_PLANE[:2]], axis=1)
    axes.plot(times, forces, color=BLUE, linewidth=0.8, label="force, bias and delay taken away")
    for label, colour, spans in (
        ("windows of pairs", GREEN, recorded.windows),
        ("the body rests", ORANGE, recorded.rests),
    ):
        for number, (start, end) in enumerate(spans):
            axes.axvspan(
                start, end, color=colour, alpha=0.25, linewidth=0, label="" if number else label
            )
    axes.set(title="The recording", xlabel="time [s]", ylabel="force in the sensor's plane [N]")
    axes.set_ylim(0.0, 1.2 * max(float(forces.max()), 1e-300))
    axes.legend(loc="upper right", ncols=3)
