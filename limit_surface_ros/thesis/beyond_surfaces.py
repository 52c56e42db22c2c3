# SPDX-License-Identifier: Apache-2.0
"""What chapter 3 leaves open: the weight of motions against noise, convex polynomials, minima."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import MissingExtraError
from limit_surface_ros.plots.canvas import BLACK, BLUE, GREEN, VERMILION, new_figure
from limit_surface_ros.plots.distributions import draw_distribution, frame_distributions
from limit_surface_ros.plots.surface_view import draw_section
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.surface.measures import force_error, mean_angle, velocity_error
from limit_surface_ros.surface.sampling import random_directions
from limit_surface_ros.thesis.findings import Claim, Findings, Study
from limit_surface_ros.thesis.fits import (
    VELOCITY_WEIGHTS,
    Fit,
    body_of,
    fitted,
    fitted_model,
    test_pairs,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.thesis.findings import Table
    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

BODIES = {"three_points": "three points", "whole_face": "whole face"}
# The thesis's family and one that is convex, with as many terms.
WEIGHED = "thesis3"
OBJECTIVES = sorted(VELOCITY_WEIGHTS, key=lambda name: VELOCITY_WEIGHTS[name])
POLYNOMIALS = ("polynomial", "convex_polynomial")
MANY = ("thesis1", "thesis2", "thesis3", "thesis4")


def weights(settings: Settings, store: Store) -> Findings:
    """Errors of three terms by the weight of the motions, with clean and with noisy data."""
    rows = {
        (body, noisy): np.array([_medians(body, name, noisy, store) for name in OBJECTIVES])
        for body in BODIES
        for noisy in (False, True)
    }
    # Where a weight of 0 would be on an axis of powers of ten, it stands at a third of the next.
    scale = np.array([VELOCITY_WEIGHTS[name] for name in OBJECTIVES])
    best = {key: OBJECTIVES[int(np.argmin(errors[:, 0]))] for key, errors in rows.items()}
    j2 = OBJECTIVES.index("J2")
    gains = {
        key: float(errors[:, 0].min() / errors[j2, 0]) for key, errors in rows.items() if key[1]
    }
    claim = Claim(
        "A factor on the errors of motion takes care of what J2 makes of noise.",
        "Best factor for motions, clean and noisy: "
        + "; ".join(
            f"{name} {VELOCITY_WEIGHTS[best[body, False]]:g} and "
            f"{VELOCITY_WEIGHTS[best[body, True]]:g}"
            for body, name in BODIES.items()
        )
        + ". With noise it takes the median error of motion to "
        + ", ".join(f"{100.0 * gain:.0f} %" for gain in gains.values())
        + " of that of J2.",
        all(gain < 0.95 for gain in gains.values()),
        any(gain < 0.95 for gain in gains.values()),
    )
    table: dict[str, Floats] = {"weight": scale}
    for (body, noisy), errors in rows.items():
        name = f"{BODIES[body]}, {'noisy' if noisy else 'clean'}"
        table[f"motion, {name}"], table[f"load, {name}"] = errors.T
    return Findings(
        {"weights": _draw_weights(scale, rows)},
        {"weights": table},
        (claim,),
        f"Three terms; noise of {settings.noise:g} on the data that are fitted. Errors are "
        "measured against the exact body, without noise.",
        captions={"weights": "Median errors by the weight of the errors of motion"},
    )


def polynomials(settings: Settings, store: Store) -> Findings:
    """The polynomial of least squares, which may bend inward, beside the convex one."""
    fits = {body: [Fit(body, family, "J1") for family in POLYNOMIALS] for body in BODIES}
    dented = {
        body: 100.0 * is_convex(fitted(fits[body][0], store)).dented_share for body in BODIES
    }
    claims = [
        Claim(
            "The polynomial of fourth order that is fitted by least squares is convex.",
            "It bends inward in this share of the directions of load: "
            + ", ".join(f"{name} {dented[body]:.1f} %" for body, name in BODIES.items())
            + ".",
            not any(dented.values()),
            not all(dented.values()),
        )
    ]
    try:
        errors = {fit: _errors(fit, store) for body in BODIES for fit in fits[body]}
    except MissingExtraError as error:
        return Findings({}, {}, tuple(claims), f"The convex polynomial is left out: {error}")
    medians = {fit: [float(np.median(each)) for each in pair] for fit, pair in errors.items()}
    claims.append(
        Claim(
            "The fractional terms do better than the convex polynomial of fourth order.",
            "Median errors of motion and load, convex polynomial, then two, three terms by J2: "
            + "; ".join(
                f"{name} "
                + ", ".join(
                    f"{motion:.3f} / {load:.3f}"
                    for motion, load in (medians[fits[body][1]], *_rivals(body, store))
                )
                for body, name in BODIES.items()
            )
            + ".",
            all(
                motion < medians[fits[body][1]][0] and load < medians[fits[body][1]][1]
                for body in BODIES
                for motion, load in _rivals(body, store)
            ),
            any(
                motion < medians[fits[body][1]][0]
                for body in BODIES
                for motion, load in _rivals(body, store)
            ),
        )
    )
    shapes = {
        body: {
            "exact": body_of(body),
            "least squares": fitted(fits[body][0], store),
            "convex": fitted(fits[body][1], store),
        }
        for body in BODIES
    }
    with new_figure(7.5, 5.2) as figure:
        panels = figure.subplots(2, 3)
        for row, (body, compared) in zip(panels, shapes.items(), strict=True):
            for axes, components in zip(row, ((0, 1), (0, 2), (1, 2)), strict=True):
                draw_section(axes, compared, components)
            row[0].set_title(f"{BODIES[body]}, {row[0].get_title()}")
        panels[0, 0].legend(loc="center")
    table = {
        f"{BODIES[fit.body]}, {fit.family}, {what}": np.sort(values)[: settings.directions]
        for fit, pair in errors.items()
        for what, values in zip(("motion", "load"), pair, strict=True)
    }
    least = min(len(values) for values in table.values())
    return Findings(
        {"sections": figure, "errors": _draw_errors(errors)},
        {"errors": {name: values[:least] for name, values in table.items()}},
        tuple(claims),
        "The convex polynomial is a sum of squares, found by a semidefinite program as Zhou, "
        "Paolini, Bagnell and Mason (2016) do.",
        captions={"sections": "Sections", "errors": "Errors of motion and of load"},
    )


def minima(settings: Settings, store: Store) -> Findings:
    """How many minima the starts of a fit find, and how good two or three terms are."""
    rows = {}
    angles = {}
    for body in BODIES:
        for family in MANY:
            for objective in ("J1", "J2"):
                fit = Fit(body, family, objective)
                model = fitted_model(fit, store)
                costs = np.array(model.fit["start_costs"])
                rows[fit] = (len(costs), _distinct(costs), float(costs[-1] / costs[0]))
                angles[fit] = float(
                    np.degrees(mean_angle(model.surface, test_pairs(body, False, settings)))
                )
    several = [fit for fit, (_, count, _) in rows.items() if count > 1]
    worst = max(rows.values(), key=lambda row: row[2])
    # The thesis calls it excellent; a degree is what cameras see.
    good = {fit: angles[fit] for fit in angles if fit.family in ("thesis2", "thesis3")}
    claims = (
        Claim(
            "The fits have several local minima.",
            f"In {len(several)} of {len(rows)} fits up to {max(r[0] for r in rows.values())} "
            f"starts end in more than one minimum, the worst in one {worst[2]:.2g} times as high "
            "as the best.",
            2 * len(several) > len(rows),
            bool(several),
        ),
        Claim(
            "With two or three matrices the fit is excellent.",
            "Mean angle between motions with two and three terms by J2: "
            + "; ".join(
                f"{name} {angles[Fit(body, 'thesis2')]:.1f} and "
                f"{angles[Fit(body, 'thesis3')]:.1f} deg"
                for body, name in BODIES.items()
            )
            + "; with one "
            + ", ".join(f"{angles[Fit(body, 'thesis1')]:.1f} deg" for body in BODIES)
            + ".",
            max(good.values()) < 2.0,
            min(good.values()) < 2.0,
        ),
    )
    table: Table = {
        "fit": [f"{BODIES[fit.body]}, {fit.label}" for fit in rows],
        "starts": [row[0] for row in rows.values()],
        "minima": [row[1] for row in rows.values()],
        "worst over best": [row[2] for row in rows.values()],
        "mean angle [deg]": list(angles.values()),
    }
    return Findings({}, {"minima": table}, claims)


def _medians(body: str, objective: str, noisy: bool, store: Store) -> tuple[float, float]:
    motion, load = _errors(Fit(body, WEIGHED, objective, noisy), store)
    return float(np.median(motion)), float(np.median(load))


def _errors(fit: Fit, store: Store) -> tuple[Floats, Floats]:
    """Return the errors of motion and of load of a fit, against the exact body."""
    surface, settings = fitted(fit, store), store.settings
    directions = random_directions(settings.directions, settings.seed + 2000)
    return (
        velocity_error(surface, test_pairs(fit.body, False, settings)),
        force_error(surface, body_of(fit.body), directions),
    )


def _rivals(body: str, store: Store) -> list[tuple[float, float]]:
    found = []
    for family in ("thesis2", "thesis3"):
        motion, load = _errors(Fit(body, family), store)
        found.append((float(np.median(motion)), float(np.median(load))))
    return found


def _distinct(costs: Floats) -> int:
    """Return how many costs differ by more than a thousandth, the costs rising."""
    return 1 + int(np.count_nonzero(np.diff(np.sort(costs)) > 1e-3 * costs.min()))


def _draw_weights(scale: Floats, rows: Mapping[tuple[str, bool], Floats]) -> Figure:
    places = np.where(scale > 0.0, scale, scale[1] / 3.0)
    with new_figure(7.0, 5.0) as figure:
        panels = figure.subplots(2, 2, sharex=True)
        for column, (body, name) in enumerate(BODIES.items()):
            for row, what in enumerate(("motion", "load")):
                axes = panels[row, column]
                for noisy, color, style in ((False, BLUE, "o-"), (True, VERMILION, "s--")):
                    label = "noisy data" if noisy else "clean data"
                    values = rows[body, noisy][:, row]
                    axes.semilogx(places, values, style, color=color, label=label, markersize=4)
                axes.set_ylim(bottom=0.0)
                if not column:
                    axes.set_ylabel(f"error of {what} [-]")
                if not row:
                    axes.set_title(name)
                else:
                    axes.set_xticks(places, labels=[f"{weight:g}" for weight in scale])
                    axes.set_xticks([], minor=True)
                    axes.set_xlabel("weight of the errors of motion")
        panels[0, 0].legend()
    return figure


def _draw_errors(errors: Mapping[Fit, tuple[Floats, Floats]]) -> Figure:
    with new_figure(7.5, 5.4) as figure:
        panels = figure.subplots(2, 2, sharey=True)
        for row, (body, name) in zip(panels, BODIES.items(), strict=True):
            chosen = {fit: pair for fit, pair in errors.items() if fit.body == body}
            for column, what in enumerate(("motion |v - v̂|", "load |f - f̂|")):
                end = 1.05 * max(np.quantile(pair[column], 0.99) for pair in chosen.values())
                for fit, pair in chosen.items():
                    convex = fit.family == "convex_polynomial"
                    draw_distribution(
                        row[column],
                        pair[column],
                        end,
                        color=GREEN if convex else BLACK,
                        linestyle="-" if convex else ":",
                        label="convex" if convex else "least squares",
                    )
                frame_distributions(row[column], f"error of {what} [-]", end)
                row[column].set_title(name)
            row[0].set_ylabel("share of cases [%]")
        panels[0, 0].legend(loc="lower right")
    return figure


def _needs(*fits: Fit) -> tuple[str, ...]:
    return tuple(sorted({fit.name for fit in fits}))


STUDIES = (
    Study(
        "B.3",
        "The weight of motions against noise",
        weights,
        _needs(
            *(
                Fit(body, WEIGHED, name, noisy)
                for body in BODIES
                for name in OBJECTIVES
                for noisy in (False, True)
            )
        ),
    ),
    Study(
        "B.4",
        "The convex polynomial beside least squares",
        polynomials,
        _needs(
            *(Fit(body, family, "J1") for body in BODIES for family in POLYNOMIALS),
            *(Fit(body, family) for body in BODIES for family in ("thesis2", "thesis3")),
        ),
    ),
    Study(
        "B.5",
        "Minima, and how good few terms are",
        minima,
        _needs(
            *(Fit(body, family, o) for body in BODIES for family in MANY for o in ("J1", "J2"))
        ),
    ),
)
