# SPDX-License-Identifier: Apache-2.0
"""Pictures of limit surfaces: in load space, and cut through its three planes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.plots.canvas import BLACK, CYCLE, GREY, line_style, new_figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

LOAD_LABELS = ("$f_x$ [N]", "$f_y$ [N]", r"$\tau_z$ [N m]")
# The two components that span each section; the third is zero there.
SECTIONS = ((0, 1), (0, 2), (1, 2))
# Loads this close to a section's plane, in parts of the data's extent, are drawn into it.
SLAB = 0.05

_SECTION_POINTS = 721
_MERIDIANS, _PARALLELS = 97, 65
_MOST_DOTS = 1500
# By the number of surfaces in one picture.
_ZOOM = {1: 1.0, 2: 0.98, 3: 0.92, 4: 0.9}
# Where the viewer stands and where the light comes from [deg].
_AZIMUTH, _ELEVATION = -55.0, 24.0
_LIGHT = (-80.0, 45.0)


def surface_grid(
    surface: LimitSurface, meridians: int = _MERIDIANS, parallels: int = _PARALLELS
) -> Floats:
    """Return wrenches on the surface over a grid of longitudes and latitudes of scaled load.

    Returns:
        Shape (parallels, meridians, 3), in [N, N, N m]; the first and last meridian coincide.
    """
    longitude = np.linspace(0.0, 2.0 * np.pi, meridians)
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, parallels)[:, np.newaxis]
    directions = np.stack(
        np.broadcast_arrays(
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ),
        axis=-1,
    )
    return _onto(surface, directions)


def section_curve(
    surface: LimitSurface, components: tuple[int, int], count: int = _SECTION_POINTS
) -> Floats:
    """Return wrenches all around one section of the surface.

    Args:
        surface: The surface to cut.
        components: The two of (fx, fy, tau_z) that span the plane of the section.
        count: Number of points; the first and the last coincide.

    Returns:
        Shape (count, 2), the two components in their units.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    directions = np.zeros((count, 3))
    directions[:, components[0]] = np.cos(angle)
    directions[:, components[1]] = np.sin(angle)
    return _onto(surface, directions)[:, components]


def draw_section(
    axes: Axes,
    surfaces: Mapping[str, LimitSurface],
    components: tuple[int, int],
    loads: Floats | None = None,
) -> None:
    """Draw one section of each surface, and the loads that lie near its plane.

    Args:
        axes: Where to draw.
        surfaces: The surfaces by name.
        components: The two of (fx, fy, tau_z) that span the plane of the section.
        loads: Wrenches that data give, shape (n, 3).
    """
    if loads is not None:
        (across,) = {0, 1, 2} - set(components)
        near = np.abs(loads[:, across]) <= SLAB * np.abs(loads[:, across]).max()
        axes.plot(*loads[near][:, components].T, ".", color=GREY, markersize=3, label="data")
    for index, (name, surface) in enumerate(surfaces.items()):
        curve = section_curve(surface, components)
        axes.plot(*curve.T, label=name, **line_style(index))
    (zero,) = {0, 1, 2} - set(components)
    axes.set(
        xlabel=LOAD_LABELS[components[0]],
        ylabel=LOAD_LABELS[components[1]],
        title=f"section {LOAD_LABELS[zero].split(' [')[0]} = 0",
    )
    if components == (0, 1):
        axes.set_aspect("equal", adjustable="datalim")


def draw_solid(
    axes: Axes3D,
    surface: LimitSurface | None,
    loads: Floats | None = None,
    color: str = CYCLE[0],
    dot_color: str = BLACK,
    zoom: float = 0.9,
) -> None:
    """Draw a surface in load space, lit from above, with the loads that data give as dots.

    Args:
        axes: Where to draw, three-dimensional.
        surface: The surface; None draws the loads alone.
        loads: Wrenches, shape (n, 3); of very many, an even choice is drawn, and in front of a
            surface only those on the viewer's side, as behind it they would not be seen.
        color: Of the surface.
        dot_color: Of the loads.
        zoom: How much of the panel is used; beyond 0.9 a narrow one cuts the labels off.
    """
    grid = np.zeros((1, 1, 3)) if surface is None else surface_grid(surface)
    extent = np.abs(grid).max(axis=(0, 1))
    if loads is not None:
        extent = np.maximum(extent, np.abs(loads).max(axis=0))
    extent = np.where(extent > 0.0, extent, 1.0)
    axes.computed_zorder = False
    if surface is not None:
        axes.plot_surface(
            *np.moveaxis(grid, -1, 0),
            facecolors=_lit(grid / extent, color),
            shade=False,
            rstride=1,
            cstride=1,
            linewidth=0,
            antialiased=False,
            zorder=1,
        )
    if loads is not None:
        dots = loads[:: max(1, -(-len(loads) // _MOST_DOTS))]
        if surface is not None:
            dots = dots[(dots / extent) @ _unit_vector(_AZIMUTH, _ELEVATION) > 0.0]
        axes.scatter(*dots.T, s=3, color=dot_color, linewidths=0, depthshade=False, zorder=2)
    style_solid(axes, extent, zoom)


def style_solid(axes: Axes3D, extent: Floats, zoom: float = 0.9) -> None:
    """Give three-dimensional axes their labels, limits and point of view."""
    limits: dict[str, Any] = {
        f"{name}lim": (-1.02 * half, 1.02 * half) for name, half in zip("xyz", extent, strict=True)
    }
    # Few ticks, away from the corners, where those of two axes would meet.
    axes.set(**limits)
    for axis, half in zip((axes.xaxis, axes.yaxis, axes.zaxis), extent, strict=True):
        tick = _tick(float(half))
        axis.set_ticks([-tick, 0.0, tick], labels=[f"\N{MINUS SIGN}{tick:g}", "0", f"{tick:g}"])
    axes.set_xlabel(LOAD_LABELS[0], labelpad=-4)
    axes.set_ylabel(LOAD_LABELS[1], labelpad=-4)
    # Beside its axis the label would leave a narrow panel; above its end there is room.
    axes.text2D(0.99, 0.86, LOAD_LABELS[2], transform=axes.transAxes, ha="right", fontsize=9)
    axes.tick_params(labelsize=7, pad=-2)
    axes.tick_params(axis="z", pad=1)
    axes.set_box_aspect((1.0, 1.0, 0.85), zoom=zoom)
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH)


def _tick(half: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is well below a limit."""
    most = 0.75 * half
    power = 10.0 ** np.floor(np.log10(most))
    return float(max(round(step * power, 12) for step in (1, 2, 5) if step * power <= most))


def draw_surfaces(surfaces: Mapping[str, LimitSurface], loads: Floats | None = None) -> Figure:
    """Draw surfaces in load space, above, and their three sections, below.

    Args:
        surfaces: One to four surfaces by name.
        loads: Wrenches that they were fitted to, shape (n, 3).

    Raises:
        DataError: There is no surface, or more than fit into one picture.
        MissingExtraError: matplotlib is not installed.
    """
    if not 1 <= len(surfaces) <= 4:
        raise DataError(f"one picture holds one to four surfaces, got {len(surfaces)}")
    with new_figure(9.0, 7.0) as figure:
        above, below = figure.subfigures(2, 1, height_ratios=(1.25, 1.0))
        for index, (name, surface) in enumerate(surfaces.items()):
            solid: Any = above.add_subplot(1, len(surfaces), index + 1, projection="3d")
            draw_solid(solid, surface, loads, CYCLE[index], zoom=_ZOOM[len(surfaces)])
            solid.set_title(name, y=1.0)
        panels = below.subplots(1, 3)
        for axes, components in zip(panels, SECTIONS, strict=True):
            draw_section(axes, surfaces, components, loads)
        panels[0].legend(loc="center")
    return figure


def _onto(surface: LimitSurface, directions: Floats) -> Floats:
    """Scale directions of scaled load onto the surface, in physical units."""
    wrenches = directions * surface.scaling.wrench_unit
    factors = surface.load_factor(wrenches)
    return np.asarray(wrenches / factors[..., np.newaxis])


def _unit_vector(azimuth: float, elevation: float) -> Floats:
    """Return the direction of two angles [deg], shape (3,)."""
    a, e = np.radians((azimuth, elevation))
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def _lit(grid: Floats, color: str) -> Floats:
    """Return the colour of each cell of a grid by how it faces the light, (rows, columns, 4)."""
    from matplotlib.colors import to_rgba

    diagonal = grid[1:, 1:] - grid[:-1, :-1]
    other = grid[1:, :-1] - grid[:-1, 1:]
    normals = np.cross(diagonal, other)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    light = 0.5 + 0.5 * (normals @ _unit_vector(*_LIGHT))
    base = np.array(to_rgba(color))
    colors = np.ones((*light.shape, 4))
    brightness = 1.25 * light[..., np.newaxis]
    colors[..., :3] = np.where(
        brightness < 1.0,
        base[:3] * (0.25 + 0.75 * brightness),
        base[:3] + (1.0 - base[:3]) * (brightness - 1.0),
    )
    return colors
