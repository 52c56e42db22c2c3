# SPDX-License-Identifier: Apache-2.0
"""Whether regions hold as many pushes as they promise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.plots.canvas import BLACK, GREY, line_style, new_figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure

# Standard deviations of the band in which 19 of 20 shares of so many pushes lie by chance.
_BAND = 1.96


def draw_calibration(curves: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw the shares of pushes inside of regions against the regions' probabilities.

    Args:
        curves: By what the pushes are, their number (`pushes`), probabilities of regions
            (`regions`) and the shares that lie inside (`inside`), as a fit stores them.
    """
    with new_figure(4.6, 4.4) as figure:
        axes = figure.subplots()
        axes.plot([0.0, 100.0], [0.0, 100.0], color=BLACK, linewidth=0.8, label="as promised")
        fewest = min(curve["pushes"] for curve in curves.values())
        promised = np.linspace(0.0, 1.0, 101)
        chance = _BAND * np.sqrt(promised * (1.0 - promised) / fewest)
        axes.fill_between(
            100.0 * promised,
            100.0 * np.maximum(promised - chance, 0.0),
            100.0 * np.minimum(promised + chance, 1.0),
            color=GREY,
            alpha=0.2,
            linewidth=0.0,
            label=f"chance, {fewest} pushes",
        )
        for index, (label, curve) in enumerate(curves.items()):
            regions, inside = (
                100.0 * np.concatenate([[0.0], curve[key], [1.0]]) for key in ("regions", "inside")
            )
            axes.plot(
                regions, inside, label=f"{label}, {curve['pushes']} pushes", **line_style(index)
            )
        axes.set(
            title="Pushes that the fit did not see",
            xlabel="probability of a region [%]",
            ylabel="pushes inside [%]",
            xlim=(0.0, 100.0),
            ylim=(0.0, 100.0),
        )
        axes.set_aspect("equal")
        axes.legend(loc="upper left")
        return figure
