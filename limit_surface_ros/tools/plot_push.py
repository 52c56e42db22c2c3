# SPDX-License-Identifier: Apache-2.0
"""Predict where a push along a path ends, and draw it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.files.yaml_reader import read_yaml
from limit_surface_ros.motion.rollout import DEFAULT_ACCURACY, OVERLAPS, simulate_push
from limit_surface_ros.motion.spread import push_spread
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.plots.push_view import draw_push, write_film
from limit_surface_ros.tools.common.motion_options import (
    add_motion_options,
    check_film,
    pose_in_words,
)
from limit_surface_ros.tools.common.options import (
    add_picture_options,
    check_picture,
    check_ranges,
)
from limit_surface_ros.tools.common.program import program_parser, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.motion.outcomes import PushRun
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.motion.spread import EndPoses
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.dissipation_scatter import UncertainSurface

EPILOG = """\
MODEL is a model file with the key `outline`, or a contact file whose shape has a rim. The path is
that of the tip's centre, in the frame in which the body begins at --pose. Without --path the tip
pushes the body from the left, a quarter of its height above its middle, over half its width.

examples:
  plot_push config/models/triangle_patch.yaml --output push.png
  plot_push box.yaml --path -0.10 0.02 0.00 0.02 0.05 0.05 --friction 0.25 --tip-radius 0.005
  plot_push box.yaml --animate push.gif
"""


_MOST_MEMBERS = 10_000


class Body(NamedTuple):
    """What a file says of a body that is pushed."""

    name: str
    surface: LimitSurface
    outline: Outline
    reference_point: Floats
    uncertain: UncertainSurface | None = None


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("plot_push", __doc__, EPILOG, "surface", "contact")
    top.add_argument("model", type=Path, metavar="MODEL", help="model or contact file (.yaml)")
    add_picture_options(top, "push.png")
    top.add_argument(
        "--path",
        type=float,
        nargs="+",
        metavar="X",
        help="corners x y of the path of the tip's centre, two or more [m]",
    )
    top.add_argument(
        "--tip-radius", type=float, default=0.005, help="of the pusher [m] (%(default)g)"
    )
    top.add_argument(
        "--friction",
        type=float,
        default=0.3,
        help="coefficient between tip and body, 0 to inf (%(default)g)",
    )
    top.add_argument(
        "--accuracy",
        type=float,
        default=DEFAULT_ACCURACY,
        help="error of the end pose that is aimed at [m] (%(default)g)",
    )
    top.add_argument(
        "--overlap",
        choices=OVERLAPS,
        default=OVERLAPS[0],
        help="of tip and body at the start: taken as an offset, or pushed out (%(default)s)",
    )
    top.add_argument(
        "--members",
        type=int,
        default=0,
        metavar="N",
        help="push N surfaces, too, that the scatter of a model of `fit_surface --auto` allows, "
        "and draw the ellipse of 9 of 10 of their ends: what the ground does alone; of real ends "
        "it holds one or two of 10, for the tip's friction, the outline and poses err as well",
    )
    add_motion_options(top, "the body")
    return top


def read_body(path: Path) -> Body:
    """Read a body that can be pushed.

    Raises:
        FileError: The file is neither a model nor a contact.
        DataError: It has no outline.
    """
    if "kind" in read_yaml(path):
        model = read_surface_model(path)
        name, surface, outline = model.name, model.surface, model.outline
        about, uncertain = np.array(model.reference_point), model.uncertain
    else:
        contact = read_contact(path)
        name, surface, outline = contact.name, contact.surface, contact.outline
        about, uncertain = contact.reference_point, None
    if outline is None:
        raise DataError(
            f"{path}: has no outline for a tip to touch: add `outline`, such as "
            "`outline: {kind: rectangle, size: [0.1, 0.06]}`"
        )
    return Body(name, surface, outline, about, uncertain)


def default_path(outline: Outline, pose: Floats, radius: float) -> Floats:
    """Return a path from the left, a quarter of the height above the middle."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = outline.drawn() @ np.array([[c, s], [-s, c]]) + pose[:2]
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    begin = left - 2.0 * radius - 0.05 * (right - left)
    end, height = 0.5 * (left + right), 0.25 * bottom + 0.75 * top
    return np.array([[begin, height], [end, height]])


def report(name: str, found: PushRun, ends: EndPoses | None) -> None:
    """Print how a push goes, and how far an ensemble's ends lie apart."""
    print(f"body        {name}")
    touched = "never" if found.touched_at is None else f"after {1e3 * found.touched_at:.3f} mm"
    print(f"touched     {touched}")
    if found.left_at is not None:
        print(f"left        after {1e3 * found.left_at:.3f} mm")
    kept = [mode.value for mode in found.modes[:-1]]
    modes = [mode for place, mode in enumerate(kept) if place == 0 or kept[place - 1] != mode]
    print(f"modes       {', '.join(modes)}")
    print(f"end         {pose_in_words(found.end_pose)}")
    print(f"error       about {max(found.error, 1e-15):.1g} m, by {found.evaluations} evaluations")
    if ends is not None:
        large, small = 1e3 * ends.ellipse(0.9).half_axes
        least, _, most = np.degrees(ends.pose_quantiles[:, 2])
        print(
            "spread      9 of 10 members in an ellipse of half-axes "
            f"{large:.2f} and {small:.2f} mm, angles from {least:.2f} to {most:.2f} deg"
        )
        print("            by the ground alone: real ends lie outside far more often")


def run(options: argparse.Namespace) -> None:
    """Read, simulate, say, draw."""
    check_picture(options, [options.model])
    check_film(parser(), options, [options.model])
    check_ranges(options, {"members": (0, _MOST_MEMBERS)})
    if options.path is not None and (len(options.path) < 4 or len(options.path) % 2):
        raise RangeError("--path takes two or more corners, each an x and a y")
    body = read_body(options.model)
    if options.members and body.uncertain is None:
        raise DataError(
            f"{options.model}: does not say how far pushes scatter; --members is for models of "
            "`fit_surface --auto`"
        )
    pose = np.array(options.pose)
    if options.path is None:
        path = default_path(body.outline, pose, options.tip_radius)
    else:
        path = np.array(options.path).reshape(-1, 2)
    push = (body.outline, options.tip_radius, options.friction, pose, path)
    settings: dict[str, Any] = {
        "accuracy": options.accuracy,
        "overlap": options.overlap,
        "reference_point": body.reference_point,
    }
    found = simulate_push(body.surface, *push, **settings)
    ends = None
    if options.members and body.uncertain is not None:
        ends = push_spread(body.uncertain.members(options.members), *push, **settings)
    report(body.name, found, ends)
    title = f"{body.name}, friction {options.friction:g}"
    save_figure(
        draw_push(found, body.outline, options.tip_radius, title, ends),
        options.output,
        options.dpi,
    )
    print(f"written     {options.output}")
    if options.animate is not None:
        write_film(found, body.outline, options.tip_radius, options.animate, options.seconds)
        print(f"written     {options.animate}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
