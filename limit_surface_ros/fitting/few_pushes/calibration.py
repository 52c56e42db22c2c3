# SPDX-License-Identifier: Apache-2.0
"""How wide the scatter of a model's twists is: one number, from the pushes that folds held out.

g is the mode of its posterior: residuals of held-out pushes follow the t distribution of
`dissipation_scatter` about the twists of the model that did not see them, and g itself a normal
distribution about 0. A t bounds what an outlier weighs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.surface.kinds.dissipation_scatter import (
    FREEDOM,
    TwistScatter,
    log_map,
    region_probability,
    tangent_basis,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.kinds.dissipation import Dissipation
    from limit_surface_ros.surface.pairs import Pairs

# Standard deviation of g among the sets that its distribution was fitted to.
_SPREAD = 0.35
_ITERATIONS = 50
# Probabilities of the regions whose shares of pushes a fit tells.
REGIONS = tuple(round(0.05 * k, 2) for k in range(1, 20))


@dataclass(frozen=True, eq=False)
class Calibration:
    """The scatter of a model's twists, and what the pushes that folds held out make of it.

    Attributes:
        scatter: Of the model of all pushes.
        levels: Of each held-out push, the probability of the smallest region that holds it, by
            the model that did not see it, shape (n,).
    """

    scatter: TwistScatter
    levels: Floats

    def summary(self) -> dict[str, Any]:
        """Return plain values for a model file; see `inside_regions`."""
        return inside_regions(self.levels)


def calibrate(
    surface: Dissipation, folds: Sequence[Dissipation], held_out: Sequence[Pairs]
) -> Calibration:
    """Return the scatter of a model's twists, and how it holds the pushes of the folds.

    Args:
        surface: The model of all pushes.
        folds: The models that did not see the pushes of a fold, at least two.
        held_out: The pushes of each fold.

    Raises:
        DataError: There are fewer than two folds.
    """
    matrices = tuple(fold.matrices for fold in folds)
    squares = np.concatenate(
        [
            squared_residuals(TwistScatter(fold.matrices, matrices), fold, pairs)
            for fold, pairs in zip(folds, held_out, strict=True)
        ]
    )
    scale = _log_scale(squares)
    levels = region_probability(np.exp(-scale) * squares)
    return Calibration(TwistScatter(surface.matrices, matrices, scale), levels)


def held_out_levels(scatter: TwistScatter, surface: Dissipation, pairs: Pairs) -> Floats:
    """Return the probability of the smallest region that holds each push, shape (n,)."""
    return region_probability(squared_residuals(scatter, surface, pairs))


def inside_regions(levels: Floats) -> dict[str, Any]:
    """Return how many pushes there are, and which shares of them lie inside `REGIONS`."""
    shares = np.mean(levels <= np.array(REGIONS)[:, None], axis=1)
    return {
        "pushes": len(levels),
        "regions": list(REGIONS),
        "inside": [round(float(share), 4) for share in shares],
    }


def squared_residuals(scatter: TwistScatter, surface: Dissipation, pairs: Pairs) -> Floats:
    """Return r' inv(S) r of pushes: how far their twists lie from the model's, shape (n,)."""
    unit = surface.scaling.twist_unit
    units = surface.twist_of_wrench(pairs.wrenches) / unit
    measured = pairs.twists / unit
    measured = measured / np.linalg.norm(measured, axis=1, keepdims=True)
    plane = tangent_basis(units)
    residuals = log_map(units, measured, plane)
    inverse = np.linalg.inv(scatter.plane_scale(units, plane))
    return np.asarray(np.einsum("ni,nij,nj->n", residuals, inverse, residuals))


def _log_scale(squares: Floats) -> float:
    """Return g by Newton's method; its log posterior is concave where it matters."""
    scaled, g = squares / FREEDOM, 0.0
    half = 0.5 * FREEDOM + 1.0
    for _ in range(_ITERATIONS):
        part = np.exp(-g) * scaled
        part /= 1.0 + part
        slope = float(np.sum(1.0 - half * part)) + g / _SPREAD**2
        curvature = half * float(np.sum(part * (1.0 - part))) + 1.0 / _SPREAD**2
        step = slope / curvature
        g -= max(-1.0, min(1.0, step))
        if abs(step) < 1e-10:
            break
    return g
