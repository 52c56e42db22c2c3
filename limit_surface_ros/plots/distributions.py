# SPDX-License-Identifier: Apache-2.0
"""Empirical distributions of errors, side by side: which model is how far off how often."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    for index, (name, values) in enumerate(errors.items()):
        sizes, shares = empirical_distribution(values)
        axes.step(sizes, 100.0 * shares, where="post", label=name, **line_style(index))
    axes.set(xlabel=label, ylabel="share of cases [%]", ylim=(0.0, 101.0))
    axes.set_xlim(left=0.0)
    axes.legend(loc="lower right")
