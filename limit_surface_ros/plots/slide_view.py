# SPDX-License-Identifier: Apache-2.0
"""Slides with mass as pictures: the body on its way, its motion and its load over time; films."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.plots.canvas import BLACK, BLUE, GREY, SKY, VERMILION, new_figure
from limit_surface_ros.plots.film import RATE, outline_at, save_film

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.sliding.load import Load
    from limit_surface_ros.motion.sliding.result import Slide
    from limit_surface_ros.surface.base import LimitSurface

_GHOSTS = 10
_TIMES = 400
# Time that is drawn beyond the rest, in parts of that until it.
_AFTER = 0.05


def draw_slide(
    found: Slide, outline: Floats, surface: LimitSurface, load: Load | None = None, title: str = ""
) -> Figure:
    """Draw a slide: the body's way on the left, its motion and its load over time on the right.

    Args:
        found: The slide.
        outline: Of the body about its reference point, shape (n, 2) [m].
        surface: Under it, for the load factor.
        load: On it.
        title: What to write above.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    with new_figure(8.0, 4.2) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
        way = figure.add_subplot(grid[:, 0])
        _draw_way(way, found, outline)
        _draw_motion(figure.add_subplot(grid[0, 1]), found)
        second = figure.add_subplot(grid[1, 1])
        if load is None:
            _draw_heading(second, found)
        else:
            _draw_load(second, found, surface, load)
        second.set_xlabel("time [s]")
        # Inside the axes it could cover where the body rests.
        figure.legend(*way.get_legend_handles_labels(), loc="outside lower left", ncols=6)
        figure.suptitle(title or "a slide to rest")
    return figure


def _times(found: Slide) -> Floats:
    return np.linspace(0.0, (1.0 + _AFTER) * found.time or 1.0, _TIMES)


def _draw_way(axes: Axes, found: Slide, outline: Floats) -> None:
    poses, _ = found.path.at(np.linspace(0.0, found.time, _GHOSTS))
    for place, pose in enumerate(poses):
        last = place == _GHOSTS - 1
        x, y = 1e3 * outline_at(outline, pose).T
        faint = 1.0 if last else 0.25 + 0.6 * place / _GHOSTS
        axes.plot(x, y, color=BLACK if last else SKY, alpha=faint, linewidth=1.0)
    way = 1e3 * found.path.at(_times(found))[0][:, :2]
    axes.plot(*way.T, color=VERMILION, linewidth=1.0, label="reference point")
    rests = 1e3 * found.path.at(found.rests[:, 0])[0][:, :2]
    if len(rests):
        axes.plot(*rests.T, "o", color=GREY, markersize=5, label="rests on the way")
    axes.plot(*way[-1], "o", color=BLACK, markersize=4, label="rests for good")
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _shade_rests(axes: Axes, found: Slide) -> None:
    for begin, end in found.rests:
        axes.axvspan(begin, end, color=GREY, alpha=0.2, linewidth=0)
    axes.axvline(found.time, color=BLACK, linewidth=0.8, linestyle=":")
    axes.set_xlim(0.0, _times(found)[-1])


def _draw_motion(axes: Axes, found: Slide) -> None:
    times = _times(found)
    _, twists = found.path.at(times)
    twists[times > found.time] = 0.0
    _shade_rests(axes, found)
    axes.plot(times, np.hypot(twists[:, 0], twists[:, 1]), color=BLUE)
    axes.set_ylabel("speed [m/s]", color=BLUE)
    beside = axes.twinx()
    beside.spines["right"].set_visible(True)
    beside.grid(visible=False)
    beside.plot(times, twists[:, 2], color=VERMILION, linestyle="--")
    beside.set_ylabel("turning [rad/s]", color=VERMILION)


def _draw_heading(axes: Axes, found: Slide) -> None:
    times = _times(found)
    _shade_rests(axes, found)
    axes.plot(times, np.degrees(found.path.at(times)[0][:, 2]), color=BLACK)
    axes.set_ylabel("heading [deg]")


def _draw_load(axes: Axes, found: Slide, surface: LimitSurface, load: Load) -> None:
    times = _times(found)
    headings = found.path.at(times)[0][:, 2]
    wrenches = np.array([load.in_body(heading) for heading in headings.tolist()])
    fractions = load.decay(times) / load.decay.start
    _shade_rests(axes, found)
    axes.plot(times, surface.load_factor(wrenches) * fractions, color=BLACK)
    for level in (-1.0, 1.0):
        axes.axhline(level, color=GREY, linewidth=0.8, linestyle="--")
    axes.set_ylabel("load factor")


def write_slide_film(
    found: Slide, outline: Floats, path: str | Path, seconds: float = 4.0
) -> None:
    """Write a slide as a GIF or an MP4, in one step.

    Args:
        found: The slide.
        outline: Of the body about its reference point, shape (n, 2) [m].
        path: The file; its suffix is one of `film.FILMS`.
        seconds: How long the film is [s]; the last tenth shows the body at rest.

    Raises:
        FileError: The suffix is another, or the file cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    count = max(2, round(RATE * seconds))
    times = np.minimum(np.linspace(0.0, found.time / 0.9, count), found.time)
    poses, _ = found.path.at(times)
    with new_figure(5.0, 4.5) as figure:
        axes = figure.add_subplot()
        drawn = 1e3 * np.concatenate([outline_at(outline, pose) for pose in poses])
        low, high = drawn.min(axis=0), drawn.max(axis=0)
        margin = 0.05 * (high - low).max()
        axes.set(
            xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin)
        )
        axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        axes.plot(*(1e3 * outline_at(outline, poses[0])).T, color=SKY, linewidth=0.8)
        axes.plot(*(1e3 * poses[:, :2]).T, color=VERMILION, linewidth=0.8)
        (body,) = axes.plot([], [], color=BLACK)

        def show(place: int) -> list[object]:
            body.set_data(*(1e3 * outline_at(outline, poses[place])).T)
            axes.set_title(f"{times[place]:.3f} s")
            return [body]

        save_film(figure, show, count, path)
