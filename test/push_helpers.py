# SPDX-License-Identifier: Apache-2.0
"""Surfaces, outlines and random pushes that tests of pushes and rollouts share."""

from dataclasses import dataclass

import numpy as np

from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import MONOMIALS, Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.surface.shape import Shape

SCALING = Scaling(0.05, 2.0)
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


def matrices(rng, count, rank=3):
    factors = rng.standard_normal((count, 3, rank))
    return factors @ factors.transpose(0, 2, 1)


def quartic(rng):
    """A convex quartic: the square of one ellipsoid, and a little of other fourth powers."""
    coefficients = np.zeros(15)
    a = matrices(rng, 1)[0] + np.eye(3)
    squares = {(i, j): a[i, j] for i in range(3) for j in range(3)}
    for (i, j), x in squares.items():
        for (k, m), y in squares.items():
            powers = np.bincount([i, j, k, m], minlength=3)
            coefficients[(powers == MONOMIALS).all(axis=1)] += x * y
    for powers in ([4, 0, 0], [0, 4, 0], [0, 0, 4]):
        coefficients[(np.array(powers) == MONOMIALS).all(axis=1)] += rng.uniform(0.0, 1.0)
    return Polynomial(coefficients, SCALING)


KINDS = {
    "ellipsoid": lambda rng: PowerSum.thesis(matrices(rng, 1), SCALING),
    "norms": lambda rng: PowerSum.norms(matrices(rng, 3), SCALING),
    "norms with corners": lambda rng: PowerSum.norms(
        np.concatenate([matrices(rng, 2, 2), matrices(rng, 1)]), SCALING
    ),
    "two powers": lambda rng: PowerSum.thesis(matrices(rng, 2), SCALING),
    "polynomial": quartic,
    "dissipation": lambda rng: Dissipation(matrices(rng, 5), SCALING),
    "facets": lambda rng: Dissipation(matrices(rng, 3, 2), SCALING),
    "points": lambda rng: PointContacts(
        0.05 * rng.standard_normal((4, 2)), rng.uniform(0.2, 2.0, 4), SCALING
    ),
}


def random_contacts(rng, count):
    points = 0.05 * rng.standard_normal((count, 2))
    angle = rng.uniform(-np.pi, np.pi, count)
    heading = angle + rng.uniform(-1.57, 1.57, count)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    velocities = 0.01 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return points, normals, velocities


def mirrored(surface):
    """Return a surface of KINDS as a mirror shows it that turns y round."""
    flip, turned = np.array([1.0, -1.0]), np.array([1.0, -1.0, -1.0])
    if isinstance(surface, PowerSum):
        matrices = surface.matrices * np.outer(turned, turned)
        return PowerSum(matrices, surface.exponents, SCALING)
    if isinstance(surface, Dissipation):
        return Dissipation(surface.matrices * np.outer(turned, turned), SCALING)
    if isinstance(surface, PointContacts):
        return PointContacts(surface.points * flip, surface.friction_limits, SCALING)
    signs = (-1.0) ** MONOMIALS[:, 1:].sum(axis=1)
    return Polynomial(surface.coefficients * signs, SCALING)


def turned(vectors, angle):
    """Return vectors (n, 2) turned by an angle, or by one each."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = np.asarray(vectors).T
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def best_differences(moved, derivatives, sizes):
    """Return errors (n, ...) of derivatives (n, ..., k) against differences of fourth order.

    The least for steps of several lengths: long ones err by the curve, short ones by rounding.

    Args:
        moved: Returns values (n, ..., k) at a step; NaN where they are on another branch.
        derivatives: What the differences should tend to.
        sizes: In parts of which errors are told, shape (n, ...).
    """
    least = np.full(np.shape(sizes), np.inf)
    for step in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        near, far = (moved(k * step) - moved(-k * step) for k in (1.0, 2.0))
        error = np.abs((8.0 * near - far) / (12.0 * step) - derivatives).max(axis=-1) / sizes
        least = np.fmin(least, error)
    return least


class BoxShape(Shape):
    """Loads of which no component is above 1."""

    def load_factors(self, loads):
        return np.abs(loads).max(axis=0)

    def motions(self, loads):
        largest = np.abs(loads).argmax(axis=0), np.arange(loads.shape[1])
        motions = np.zeros_like(loads)
        motions[largest] = np.sign(loads[largest])
        return motions

    def loads(self, motions):
        return np.sign(motions)


@dataclass(frozen=True, eq=False)
class Box(LimitSurface):
    """A kind that the package does not know: loads of which no component is above its limit."""

    kind = "box"
    scaling: Scaling = SCALING

    def _new_shape(self):
        return BoxShape()
