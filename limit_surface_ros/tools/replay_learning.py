# SPDX-License-Identifier: Apache-2.0
"""Replay recorded pushes to a learner: how its predictions would have improved, push by push."""

from __future__ import annotations

import argparse
import datetime
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.checks import counted
from limit_surface_ros.errors import DataError, RangeError
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.fitting.few_pushes.online import OnlineSurface
from limit_surface_ros.fitting.pairs import scaling_of_pairs
from limit_surface_ros.plots.canvas import SUFFIXES, line_style, new_figure, save_figure
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.tools.common.bag_options import OF_BAGS, add_bag_options
from limit_surface_ros.tools.common.csv_options import OF_CELLS, add_cell_options, cell_options
from limit_surface_ros.tools.common.options import check_output, named_path, refuse_unused
from limit_surface_ros.tools.common.program import program_parser, run_program
from limit_surface_ros.tools.common.training_data import (
    BAG,
    PUSHES,
    check_input,
    naming,
    training_data_of_bag,
    training_data_of_pushes,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.few_pushes.online import Update
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.tools.common.training_data import TrainingData

EPILOG = """\
Each push is predicted before it is learnt; the printed angles are means over the pushes since the
line before, of the learner and of the model that it began with. Without --prior that is a sphere
of the size of the first pushes.

examples:
  replay_learning pushes.csv --prior model.yaml --output learnt.yaml
  replay_learning pushes.csv --forgetting blend --picture learning.png
  replay_learning bag_folder --wrench-topic /wrench --motion-topic /pose
"""
# Pushes between two lines of the table, and of the running mean of the picture.
EVERY, RUN = 5, 9
# Pushes that tell the size of a prior where none is given.
_FIRST = 5


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("replay_learning", __doc__, EPILOG, "pushes", "bag", "surface")
    top.add_argument("input", type=named_path, help="recorded pushes (.csv), or a bag")
    top.add_argument("--prior", type=Path, metavar="MODEL", help="model file to begin with")
    top.add_argument(
        "--keep", type=int, default=50, metavar="N", help="pushes in the window (%(default)s)"
    )
    top.add_argument(
        "--forgetting",
        default="1.0",
        metavar="X",
        help="weight of a push relative to the next, or blend: two windows, of which one forgets, "
        "by how well each predicts (%(default)s)",
    )
    top.add_argument("-o", "--output", type=Path, help="model file to write (.yaml); optional")
    top.add_argument(
        "--picture", type=Path, help=f"learning curve: {', '.join(SUFFIXES)}; optional"
    )
    add_cell_options(top.add_argument_group("CSV files"))
    add_bag_options(top)
    return top


def forgetting_of(text: str) -> float | str:
    """Return what --forgetting says.

    Raises:
        RangeError: It is neither blend nor a number.
    """
    if text == "blend":
        return text
    try:
        return float(text)
    except ValueError:
        raise RangeError(f"--forgetting must be a number or blend, got {text!r}") from None


def read(options: argparse.Namespace) -> TrainingData:
    """Read the pushes in their order.

    Raises:
        FileError: The input is absent or no recording.
        DataError: It holds no pushes.
    """
    kind = check_input(options.input)
    refuse_unused(parser(), options, OF_CELLS if kind == BAG else OF_BAGS, f"not for {kind}")
    if kind == BAG:
        return training_data_of_bag(options.input, options)
    if kind != PUSHES:
        raise DataError(f"{options.input}: is {kind}; accepted are recorded pushes, or a bag")
    return training_data_of_pushes(options.input, None, cell_options(options))


def sphere_of(data: TrainingData) -> Dissipation:
    """Return a sphere of the size of the first pushes: nothing is known of the body."""
    first = data.training.take(np.arange(min(_FIRST, len(data.training))))
    return Dissipation(np.eye(3)[None], scaling_of_pairs(first, data.characteristic_length))


def table(updates: Sequence[Update]) -> None:
    """Print the angles before pushes were learnt, some pushes a line."""
    print("pushes       learner [deg]   prior [deg]   refused")
    for begin in range(0, len(updates), EVERY):
        part = updates[begin : begin + EVERY]
        learner, prior = (
            np.degrees(np.mean([getattr(each, name) for each in part]))
            for name in ("angle_before", "prior_angle")
        )
        refused = sum(not each.accepted for each in part)
        name = f"{begin + 1} to {begin + len(part)}"
        print(f"{name:<12} {learner:13.2f} {prior:13.2f} {refused:9d}")


def draw(updates: Sequence[Update], path: Path) -> None:
    """Draw the learning curve: each push, and running means."""
    pushes = np.arange(1, len(updates) + 1)
    with new_figure(7.0, 4.0) as figure:
        axes = figure.subplots()
        for index, (name, label) in enumerate(
            (("angle_before", "learner"), ("prior_angle", "prior"))
        ):
            angles = np.degrees([getattr(each, name) for each in updates])
            style = line_style(index)
            axes.plot(pushes, angles, ".", color=style["color"], alpha=0.35)
            axes.plot(pushes, running_mean(angles), label=f"{label}, mean of {RUN}", **style)
        axes.set(xlabel="push", ylabel="angle before it was learnt [deg]", ylim=(0.0, None))
        axes.legend()
        save_figure(figure, path)


def running_mean(values: Floats) -> Floats:
    """Return means over the last pushes, fewer at the beginning, shape of `values`."""
    sums = np.cumsum(np.concatenate([[0.0], values]))
    ends = np.arange(1, len(values) + 1)
    begins = np.maximum(ends - RUN, 0)
    return np.asarray((sums[ends] - sums[begins]) / (ends - begins))


def model_of(
    online: OnlineSurface, prior: SurfaceModel | None, data: TrainingData, name: str
) -> SurfaceModel:
    """Return what was learnt as a model, with the pushes of its window."""
    surface, scatter = online.surface_and_scatter()
    sureness = {} if scatter is None else {"uncertainty": scatter.stored()}
    return SurfaceModel(
        name=name,
        surface=surface,
        frame_id=prior.frame_id if prior else data.frame_id or "object",
        reference_point=prior.reference_point if prior else data.reference_point,
        normal_force=data.normal_force or (prior.normal_force if prior else None),
        fit={
            **data.about,
            "objective": f"learnt push by push, {counted(online.count, 'push')}",
            "prior": prior.name if prior else "a sphere",
            "online": online.state(),
            **sureness,
            "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
            "version": __version__,
        },
    )


def run(options: argparse.Namespace) -> None:
    """Read, replay, print, draw, write."""
    inputs = [options.input, *([options.prior] if options.prior else [])]
    if options.output is not None:
        check_output(options.output, YAML_SUFFIXES, inputs)
    if options.picture is not None:
        check_output(options.picture, SUFFIXES, inputs)
        with new_figure(1.0, 1.0):
            pass
    forgetting = forgetting_of(options.forgetting)
    prior = None if options.prior is None else read_surface_model(options.prior)
    data = read(options)
    with naming(options.input):
        begin: LimitSurface = sphere_of(data) if prior is None else prior.surface
        online = OnlineSurface(begin, options.keep, forgetting)
        pairs = zip(data.training.wrenches, data.training.twists, strict=True)
        updates = [online.add(wrench, twist) for wrench, twist in pairs]
    table(updates)
    for reason, count in online.refused.items():
        print(f"refused     {counted(count, 'push')}: {reason}")
    if options.output is not None:
        command = shlex.join(["replay_learning", *options.command])
        model = model_of(online, prior, data, options.output.stem)
        write_surface_model(model, options.output, header=f"Made by: {command}")
        print(f"written     {options.output}")
    if options.picture is not None:
        draw(updates, options.picture)
        print(f"written     {options.picture}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    top = parser()
    top.set_defaults(command=sys.argv[1:] if argv is None else list(argv))
    return run_program(top, run, argv)


if __name__ == "__main__":
    sys.exit(main())
