# SPDX-License-Identifier: Apache-2.0
"""The promise of Jacobians: what JAX makes of the definitions of the kinds, on 2000 draws each."""

import numpy as np
import pytest

from export_models import MODELS, SCALING

pytest.importorskip("jax", reason="JAX is not installed: requirements/exports.txt")

from jax_maps import conjugate, direction, half_square, on_surface

SMOOTH = ["ellipsoid", "thesis_2", "thesis_3_convex", "norms_4", "dissipation_4", "polynomial"]
W, V = SCALING.wrench_unit, SCALING.twist_unit
DRAWS = 2000


def drawn(seed):
    """Return scaled vectors (2000, 3), of sizes about one."""
    found = np.random.default_rng(seed).normal(size=(DRAWS, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def off(found, right, made_of=0.0):
    """Return the largest error of each matrix (m, 3, 3), in parts of its size.

    Args:
        found: Of the library.
        right: Of JAX.
        made_of: Size of the matrices (m,) of which a difference gave these, if it is larger.
    """
    size = np.maximum(np.abs(right).max(axis=(1, 2)), made_of)
    return np.abs(found - right).max(axis=(1, 2)) / size


def by_jax(surface, loads, motions):
    """Return kappa with K at loads, and the loads with their derivatives at motions, scaled."""
    if surface.wrench_is_closed:
        starts = surface.quadratic_twist(loads * W)[0] * SCALING.friction_force / V
        kappa = conjugate(surface, starts)(loads)
        values, matrices = half_square(surface)(motions)
    else:
        kappa = half_square(surface)(loads)
        found = surface.wrench_of_twist(motions * V) / W
        power = (found * motions).sum(axis=1, keepdims=True)
        values, matrices = conjugate(surface, found * power)(motions)
    # What takes the part along the motion from these matrices leaves their rounding.
    size = np.abs(matrices).max(axis=(1, 2)) / np.sqrt((values * motions).sum(axis=1))
    return kappa, (*on_surface(values, matrices, motions), size)


def errors(name):
    """Return the largest errors of both Jacobians, of K, and of K times its inverse less one."""
    surface = MODELS[name]
    loads, motions = drawn(1), drawn(2)
    (kappa, k), (on_it, by_motion, size) = by_jax(surface, loads, motions)
    units, by_load = direction(kappa, k)

    twists, jacobians = surface.twist_jacobian(loads * W)
    assert np.abs(twists / V - units).max() <= 1e-12
    of_twist = off(jacobians * W / V[:, np.newaxis], by_load)
    wrenches, jacobians = surface.wrench_jacobian(motions * V)
    assert np.abs(wrenches / W - on_it).max() <= 1e-12 * np.abs(on_it).max()
    of_wrench = off(jacobians * V / W[:, np.newaxis], by_motion, size)
    ours = surface.quadratic_twist(loads * W)[1] * W * W[:, np.newaxis]
    gradient = surface.load_factor_gradient(loads * W) * W
    factors = np.sqrt((kappa * loads).sum(axis=1, keepdims=True))
    assert np.abs(gradient - kappa / factors).max() <= 1e-12 * np.abs(gradient).max()
    return of_twist.max(), of_wrench.max(), off(ours, k).max(), of_inverses(surface)


def of_inverses(surface):
    """Return how far K at a load, times its inverse at the motion there, is from one."""
    kappa, k = surface.quadratic_twist(drawn(3) * W)
    load, second = surface.wrench_jacobian(kappa)
    dissipation = (load * kappa).sum(axis=1)[:, np.newaxis, np.newaxis]
    m = load[:, :, np.newaxis] * load[:, np.newaxis] + dissipation * second
    return np.abs((k @ m) * V / V[:, np.newaxis] - np.eye(3)).max()


@pytest.mark.parametrize("name", SMOOTH)
def test_jacobians_are_those_of_jax_and_either_is_the_inverse_of_the_other(name):
    assert max(errors(name)) <= 1e-12
