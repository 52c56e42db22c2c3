# SPDX-License-Identifier: Apache-2.0
"""Fit a limit surface to each contact or recording in a folder, and write one model for each.

A run that is interrupted, or killed, goes on where it was when the same command is given again:
models that are finished are kept, as long as their input, the options and the version of this
package are what they were.
An object that cannot be fitted fails alone; the exit code is then 1.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import shlex
import sys
import time
import warnings
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from limit_surface_ros import __version__
from limit_surface_ros.errors import FileError, LimitSurfaceError
from limit_surface_ros.files.surface_file import read_surface_model, write_surface_model
from limit_surface_ros.fitting.catalogue import Outcome, outcomes
from limit_surface_ros.fitting.workers import available_cores, worker_processes
from limit_surface_ros.surface.convexity import NotConvexWarning
from limit_surface_ros.tools.common.executors import (
    CLUSTER_IN_FLIGHT,
    check_address,
    dask_executor,
)
from limit_surface_ros.tools.common.fit_options import (
    add_fit_options,
    add_frame_option,
    check_fit_options,
    refuse_options_of_others,
)
from limit_surface_ros.tools.common.options import refuse_empty
from limit_surface_ros.tools.common.program import (
    FAILED,
    program_parser,
    progress_bar,
    run_program,
)
from limit_surface_ros.tools.common.surface_fit import fit_model
from limit_surface_ros.tools.common.training_data import (
    ACCEPTED,
    SUFFIXES,
    is_bag,
    is_bag_folder,
    kind_of_input,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from concurrent.futures import Executor

    from limit_surface_ros.files.surface_file import SurfaceModel

EXAMPLES = """examples:
  fit_catalogue contacts/ --output models/ --terms 3
  fit_catalogue pushes/ --output models/ --family norms --workers 8
  fit_catalogue pushes/ --output models/ --dask tcp://head-node:8786
"""
# Key in the history of a model by which a later run recognises it.
MADE_FROM = "made_from"
# Bags are large: they are hashed in parts [bytes].
_READ_SIZE = 2**20
# Options that say where and how to work, and not what model comes out.
_WORKING_OPTIONS = ("folder", "output", "workers", "dask", "refit", "command")


@dataclass(frozen=True)
class CatalogueObject:
    """One object of a catalogue.

    Attributes:
        source: Its contact or recording, an absolute path.
        target: Its model file.
        made_from: Stands for the content of the source, the options of the fit and the version.
    """

    source: Path
    target: Path
    made_from: str


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    top = program_parser("fit_catalogue", __doc__, EXAMPLES, "contact", "body", "pushes", "bag")
    top.add_argument("folder", type=Path, help=f"a folder in which each file is {ACCEPTED}")
    top.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FOLDER",
        help="another folder, made if it is not there; NAME.csv becomes NAME.yaml in it, and the "
        "model's name is the contact's, or NAME",
    )
    top.add_argument("--refit", action="store_true", help="fit also what is finished")
    where = top.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=int,
        default=available_cores(),
        metavar="N",
        help="processes; the models do not depend on it (%(default)s)",
    )
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="fit on the Dask cluster with this scheduler, such as tcp://host:8786; its workers "
        "need this package and the folder under the same path (extra: cluster)",
    )
    add_frame_option(top)
    add_fit_options(top)
    return top


def inputs(options: argparse.Namespace) -> list[Path]:
    """List the contacts and recordings of the folder by name.

    Raises:
        FileError: The folder is absent, cannot be read or holds no object, is the output folder
            too, or two files would become one model.
    """
    folder, output = options.folder.resolve(), options.output.resolve()
    if not folder.is_dir():
        raise FileError(f"{options.folder}: there is no such folder")
    if folder == output:
        raise FileError(f"{options.output}: models must go to another folder than their inputs")
    sources = sorted(path for path in folder.iterdir() if is_input(path))
    if not sources:
        raise FileError(
            f"{options.folder}: the folder holds no {', '.join(SUFFIXES)} and no ROS 2 bag"
        )
    taken: dict[str, Path] = {}
    for source in sources:
        other = taken.setdefault(source.stem, source)
        if other != source:
            raise FileError(
                f"{options.folder}: {other.name} and {source.name} would both become "
                f"{source.stem}.yaml; rename one of them"
            )
    return sources


def objects(sources: Iterable[Path], options: argparse.Namespace) -> list[CatalogueObject]:
    """Return the objects of the inputs, in their order."""
    output, settings = options.output.resolve(), fit_settings(options)
    return [
        CatalogueObject(source, output / f"{source.stem}.yaml", fingerprint(source, settings))
        for source in sources
    ]


def fit_settings(options: argparse.Namespace) -> str:
    """Return the options on which models depend, and the version that fits them, as text."""
    values = {key: val for key, val in vars(options).items() if key not in _WORKING_OPTIONS}
    return json.dumps({"version": __version__, **values}, sort_keys=True, default=str)


def is_input(path: Path) -> bool:
    """Tell whether something in the folder is to be fitted."""
    if path.is_dir():
        return is_bag_folder(path)
    return path.suffix.lower() in SUFFIXES or is_bag(path)


def fingerprint(source: Path, settings: str) -> str:
    """Return what stands for an input's content and the settings; empty if it is unreadable."""
    digest = hashlib.sha256(settings.encode())
    files = sorted(source.rglob("*")) if source.is_dir() else [source]
    try:
        for file in files:
            digest.update(b"\0")
            if file.is_file():
                with file.open("rb") as stream:
                    while part := stream.read(_READ_SIZE):
                        digest.update(part)
    except OSError:
        return ""
    return digest.hexdigest()


def is_finished(item: CatalogueObject) -> bool:
    """Tell whether the model of an object is there, whole, and made from what stands there now."""
    try:
        with warnings.catch_warnings():
            # That a model is not convex was said when it was fitted.
            warnings.simplefilter("ignore", NotConvexWarning)
            history = read_surface_model(item.target).fit
    except LimitSurfaceError:
        return False
    return bool(item.made_from) and history.get(MADE_FROM) == item.made_from


def fit_object(options: argparse.Namespace, item: CatalogueObject) -> SurfaceModel:
    """Fit one object, in whatever process this runs."""
    model = fit_model(item.source, None, options, item.source.stem).model
    return replace(model, fit={**model.fit, MADE_FROM: item.made_from})


def opened_executor(options: argparse.Namespace) -> AbstractContextManager[Executor]:
    """Return the executor that the options ask for."""
    if options.dask is not None:
        return dask_executor(options.dask, options.folder.resolve())
    return worker_processes(options.workers)


def written(outcome: Outcome[CatalogueObject], header: str) -> Outcome[CatalogueObject]:
    """Write the model of an object, if there is one; a disk that refuses fails the object."""
    if outcome.error:
        return outcome
    try:
        write_surface_model(outcome.value, outcome.job.target, header)
    except FileError as error:
        return Outcome(outcome.job, error=str(error))
    return outcome


def fit_all(
    todo: Sequence[CatalogueObject], options: argparse.Namespace
) -> list[Outcome[CatalogueObject]]:
    """Fit objects, write each model as it comes, and return those that failed, by name."""
    header = f"Made by: {shlex.join(['fit_catalogue', *options.command])}"
    failures = []
    in_flight = 2 * options.workers if options.dask is None else CLUSTER_IN_FLIGHT
    work = functools.partial(fit_object, options)
    opened = functools.partial(opened_executor, options)
    with progress_bar("objects") as progress:
        progress(0, len(todo))
        for done, outcome in enumerate(outcomes(todo, work, opened, in_flight), start=1):
            kept = written(outcome, header)
            if kept.error:
                failures.append(kept)
            progress(done, len(todo), len(failures))
    return sorted(failures, key=lambda each: each.job.source)


def report(failures: Iterable[Outcome[CatalogueObject]]) -> None:
    """List what failed, and why."""
    for outcome in failures:
        print(f"FAILED {outcome.job.source.name}: {outcome.error}", file=sys.stderr)


def run(options: argparse.Namespace) -> int:
    """Fit what is not finished, and report."""
    refuse_empty(options, ["frame_id"])
    check_fit_options(options)
    if options.dask is not None:
        check_address(options.dask)
    sources = inputs(options)
    refuse_options_of_others(parser(), options, {kind_of_input(source) for source in sources})
    every = objects(sources, options)
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{options.output}: cannot be made: {error.strerror}") from None
    todo = [item for item in every if options.refit or not is_finished(item)]
    kept = len(every) - len(todo)
    print(f"{len(every)} objects: {kept} finished before, {len(todo)} to fit", flush=True)
    begin = time.perf_counter()
    failures = fit_all(todo, options) if todo else []
    seconds = time.perf_counter() - begin
    print(
        f"{len(todo) - len(failures)} fitted, {kept} kept, {len(failures)} failed in "
        f"{seconds:.1f} s; models are in {options.output}"
    )
    report(failures)
    return FAILED if failures else 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program and return its exit code."""
    top = parser()
    top.set_defaults(command=sys.argv[1:] if argv is None else list(argv))
    return run_program(
        top,
        run,
        argv,
        interrupted="interrupted; finished models are kept, the same command goes on from there",
    )


if __name__ == "__main__":
    sys.exit(main())
