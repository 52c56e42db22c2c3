# SPDX-License-Identifier: Apache-2.0
"""A surface as the numbers that every target needs: roots, exponents, coefficients, starts.

All three families have a gauge, a positive function that is homogeneous of degree one. It is the
load factor of scaled loads, or the dissipation of scaled twists; the gradient of the one gives
twists, that of the other loads. The map back is a support function: the point of gauge 1 with the
largest product with a given vector.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import DataError
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.gauges.corners import Corners
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import even_directions, root_of

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# Families of gauges, by the numbers that templates know them by.
NORMS, POWERS, QUARTIC = 0, 1, 2
# Starts of the map back, over half the sphere.
_STARTS = 96
# A term whose third row is smaller than this part of its size has all but a corner.
_NEARLY_FLAT = 1e-3


@dataclass(frozen=True, eq=False)
class Corner:
    """A point where one term of a sum of norms is at rest, and the cone of its normals.

    Attributes:
        point: Scaled so that the other terms' gauge is 1 there, shape (3,).
        rows: G with G R' = 1 for the two rows R of the term, shape (2, 3).
        centre: G times the gradient of the other terms, shape (2,).
        curvature: G times their Hessian times G', shape (2, 2).
        rest: The term's own norm at the point: 0 if it is of rank two.
    """

    point: Floats
    rows: Floats
    centre: Floats
    curvature: Floats
    rest: float


@dataclass(frozen=True, eq=False)
class Portable:
    """The numbers of a surface, in scaled variables.

    Attributes:
        kind: The surface's kind.
        family: `NORMS`, `POWERS` or `QUARTIC`.
        gauge_of_loads: Whether the gauge is the load factor; else it is the dissipation.
        convex: Whether that is certain: else the map back is not offered.
        not_convex: Why it is not, in words.
        roots: R_k with A_k = R_k'R_k, shape (k, 3, 3); k = 0 for a polynomial.
        exponents: p_k of the powers of f'A_k f, shape (k,).
        coefficients: Of a polynomial, shape (15,); else zeros.
        characteristic_length: rho [m].
        friction_force: F0 [N].
        mean_conjugate: Mean K of x -> g(x) grad g(x) = K x, shape (3, 3); an ellipsoid's own form.
        starts: Points of gauge 1 over half the sphere, shape (d, 3).
        start_gradients: Gradients of the gauge there, shape (d, 3).
        corners: Of a sum of norms.
    """

    kind: str
    family: int
    gauge_of_loads: bool
    convex: bool
    not_convex: str
    roots: Floats
    exponents: Floats
    coefficients: Floats
    characteristic_length: float
    friction_force: float
    mean_conjugate: Floats
    starts: Floats
    start_gradients: Floats
    corners: tuple[Corner, ...]

    @property
    def forms(self) -> Floats:
        """Return A_k = R_k'R_k, shape (k, 3, 3)."""
        return np.asarray(np.swapaxes(self.roots, 1, 2) @ self.roots)

    @property
    def sizes(self) -> Floats:
        """Return the traces of A_k, shape (k,)."""
        return np.asarray(np.square(self.roots).sum(axis=(1, 2)))

    @property
    def wrench_unit(self) -> Floats:
        """Return (F0, F0, F0 rho), shape (3,) [N, N, N m]."""
        force = self.friction_force
        return np.array([force, force, force * self.characteristic_length])

    @property
    def twist_unit(self) -> Floats:
        """Return (1, 1, 1 / rho), shape (3,) [m/s, m/s, rad/s]."""
        return np.array([1.0, 1.0, 1.0 / self.characteristic_length])


def portable(surface: LimitSurface) -> Portable:
    """Return the numbers of a surface.

    Args:
        surface: Of a kind of this package.

    Raises:
        DataError: The kind is not one that can be exported.
    """
    roots: Floats = np.empty((0, 3, 3))
    exponents: Floats = np.empty(0)
    coefficients: Floats = np.zeros(15)
    if isinstance(surface, PowerSum):
        roots = np.array([root_of(matrix) for matrix in surface.matrices])
        exponents = surface.exponents
        # One term's gauge is the norm itself, whatever its exponent.
        family = NORMS if len(roots) == 1 or (exponents == 0.5).all() else POWERS
    elif isinstance(surface, Dissipation):
        roots, family = np.array([root_of(matrix) for matrix in surface.matrices]), NORMS
    elif isinstance(surface, PointContacts):
        roots, family = _point_roots(surface), NORMS
    elif isinstance(surface, Polynomial):
        coefficients, family = surface.coefficients, QUARTIC
    else:
        raise DataError(
            f"a surface of kind {surface.kind!r} cannot be exported; "
            "power_sum, dissipation, point_contacts and polynomial can"
        )
    if family == NORMS:
        exponents = np.full(len(roots), 0.5)
    convexity = is_convex(surface)
    directions = even_directions(2 * _STARTS)[_STARTS:]
    gauge_of_loads = family != NORMS or isinstance(surface, PowerSum)
    values, gradients = _gauge(surface, gauge_of_loads, directions)
    # Directions that are spread evenly have a third of the unit matrix as mean square.
    mean = 3.0 * np.einsum("d,di,dj->ij", values, gradients, directions) / len(directions)
    return Portable(
        kind=surface.kind,
        family=family,
        gauge_of_loads=gauge_of_loads,
        convex=convexity.convex,
        not_convex="" if convexity.convex else convexity.reason,
        roots=roots,
        exponents=exponents,
        coefficients=coefficients,
        characteristic_length=surface.scaling.characteristic_length,
        friction_force=surface.scaling.friction_force,
        mean_conjugate=0.5 * (mean + mean.T),
        starts=directions / values[:, np.newaxis],
        start_gradients=gradients,
        corners=_corners(roots) if family == NORMS else (),
    )


def _gauge(surface: LimitSurface, gauge_of_loads: bool, points: Floats) -> tuple[Floats, Floats]:
    """Return a surface's gauge (d,) and its gradients (d, 3) at scaled points (d, 3)."""
    unit_of_loads, unit_of_twists = surface.scaling.wrench_unit, surface.scaling.twist_unit
    if not gauge_of_loads:
        loads = surface.wrench_of_twist(points * unit_of_twists) / unit_of_loads
        return (loads * points).sum(axis=1), loads
    twists, values = surface.twist_and_load_factor(points * unit_of_loads)
    twists = twists / unit_of_twists
    return values, twists * (values / (twists * points).sum(axis=1))[:, np.newaxis]


def _point_roots(surface: PointContacts) -> Floats:
    """Return m_k [[1, 0, -y_k], [0, 1, x_k], [0, 0, 0]], scaled, shape (n, 3, 3)."""
    held = surface.friction_limits > 0.0
    x, y = (surface.points[held] / surface.scaling.characteristic_length).T
    roots = np.zeros((len(x), 3, 3))
    roots[:, 0, 0] = roots[:, 1, 1] = 1.0
    roots[:, 0, 2], roots[:, 1, 2] = -y, x
    limits = surface.friction_limits[held] / surface.scaling.friction_force
    return np.asarray(limits[:, np.newaxis, np.newaxis] * roots)


def _corners(roots: Floats) -> tuple[Corner, ...]:
    """Return the corners of a sum of norms |R_k x|, and what is all but a corner."""
    sizes = np.sqrt(np.square(roots).sum(axis=(1, 2)))
    found = []
    for index, (root, size) in enumerate(zip(roots, sizes, strict=True)):
        kink = np.cross(root[0], root[1])
        length = float(np.linalg.norm(kink))
        if length <= 1e-9 * size * size:
            continue
        kink /= length
        rest = float(np.linalg.norm(root[2] @ kink))
        others = np.delete(roots, index, axis=0)
        images = others @ kink
        norms = np.linalg.norm(images, axis=1)
        if rest > _NEARLY_FLAT * size or (norms <= 1e-9 * np.delete(sizes, index)).any():
            continue
        parts = np.einsum("kij,ki->kj", others, images) / norms[:, np.newaxis]
        forms = np.swapaxes(others, 1, 2) @ others
        hessian = ((forms - parts[:, :, np.newaxis] * parts[:, np.newaxis]).T / norms).sum(axis=-1)
        if len(others) == 0:
            continue
        gradient = parts.sum(axis=0)
        each = Corners.of_norms(
            kink[np.newaxis],
            root[np.newaxis, :2],
            gradient[:, np.newaxis],
            hessian[:, :, np.newaxis],
        )
        if each is not None:
            scale = float(np.linalg.norm(each.points[0]))
            found.append(
                Corner(
                    each.points[0],
                    each.inverses[0],
                    each.centres[0],
                    each.curvatures[0],
                    rest * scale,
                )
            )
    return tuple(found)
