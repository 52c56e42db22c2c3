"""The positive root of H(alpha f) = 1 for sums of powers of quadratic forms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Newton's method needs five to seven steps from its start; the bound is for the pathological.
_MAX_STEPS = 60


def log_scales(forms: Floats, exponents: Floats) -> Floats:
    """Return t = log(alpha) with sum_i (alpha^2 q_i)^p_i = 1.

    log(sum_i exp(2 p_i t + p_i log q_i)) is a rising convex function of t, so that Newton's
    method falls monotonically to its one root from any start beyond it. Such a start is the
    alpha at which the first of the terms alone reaches 1.

    Args:
        forms: q_i = f' A_i f, shape (k, m), not negative.
        exponents: p_i, shape (k,).

    Returns:
        Shape (m,); infinite where every form is zero: nothing limits that load.
    """
    slopes = 2.0 * exponents[:, np.newaxis]
    with np.errstate(divide="ignore"):
        logs = np.log(forms)
    start = -0.5 * logs.max(axis=0)
    t: Floats = start.copy()
    todo = np.flatnonzero(np.isfinite(start))
    offsets = exponents[:, np.newaxis] * logs
    for _ in range(_MAX_STEPS):
        terms = np.exp(slopes * t[todo] + offsets[:, todo])
        value = terms.sum(axis=0)
        step = np.log(value) * value / (slopes * terms).sum(axis=0)
        t[todo] -= step
        todo = todo[np.abs(step) > 1e-9]
        if len(todo) == 0:
            break
    return t
