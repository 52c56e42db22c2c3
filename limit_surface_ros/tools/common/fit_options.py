# SPDX-License-Identifier: Apache-2.0
"""The options of a fit, and which of them count for which inputs and kinds; others are refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.surface_file import LARGEST_SCALE
from limit_surface_ros.fitting.dissipation import FITTED_ON
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.tools.common.bag_options import OF_BAGS, add_bag_options
from limit_surface_ros.tools.common.csv_options import OF_CELLS, add_cell_options
from limit_surface_ros.tools.common.options import check_ranges, refuse_unused
from limit_surface_ros.tools.common.training_data import BAG, BODY, CONTACT, PUSHES

if TYPE_CHECKING:
    import argparse
    from collections.abc import Collection

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
OF_CONTACTS = ("motions", "facet_loads", "load_noise", "motion_noise")
OF_INPUTS = {
    BODY: ("link", "friction_coefficient", "normal_force"),
    PUSHES: ("rows", "reference_point", *OF_CELLS),
    BAG: OF_BAGS,
}
CHOSEN_BY_AUTO = ("kind", "terms", "family", "objective", "velocity_weight", "starts")
OF_AUTO = ("folds", "support", "bootstrap")
# Objectives that look at loads alone.
WITHOUT_MOTIONS = {"J1", "forces", "least-squares"}


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
        help="mix models of the pressure on the ground that fits the pushes, of three free terms "
        "and an ellipsoid, and tell by cross-validation how sure that is; leaves the options "
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
        "--reference-point",
        type=float,
        nargs=2,
        metavar=("X", "Y"),
        help="where in the model's frame the point is that the pushes of a CSV are about [m]; "
        "default: its origin",
    )
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
    for value in options.reference_point or ():
        # NaN fails this.
        if not abs(value) <= LARGEST_SCALE:
            raise RangeError(
                f"--reference-point must be two numbers from {-LARGEST_SCALE:.7g} to "
                f"{LARGEST_SCALE:.7g}, got {value}"
            )


def refuse_options_of_others(
    parser: argparse.ArgumentParser, options: argparse.Namespace, inputs: Collection[str]
) -> None:
    """Refuse what is for other inputs or another kind of fit than those that are asked for.

    Args:
        parser: Of the program.
        options: What it read, those of `add_fit_options` among them.
        inputs: What is to be fitted, each CONTACT, BODY, PUSHES or BAG: at least one.

    Raises:
        RangeError: An option would do nothing for any of the inputs, or contradicts another.
    """
    for kind, names in OF_INPUTS.items():
        if kind not in inputs:
            refuse_unused(parser, options, names, f"for {kind}")
    if not {CONTACT, BODY} & set(inputs):
        refuse_unused(parser, options, OF_CONTACTS, f"for {CONTACT}")
    if options.auto:
        refuse_unused(parser, options, CHOSEN_BY_AUTO, "what --auto chooses")
        return
    refuse_unused(parser, options, OF_AUTO, "for --auto")
    # Whether a contact is of points is known when it is read; for the options it makes no odds.
    recorded = {kind not in (CONTACT, BODY) for kind in inputs}
    kinds = {each: kind_of(options, each, of_points=False) for each in recorded}
    if options.kind == EXACT:
        if True in recorded:
            raise RangeError("--kind exact is for contacts: pushes do not say where a body stands")
        names = ("terms", "family", "objective", "velocity_weight", "starts")
        refuse_unused(parser, options, names, "not for --kind exact, which fits nothing")
        return
    if "power_sum" not in kinds.values():
        refuse_unused(parser, options, ["family"], "for --kind power_sum")
    if set(kinds.values()) == {"polynomial"}:
        refuse_unused(parser, options, ["terms", "starts"], "not for --kind polynomial")
    objectives = {objective_of(options, kind, each) for each, kind in kinds.items()}
    if "second" in objectives:
        of_others = "not for --objective second, which has two terms of its own"
        refuse_unused(parser, options, ["terms", "family"], of_others)
    if objectives <= WITHOUT_MOTIONS:
        of_others = f"not for the objective {' or '.join(sorted(objectives))}"
        refuse_unused(parser, options, ["velocity_weight"], of_others)


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
