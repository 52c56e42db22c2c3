# SPDX-License-Identifier: Apache-2.0
"""Predict how a shoved body slides to rest, and draw it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.files.decay_file import read_decay_model
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide_stages, stop_bracket
from limit_surface_ros.motion.stages import finish
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.plots.slide_view import draw_slide, write_slide_film
from limit_surface_ros.tools.common.motion_options import (
    add_motion_options,
    check_film,
    pose_in_words,
)
from limit_surface_ros.tools.common.options import (
    add_picture_options,
    check_picture,
    refuse_unused,
)
from limit_surface_ros.tools.common.program import program_parser, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel

EPILOG = """\
The body is that of a model file: friction by its surface, drawn by its `outline`, or as a circle
of the characteristic length with a spoke where the file has none. It starts at --twist, that of
the reference point in the model's frame, and is acted on by the load of --wrench, which dies away
by the decay model of --decay. One coefficient of friction holds for motion and rest, and the
pressure does not shift while the body brakes.

examples:
  plot_slide config/models/triangle_patch.yaml --mass 0.3 --moment 5e-4 --twist 0.8 0.2 12
  plot_slide disc.yaml --mass 0.5 --moment 6e-4 --wrench 6 0 0.05 --decay relaxation.yaml
  plot_slide disc.yaml --mass 0.5 --moment 6e-4 --twist 0.5 0 9 --animate slide.gif
"""
# Of the circle that is drawn where there is no outline.
_CORNERS = 72


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("plot_slide", __doc__, EPILOG, "surface", "decay")
    top.add_argument("model", type=Path, metavar="MODEL", help="model file of a surface (.yaml)")
    add_picture_options(top, "slide.png")
    top.add_argument("--mass", type=float, required=True, help="[kg]")
    top.add_argument(
        "--moment",
        type=float,
        required=True,
        help="of inertia about the vertical axis through the centre of mass [kg m^2]; of an even "
        "box of sides a and b: mass (a^2 + b^2) / 12, of a disc: mass radius^2 / 2",
    )
    top.add_argument(
        "--centre",
        type=float,
        nargs=2,
        default=[0.0, 0.0],
        metavar=("X", "Y"),
        help="of mass, about the reference point [m] (0 0)",
    )
    top.add_argument(
        "--twist",
        type=float,
        nargs=3,
        default=[0.0, 0.0, 0.0],
        metavar=("VX", "VY", "OMEGA"),
        help="at the start [m/s, m/s, rad/s] (at rest)",
    )
    top.add_argument(
        "--wrench",
        type=float,
        nargs=3,
        metavar=("FX", "FY", "TAU"),
        help="load at the start, about the reference point [N, N, N m]",
    )
    top.add_argument("--decay", type=Path, help="decay model by which the load dies away (.yaml)")
    top.add_argument(
        "--in-world",
        action="store_true",
        help="the load keeps its direction in the world; else it turns with the body",
    )
    add_motion_options(top, "the reference point")
    return top


def outline_of(model: SurfaceModel) -> Floats:
    """Return the outline of a body about its reference point, shape (n, 2) [m]."""
    if model.outline is not None:
        return np.asarray(model.outline.drawn() - np.array(model.reference_point))
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS)
    # From the middle on, so that a spoke shows how the body turns.
    circle = np.concatenate([[[0.0, 0.0]], np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    return np.asarray(model.surface.scaling.characteristic_length * circle)


def run(options: argparse.Namespace) -> None:
    """Read, slide, say, draw."""
    inputs = [path for path in (options.model, options.decay) if path is not None]
    check_picture(options, inputs)
    check_film(parser(), options, inputs)
    if (options.wrench is None) != (options.decay is None):
        raise RangeError("--wrench and --decay belong together: a load and how it dies away")
    model = read_surface_model(options.model)
    body = SlidingBody(model.surface, Inertia(options.mass, options.moment, options.centre))
    load = None
    if options.decay is None:
        refuse_unused(parser(), options, ["in_world"], "for --wrench")
    else:
        decay = read_decay_model(options.decay)
        load = Load(options.wrench, decay.sum, options.in_world)
    found = finish(slide_stages(body, options.twist, load, options.pose))
    print(f"body        {model.name}")
    print(f"rests       after {found.time:.6f} s")
    if load is not None:
        earliest, latest = stop_bracket(body, options.twist, load, decay.max_error, options.pose)
        print(f"bracket     {earliest:.6f} to {latest:.6f} s, by the error of the decay model")
    for begin, end in found.rests:
        print(f"on the way  {begin:.6f} to {end:.6f} s")
    print(f"end         {pose_in_words(found.pose)}")
    print(f"energy      kept to {max(found.energy_residual, 1e-16):.1g} of it")
    outline = outline_of(model)
    title = f"{model.name}, {options.mass:g} kg"
    figure = draw_slide(found, outline, model.surface, load, title)
    save_figure(figure, options.output, options.dpi)
    print(f"written     {options.output}")
    if options.animate is not None:
        write_slide_film(found, outline, options.animate, options.seconds)
        print(f"written     {options.animate}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
