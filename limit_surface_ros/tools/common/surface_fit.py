# SPDX-License-Identifier: Apache-2.0
"""The fit of one input, as the options ask for it: what fit_surface and fit_catalogue share."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.checks import counted
from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.files.body_file import read_body
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.fitting.description import Description, describe_fit
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.calibration import held_out_levels, inside_regions
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.second_approximation import fit_second_approximation
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import scatter_of
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools.common.csv_options import cell_options
from limit_surface_ros.tools.common.fit_options import (
    DEFAULT_FRAME,
    EXACT,
    FEW_TERMS,
    PATCH_TERMS,
    kind_of,
    objective_of,
)
from limit_surface_ros.tools.common.training_data import (
    BAG,
    BODY,
    CONTACT,
    Simulation,
    check_input,
    check_scaling,
    checked,
    naming,
    training_data_of_bag,
    training_data_of_contact,
    training_data_of_pushes,
)

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Executor
    from pathlib import Path

    from limit_surface_ros.fitting.search import Progress
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.tools.common.training_data import TrainingData


# Mean angle on its own data [deg] beyond which a model is none of them.
WRONG_ANGLE = 25.0
# Where a model file tells how many pushes its regions hold, of the folds and of held-out rows.
CALIBRATION, HELD_OUT_CALIBRATION = "calibration", "held_out_calibration"
# Regions of which the report tells.
TOLD_REGIONS = (0.5, 0.9, 0.95)


@dataclass(frozen=True)
class FittedModel:
    """A model ready to be written, and what is known of its fit.

    Attributes:
        model: The model.
        result: How it was fitted.
        description: Its size, what its data cover, and what looks like a slip.
        sureness: How far pushes scatter about its twists, lines of a label and a text; none if
            that is not known.
    """

    model: SurfaceModel
    result: FitResult
    description: Description
    sureness: Sequence[tuple[str, str]] = ()


def fit_model(
    path: Path,
    name: str | None,
    options: argparse.Namespace,
    default_name: str,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> FittedModel:
    """Read an input and fit what the options ask for.

    Args:
        path: A contact file, recorded pushes or a bag.
        name: The model's name; that of the contact if not given.
        options: What `add_fit_options` and `add_frame_option` declare.
        default_name: The model's name where the input states none either.
        executor: Where starts run; here and one by one if not given.
        progress: Called with (starts done, starts at most) after each.

    Raises:
        FileError: The input is absent or not valid.
        LimitSurfaceError: The data cannot support the fit, or an option is out of range.
    """
    data = read_input(path, options)
    with naming(path):
        result = fit(options, data, Search(options.starts, options.seed, executor, progress))
    model = SurfaceModel(
        name=name or data.name or default_name,
        surface=result.surface,
        frame_id=options.frame_id or data.frame_id or DEFAULT_FRAME,
        reference_point=data.reference_point,
        normal_force=data.normal_force,
        outline=data.outline,
    )
    description = describe_fit(
        result.surface,
        model.convexity,
        data.training,
        recorded=data.recorded,
        normal_force=data.normal_force,
    )
    doubts = (*data.doubts, *description.doubts, *doubts_of_errors(result))
    described = replace(description, doubts=doubts)
    fitted = replace(model, fit=provenance(options, data, result, described))
    return FittedModel(fitted, result, described, sureness_of(fitted, data))


def read_input(path: Path, options: argparse.Namespace) -> TrainingData:
    """Read or make the pairs that the input stands for.

    Raises:
        FileError: The input is absent or not valid.
        DataError: It is of no size that a model file takes, or has not the rows or topics that
            the options ask for; the message names the input.
    """
    kind = check_input(path)
    if kind == BAG:
        return checked(path, training_data_of_bag(path, options), options.anyway)
    if kind in (CONTACT, BODY):
        simulation = Simulation(
            options.motions,
            options.facet_loads,
            options.load_noise,
            options.motion_noise,
            options.seed,
        )
        contact = (
            read_contact(path)
            if kind == CONTACT
            else read_body(path, options.link, options.friction_coefficient, options.normal_force)
        )
        return training_data_of_contact(path, contact, simulation, options.characteristic_length)
    pushes = training_data_of_pushes(path, options.rows, cell_options(options))
    if options.reference_point is not None:
        x, y = options.reference_point
        pushes = replace(pushes, reference_point=(x, y))
    return checked(path, pushes, options.anyway)


def fit(options: argparse.Namespace, data: TrainingData, search: Search) -> FitResult:
    """Fit what the options ask for."""
    length = options.characteristic_length
    if length is None:
        length = data.characteristic_length
    scaling = scaling_of_pairs(data.training, length)
    if data.support is not None and not data.recorded:
        # A contact states its friction force; the loads of pushes only hint at it.
        scaling = Scaling(scaling.characteristic_length, data.support.scaling.friction_force)
    check_scaling(scaling)
    if not options.auto:
        result = fit_as_asked(options, data, scaling, search)
        return result if data.held_out is None else result.tested_on(data.held_out)
    result = fit_automatically(
        data.training,
        scaling=scaling,
        support=support_of(options, data),
        folds=options.folds,
        refits=options.bootstrap,
        search=search,
    )
    if data.held_out is None or not isinstance(result.surface, Dissipation):
        return result
    scatter = scatter_of(result.details["uncertainty"], result.surface)
    levels = held_out_levels(scatter, result.surface, data.held_out)
    details = {**result.details, HELD_OUT_CALIBRATION: inside_regions(levels)}
    return replace(result.tested_on(data.held_out), details=details)


def fit_as_asked(
    options: argparse.Namespace, data: TrainingData, scaling: Scaling, search: Search
) -> FitResult:
    """Fit the kind and the objective that the options name."""
    kind = kind_of(options, data.recorded, of_points=data.of_points)
    pairs, weight, terms = data.training, options.velocity_weight, terms_of(options, kind, data)
    if kind == EXACT:
        return exact_model(data)
    objective = objective_of(options, kind, data.recorded)
    if kind == "polynomial":
        convex = objective == "convex"
        return fit_polynomial(
            pairs,
            velocity_weight=weight if convex else 0.0,
            convex=convex,
            scaling=scaling,
            symmetry=data.symmetry,
        )
    if kind == "dissipation":
        return fit_dissipation(
            pairs,
            terms,
            fitted_on=objective,
            velocity_weight=weight,
            scaling=scaling,
            search=search,
            symmetry=data.symmetry,
        )
    # On few real pushes the thesis's exponents err less; where they bend inward, the fit warns.
    family = options.family or ("thesis" if data.recorded else "norms")
    if objective == "second":
        return fit_second_approximation(
            pairs, velocity_weight=weight, scaling=scaling, search=search
        )
    return fit_power_sum(
        pairs,
        thesis_exponents(terms) if family == "thesis" else np.full(terms, 0.5),
        velocity_weight=0.0 if objective == "J1" else weight,
        scaling=scaling,
        search=search,
        symmetry=data.symmetry,
    )


def exact_model(data: TrainingData) -> FitResult:
    """Return the contact's own support points as a result: nothing is fitted, the error is 0.

    Raises:
        RangeError: The data are recorded pushes.
    """
    if data.recorded or data.support is None:
        raise RangeError("--kind exact is for contacts: pushes do not say where a body stands")
    points = len(data.support.points)
    what = counted(points, "support point" if data.of_points else "cell")
    return FitResult(
        surface=data.support,
        objective=f"exact: the {what} of the contact",
        cost=0.0,
        start_costs=(0.0,),
        iterations=0,
        gradient_norm=0.0,
        converged=True,
        wall_time=0.0,
        training=errors_on(data.support, data.training),
    )


def terms_of(options: argparse.Namespace, kind: str, data: TrainingData) -> int:
    """Return the number of terms, that of the options or the usual one of the kind."""
    if options.terms is not None:
        return int(options.terms)
    if kind != "dissipation" or data.recorded:
        return FEW_TERMS
    points = len(data.support.points) if data.of_points and data.support else PATCH_TERMS
    return min(points, PATCH_TERMS)


def support_of(options: argparse.Namespace, data: TrainingData) -> PointContacts | None:
    """Return the support points that a prior is made of, if the options ask for one."""
    if options.support and data.support is None:
        raise DataError(
            "--support: the input states no support points with their loads; a CSV states them in "
            'a first line # {"support_points_m_body_frame": [[x, y], ...], '
            '"support_loads_N": [load, ...]}'
        )
    return data.support if options.support else None


def sureness_of(model: SurfaceModel, data: TrainingData) -> list[tuple[str, str]]:
    """Return how far pushes scatter, and how many of those not seen the regions hold."""
    uncertain = model.uncertain
    if uncertain is None or not isinstance(model.surface, Dissipation):
        return []
    axes = np.degrees(uncertain.twist_with_covariance(data.training.wrenches).half_axes)
    large, small = np.median(axes, axis=0)
    text = f"9 of 10 pushes within {large:.0f} x {small:.0f} deg (median) of the prediction"
    lines = [("scatter", text)]
    if CALIBRATION in model.fit:
        lines.append((CALIBRATION, shares_in_words(model.fit[CALIBRATION])))
    if HELD_OUT_CALIBRATION in model.fit:
        lines.append(
            ("", f"{shares_in_words(model.fit[HELD_OUT_CALIBRATION])}, of those held out")
        )
    return lines


def shares_in_words(calibration: Mapping[str, Any]) -> str:
    """Return which shares of the pushes that a fit did not see lie inside of its regions."""
    inside = dict(zip(calibration["regions"], calibration["inside"], strict=True))
    told, found = (
        " / ".join(f"{100.0 * share:.0f}" for share in shares)
        for shares in (TOLD_REGIONS, [inside[region] for region in TOLD_REGIONS])
    )
    pushes = counted(calibration["pushes"], "push")
    return f"{told} % regions hold {found} % of {pushes} not seen"


def doubts_of_errors(result: FitResult) -> list[str]:
    """Return why the errors of a fit say that it is no model of its data, sentences."""
    angle = np.degrees(result.training.mean_angle)
    if angle < WRONG_ANGLE:
        return []
    return [
        f"the model misses its own data by {angle:.0f} deg in the mean, where pushes scatter by 5 "
        "to 15: are wrench and twist in one frame, about one point, in the columns' units?"
    ]


def provenance(
    options: argparse.Namespace, data: TrainingData, result: FitResult, description: Description
) -> dict[str, Any]:
    """Return how the model came about, for its file."""
    return {
        **data.about,
        **result.summary(),
        "description": description.summary(),
        "seed": options.seed,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "version": __version__,
    }
