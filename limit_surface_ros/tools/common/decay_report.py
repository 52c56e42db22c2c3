# SPDX-License-Identifier: Apache-2.0
"""What a person is told of a fitted decay: its summary, and doubts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.checks import counted
from limit_surface_ros.decay.noise import resting_level
from limit_surface_ros.decay.outliers import onset_size, starts_alone
from limit_surface_ros.decay.targets import Record
from limit_surface_ros.tools.common.decay_fit import between, beyond

if TYPE_CHECKING:
    from limit_surface_ros.decay.certify import LargestError
    from limit_surface_ros.decay.fit import DecayFit
    from limit_surface_ros.tools.common.decay_input import DecayInput

# Parts of the onset from which on a fit is doubted: what is left at the end, and the error.
_MOST_LEFT, _LARGE_ERROR = 0.9, 0.5
# Outliers whose times are printed.
_MOST_SHOWN = 8


def report(result: DecayFit, given: DecayInput) -> None:
    """Print the summary of a fit."""
    fit, choice = result.fit, result.choice
    chosen = ", ".join(
        f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in choice.parameters.items()
    )
    after = beyond(result, given)
    slowest = fit.sum.rates[int(np.argmax(fit.sum.rates.real))]
    where = "" if given.samples is None else f"at the {given.samples} samples "
    proof = "" if result.largest is None else f"; {proof_in_words(result.largest)}"
    rows = [
        ("response", given.source + (f" less {given.offset:.6g}" if given.offset else "")),
        *(("read", note) for note in given.notes),
        ("method", choice.method + (f" ({chosen})" if chosen else "")),
        ("terms", f"{fit.sum.terms} real ({len(fit.sum.rates)} rates)"),
        ("error", f"{fit.max_error:.4e} {where}on [0, {given.end:g}] s{proof}"),
    ]
    lines = between(result, given)
    if lines is not None:
        rows.append(("between", f"up to {lines:.4e} from the straight lines between samples"))
    if np.isfinite(fit.lower_bound):
        gap = (fit.grid_error - fit.lower_bound) / max(fit.grid_error, 1e-300)
        rows.append(
            (
                "optimal",
                f"{fit.norm}-norm {fit.grid_error:.4e} on the fit's grid; other coefficients "
                f"would lower it by {max(gap, 0.0):.1e} of itself at most",
            )
        )
    if result.noise:
        rows.append(("noise", f"{result.noise:.3g}, the standard deviation of a sample"))
    if len(result.outliers):
        rows.append(("outliers", outliers_in_words(result)))
    if result.terms_tried:
        rows.append(("tried", tried_in_words(result)))
    if fit.sum.constant:
        rows.append(("constant", f"{fit.sum.constant:.6g}, to which the sum decays"))
    if after is not None:
        rows.append(("beyond", f"{after:.4e} on [{given.end:g}, {given.horizon:g}] s"))
    if result.tail is not None:
        rows.append(("assumed", result.tail.assumption))
        rows.append(
            (
                "bound",
                f"the sum stays within {result.tail.bound:.4g} there, so that its error is at "
                f"most {result.tail.error:.4g}",
            )
        )
    rows.append(("right-most", f"{slowest.real:.4g} {slowest.imag:+.4g}i 1/s"))
    rows.append(("time", f"{result.seconds:.2f} s"))
    for label, value in rows:
        print(f"{label:<11} {value}")


def proof_in_words(largest: LargestError) -> str:
    """Return how far the largest error that was found is also proven."""
    if np.isfinite(largest.proven):
        return f"proven to be at most {largest.proven:.4e}"
    return f"found on {largest.points} points and refined near the highest, not proven"


def outliers_in_words(result: DecayFit) -> str:
    """Return how many samples were taken as outliers, and when the first of them were."""
    shown = ", ".join(f"{time:.6g}" for time in result.outliers[:_MOST_SHOWN])
    more = ", ..." if len(result.outliers) > _MOST_SHOWN else ""
    return f"{counted(len(result.outliers), 'sample')} left out, at {shown}{more} s"


def tried_in_words(result: DecayFit) -> str:
    """Return the numbers of terms that were compared, with their criterion."""
    least = min(tried.bic for tried in result.terms_tried)
    return "BIC above the least: " + ", ".join(
        f"{counted(tried.terms, 'term')} {tried.bic - least:.1f}" for tried in result.terms_tried
    )


def _onset_is_doubtful(result: DecayFit, given: DecayInput) -> bool:
    """Tell whether the first sample alone makes the onset that was fitted."""
    record = given.target
    if not isinstance(record, Record) or 0.0 in result.outliers:
        return False
    kept = ~np.isin(record.knots, result.outliers)
    values = record.values[kept] - result.fit.sum.constant
    return starts_alone(record.knots[kept], values, result.noise)


def doubts(result: DecayFit, given: DecayInput) -> list[str]:
    """Return why the fit may be no model of a decaying response, in one line each."""
    fit, found = result.fit, []
    onset = abs(float(given.target(0.0)))
    if isinstance(given.target, Record):
        onset = onset_size(given.target.knots, given.target.values, result.noise)
    left = abs(float(fit.sum(given.end))) / abs(float(fit.sum(0.0)) or onset)
    if left > _MOST_LEFT:
        found.append(
            f"the fitted sum does not decay: at {given.end:g} s it is {left:.3g} times its onset"
        )
    if fit.max_error > _LARGE_ERROR * onset:
        found.append(
            f"the error is {fit.max_error / onset:.3g} times the onset: "
            "too few terms, or no decaying response"
        )
    if _onset_is_doubtful(result, given):
        found.append(
            f"the first sample, {float(given.target(0.0)):.4g}, is kept, but no other bears it "
            "out: a stray one, or a term that is gone with the second? If it is stray, "
            "begin after it with --start"
        )
    level = None
    if isinstance(given.target, Record):
        level = resting_level(given.target, given.end)
    if level is not None:
        found.append(
            f"the record ends at about {level:.3g}: is that an offset, such as a sensor's bias? "
            "Then take it away with --offset auto; a load does not die away to it"
        )
    return found
