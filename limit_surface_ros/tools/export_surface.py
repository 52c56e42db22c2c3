# SPDX-License-Identifier: Apache-2.0
"""Export a limit surface to C++, optimisers, simulators and browsers, bit by bit."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros.export.targets import SUFFIXES, export_surface
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.tools.common.options import check_output
from limit_surface_ros.tools.common.program import program_parser, run_program

if TYPE_CHECKING:
    from collections.abc import Sequence

EPILOG = """\
targets:
  cpp        header for C++17: load factor, twist, wrench and their Jacobians; no dependency, no
             allocation, noexcept, any scalar type
  casadi     module of CasADi functions: the same maps, in closed form or by a rootfinder
  jax        module of JAX functions: the closed forms, differentiable as often as one likes
  js         module for browsers and Node.js
  mujoco     MJCF model of the body on --spheres spheres with torsional friction
  ellipsoid  the matrix L of twist = L wrench that is closest, with its error: NAME_ellipsoid.yaml

Each file is one fixed text with the model's numbers in it, to the last bit. A map that cannot be
certified, as the load of a twist of a surface that is not convex, is left out and named.

examples:
  export_surface model.yaml --to cpp -o box.hpp
  export_surface model.yaml --to mujoco --spheres 4 -o box.xml

More: docs/how_to/use_a_model_in_an_optimiser.md and docs/how_to/use_a_model_in_cpp.md
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("export_surface", __doc__, EPILOG, "surface")
    top.add_argument("model", type=Path, metavar="MODEL", help="model file (.yaml)")
    top.add_argument("--to", required=True, choices=list(SUFFIXES), help="what to export to")
    top.add_argument(
        "--output",
        "-o",
        type=Path,
        metavar="FILE",
        help="file to write (default: the model's name with the target's suffix); as with all "
        "programs, a file of that name is replaced, an input never",
    )
    top.add_argument(
        "--spheres",
        type=int,
        default=4,
        metavar="N",
        help="spheres of --to mujoco, 1 to 32 (default: %(default)s)",
    )
    return top


def run(options: argparse.Namespace) -> None:
    """Read, export, write."""
    suffix = SUFFIXES[options.to]
    model = read_surface_model(options.model)
    # NAME.yaml would be the model's own file, or that of its contact.
    ending = "_ellipsoid" if options.to == "ellipsoid" else ""
    output = options.output or Path(f"{model.name}{ending}{suffix}")
    accepted = [".hpp", ".h", ".hh", ".hxx"] if options.to == "cpp" else [suffix]
    check_output(output, [*accepted, *([".js"] if options.to == "js" else [])], [options.model])
    exported = export_surface(model, options.to, options.spheres)
    write_atomically(output, exported.text)
    for note in exported.notes:
        print(f"note        {note}")
    print(f"written     {output}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    return run_program(parser(), run, argv)


if __name__ == "__main__":
    sys.exit(main())
