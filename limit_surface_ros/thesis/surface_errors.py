# SPDX-License-Identifier: Apache-2.0
"""Figures 3.9 to 3.12: how far the fits are off, on clean and on noisy data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.plots.canvas import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    new_figure,
)
from limit_surface_ros.plots.distributions import draw_distribution, frame_distributions
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.measures import (
    empirical_distribution,
    force_error,
    quantiles,
    velocity_error,
)
from limit_surface_ros.surface.sampling import random_directions
from limit_surface_ros.thesis.findings import Claim, Findings, Study
from limit_surface_ros.thesis.fits import Fit, body_of, fitted, test_pairs

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

TERMS = ("thesis1", "thesis2", "thesis3", "thesis4")
PEER = "polynomial"
BEYOND = ("norms3", "norms4", "dissipation4")
BODY_NAMES = {"three_points": "three points", "whole_face": "whole face"}
_COLOURS = {
    "thesis1": BLUE,
    "thesis2": VERMILION,
    "thesis3": GREEN,
    "thesis4": PURPLE,
    "second": SKY,
    PEER: BLACK,
    "norms3": SKY,
    "norms4": ORANGE,
    "dissipation4": BLACK,
}
_DASHES = {"J1": "--", "J2": "-"}


class Errors:
    """Errors of motion and of load of a set of fits, sorted.

    Args:
        fits: The fits.
        store: Where they are.

    Attributes:
        dented: Share of the directions of load in which a fit is not convex.
        velocity: Errors of unit twists by fit, sorted.
        force: Errors of load by fit, sorted.
    """

    def __init__(self, fits: Sequence[Fit], store: Store) -> None:
        """Measure every fit on fresh motions and in every direction of load."""
        settings = store.settings
        directions = random_directions(settings.directions, settings.seed + 2000)
        self.dented: dict[Fit, float] = {}
        self.velocity: dict[Fit, Floats] = {}
        self.force: dict[Fit, Floats] = {}
        for fit in fits:
            surface = fitted(fit, store)
            pairs = test_pairs(fit.body, fit.noisy, settings)
            self.dented[fit] = is_convex(surface).dented_share
            self.velocity[fit] = np.sort(velocity_error(surface, pairs))
            self.force[fit] = np.sort(force_error(surface, body_of(fit.body), directions))

    def table(self, which: str) -> dict[str, Floats]:
        """Return the sorted errors, "velocity" or "force", with the share of no larger ones."""
        errors: dict[Fit, Floats] = getattr(self, which)
        _, shares = empirical_distribution(next(iter(errors.values())))
        return {"share": shares, **{fit.label: values for fit, values in errors.items()}}


def thesis_fits(body: str, noisy: bool = False) -> list[Fit]:
    """Return the fits that the thesis's own figure compares."""
    fits = [Fit(body, family, objective, noisy) for objective in ("J1", "J2") for family in TERMS]
    return [*fits, Fit(body, "second", "J1", noisy), Fit(body, PEER, "J1", noisy)]


def beyond_fits(body: str, noisy: bool = False) -> list[Fit]:
    """Return the best of the thesis and what goes beyond it."""
    families = ("thesis1", "thesis4", *BEYOND)
    return [Fit(body, family, "J2", noisy) for family in families]


def error_study(body: str, noisy: bool) -> Callable[[Settings, Store], Findings]:
    """Return the study of Figure 3.9, 3.10, 3.11 or 3.12."""

    def study(settings: Settings, store: Store) -> Findings:
        errors = Errors(thesis_fits(body, noisy), store)
        beyond = Errors(beyond_fits(body, noisy), store)
        if noisy:
            claims = noisy_claims(body, errors, Errors(thesis_fits(body), store))
        else:
            claims = {"three_points": point_claims, "whole_face": face_claims}[body](errors)
        return Findings(
            {"thesis": draw_errors(errors), "beyond": draw_errors(beyond)},
            {
                "velocity": errors.table("velocity"),
                "force": errors.table("force"),
                "beyond_velocity": beyond.table("velocity"),
                "beyond_force": beyond.table("force"),
                "quantiles": quantile_table(errors, beyond),
            },
            claims,
            (
                f"Noise of standard deviation {settings.noise:g} on loads and on unit motions. "
                if noisy
                else ""
            )
            + _convexity(errors, beyond),
        )

    return study


def point_claims(errors: Errors) -> tuple[Claim, ...]:
    """Judge what the text says of three points."""
    v, f = _medians(errors.velocity), _medians(errors.force)
    body = "three_points"
    peer = Fit(body, PEER, "J1")
    return (
        *_common_claims(body, errors),
        _beats_peer(body, v, "motion", TERMS, most=1),
        Claim(
            "With one term the errors of load are poor.",
            f"Medians with 1 and 2 terms: J1 {f[Fit(body, 'thesis1', 'J1')]:.3f}, "
            f"{f[Fit(body, 'thesis2', 'J1')]:.3f}; J2 {f[Fit(body, 'thesis1')]:.3f}, "
            f"{f[Fit(body, 'thesis2')]:.3f}.",
            all(
                f[Fit(body, "thesis1", o)] > 1.2 * f[Fit(body, "thesis2", o)] for o in ("J1", "J2")
            ),
        ),
        Claim(
            "Higher orders give much smaller errors of load than the polynomial.",
            f"Medians with 2, 3, 4 terms: J1 {_row(f, body, TERMS[1:], 'J1')}, "
            f"J2 {_row(f, body, TERMS[1:], 'J2')}; polynomial {f[peer]:.3f}.",
            all(
                f[Fit(body, family, o)] < 0.8 * f[peer]
                for family in TERMS[1:]
                for o in ("J1", "J2")
            ),
            any(
                f[Fit(body, family, o)] < 0.8 * f[peer]
                for family in TERMS[1:]
                for o in ("J1", "J2")
            ),
        ),
    )


def face_claims(errors: Errors) -> tuple[Claim, ...]:
    """Judge what the text says of the whole face."""
    v, f = _medians(errors.velocity), _medians(errors.force)
    body = "whole_face"
    peer = Fit(body, PEER, "J1")
    return (
        *_common_claims(body, errors),
        Claim(
            "In motion the polynomial does better than one term by J1, and all others do better "
            "than the polynomial.",
            f"Medians with 1 to 4 terms: J1 {_row(v, body, TERMS, 'J1')}, "
            f"J2 {_row(v, body, TERMS, 'J2')}; polynomial {v[peer]:.3f}.",
            v[peer] < v[Fit(body, "thesis1", "J1")]
            and all(
                v[Fit(body, family, o)] < v[peer]
                for family in TERMS
                for o in ("J1", "J2")
                if (family, o) != ("thesis1", "J1")
            ),
            v[peer] < v[Fit(body, "thesis1", "J1")],
        ),
        Claim(
            "In load J1 does much better than J2.",
            f"Medians with 1 to 4 terms: J1 {_row(f, body, TERMS, 'J1')}, "
            f"J2 {_row(f, body, TERMS, 'J2')}.",
            all(f[Fit(body, k, "J1")] < 0.8 * f[Fit(body, k, "J2")] for k in TERMS),
            sum(f[Fit(body, k, "J1")] < 0.8 * f[Fit(body, k, "J2")] for k in TERMS) > 1,
        ),
        Claim(
            "In load, fits of more terms do better than the polynomial.",
            f"Medians with 2, 3, 4 terms: J1 {_row(f, body, TERMS[1:], 'J1')}; "
            f"polynomial {f[peer]:.3f}.",
            all(f[Fit(body, k, "J1")] < f[peer] for k in TERMS[1:]),
            any(f[Fit(body, k, "J1")] < f[peer] for k in TERMS[1:]),
        ),
    )


def noisy_claims(body: str, noisy: Errors, clean: Errors) -> tuple[Claim, ...]:
    """Judge what the text says of noisy data."""
    v, before = _medians(noisy.velocity), _medians(clean.velocity)
    f, f_before = _medians(noisy.force), _medians(clean.force)
    changes = [f[fit] - f_before[Fit(fit.body, fit.family, fit.objective)] for fit in f]
    claims = [
        Claim(
            "With noise the results do not change drastically.",
            f"The medians of the errors of load change by {min(changes):+.3f} to "
            f"{max(changes):+.3f}.",
            max(changes) < 0.1,
        )
    ]
    if body == "whole_face":
        ratios = [v[Fit(body, k, "J2", True)] / v[Fit(body, k, "J1", True)] for k in TERMS[1:]]
        clean_ratios = [before[Fit(body, k)] / before[Fit(body, k, "J1")] for k in TERMS[1:]]
        claims.append(
            Claim(
                "With noise J1 and J2 do equally well in motion, where J2 was better without.",
                "Median of J2 over that of J1 with 2, 3, 4 terms: "
                f"{_as_text(ratios)}; without noise {_as_text(clean_ratios)}.",
                all(0.8 < ratio < 1.25 for ratio in ratios) and max(clean_ratios) < 0.8,
            )
        )
    return tuple(claims)


def quantile_table(*groups: Errors) -> dict[str, list[float] | list[str]]:
    """Return median, 95 % and largest errors of every fit."""
    fits = {fit: errors for errors in groups for fit in errors.velocity}
    table: dict[str, list[float] | list[str]] = {"fit": [fit.label for fit in fits]}
    for which in ("velocity", "force"):
        rows = np.array([quantiles(getattr(errors, which)[fit]) for fit, errors in fits.items()])
        for column, level in enumerate(("50 %", "95 %", "100 %")):
            table[f"{which} {level}"] = rows[:, column].tolist()
    table["not convex in %"] = [100.0 * errors.dented[fit] for fit, errors in fits.items()]
    return table


def draw_errors(errors: Errors) -> Figure:
    """Draw both distributions, colour by family and dashes by objective."""
    with new_figure(7.5, 4.4) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        _draw(panels[0], errors.velocity, "error of motion |v - v̂| [-]")
        _draw(panels[1], errors.force, "error of load |f - f̂| [-]")
        panels[0].set_ylabel("share of cases [%]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw(axes: Axes, errors: Mapping[Fit, Floats], label: str) -> None:
    # The last percent may be far out and would squeeze the rest.
    end = 1.05 * max(float(np.quantile(values, 0.99)) for values in errors.values())
    for fit, values in errors.items():
        dashes = ":" if fit.family == PEER else _DASHES[fit.objective]
        style = {"color": _COLOURS[fit.family], "linestyle": dashes, "label": fit.label}
        draw_distribution(axes, values, end, **style)
    frame_distributions(axes, label, end)


def _convexity(*groups: Errors) -> str:
    """Say which fits are not convex, and where nothing has to be checked."""
    dented = {f.label: share for errors in groups for f, share in errors.dented.items() if share}
    if not dented:
        return "All fits are convex."
    shares = ", ".join(f"{label} {100.0 * share:.1f} %" for label, share in dented.items())
    return f"Not convex, in this share of the directions of load: {shares}. All others are convex."


def _common_claims(body: str, errors: Errors) -> tuple[Claim, ...]:
    v = _medians(errors.velocity)
    largest = [float(errors.velocity[Fit(body, k)][-1]) for k in TERMS]
    f = _medians(errors.force)
    two = f[Fit(body, "thesis2", "J1")]
    ratios = [f[Fit(body, k)] / two for k in TERMS[1:]]
    falling = [v[Fit(body, k)] for k in TERMS]
    return (
        Claim(
            "In motion J2 does better than J1.",
            f"Medians with 1 to 4 terms: J1 {_row(v, body, TERMS, 'J1')}, "
            f"J2 {_row(v, body, TERMS, 'J2')}.",
            all(v[Fit(body, k)] < v[Fit(body, k, "J1")] for k in TERMS),
        ),
        Claim(
            "With more terms J2 gets better, until all errors of motion are below 0.3.",
            f"Medians with 1 to 4 terms {_as_text(falling)}; largest {_as_text(largest)}.",
            falling == sorted(falling, reverse=True) and min(largest) < 0.3,
            falling == sorted(falling, reverse=True),
        ),
        Claim(
            "In load, J2 with more terms does about as well as J1 with two.",
            f"Medians of J2 with 2, 3, 4 terms over that of J1 with two: {_as_text(ratios)}.",
            all(0.75 < ratio < 1.33 for ratio in ratios),
            any(0.75 < ratio < 1.33 for ratio in ratios),
        ),
    )


def _beats_peer(
    body: str, medians: Mapping[Fit, float], what: str, families: Sequence[str], most: int
) -> Claim:
    peer = medians[Fit(body, PEER, "J1")]
    worse = [
        Fit(body, k, o).label
        for k in families
        for o in ("J1", "J2")
        if medians[Fit(body, k, o)] >= peer
    ]
    return Claim(
        f"Almost every fit has smaller errors of {what} than the polynomial of fourth order.",
        f"Medians with 1 to 4 terms: J1 {_row(medians, body, families, 'J1')}, "
        f"J2 {_row(medians, body, families, 'J2')}; polynomial {peer:.3f}"
        + (f". Not smaller: {'; '.join(worse)}." if worse else "."),
        len(worse) <= most,
    )


def _medians(errors: Mapping[Fit, Floats]) -> dict[Fit, float]:
    return {fit: float(np.median(values)) for fit, values in errors.items()}


def _row(medians: Mapping[Fit, float], body: str, families: Sequence[str], objective: str) -> str:
    return _as_text([medians[Fit(body, family, objective)] for family in families])


def _as_text(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def _study(number: str, body: str, noisy: bool) -> Study:
    fits = {fit.name for fit in (*thesis_fits(body, noisy), *beyond_fits(body, noisy))}
    if noisy:
        fits |= {fit.name for fit in thesis_fits(body)}
    title = f"Errors of the fits, {BODY_NAMES[body]}" + (", noisy data" if noisy else "")
    return Study(number, title, error_study(body, noisy), tuple(sorted(fits)))


STUDIES = (
    _study("3.9", "three_points", False),
    _study("3.10", "whole_face", False),
    _study("3.11", "three_points", True),
    _study("3.12", "whole_face", True),
)
