# SPDX-License-Identifier: Apache-2.0
"""Surfaces for simulators: contacts that resist as the body does, and how far off they are.

A sphere with torsional friction (MuJoCo, condim 4, elliptic cone) resists a motion v with the
gradient of one norm, m sqrt(|w|^2 + (t omega)^2), w its velocity. A few of them are therefore a
dissipation model and can be fitted to a body. A single contact is no more than an ellipsoid or, in
engines that bound torsion apart from sliding, a prism: it is matched in its axes, and judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.linalg import even_directions

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

# Directions of motion that contacts are fitted to, and judged on.
_FITTED, _JUDGED = 400, 2000
_MOST_SPHERES = 32


@dataclass(frozen=True)
class Audit:
    """How far the motions of a stand-in are from those of the surface [deg].

    The load that the stand-in gives at a motion moves the body itself in another direction: the
    angle between both, in scaled variables, over directions of motion spread evenly.
    """

    mean: float
    high: float

    def __str__(self) -> str:
        """Return both figures in words."""
        return f"motions off by {self.mean:.2g} deg in the mean, {self.high:.2g} deg at 95 %"


@dataclass(frozen=True, eq=False)
class Spheres:
    """Spheres that stand for a body, about its reference point.

    Attributes:
        points: Where they touch [m], shape (n, 2).
        limits: Friction that each can give [N], shape (n,).
        torsion_length: Largest moment of each over its friction limit [m].
        audit: How far they are off.
    """

    points: Floats
    limits: Floats
    torsion_length: float
    audit: Audit


@dataclass(frozen=True)
class SingleContact:
    """One contact matched to a body, for engines that offer no more.

    Attributes:
        force: Largest friction force, the mean over directions [N].
        moment: Largest moment about the reference point [N m].
        ellipsoid: How far off a contact is that couples both, as MuJoCo's elliptic cone does.
        prism: How far off one is that bounds them apart, as those of SDF (ODE) and PhysX do.
    """

    force: float
    moment: float
    ellipsoid: Audit
    prism: Audit


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """The ellipsoid f'L f = 1 that is closest to a surface, for planners that take a matrix.

    Attributes:
        matrix: L with twist = L wrench up to a factor, physical units, symmetric, shape (3, 3).
        audit: How far it is off.
    """

    matrix: Floats
    audit: Audit


def fit_spheres(surface: LimitSurface, count: int = 4) -> Spheres:
    """Return the spheres whose loads are closest to a surface's, in the mean over motions.

    Support points, if there are no more of them, are taken as they are.

    Args:
        surface: The body.
        count: How many spheres, 1 to 32.

    Raises:
        RangeError: The number of spheres is another.
    """
    from scipy.optimize import least_squares

    if not 1 <= count <= _MOST_SPHERES:
        raise RangeError(f"spheres must be 1 to {_MOST_SPHERES}, got {count}")
    rho, force = surface.scaling.characteristic_length, surface.scaling.friction_force
    if isinstance(surface, PointContacts) and len(surface.points) <= count:
        held = surface.friction_limits > 0.0
        return Spheres(surface.points[held], surface.friction_limits[held], 0.0, Audit(0.0, 0.0))
    motions = even_directions(2 * _FITTED)[_FITTED:]
    loads = surface.wrench_of_twist(motions * surface.scaling.twist_unit)
    loads = loads / surface.scaling.wrench_unit

    def residuals(parameters: Floats) -> Floats:
        return np.asarray((_loads(_sphere_forms(parameters), motions) - loads).ravel())

    # What turns it most easily, and with which arm: a first guess of place and size.
    total = float(np.linalg.norm(loads[:, :2], axis=1).max())
    moment = float(np.abs(loads[:, 2]).max())
    fits = []
    for turn in np.pi / count * np.array([0.0, 0.5, 1.0, 1.5]):
        angle = turn + 2.0 * np.pi * np.arange(count) / count
        radius = 0.8 * moment / total if count > 1 else 0.0
        start = np.concatenate(
            [
                radius * np.cos(angle),
                radius * np.sin(angle),
                np.full(count, np.log(total / count)),
                [np.log(0.4 * moment / total)],
            ]
        )
        fits.append(least_squares(residuals, start))
    best = min(fits, key=lambda fit: float(fit.cost)).x
    x, y, logs = best[:-1].reshape(3, count)
    stand_in = Dissipation(_sphere_forms(best), surface.scaling)
    return Spheres(
        np.array([x, y]).T * rho,
        np.exp(logs) * force,
        float(np.exp(best[-1])) * rho,
        audit(surface, stand_in.wrench_of_twist),
    )


def match_single_contact(surface: LimitSurface) -> SingleContact:
    """Return the friction force and the moment of one contact, and how far it is off."""
    angle = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    straight = np.array([np.cos(angle), np.sin(angle), np.zeros_like(angle)]).T
    powers = (surface.wrench_of_twist(straight) * straight).sum(axis=1)
    force = float(powers.mean())
    moment = float(surface.wrench_of_twist([0.0, 0.0, 1.0])[2])
    limits = np.array([force, force, moment])

    def ellipsoid(twists: Floats) -> Floats:
        images = twists * limits**2
        return np.asarray(images / np.linalg.norm(twists * limits, axis=1)[:, np.newaxis])

    def prism(twists: Floats) -> Floats:
        speed = np.linalg.norm(twists[:, :2], axis=1)[:, np.newaxis]
        slide = force * twists[:, :2] / np.where(speed > 0.0, speed, 1.0)
        return np.column_stack([slide, moment * np.sign(twists[:, 2])])

    return SingleContact(force, moment, audit(surface, ellipsoid), audit(surface, prism))


def fit_ellipsoid(surface: LimitSurface) -> Ellipsoid:
    """Return the ellipsoid whose motions are closest to a surface's, and how far it is off."""
    from scipy.optimize import least_squares

    unit_of_loads, unit_of_twists = surface.scaling.wrench_unit, surface.scaling.twist_unit
    loads = even_directions(2 * _FITTED)[_FITTED:]
    twists = surface.twist_of_wrench(loads * unit_of_loads) / unit_of_twists
    lower = np.tril_indices(3)

    def matrix(parameters: Floats) -> Floats:
        root = np.zeros((3, 3))
        root[lower] = parameters
        return np.asarray(root @ root.T)

    def residuals(parameters: Floats) -> Floats:
        found = loads @ matrix(parameters)
        found /= np.linalg.norm(found, axis=1)[:, np.newaxis]
        return np.append((found - twists).ravel(), np.trace(matrix(parameters)) - 3.0)

    best = matrix(least_squares(residuals, np.eye(3)[lower]).x)
    # Of the size that the surface has in the mean.
    sizes = np.sqrt(np.einsum("di,ij,dj->d", loads, best, loads))
    factors = surface.load_factor(loads * unit_of_loads)
    best *= float((factors / sizes).mean()) ** 2
    inverse = np.linalg.inv(best)

    def load(physical: Floats) -> Floats:
        scaled = physical / unit_of_twists
        return np.asarray(scaled @ inverse * unit_of_loads)

    return Ellipsoid(best / np.multiply.outer(unit_of_loads, unit_of_loads), audit(surface, load))


def audit(surface: LimitSurface, loads_at: Callable[[Floats], Floats]) -> Audit:
    """Return how far the motions of a stand-in are off.

    Args:
        surface: What it stands for.
        loads_at: Takes twists (m, 3) to the stand-in's loads (m, 3), in physical units.
    """
    unit = surface.scaling.twist_unit
    motions = even_directions(_JUDGED)
    found = surface.twist_of_wrench(loads_at(motions * unit)) / unit
    angles = np.degrees(np.arccos(np.clip((found * motions).sum(axis=1), -1.0, 1.0)))
    return Audit(float(angles.mean()), float(np.quantile(angles, 0.95)))


def _sphere_forms(parameters: Floats) -> Floats:
    """Return B_k of spheres, scaled, from their x, y and log m, and the log of t."""
    x, y, logs = parameters[:-1].reshape(3, -1)
    forms = np.zeros((len(x), 3, 3))
    forms[:, 0, 0] = forms[:, 1, 1] = 1.0
    forms[:, 0, 2] = forms[:, 2, 0] = -y
    forms[:, 1, 2] = forms[:, 2, 1] = x
    forms[:, 2, 2] = x * x + y * y + np.exp(2.0 * parameters[-1])
    return np.asarray(np.exp(2.0 * logs)[:, np.newaxis, np.newaxis] * forms)


def _loads(forms: Floats, motions: Floats) -> Floats:
    """Return the loads (m, 3) of a sum of norms at scaled motions (m, 3)."""
    images = np.einsum("kij,mj->kmi", forms, motions)
    norms = np.sqrt(np.einsum("kmi,mi->km", images, motions))
    return np.asarray((images / norms[:, :, np.newaxis]).sum(axis=0))
