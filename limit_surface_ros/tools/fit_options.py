# SPDX-License-Identifier: Apache-2.0
"""Which options of a fit count for which inputs and kinds of fit; the others are refused."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from limit_surface_ros.files.bag_pushes import Selection
from limit_surface_ros.tools.csv_options import OF_CELLS
from limit_surface_ros.tools.options import refuse_unused
from limit_surface_ros.tools.surface_fit import objective_of
from limit_surface_ros.tools.training_data import BAG, CONTACT, PUSHES

if TYPE_CHECKING:
    import argparse
    from collections.abc import Collection

OF_INPUTS = {
    CONTACT: ("motions", "facet_loads", "load_noise", "motion_noise"),
    PUSHES: ("rows", *OF_CELLS),
    BAG: ("wrench_topic", "motion_topic", *asdict(Selection())),
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
        inputs: What is to be fitted, each CONTACT, PUSHES or BAG: at least one.

    Raises:
        RangeError: An option would do nothing for any of the inputs, or contradicts another.
    """
    for kind, names in OF_INPUTS.items():
        if kind not in inputs:
            refuse_unused(parser, options, names, f"for {kind}")
    if options.auto:
        refuse_unused(parser, options, CHOSEN_BY_AUTO, "what --auto chooses")
        return
    refuse_unused(parser, options, OF_AUTO, "for --auto")
    if options.kind != "power_sum":
        refuse_unused(parser, options, ["family"], "for --kind power_sum")
    if options.kind == "polynomial":
        refuse_unused(parser, options, ["terms", "starts"], "not for --kind polynomial")
    objectives = {objective_of(options, recorded=kind != CONTACT) for kind in inputs}
    if "second" in objectives:
        of_others = "not for --objective second, which has two terms of its own"
        refuse_unused(parser, options, ["terms", "family"], of_others)
    if objectives <= WITHOUT_MOTIONS:
        of_others = f"not for the objective {' or '.join(sorted(objectives))}"
        refuse_unused(parser, options, ["velocity_weight"], of_others)
