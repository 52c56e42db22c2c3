# SPDX-License-Identifier: Apache-2.0
"""The load factor g of a sum of powers, sum_i (q_i / g^2)^p_i = 1, and how each form weighs.

With h_i = (q_i / g^2)^p_i the outward normal is the sum of the A_i f, weighed by p_i h_i / q_i.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Newton's method needs three to seven steps from its start; the bound is for the pathological.
_MAX_STEPS = 60
# A last step of this length leaves an error of its square.
_LAST_STEP = 1e-9


class PowerScale(Protocol):
    """Finds g for columns of forms q_i = f' A_i f, shape (k, m), not negative."""

    def load_factors(self, forms: Floats) -> Floats:
        """Return g, shape (m,); 0 where every form is zero: nothing limits that load."""
        ...

    def load_factors_and_weights(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return g (m,), and weights (k, m) of the A_i f in a normal of any length.

        The weight of a form that is zero is finite: with the exponent 1 what it is beside that
        place, 0 with lower ones, which have a kink or worse there.
        """
        ...


def power_scale(exponents: Floats) -> PowerScale:
    """Return the quickest way for exponents p_i in (0, 1], shape (k,)."""
    if np.isin(exponents, (0.5, 1.0)).all():
        return QuadraticScale(exponents)
    return LogarithmicScale(exponents)


class QuadraticScale:
    """For exponents 1 and 1/2: g is the root of g^2 = a + b g, with sums a of q_i, b of roots."""

    def __init__(self, exponents: Floats) -> None:
        """Keep which p_i are 1, shape (k,)."""
        self._whole = exponents == 1.0
        self._half = ~self._whole

    def load_factors(self, forms: Floats) -> Floats:
        """Return g, shape (m,); 0 where every form is zero."""
        return self._root(forms, np.sqrt(forms[self._half]))

    def load_factors_and_weights(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return g (m,) and weights, 2 for the exponents 1 and g / sqrt(q_i) for 1/2, (k, m)."""
        norms = np.sqrt(forms[self._half])
        root = self._root(forms, norms)
        if np.count_nonzero(norms) < norms.size:
            norms[norms == 0.0] = np.inf
        weights = np.empty_like(forms)
        weights[self._whole] = 2.0
        weights[self._half] = root / norms
        return root, weights

    def _root(self, forms: Floats, norms: Floats) -> Floats:
        """Return the larger root, which is not negative."""
        linear = np.add.reduce(norms)
        root = linear * linear
        root += 4.0 * np.add.reduce(forms[self._whole])
        np.sqrt(root, out=root)
        root += linear
        root *= 0.5
        return np.asarray(root)


class LogarithmicScale:
    """For any exponents, by Newton's method for t = -log g.

    log(sum_i exp(2 p_i t + p_i log q_i)) is a rising convex function of t, so that Newton's
    method falls monotonically to its one root from any start beyond it. Such a start is the
    t at which the first of the terms alone reaches 1.
    """

    def __init__(self, exponents: Floats) -> None:
        """Keep the p_i, shape (k,)."""
        self._exponents = exponents

    def load_factors(self, forms: Floats) -> Floats:
        """Return g, shape (m,); 0 where every form is zero."""
        return np.exp(-self._scales_and_shares(forms)[0])

    def load_factors_and_weights(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return g (m,) and weights p_i h_i / q_i, shape (k, m)."""
        t, weights = self._scales_and_shares(forms)
        weights *= self._exponents[:, np.newaxis]
        null = forms == 0.0
        if null.any():
            weights /= np.where(null, np.inf, forms)
            # With the exponent 1 a weight is the same wherever its form goes.
            null &= (self._exponents == 1.0)[:, np.newaxis] & (t < np.inf)
            weights[null] = np.broadcast_to(np.exp(2.0 * t), null.shape)[null]
        else:
            weights /= forms
        return np.exp(-t), weights

    def _scales_and_shares(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return t (m,), infinite where every form is zero, and the shares h_i (k, m)."""
        limited = forms.any(axis=0)
        if not limited.all():
            t: Floats = np.full(forms.shape[1], np.inf)
            shares: Floats = np.zeros_like(forms)
            t[limited], shares[:, limited] = self._scales_and_shares(forms[:, limited])
            return t, shares
        with np.errstate(divide="ignore"):
            logs = np.log(forms)
        t = -0.5 * logs.max(axis=0)
        slopes = 2.0 * self._exponents
        offsets = self._exponents[:, np.newaxis] * logs
        for _ in range(_MAX_STEPS):
            shares = np.multiply.outer(slopes, t)
            shares += offsets
            np.exp(shares, out=shares)
            value = shares.sum(axis=0)
            step = np.log(value)
            step *= value
            step /= slopes @ shares
            t -= step
            if step.max(initial=0.0) < _LAST_STEP:
                break
        np.multiply.outer(slopes, t, out=shares)
        shares += offsets
        return t, np.exp(shares, out=shares)
