# SPDX-License-Identifier: Apache-2.0
"""What fit_surface and fit_catalogue share: the options of a fit, and the fit of one input."""

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
from limit_surface_ros.files.surface_file import LARGEST_SCALE, SurfaceModel
from limit_surface_ros.fitting.description import Description, describe_fit
from limit_surface_ros.fitting.dissipation import FITTED_ON, fit_dissipation
from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.few_pushes.calibration import squared_residuals
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.fitting.polynomial import fit_polynomial
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.result import FitResult, errors_on
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.fitting.second_approximation import fit_second_approximation
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.dissipation_scatter import region_quantile
from limit_surface_ros.surface.kinds.power_sum import thesis_exponents
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools.common.bag_options import add_bag_options
from limit_surface_ros.tools.common.csv_options import add_cell_options, cell_options
from limit_surface_ros.tools.common.options import check_ranges
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
    from concurrent.futures import Executor
    from pathlib import Path

    from limit_surface_ros.fitting.search import Progress
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.tools.common.training_data import TrainingData


# What numbers the fit takes: the upper ends keep a slip of the keyboard from filling the memory.
RANGES = {
    "seed": (0, 2**63 - 1),
    "motions": (1, 1_000_000),
    "facet_loads": (0, 100_000),
    "friction_coefficient": (1e-6, 1e6),
    "normal_force": (1.0 / LARGEST_SCALE, LARGEST_SCALE),
    "load_noise": (0.0, 1e6),
    "motion_noise": (0.0, 1e6),
    "characteristic_length": (1.0 / LARGEST_SCALE, LARGEST_SCALE),
    "terms": (1, 1000),
    "velocity_weight": (0.0, 1e12),
    "starts": (1, 1_000_000),
    "folds": (2, 1000),
    "bootstrap": (0, 100_000),
}
VELOCITY_WEIGHT = 1.0
# Mean angle on its own data [deg] beyond which a model is none of them.
WRONG_ANGLE = 25.0
# Frame of a model whose data state none.
DEFAULT_FRAME = "object"
# The kind that needs no fit.
EXACT = "exact"
# Terms where none are asked for, of a contact's dissipation and of all else: a patch is met within
# a degree by six, and one of two axes of symmetry within as much.
PATCH_TERMS, FEW_TERMS = 6, 3
# What each kind can be fitted by, the default first.
OBJECTIVES: dict[str, tuple[str, ...]] = {
    "power_sum": ("J2", "J1", "second"),
    "dissipation": FITTED_ON,
    "polynomial": ("least-squares", "convex"),
}


@dataclass(frozen=True)
class FittedModel:
    """A model ready to be written, and what is known of its fit.

    Attributes:
        model: The model.
        result: How it was fitted.
        description: Its size, what its data cover, and what looks like a slip.
        sureness: How far pushes scatter about its twists, in words; empty if that is not known.
    """

    model: SurfaceModel
    result: FitResult
    description: Description
    sureness: str = ""


def add_fit_options(parser: argparse.ArgumentParser) -> None:
    """Declare every option on which the fitted model depends, but for its name."""
    _add_data_options(parser.add_argument_group("data"))
    add_bag_options(parser)

    fit = parser.add_argument_group("fit")
    fit.add_argument(
        "--kind",
        choices=[EXACT, *OBJECTIVES],
        help="of surface; exact takes the support points as they are, a polynomial is of fourth "
        "order; default: exact for a contact of points unless another option of the fit is given, "
        "else dissipation for a contact, and power_sum for pushes",
    )
    fit.add_argument(
        "--terms",
        type=int,
        help="terms of the model; default: 6 of a dissipation of a contact, else 3",
    )
    fit.add_argument(
        "--family",
        choices=["norms", "thesis"],
        help="exponents of a power_sum: 1/2 for every term, which is always convex, or 1, "
        "(n-1)/n, ..., 1/n, of which those below 1/2 may bend it inward (default norms for a "
        "contact, thesis for pushes)",
    )
    fit.add_argument(
        "--objective",
        choices=[*OBJECTIVES["power_sum"], *FITTED_ON, *OBJECTIVES["polynomial"]],
        help="of a power_sum: J1 fits loads, J2 loads and motions, second is J2 of two terms with "
        "one by least squares inside (default J2); of a dissipation: forces, directions or both "
        "(default forces for contacts, directions for pushes); of a polynomial: least-squares on "
        "loads, or convex on loads and motions (default least-squares)",
    )
    fit.add_argument(
        "--velocity-weight",
        type=float,
        default=VELOCITY_WEIGHT,
        metavar="W",
        help="weight of the motions, in all but J1, forces and least-squares (%(default)s)",
    )
    fit.add_argument(
        "--starts",
        type=int,
        default=Search.starts,
        help="starts at most, half of them random, the others near the best so far (%(default)s)",
    )
    fit.add_argument("--seed", type=int, default=0, help="of all that is random (%(default)s)")

    few = parser.add_argument_group("few, noisy pushes")
    few.add_argument(
        "--auto",
        action="store_true",
        help="choose kind, terms, weight and the prior of the fit (the pressure on the "
        "ground that fits the pushes, or an ellipsoid) by cross-validation; leaves the options "
        "above aside",
    )
    few.add_argument(
        "--folds",
        type=int,
        default=5,
        help="of the cross-validation; at most one for each push (%(default)s)",
    )
    few.add_argument(
        "--support",
        action="store_true",
        help="let --auto use the support points that the pushes' first line states",
    )
    few.add_argument(
        "--bootstrap",
        type=int,
        default=0,
        metavar="N",
        help="refit N times with random weights of the pushes and store the surfaces, whose "
        "spread shows how sure a predicted twist is (with --auto)",
    )


def add_frame_option(parser: argparse.ArgumentParser) -> None:
    """Declare the frame of the models that a program writes."""
    parser.add_argument(
        "--frame-id", help=f"the model's frame; default: the contact's, or {DEFAULT_FRAME}"
    )


def _add_data_options(data: argparse._ArgumentGroup) -> None:
    data.add_argument(
        "--rows", help="rows of a CSV to fit, such as 0,3,10-14; others are held out"
    )
    add_cell_options(data)
    data.add_argument(
        "--anyway",
        action="store_true",
        help="fit to recorded pushes although their units, axes or signs are not those of a body",
    )
    data.add_argument(
        "--characteristic-length",
        type=float,
        metavar="M",
        help="makes moments and rotations comparable [m]; default: what the data state, or the "
        "ratio of moments to forces in them",
    )
    data.add_argument("--link", help="link of a URDF or SDF that stands on the ground")
    data.add_argument(
        "--friction-coefficient",
        type=float,
        metavar="MU",
        help="under the link; default: what the URDF or SDF states",
    )
    data.add_argument(
        "--normal-force",
        type=float,
        metavar="N",
        help="on the ground under the link [N]; default: the weight of its mass",
    )
    data.add_argument(
        "--motions", type=int, default=2000, help="random motions of a contact (%(default)s)"
    )
    data.add_argument(
        "--facet-loads",
        type=int,
        default=150,
        help="loads on each facet of a contact of a few points (%(default)s)",
    )
    for what, of in (("load", "each component's root mean square"), ("motion", "a unit motion")):
        data.add_argument(
            f"--{what}-noise",
            type=float,
            default=0.0,
            metavar="S",
            help=f"noise added to a contact's {what}s, in parts of {of} (%(default)s)",
        )


def check_fit_options(options: argparse.Namespace) -> None:
    """Refuse numbers that no fit takes, before there is any work.

    Raises:
        RangeError: One of them is out of its range; the message names the option.
    """
    check_ranges(options, RANGES)


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
    if options.auto:
        result = fit_automatically(
            data.training,
            scaling=scaling,
            support=support_of(options, data),
            folds=options.folds,
            refits=options.bootstrap,
            search=search,
        )
    else:
        result = fit_as_asked(options, data, scaling, search)
    return result if data.held_out is None else result.tested_on(data.held_out)


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


def kind_of(options: argparse.Namespace, recorded: bool, *, of_points: bool) -> str:
    """Return the kind of surface that the options ask for.

    Args:
        options: What is asked for.
        recorded: Whether the data are recorded pushes.
        of_points: Whether they are a contact of support points.
    """
    if options.kind is not None:
        return str(options.kind)
    if recorded or options.family is not None or options.objective in OBJECTIVES["power_sum"]:
        return "power_sum"
    return "dissipation" if not of_points or asks_for_a_fit(options) else EXACT


def asks_for_a_fit(options: argparse.Namespace) -> bool:
    """Tell whether an option is given that does nothing to an exact model."""
    given = {"terms", "family", "objective", "load_noise", "motion_noise"}
    changed = {"velocity_weight": VELOCITY_WEIGHT, "starts": Search.starts}
    return any(getattr(options, name) for name in given) or any(
        getattr(options, name) != default for name, default in changed.items()
    )


def terms_of(options: argparse.Namespace, kind: str, data: TrainingData) -> int:
    """Return the number of terms, that of the options or the usual one of the kind."""
    if options.terms is not None:
        return int(options.terms)
    if kind != "dissipation" or data.recorded:
        return FEW_TERMS
    points = len(data.support.points) if data.of_points and data.support else PATCH_TERMS
    return min(points, PATCH_TERMS)


def objective_of(options: argparse.Namespace, kind: str, recorded: bool) -> str:
    """Return the objective, by default the first of the kind's.

    Args:
        options: What is asked for.
        kind: Of surface, not exact.
        recorded: Whether the data are recorded pushes and not a contact.

    Raises:
        RangeError: The objective is none of the kind's.
    """
    accepted = OBJECTIVES[kind]
    if options.objective is None:
        on_pushes = kind == "dissipation" and recorded
        return "directions" if on_pushes else accepted[0]
    if options.objective not in accepted:
        raise RangeError(
            f"--objective {options.objective} is not for --kind {kind}, "
            f"which takes {', '.join(accepted)}"
        )
    return str(options.objective)


def support_of(options: argparse.Namespace, data: TrainingData) -> PointContacts | None:
    """Return the support points that a prior is made of, if the options ask for one."""
    if options.support and data.support is None:
        raise DataError(
            "--support: the input states no support points with their loads; a CSV states them in "
            'a first line # {"support_points_m_body_frame": [[x, y], ...], '
            '"support_loads_N": [load, ...]}'
        )
    return data.support if options.support else None


def sureness_of(model: SurfaceModel, data: TrainingData) -> str:
    """Return in words how far pushes scatter, and whether those that were held out do so."""
    uncertain = model.uncertain
    if uncertain is None or not isinstance(model.surface, Dissipation):
        return ""
    axes = np.degrees(uncertain.twist_with_covariance(data.training.wrenches).half_axes)
    large, small = np.median(axes, axis=0)
    text = f"9 of 10 pushes within {large:.0f} x {small:.0f} deg (median) of the prediction"
    if data.held_out is None:
        return text
    squares = squared_residuals(uncertain.scatter, model.surface, data.held_out)
    share = np.mean(squares <= region_quantile(0.9))
    return f"{text}; of those held out {100.0 * share:.0f} %"


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
