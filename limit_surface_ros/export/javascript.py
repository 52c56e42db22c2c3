# SPDX-License-Identifier: Apache-2.0
"""A surface as a JavaScript module, for browsers and Node.js."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from limit_surface_ros.export.texts import filled, identifier, template

if TYPE_CHECKING:
    from limit_surface_ros.export.portable import Portable


def javascript_engine() -> str:
    """Return the text of `makeSurface(numbers)`, for pages that hold several models."""
    return template("engine.js").partition("\n")[2].strip("\n")


def javascript_numbers(model: Portable, name: str) -> str:
    """Return the numbers of a surface as `makeSurface` takes them, in JSON."""
    return json.dumps(
        {
            "name": name,
            "kind": model.kind,
            "family": model.family,
            "gauge_of_loads": model.gauge_of_loads,
            "convex": model.convex,
            "characteristic_length": model.characteristic_length,
            "wrench_unit": model.wrench_unit.tolist(),
            "twist_unit": model.twist_unit.tolist(),
            "roots": model.roots.tolist(),
            "exponents": model.exponents.tolist(),
            "coefficients": model.coefficients.tolist(),
            "starts": model.starts.tolist(),
            "corners": [
                {
                    "point": each.point.tolist(),
                    "rows": each.rows.tolist(),
                    "centre": each.centre.tolist(),
                    "curvature": each.curvature.tolist(),
                    "rest": each.rest,
                }
                for each in model.corners
            ],
        }
    )


def javascript_module(model: Portable, name: str, title: str) -> str:
    """Return the text of the module; it exports `surface`."""
    return filled(
        "surface.js",
        {
            "TITLE": title,
            "MODULE": identifier(name),
            "ENGINE": javascript_engine(),
            "MODEL": javascript_numbers(model, name),
        },
    )
