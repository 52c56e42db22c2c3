# SPDX-License-Identifier: Apache-2.0
"""The fits of chapter 3 and those beyond it: which body, which family, which objective."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.second_approximation import fit_second_approximation
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import facet_loads, random_motions
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.thesis import bodies

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.fitting.result import FitResult
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

# By name: the body, and whether its facets are large enough to be sampled.
BODIES: dict[str, tuple[Callable[[], PointContacts], bool]] = {
    "three_points": (bodies.three_points, True),
    "whole_face": (bodies.triangle_patch, False),
    "square": (bodies.square_patch, False),
    "ellipse": (bodies.ellipse_patch, False),
}
# J2 weighs the errors of motion as much as those of load, J1 not at all.
VELOCITY_WEIGHTS = {"J1": 0.0, "J2": 1.0}
# By name, between and beyond the two.
MORE_WEIGHTS = {f"w{weight:g}": weight for weight in (0.01, 0.03, 0.1, 0.3, 3.0)}
VELOCITY_WEIGHTS |= MORE_WEIGHTS
# The thesis's loads and lengths are near one as they are.
UNSCALED = Scaling()


@dataclass(frozen=True)
class Fit:
    """One fit.

    Attributes:
        body: Name of one of `BODIES`.
        family: Name of one of `FAMILIES`.
        objective: "J1", "J2", or one of `MORE_WEIGHTS`.
        noisy: Whether loads and motions carry noise.
    """

    body: str
    family: str
    objective: str = "J2"
    noisy: bool = False

    @property
    def name(self) -> str:
        """Of the model and its file."""
        return "_".join(
            [self.body, self.family, self.objective.lower(), *(["noisy"] if self.noisy else [])]
        )

    @property
    def label(self) -> str:
        """For legends."""
        name = LABELS[self.family]
        return name if self.family in LOADS_ALONE else f"{name}, {self.objective}"


def _thesis(terms: int) -> Callable[[Pairs, str, Search], FitResult]:
    def fit(pairs: Pairs, objective: str, search: Search) -> FitResult:
        return fit_power_sum(
            pairs,
            thesis_exponents(terms),
            velocity_weight=VELOCITY_WEIGHTS[objective],
            scaling=UNSCALED,
            search=search,
        )

    return fit


def _norms(terms: int) -> Callable[[Pairs, str, Search], FitResult]:
    def fit(pairs: Pairs, objective: str, search: Search) -> FitResult:
        return fit_power_sum(
            pairs,
            np.full(terms, 0.5),
            velocity_weight=VELOCITY_WEIGHTS[objective],
            scaling=UNSCALED,
            search=search,
        )

    return fit


def _dissipation(terms: int) -> Callable[[Pairs, str, Search], FitResult]:
    def fit(pairs: Pairs, objective: str, search: Search) -> FitResult:
        return fit_dissipation(pairs, terms, scaling=UNSCALED, search=search)

    return fit


def _polynomial(convex: bool) -> Callable[[Pairs, str, Search], FitResult]:
    def fit(pairs: Pairs, objective: str, search: Search) -> FitResult:
        return fit_polynomial(pairs, convex=convex, scaling=UNSCALED)

    return fit


def _second(pairs: Pairs, objective: str, search: Search) -> FitResult:
    weight = VELOCITY_WEIGHTS[objective]
    return fit_second_approximation(pairs, velocity_weight=weight, scaling=UNSCALED, search=search)


FAMILIES: dict[str, Callable[[Pairs, str, Search], FitResult]] = {
    **{f"thesis{terms}": _thesis(terms) for terms in (1, 2, 3, 4)},
    "second": _second,
    "polynomial": _polynomial(convex=False),
    "convex_polynomial": _polynomial(convex=True),
    **{f"norms{terms}": _norms(terms) for terms in (3, 4)},
    "dissipation4": _dissipation(4),
}
LABELS = {
    "thesis1": "1 term",
    **{f"thesis{terms}": f"{terms} terms" for terms in (2, 3, 4)},
    "second": "2nd approximation",
    "polynomial": "4th order polynomial",
    "convex_polynomial": "4th order polynomial, convex",
    **{f"norms{terms}": f"{terms} norms" for terms in (3, 4)},
    "dissipation4": "4 terms of dissipation",
}
# These are fitted to loads alone: an objective in their label would mislead.
LOADS_ALONE = ("polynomial", "convex_polynomial", "dissipation4")


@cache
def body_of(name: str) -> PointContacts:
    """Return one of `BODIES`."""
    return BODIES[name][0]()


@cache
def training_pairs(name: str, noisy: bool, settings: Settings) -> Pairs:
    """Return the pairs that surfaces of a body are fitted to."""
    body = body_of(name)
    pairs = random_motions(body, settings.motions, settings.seed)
    if BODIES[name][1]:
        facets = facet_loads(body, settings.per_facet, settings.seed)
        pairs = Pairs(
            np.vstack([pairs.wrenches, facets.wrenches]), np.vstack([pairs.twists, facets.twists])
        )
    return _with_noise(pairs, settings, 0) if noisy else pairs


@cache
def test_pairs(name: str, noisy: bool, settings: Settings) -> Pairs:
    """Return fresh motions of a body, which no fit has seen."""
    pairs = random_motions(body_of(name), settings.tests, settings.seed + 1000)
    return _with_noise(pairs, settings, 1) if noisy else pairs


def fitted(fit: Fit, store: Store) -> LimitSurface:
    """Return a fitted surface, from the store if it is there."""
    return fitted_model(fit, store).surface


def fitted_model(fit: Fit, store: Store) -> SurfaceModel:
    """Return a fitted surface with what its file says of the fit."""

    def make() -> SurfaceModel:
        pairs = training_pairs(fit.body, fit.noisy, store.settings)
        search = Search(store.settings.starts, store.settings.seed, store.executor)
        result = FAMILIES[fit.family](pairs, fit.objective, search)
        return SurfaceModel(fit.name, result.surface, fit=result.summary())

    return store.surface(fit.name, make)


def _with_noise(pairs: Pairs, settings: Settings, stream: int) -> Pairs:
    """Return pairs with normal noise on loads and on unit twists."""
    rng = np.random.default_rng([settings.seed, 7, stream])
    twists = pairs.twists / np.linalg.norm(pairs.twists, axis=1, keepdims=True)
    return Pairs(
        pairs.wrenches + settings.noise * rng.standard_normal(pairs.wrenches.shape),
        twists + settings.noise * rng.standard_normal(twists.shape),
    )
