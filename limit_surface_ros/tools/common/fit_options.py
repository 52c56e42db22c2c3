# SPDX-License-Identifier: Apache-2.0
"""Which options of a fit count for which inputs and kinds of fit; the others are refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError
from limit_surface_ros.tools.common.bag_options import OF_BAGS
from limit_surface_ros.tools.common.csv_options import OF_CELLS
from limit_surface_ros.tools.common.options import refuse_unused
from limit_surface_ros.tools.common.surface_fit import EXACT, kind_of, objective_of
from limit_surface_ros.tools.common.training_data import BAG, BODY, CONTACT, PUSHES

if TYPE_CHECKING:
    import argparse
    from collections.abc import Collection

OF_CONTACTS = ("motions", "facet_loads", "load_noise", "motion_noise")
OF_INPUTS = {
    BODY: ("link", "friction_coefficient", "normal_force"),
    PUSHES: ("rows", *OF_CELLS),
    BAG: OF_BAGS,
}
CHOSEN_BY_AUTO = ("kind", "terms", "family", "objective", "velocity_weight", "starts")
OF_AUTO = ("folds", "support", "bootstrap")
# Objectives that look at loads alone.
WITHOUT_MOTIONS = {"J1", "forces", "least-squares"}


def refuse_options_of_others(
    parser: argparse.ArgumentParser, options: argparse.Namespace, inputs: Collection[str]
) -> None:
    """Refuse what is for other inputs or another kind of fit than those that are asked for.

    Args:
        parser: Of the program.
        options: What it read, those of `surface_fit.add_fit_options` among them.
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
