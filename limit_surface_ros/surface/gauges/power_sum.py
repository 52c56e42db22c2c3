# SPDX-License-Identifier: Apache-2.0
"""The load factor of a sum of powers as a gauge, with its derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.surface.gauges.corners import Corners
from limit_surface_ros.surface.gauges.gauge import Turning
from limit_surface_ros.surface.gauges.jacobians import six_of, sum_of_terms, take_outer
from limit_surface_ros.surface.gauges.power_scale import power_scale
from limit_surface_ros.surface.linalg import NULL_TOLERANCE, squared_lengths

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats


class PowerSumGauge:
    """g(f) with H(f / g) = 1, H(f) = sum_i (f' A_i f)^p_i and A_i = R_i' R_i."""

    def __init__(self, roots: Floats, exponents: Floats) -> None:
        """Keep the factors R_i (k, 3, 3) and the exponents p_i (k,)."""
        self._roots = roots
        self._stacked_roots = roots.reshape(-1, 3)
        self._forms = np.swapaxes(roots, 1, 2) @ roots
        self._sizes = np.trace(self._forms, axis1=1, axis2=2)[:, np.newaxis]
        self._exponents = exponents
        self._scale = power_scale(exponents)
        # A matrix of full rank, as `root_of` tells it, has no null space.
        full = np.abs(roots).any(axis=2).all()
        self._null = None if full else NULL_TOLERANCE * self._sizes
        # All that takes loads to the A_i f, component by component, and the forms.
        self._stacked_forms = self._forms.swapaxes(0, 1).reshape(-1, 3)
        self._six = six_of(self._forms)
        # Terms that are no quadratic forms: the last in the order of files, where a slice will do
        # that copies nothing.
        rooted = exponents < 1.0
        first = len(exponents) - np.count_nonzero(rooted)
        self._curved = slice(first, None) if rooted[first:].all() else np.flatnonzero(rooted)

    def values(self, loads: Floats) -> Floats:
        """Return g (m,); 0 for a load that nothing limits."""
        return self._scale.load_factors(self.images_and_forms(loads)[1])

    def values_and_normals(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return g (m,) and vectors (3, m) along its gradient, of any length.

        A term adds nothing to the normal of a load in its null space.
        """
        images, forms = self.images_and_forms(loads)
        values, weights = self._scale.load_factors_and_weights(forms)
        images *= weights[:, np.newaxis]
        normals = self._stacked_roots.T.dot(images.reshape(-1, images.shape[2]))
        return values, np.asarray(normals)

    def images_and_forms(self, loads: Floats) -> tuple[Floats, Floats]:
        """Return R_i f, shape (k, 3, m), and f' A_i f, shape (k, m)."""
        terms = len(self._stacked_roots) // 3
        images = self._stacked_roots.dot(loads).reshape(terms, 3, loads.shape[1])
        forms: Floats = np.einsum("kcm,kcm->km", images, images)
        if self._null is not None:
            forms[forms <= self._null * squared_lengths(loads)] = 0.0
        return images, forms

    def derivatives(self, loads: Floats, smoothing: Floats) -> tuple[Floats, Floats, Floats]:
        """Return g, its gradient and its Hessian; see `Gauge`.

        With q_i = f' A_i f and h_i = (q_i / g^2)^p_i, which sum to 1, implicit differentiation of
        sum_i exp(p_i log q_i - 2 p_i t) = 1 gives those of t = log g.
        """
        images = self._roots @ loads
        values = np.einsum("kcm,kcm->km", images, images) + self._sizes * smoothing**2
        gauge = self._scale.load_factors(values)
        t = np.log(gauge)
        total = np.zeros_like(t)
        second_total = np.zeros_like(t)
        gradient: Floats = np.zeros_like(loads)
        mixed: Floats = np.zeros_like(loads)
        hessian: Floats = np.zeros((3, *loads.shape))
        for root, form, image, value, p in zip(
            self._roots, self._forms, images, values, self._exponents, strict=True
        ):
            safe = np.where(value > 0.0, value, np.inf)
            share = 2.0 * p * np.exp(p * (np.log(np.maximum(value, 1e-300)) - 2.0 * t))
            weight = share / safe
            part = root.T @ image
            total += share
            second_total += 2.0 * p * share
            gradient += weight * part
            mixed += 2.0 * p * weight * part
            curvature = (2.0 * p - 2.0) * weight / safe
            hessian += weight * form[:, :, np.newaxis] + curvature * part[:, np.newaxis] * part
        gradient /= total
        across = mixed[:, np.newaxis] * gradient
        hessian -= across + across.swapaxes(0, 1)
        hessian /= total
        hessian += (second_total / total + 1.0) * gradient[:, np.newaxis] * gradient
        return gauge, gauge * gradient, gauge * hessian

    def turning(self, loads: Floats, null: float | None = None) -> Turning:
        """Return values, normals and how these turn; see `Gauge`.

        With weights w_i of the A_i f in the normal, its derivative is sum_i w_i A_i, which takes
        f to N, less 2 (1 - p_i) w_i / q_i A_i f (A_i f)', but for parts along N. With
        A_i f - (q_i / N.f) N instead of A_i f, which are zero along f, the latter take f to zero.
        """
        columns = loads.shape[1]
        images, forms = self.images_and_forms(loads)
        if null is not None and self._null is not None:
            forms[forms <= null * null * self._sizes * squared_lengths(loads)] = 0.0
        values, weights = self._scale.load_factors_and_weights(forms)
        # In the place of the images, which have served.
        parts = self._stacked_forms.dot(loads, out=images.reshape(-1, columns))
        parts = parts.reshape(3, -1, columns)
        matrices = self._six.dot(weights)
        parts *= weights
        normals = sum_of_terms(parts)
        curved, kinks = self._curved, None
        forms = forms[curved]
        if len(forms):
            # The parts are times w_i already.
            forms *= weights[curved]
            parts = parts[:, curved]
            parts -= forms / np.einsum("im,im->m", normals, loads) * normals[:, np.newaxis]
            if self._null is not None:
                at_kink = forms == 0.0
                if at_kink.any():
                    kinks = (self._six / self._sizes.T)[:, curved].dot(at_kink)
                    # Their parts are zero.
                    forms[at_kink] = 1.0
            forms /= 2.0 - 2.0 * self._exponents[curved, np.newaxis]
            parts /= np.sqrt(forms, out=forms)
            take_outer(matrices, parts)
        return Turning(values, normals, matrices, kinks)

    def ellipsoids(self, loads: Floats) -> Floats:
        """Return P (m, 3, 3): ellipsoids f' P^-1 f = 1 within the surface, touching it.

        Args:
            loads: Directions in which they touch, shape (3, m).
        """
        return np.asarray(np.linalg.inv(np.moveaxis(self._tangent_forms(loads), 2, 0)))

    def _tangent_forms(self, loads: Floats) -> Floats:
        """Return P^-1 (3, 3, m), quadratic forms that are 1 on ellipsoids within the surface.

        Each q^p is concave in q, so that its tangent in q, a quadratic form of the load, lies
        above it: on the surface, sum_i p_i h_i (q_i / q_i0 - 1) <= 0 bounds a set within it.
        """
        images = self._roots @ loads
        values = np.einsum("kcm,kcm->km", images, images)
        values = np.maximum(values, 1e-30 * self._sizes * (loads * loads).sum(axis=0))
        gauge, weights = self._scale.load_factors_and_weights(values)
        weights *= gauge * gauge / (weights * values).sum(axis=0)
        forms: Floats = (self._forms.reshape(-1, 9).T @ weights).reshape(3, 3, -1)
        # Beside a ridge one term outweighs all others: keep the form regular.
        diagonal = np.einsum("iim->im", forms)
        diagonal += 1e-13 * diagonal.sum(axis=0)
        return forms

    def corners(self) -> Corners | None:
        """Return the loads in the null space of one norm, a term of exponent 1/2 and rank two."""
        flat = np.abs(self._roots).any(axis=2).sum(axis=1) == 2
        roots = self._roots[flat & (self._exponents == 0.5), :2]
        axes = np.cross(roots[:, 0], roots[:, 1])
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        images = self._roots @ axes.T
        values = np.einsum("kcm,kcm->km", images, images)
        values[values <= 1e-20 * self._sizes] = 0.0
        alone = (values > 0.0).sum(axis=0) == len(self._roots) - 1
        values, images, axes, roots = (
            values[:, alone],
            images[:, :, alone],
            axes[alone],
            roots[alone],
        )
        scale = 1.0 / self._scale.load_factors(values)
        gradient: Floats = np.zeros((3, len(axes)))
        hessian: Floats = np.zeros((3, 3, len(axes)))
        for root, form, image, value, p in zip(
            self._roots,
            self._forms,
            images * scale,
            values * scale**2,
            self._exponents,
            strict=True,
        ):
            safe = np.where(value > 0.0, value, np.inf)
            weight = 2.0 * p * np.power(safe, p - 1.0)
            part = root.T @ image
            gradient += weight * part
            curvature = (2.0 * p - 2.0) / safe * part[:, np.newaxis] * part
            hessian += weight * (form[:, :, np.newaxis] + curvature)
        return Corners.of_norms(axes * scale[:, np.newaxis], roots, gradient, hessian)
