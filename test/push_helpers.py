# SPDX-License-Identifier: Apache-2.0
"""Surfaces, outlines and random pushes that tests of rollouts share."""

import numpy as np

from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

TIP = 0.00475
RECTANGLE = Polygon([[-0.045, -0.056], [0.045, -0.056], [0.045, 0.056], [-0.045, 0.056]])
BUTTERFLY = Polygon(
    [[-0.05, -0.04], [0.0, -0.01], [0.05, -0.04], [0.05, 0.04], [0.0, 0.01], [-0.05, 0.04]]
)


def ellipsoid(c, force=1.0):
    """An isotropic ellipsoid with the ratio c of largest moment and force."""
    return PowerSum.thesis([np.eye(3)], Scaling(c, force))


def surfaces(seed=3):
    """One surface of each kind that is solved otherwise, with mild anisotropy."""
    rng = np.random.default_rng(seed)
    factors = rng.standard_normal((8, 3, 3))
    forms = factors @ factors.transpose(0, 2, 1) / 3.0 + 0.2 * np.eye(3)
    scaling = Scaling(0.05, 2.0)
    return {
        "ellipsoid": PowerSum.thesis(forms[:1], scaling),
        "norms": PowerSum.norms(forms[:3], scaling),
        "dissipation": Dissipation(forms, scaling),
    }


def random_runs(outline, count, rng, length=0.044, gap=0.0):
    """Return poses and straight paths of tips that begin beside random places of a polygon."""
    corners = outline.vertices
    ends = np.roll(corners, -1, axis=0)
    edge = rng.integers(len(corners), size=count)
    share = rng.uniform(0.05, 0.95, count)[:, np.newaxis]
    along = ends[edge] - corners[edge]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    angle = rng.uniform(-1.1, 1.1, count)
    c, s = np.cos(angle), np.sin(angle)
    x, y = -outward.T
    heading = np.stack([c * x - s * y, s * x + c * y], axis=1)
    start = corners[edge] + share * along + outward * (TIP + gap)
    return np.zeros((count, 3)), np.stack([start, start + length * heading], axis=1)


def metric(poses, others, outline):
    """Return |dp| + rho |dtheta| [m] between poses (n, 3)."""
    away = np.asarray(poses) - np.asarray(others)
    return np.hypot(*away[..., :2].T) + outline.mean_radius * np.abs(away[..., 2])
