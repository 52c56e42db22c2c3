"""The positive root of H(alpha f) = 1 for sums of powers of quadratic forms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Newton's method needs five to seven steps from its start; the bound is for the pathological.
_MAX_STEPS = 60


def log_scales(forms: Floats, exponents: Floats) -> Floats:
    """Return t = log(alpha) with sum_i (alpha^2 q_i)^p_i = 1; see `scale_and_shares`."""
    return scale_and_shares(forms, exponents)[0]


def scale_and_shares(forms: Floats, exponents: Floats) -> tuple[Floats, Floats]:
    """Return t = log(alpha) with sum_i (alpha^2 q_i)^p_i = 1, and these terms.

    log(sum_i exp(2 p_i t + p_i log q_i)) is a rising convex function of t, so that Newton's
    method falls monotonically to its one root from any start beyond it. Such a start is the
    alpha at which the first of the terms alone reaches 1.

    Args:
        forms: q_i = f' A_i f, shape (k, m), not negative.
        exponents: p_i, shape (k,).

    Returns:
        t (m,), infinite where every form is zero: nothing limits that load; and the terms (k, m),
        which add up to 1, but are 0 where t is infinite.
    """
    seen = forms.any(axis=0)
    if not seen.all():
        t: Floats = np.full(forms.shape[1], np.inf)
        shares: Floats = np.zeros_like(forms)
        t[seen], shares[:, seen] = scale_and_shares(forms[:, seen], exponents)
        return t, shares
    with np.errstate(divide="ignore"):
        logs = np.log(forms)
    t = -0.5 * logs.max(axis=0)
    slopes = 2.0 * exponents
    offsets = exponents[:, np.newaxis] * logs
    for _ in range(_MAX_STEPS):
        shares = np.multiply.outer(slopes, t)
        shares += offsets
        np.exp(shares, out=shares)
        value = shares.sum(axis=0)
        step = np.log(value)
        step *= value
        step /= slopes @ shares
        t -= step
        if step.max(initial=0.0) < 1e-9:
            break
    np.multiply.outer(slopes, t, out=shares)
    shares += offsets
    return t, np.exp(shares, out=shares)
