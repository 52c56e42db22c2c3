# SPDX-License-Identifier: Apache-2.0
"""Pushes along a path as pictures: outlines on the way, contact, modes, force; and as films."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.plots.canvas import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    new_figure,
)
from limit_surface_ros.plots.film import RATE, outline_at, save_film

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.motion.rollout import PushRun
    from limit_surface_ros.motion.spread import EndPoses

# What stands for each mode, in every part of the picture.
COLOURS = {
    ContactMode.STICK: GREEN,
    ContactMode.SLIDE_LEFT: BLUE,
    ContactMode.SLIDE_RIGHT: VERMILION,
    ContactMode.SEPARATE: GREY,
}
_WORDS = {
    ContactMode.STICK: "sticks",
    ContactMode.SLIDE_LEFT: "slides left",
    ContactMode.SLIDE_RIGHT: "slides right",
    ContactMode.SEPARATE: "does not push",
}
# Outlines drawn on the way.
_GHOSTS = 9
# Length of the largest force, in mean radii of the outline.
_ARROW = 0.8
# Of the ellipse of an ensemble's ends.
_PROBABILITY = 0.9


def draw_push(
    run: PushRun,
    outline: Outline,
    tip_radius: float,
    title: str = "",
    ends: EndPoses | None = None,
) -> Figure:
    """Draw a push: the body's way on the left; its turn, modes and force over the path's length.

    Args:
        run: The push.
        outline: Of the body.
        tip_radius: Of the pusher [m].
        title: What to write above.
        ends: Of an ensemble: the ellipse that holds 9 of 10 of them is drawn.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    with new_figure(8.0, 4.2) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
        way = figure.add_subplot(grid[:, 0])
        _draw_way(way, run, outline, tip_radius, ends)
        _draw_turn(figure.add_subplot(grid[0, 1]), run)
        _draw_force(figure.add_subplot(grid[1, 1]), run)
        # Inside the axes it could cover where the body ends.
        figure.legend(*way.get_legend_handles_labels(), loc="outside lower left", ncols=6)
        figure.suptitle(title or "a push along a path")
    return figure


def _tip_at(run: PushRun, length: float) -> Floats:
    return np.array([np.interp(length, run.path_lengths, each) for each in run.tips.T])


def _forces(run: PushRun) -> Floats:
    """Return the tip's forces on the body in the frame of the path, (k, 2) [N]."""
    c, s = np.cos(run.poses[:, 2]), np.sin(run.poses[:, 2])
    fx, fy = run.wrenches[:, :2].T
    return np.stack([c * fx - s * fy, s * fx + c * fy], axis=1)


def _draw_way(
    axes: Axes, run: PushRun, outline: Outline, tip_radius: float, ends: EndPoses | None
) -> None:
    from matplotlib.patches import Circle, Polygon

    lengths = np.linspace(0.0, run.path_lengths[-1], _GHOSTS)
    for place, (length, pose) in enumerate(zip(lengths, run.poses_at(lengths), strict=True)):
        last = place == _GHOSTS - 1
        x, y = 1e3 * outline_at(outline.drawn(), pose).T
        faint = 0.2 + 0.6 * place / _GHOSTS
        axes.plot(x, y, color=BLACK if last else SKY, alpha=1.0 if last else faint, linewidth=1.0)
        centre = 1e3 * _tip_at(run, length)
        radius = max(1e3 * tip_radius, 0.3)
        axes.add_patch(Circle(tuple(centre), radius, color=ORANGE, alpha=faint, linewidth=0))
    axes.plot(*(1e3 * run.tips.T), color=ORANGE, linewidth=0.8, linestyle="--", label="tip")
    axes.plot(*(1e3 * run.poses[:, :2].T), color=BLACK, linewidth=0.8, label="body's origin")
    modes = np.array([mode.value for mode in run.modes])
    for mode, colour in COLOURS.items():
        which = modes == mode.value
        if which.any() and mode is not ContactMode.SEPARATE:
            points = 1e3 * run.contacts[which]
            axes.plot(*points.T, ".", color=colour, markersize=4, label=_WORDS[mode])
    forces = _forces(run)
    largest = np.hypot(*forces.T).max()
    if largest > 0.0:
        scale = 1e3 * _ARROW * outline.mean_radius / largest
        shown = np.unique(np.searchsorted(run.path_lengths, lengths[:-1]))
        shown = shown[np.hypot(*forces[shown].T) > 0.0]
        for point, force in zip(1e3 * run.contacts[shown], forces[shown], strict=True):
            axes.annotate(
                "",
                point + scale * force,
                point,
                arrowprops={"arrowstyle": "->", "color": GREY, "linewidth": 0.8},
            )
    if ends is not None:
        axes.plot(*(1e3 * ends.poses[:, :2].T), ".", color=PURPLE, markersize=2)
        border = 1e3 * ends.ellipse(_PROBABILITY).border()
        label = f"{100.0 * _PROBABILITY:.0f} % of the members"
        axes.add_patch(Polygon(border, color=PURPLE, alpha=0.3, linewidth=0, label=label))
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _shade_modes(axes: Axes, run: PushRun) -> None:
    """Shade what the contact does over the path's length."""
    lengths = 1e3 * run.path_lengths
    for place, mode in enumerate(run.modes[:-1]):
        if lengths[place + 1] > lengths[place]:
            axes.axvspan(
                lengths[place], lengths[place + 1], color=COLOURS[mode], alpha=0.15, linewidth=0
            )
    axes.set_xlim(0.0, lengths[-1])


def _draw_turn(axes: Axes, run: PushRun) -> None:
    _shade_modes(axes, run)
    lengths = np.linspace(0.0, run.path_lengths[-1], 200)
    axes.plot(1e3 * lengths, np.degrees(run.poses_at(lengths)[:, 2]), color=BLACK)
    axes.set_ylabel("angle [deg]")


def _draw_force(axes: Axes, run: PushRun) -> None:
    _shade_modes(axes, run)
    sizes = np.hypot(*run.wrenches[:, :2].T)
    axes.plot(1e3 * run.path_lengths, sizes, color=BLACK, drawstyle="steps-post")
    axes.set_ylim(0.0, None)
    axes.set_ylabel("force [N]")
    axes.set_xlabel("path of the tip [mm]")


def write_film(
    run: PushRun, outline: Outline, tip_radius: float, path: str | Path, seconds: float = 4.0
) -> None:
    """Write a push as a GIF or an MP4, in one step.

    Args:
        run: The push.
        outline: Of the body.
        tip_radius: Of the pusher [m].
        path: The file; its suffix is one of `film.FILMS`.
        seconds: How long the film is [s].

    Raises:
        FileError, MissingExtraError: As `film.save_film`.
    """
    with new_figure(5.0, 4.5) as figure:
        from matplotlib.patches import Circle

        count = max(2, round(RATE * seconds))
        lengths = np.linspace(0.0, run.path_lengths[-1], count)
        poses = run.poses_at(lengths)
        corners = outline.drawn()
        drawn = 1e3 * np.concatenate([outline_at(corners, pose) for pose in poses])
        margin = 1e3 * tip_radius + 5.0
        low = np.minimum(drawn.min(axis=0), 1e3 * run.tips.min(axis=0)) - margin
        high = np.maximum(drawn.max(axis=0), 1e3 * run.tips.max(axis=0)) + margin
        axes = figure.add_subplot()
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.set(xlabel="x [mm]", ylabel="y [mm]")
        axes.plot(*(1e3 * outline_at(corners, run.poses[0]).T), color=SKY, linewidth=0.8)
        axes.plot(*(1e3 * run.tips.T), color=ORANGE, linewidth=0.8, linestyle="--")
        (body,) = axes.plot([], [], color=BLACK)
        tip = Circle((0.0, 0.0), max(1e3 * tip_radius, 0.5), color=ORANGE)
        axes.add_patch(tip)

        def show(place: int) -> list[object]:
            body.set_data(*(1e3 * outline_at(corners, poses[place]).T))
            tip.center = tuple(1e3 * _tip_at(run, lengths[place]))
            after = np.searchsorted(run.path_lengths, lengths[place], side="right") - 1
            mode = run.modes[int(np.clip(after, 0, len(run.modes) - 1))]
            tip.set_color(COLOURS[mode])
            axes.set_title(_WORDS[mode])
            return [body, tip]

        save_film(figure, show, count, path)
