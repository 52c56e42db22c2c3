# SPDX-License-Identifier: Apache-2.0
"""The definitions of the kinds written down once more in JAX, which differentiates them itself.

All is in scaled variables. A root that is searched for starts from the library's answer, to which
no derivative belongs; each Newton step from there gives one more of them.
"""

from __future__ import annotations

import os
from functools import partial

import numpy as np

os.environ.setdefault("JAX_PLATFORMS", "cpu")
import jax
import jax.numpy as jnp

from limit_surface_ros.surface import PowerSum
from limit_surface_ros.surface.gauges.quartic import MONOMIALS

jax.config.update("jax_enable_x64", True)
_STEPS = 4


def norms(matrices, x):
    """Return sum_k sqrt(x' B_k x)."""
    return jnp.sqrt(jnp.einsum("kij,i,j->k", matrices, x, x)).sum()


def power_sum(matrices, exponents, x):
    """Return the g with sum_i (x' A_i x / g^2)^p_i = 1."""
    logs = jnp.log(jnp.einsum("kij,i,j->k", matrices, x, x))
    t = jax.lax.stop_gradient(jnp.log(norms(matrices, x)))

    def newton(_, t):
        shares = jnp.exp(exponents * (logs - 2.0 * t))
        return t + jnp.log(shares.sum()) * shares.sum() / (2.0 * exponents @ shares)

    # Sixty steps lead there from any start, and those after them carry the derivatives.
    t = jax.lax.stop_gradient(jax.lax.fori_loop(0, 60, newton, t))
    for step in range(_STEPS):
        t = newton(step, t)
    return jnp.exp(t)


def polynomial(coefficients, x):
    """Return P(x)^(1/4)."""
    return (coefficients * jnp.prod(x ** jnp.asarray(MONOMIALS), axis=1)).sum() ** 0.25


def potential(surface):
    """Return the gauge of loads of a surface, or its dissipation of motions, as it is defined."""
    if surface.wrench_is_closed:
        return partial(norms, jnp.asarray(surface.scaled_forms))
    if isinstance(surface, PowerSum):
        return partial(power_sum, jnp.asarray(surface.matrices), jnp.asarray(surface.exponents))
    return partial(polynomial, jnp.asarray(surface.coefficients))


def half_square(surface):
    """Return gradient (m, 3) and Hessian (m, 3, 3) of half the potential's square."""
    gauge = potential(surface)
    first = jax.grad(lambda x: 0.5 * gauge(x) ** 2)
    both = jax.jit(jax.vmap(lambda x: (first(x), jax.jacfwd(first)(x))))
    return lambda rows: tuple(np.asarray(each) for each in both(jnp.asarray(rows)))


def conjugate(surface, starts):
    """Return the same of the other potential, as a function of its vectors.

    It is the inverse map, and the inverse matrix.

    Args:
        surface: The surface.
        starts: Vectors (m, 3) near those that the inverse map gives.
    """
    direct = half_square(surface)

    def inverse(rows):
        found = starts
        for _ in range(_STEPS):
            values, matrices = direct(found)
            found = found - np.linalg.solve(matrices, (values - rows)[..., np.newaxis])[..., 0]
        return found, np.linalg.inv(direct(found)[1])

    return inverse


def direction(vectors, matrices):
    """Return u = y / |y| and its derivative from y and its derivative."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    units = vectors / size
    across = np.eye(3) - units[:, :, np.newaxis] * units[:, np.newaxis]
    return units, across @ matrices / size[..., np.newaxis]


def on_surface(vectors, matrices, rows):
    """Return y / p and its derivative by x, for y = p(x) grad p(x), of p homogeneous."""
    value = np.sqrt((vectors * rows).sum(axis=1))[:, np.newaxis]
    gradient = vectors / value
    outer = gradient[:, :, np.newaxis] * gradient[:, np.newaxis]
    return gradient, (matrices - outer) / value[..., np.newaxis]
