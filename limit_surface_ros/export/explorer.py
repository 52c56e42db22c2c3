# SPDX-License-Identifier: Apache-2.0
"""Surfaces as a page to play with: one drags a load or a push and sees what each model says."""

from __future__ import annotations

import html
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.export.javascript import javascript_engine, javascript_numbers
from limit_surface_ros.export.portable import portable
from limit_surface_ros.export.texts import filled, template
from limit_surface_ros.surface.kinds import dissipation_scatter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.surface.kinds.dissipation_scatter import TwistScatter

# Models beside each other, each with a colour of its own.
MOST_MODELS = 4
# Vertices of the disc that stands for an outline that is not known.
_DISC = 48
# Fewest points of a contact whose hull is an outline.
_HULL = 3
# Share of real motions in the region that is shown: "9 of 10", as the page says.
_SHARE = 0.9


def explorer_page(models: Sequence[SurfaceModel]) -> str:
    """Return the text of the page, which needs no network.

    Args:
        models: One to four, about one point of one frame. The outline of the push is that of the
            first: its own, the hull of its support points, or a disc of its characteristic length.

    Raises:
        DataError: There are none or more models, the kind of one cannot be exported, or what
            stands under `fit: uncertainty` of one is not what fits write.
    """
    if not 1 <= len(models) <= MOST_MODELS:
        raise DataError(f"the page holds 1 to {MOST_MODELS} models, got {len(models)}")
    numbers = []
    for model in models:
        each = json.loads(javascript_numbers(portable(model.surface), model.name))
        each["outline"] = outline_of(model).tolist()
        each["scatter"] = model.uncertain and scatter_numbers(model.uncertain.scatter)
        numbers.append(each)
    names = ", ".join(model.name for model in models)
    return filled(
        "explorer.html",
        {
            "TITLE": html.escape(f"Limit surface {names}"),
            "ENGINE": javascript_engine(),
            "SCATTER": scatter_script(),
            # Within a script, no text may look like its end.
            "MODELS": json.dumps(numbers).replace("</", "<\\/"),
        },
    )


def scatter_script() -> str:
    """Return the text of `makeScatter(numbers)`, which stands behind that of `makeSurface`."""
    return template("scatter.js").partition("\n")[2].strip("\n")


def scatter_numbers(scatter: TwistScatter) -> dict[str, Any]:
    """Return the numbers of a model's scatter as `makeScatter` takes them, plain for JSON."""
    return {
        "matrices": scatter.matrices.tolist(),
        "folds": [fold.tolist() for fold in scatter.folds],
        "scale": float(np.exp(scatter.log_scale)),
        "own": dissipation_scatter.OWN,
        "friction": {
            "deviation": dissipation_scatter.FRICTION,
            "saturated": dissipation_scatter.SATURATED,
        },
        "jackknife": {
            "factor": dissipation_scatter.JACKKNIFE,
            "saturated": dissipation_scatter.JACKKNIFE_SATURATED,
        },
        "quantile": dissipation_scatter.region_quantile(_SHARE),
    }


def outline_of(model: SurfaceModel) -> Floats:
    """Return an outline about the reference point, counter-clockwise, shape (n, 2) [m].

    The model's own where its file has one, else the hull of its support points, else a disc.
    """
    if model.outline is not None:
        corners = model.outline.drawn() - model.reference_point
        x, y = corners.T
        turn = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
        return np.asarray(corners if turn > 0.0 else corners[::-1])
    contact = model.surface.contact_points
    if contact is not None:
        from scipy.spatial import ConvexHull, QhullError

        points = contact[0][contact[1] > 0.0]
        if len(points) >= _HULL:
            try:
                return np.asarray(points[ConvexHull(points).vertices])
            except QhullError:
                # All on a line: no hull.
                pass
    angle = 2.0 * np.pi * np.arange(_DISC) / _DISC
    rho = model.surface.scaling.characteristic_length
    return np.asarray(1.5 * rho * np.array([np.cos(angle), np.sin(angle)]).T)
