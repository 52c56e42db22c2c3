# SPDX-License-Identifier: Apache-2.0
"""The load factor g of a sum of powers, sum_i (q_i / g^2)^p_i = 1, and how each form weighs.

With h_i = (q_i / g^2)^p_i the outward normal is the sum of the A_i f, weighed by p_i h_i / q_i.
Exponents that are whole parts of a small n, as the thesis's are, need neither exp nor log: with
r_i = q_i^(1/n) and m_i = n p_i, w = g^(2/n) is the root of a polynomial, sum_i (r_i / w)^m_i = 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

# Newton's method needs three to seven steps from its start; the bound is for the pathological.
_MAX_STEPS = 60
# A last step of this relative length leaves an error of its square.
_LAST_STEP = 1e-7
# Exponents that differ from m / n by no more are m / n.
_ROUNDING = 1e-15
_LARGEST_DEGREE = 4


class PowerScale(Protocol):
    """Finds g for columns of forms q_i = f' A_i f, shape (k, m), not negative."""

    def load_factors(self, forms: Floats) -> Floats:
        """Return g, shape (m,); 0 where every form is zero: nothing limits that load."""
        ...

    def load_factors_and_weights(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return g (m,), and weights (k, m) of the A_i f in a normal of any length.

        The weight of a form that is zero is of no account, and finite.
        """
        ...


def power_scale(exponents: Floats) -> PowerScale:
    """Return the quickest way for exponents p_i in (0, 1], shape (k,)."""
    for degree in range(1, _LARGEST_DEGREE + 1):
        powers = np.rint(degree * exponents)
        if (np.abs(powers - degree * exponents) <= _ROUNDING * degree).all() and powers.all():
            return PolynomialScale(degree, powers.astype(int).tolist())
    return LogarithmicScale(exponents)


class PolynomialScale:
    """For exponents m_i / n: w = g^(2/n) is the root of w^n = sum_i r_i^m_i w^(n - m_i)."""

    def __init__(self, degree: int, powers: list[int]) -> None:
        """Keep n, from 1 to 4, and the m_i, from 1 to n."""
        self._degree = degree
        self._powers = powers

    def load_factors(self, forms: Floats) -> Floats:
        """Return g, shape (m,); 0 where every form is zero."""
        return self._load_factors(self._root_of_equation(forms, self._roots(forms)))

    def load_factors_and_weights(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return g (m,) and weights m_i (w / r_i)^(n - m_i), shape (k, m)."""
        roots = self._roots(forms)
        root = self._root_of_equation(forms, roots)
        if np.count_nonzero(roots) < roots.size:
            roots[roots == 0.0] = np.inf
        weights = np.divide(root, roots, out=roots)
        for weight, power in zip(weights, self._powers, strict=True):
            if power == self._degree:
                weight.fill(power)
                continue
            ratio = weight.copy() if self._degree - power > 1 else weight
            for _ in range(self._degree - power - 1):
                weight *= ratio
            if power > 1:
                weight *= power
        return self._load_factors(root), weights

    def _roots(self, forms: Floats) -> Floats:
        """Return r_i = q_i^(1/n)."""
        roots: Floats = forms.copy()
        if self._degree == 3:
            return np.cbrt(roots, out=roots)
        for _ in range(self._degree // 2):
            np.sqrt(roots, out=roots)
        return roots

    def _load_factors(self, root: Floats) -> Floats:
        """Return g = w^(n/2)."""
        if self._degree == 1:
            return np.asarray(np.sqrt(root))
        if self._degree == 2:
            return root
        return np.asarray(root * (np.sqrt(root) if self._degree == 3 else root))

    def _root_of_equation(self, forms: Floats, roots: Floats) -> Floats:
        """Return w, shape (m,)."""
        first, *others = self._coefficients(forms, roots)
        if not others:
            return first
        if self._degree == 2:
            return _larger_root(first, others[0])
        most = np.maximum.reduce(roots)
        if np.count_nonzero(most) < len(most):
            seen = most > 0.0
            root: Floats = np.zeros_like(most)
            root[seen] = self._root_of_equation(forms[:, seen], roots[:, seen])
            return root
        # g is at least that of each form alone: dividing by that overestimates, and from beyond
        # the root Newton's method falls to it.
        rest = others[-1]
        for coefficient in others[-2::-1]:
            rest = coefficient + rest / most
        root = _larger_root(first, rest)
        for step in range(_MAX_STEPS):
            # The polynomial and its slope by Horner's rule.
            value = root - first
            slope = root + value
            for coefficient in others[:-1]:
                value *= root
                value -= coefficient
                slope *= root
                slope += value
            value *= root
            value -= others[-1]
            value /= slope
            root -= value
            # From this start n + 1 steps do, but for exponents that come more than once.
            if step >= self._degree and not (value > _LAST_STEP * root).any():
                break
        return root

    def _coefficients(self, forms: Floats, roots: Floats) -> list[Floats]:
        """Return the sums c_m of the r_i^m_i with m_i = m, for m from 1 to n."""
        found: list[Floats | None] = [None] * self._degree
        for form, root, power in zip(forms, roots, self._powers, strict=True):
            value = form if power == self._degree else root
            for _ in range(power - 1 if power < self._degree else 0):
                value = value * root
            present = found[power - 1]
            found[power - 1] = value if present is None else present + value
        return [np.zeros(forms.shape[1]) if each is None else each for each in found]


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
        weights /= np.where(forms > 0.0, forms, np.inf)
        return np.exp(-t), weights

    def _scales_and_shares(self, forms: Floats) -> tuple[Floats, Floats]:
        """Return t (m,), infinite where every form is zero, and the shares h_i (k, m)."""
        seen = forms.any(axis=0)
        if not seen.all():
            t: Floats = np.full(forms.shape[1], np.inf)
            shares: Floats = np.zeros_like(forms)
            t[seen], shares[:, seen] = self._scales_and_shares(forms[:, seen])
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
            if step.max(initial=0.0) < _LAST_STEP * 1e-2:
                break
        np.multiply.outer(slopes, t, out=shares)
        shares += offsets
        return t, np.exp(shares, out=shares)


def _larger_root(linear: Floats, constant: Floats) -> Floats:
    """Return the root of x^2 = linear x + constant that is not negative, for neither negative."""
    root = linear * linear
    root += 4.0 * constant
    np.sqrt(root, out=root)
    root += linear
    root *= 0.5
    return root
