# SPDX-License-Identifier: Apache-2.0
"""Empirical distributions of errors, side by side: which model is how far off how often."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.plots.canvas import line_style
from limit_surface_ros.surface.measures import empirical_distribution

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike


def draw_distributions(axes: Axes, errors: Mapping[str, ArrayLike], label: str) -> None:
    """Draw the share of cases whose error is no larger than x, one curve for each model.

    Args:
        axes: Where to draw.
        errors: The errors by the model's name, any shape.
        label: What the errors are, with their unit.

    Raises:
        DataError: A model has no errors.
    """
    end = 1.02 * max(float(np.max(values)) for values in errors.values() if np.size(values))
    for index, (name, values) in enumerate(errors.items()):
        draw_distribution(axes, values, end, label=name, **line_style(index))
    frame_distributions(axes, label, end)
    axes.set_ylabel("share of cases [%]")
    axes.legend(loc="lower right")


def draw_distribution(axes: Axes, errors: ArrayLike, end: float, **style: Any) -> None:
    """Draw one curve, from the axis below to `end`: an exact model's goes up at 0 and on at 100 %.

    Args:
        axes: Where to draw.
        errors: The errors, any shape.
        end: Error at which the picture ends.
        style: Of the line, as plot() takes it.

    Raises:
        DataError: There are no errors.
    """
    sizes, shares = empirical_distribution(errors)
    (curve,) = axes.step(sizes, 100.0 * shares, where="post", **style)
    ends = {"colors": [curve.get_color()], "linestyles": [curve.get_linestyle()]}
    ends["linewidths"] = [curve.get_linewidth()]
    axes.vlines(sizes[0], 0.0, 100.0 * shares[0], **ends)
    axes.hlines(100.0, sizes[-1], max(end, float(sizes[-1])), **ends)


def frame_distributions(axes: Axes, label: str, end: float) -> None:
    """Label the axes, and leave room for lines at 0 and at 100 % beside them."""
    end = end if end > 0.0 else 1.0
    axes.set(xlabel=label, ylim=(0.0, 103.0), xlim=(-0.02 * end, end))
