# SPDX-License-Identifier: Apache-2.0
"""Bodies that the tests of motion/ share: the disc in closed form, random ones, points."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipe, ellipk

from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.scaling import Scaling

GRAVITY = 9.81


class Disc:
    """A uniformly pressed disc or annulus, its friction in elliptic integrals.

    Farkas, Bartels, Unger and Wolf 2003, doi:10.1103/PhysRevLett.90.248302 (disc); an annulus is
    a disc less a smaller one of the same pressure.
    """

    kind = "disc"
    contact_points = scaled_forms = None

    def __init__(self, radius, friction, hole=0.0):
        self.radius, self.friction, self.hole = radius, friction, hole
        self.scaling = Scaling(radius, friction)

    def wrench_of_twist(self, twist):
        twist = np.asarray(twist, dtype=float)
        vx, vy, turn = np.moveaxis(twist, -1, 0)
        speed = np.hypot(vx, vy)
        force, torque = _disc(speed, np.abs(turn), self.radius)
        if self.hole:
            inner = self.hole * self.radius
            less_force, less_torque = _disc(speed, np.abs(turn), inner)
            share = self.hole**2
            force = (force - share * less_force) / (1.0 - share)
            torque = (torque - share * less_torque) / (1.0 - share)
        along = force / np.where(speed > 0.0, speed, 1.0)
        return self.friction * np.stack([along * vx, along * vy, torque * np.sign(turn)], axis=-1)


def _disc(speed, turn, radius):
    """Return force and torque of a disc, in parts of its friction."""
    rim = turn * radius
    slow = speed < rim
    with np.errstate(divide="ignore", invalid="ignore"):
        eps = np.where(slow, speed / rim, rim / speed)
        m = eps**2
        # K is infinite at 1, where its factor is zero.
        k, e = ellipk(np.where(m < 1.0, m, 0.0)), ellipe(m)
        rest = (1.0 - m) * k
        # Beside a slow rim (speed > rim), eps is the inverse ratio.
        spin_force = ((1.0 + m) * e - rest) / eps
        slide_force = (1.0 / m + 1.0) * e - (1.0 / m - 1.0) * k
        spin_torque = (4.0 - 2.0 * m) * e - rest
        slide_torque = ((4.0 - 2.0 / m) * e + (2.0 / m - 5.0 + 3.0 * m) * k) / eps
    # Where differences would lose digits: the first terms of the series in m.
    small = eps < 0.01
    even = 0.75 * np.pi * (1.0 - m / 8.0 - m**2 / 64.0)
    odd = 0.5 * np.pi * (1.125 + 3.0 * m / 32.0 + 27.0 * m**2 / 1024.0)
    force = np.where(
        slow, np.where(small, eps * even, spin_force), np.where(small, even, slide_force)
    )
    torque = np.where(slow, spin_torque, np.where(small, eps * odd, slide_torque))
    return 4.0 / (3.0 * np.pi) * force, radius * 4.0 / (9.0 * np.pi) * torque


def dissipation_surface(rng, terms=4):
    """Return a random sum of full norms whose friction is about 1.5 N."""
    factors = rng.normal(size=(terms, 3, 3)) + np.eye(3)
    forms = np.einsum("kij,kil->kjl", factors, factors) / (4.0 * terms)
    return Dissipation(forms, Scaling(0.05, 1.5))


def random_inertia(rng, low=0.1, high=5.0, off_centre=0.03):
    mass = 3.0 / GRAVITY
    return Inertia(
        mass,
        mass * 0.05**2 * np.exp(rng.uniform(np.log(low), np.log(high))),
        rng.uniform(-off_centre, off_centre, 2),
    )


def random_twist(rng):
    """Return a twist of up to 1.4 m/s and 20 rad/s; one in ten is nearly pure."""
    twist = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-20.0, 20.0)])
    pure = rng.random()
    if pure < 0.05:
        twist[2] *= 1e-4
    elif pure < 0.1:
        twist[:2] *= 1e-4
    return twist


def body_on_points(rng):
    """Return a surface of 3 to 5 support points, half of them with a dominant one, and inertia."""
    count = int(rng.integers(3, 6))
    limits = rng.uniform(0.1, 1.0, count)
    if rng.random() < 0.5:
        limits[0] = rng.uniform(1.0, 4.0) * limits.sum()
    points = rng.uniform(-0.06, 0.06, (count, 2))
    surface = PointContacts(points, 1.5 * limits / limits.sum(), Scaling(0.05, 1.5))
    return surface, random_inertia(rng, 0.3, 2.0, 0.02)
