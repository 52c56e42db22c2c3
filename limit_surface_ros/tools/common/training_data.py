# SPDX-License-Identifier: Apache-2.0
"""What a program fits or compares surfaces on: pairs, and what is known about them."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.bag_pushes import Selection
from limit_surface_ros.files.bag_reader import BAG_SUFFIXES
from limit_surface_ros.files.body_file import SUFFIXES as BODY_SUFFIXES
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.surface_file import LARGEST_SCALE
from limit_surface_ros.files.yaml_reader import YAML_SUFFIXES
from limit_surface_ros.fitting.plausibility import doubts_of_pairs
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling
from limit_surface_ros.tools.common.bag_options import about_pushes, pushes_of_bag

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Mapping

    from limit_surface_ros.files.contact_file import ContactModel
    from limit_surface_ros.files.csv_table import CsvOptions
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.pairs import Pairs

# What an input can be, as messages call it.
CONTACT, PUSHES, BAG = "a contact file", "a CSV of pushes", "a bag"
BODY = "a URDF or SDF"
SUFFIXES = (*YAML_SUFFIXES, ".csv", *BODY_SUFFIXES)
# Other ends of names that tables in text have.
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", ".dat")
ACCEPTED = (
    "a contact file (.yaml, .yml), a robot description (.urdf, .sdf), recorded pushes (.csv), or "
    "a bag of ROS 2 or ROS 1"
)


@dataclass(frozen=True)
class TrainingData:
    """Pairs to fit, pairs held out, and where they came from.

    Attributes:
        training: What the fit sees.
        held_out: What it does not, if there is any.
        characteristic_length: [m], if the source states it.
        support: Support points that the source states, if it does.
        normal_force: [N], if the source states it.
        name: What the source calls the body, if it does.
        frame_id: Frame of the pairs, if the source states it.
        reference_point: About which the pairs are, in that frame [m].
        recorded: Whether the pairs were measured and not simulated.
        of_points: Whether `support` is the whole contact, and no patch cut into cells.
        symmetry: Axes about which a model is to be symmetric.
        doubts: What of the source looks like a slip, sentences.
        outline: Of the body, if the source states it.
        about: For the model file.
    """

    training: Pairs
    held_out: Pairs | None = None
    characteristic_length: float | None = None
    support: PointContacts | None = None
    normal_force: float | None = None
    name: str | None = None
    frame_id: str | None = None
    reference_point: tuple[float, float] = (0.0, 0.0)
    recorded: bool = False
    of_points: bool = False
    symmetry: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    outline: Outline | None = None
    about: Mapping[str, Any] = field(default_factory=dict)


def checked(path: Path, data: TrainingData, anyway: bool) -> TrainingData:
    """Refuse pushes whose units, axes or signs are not those of a body; keep other doubts.

    Args:
        path: Of the data, for the error.
        data: Recorded pushes.
        anyway: Whether they are taken all the same; the doubts are then printed.

    Raises:
        DataError: They are not those of a body; the message names the likely cause.
    """
    found = doubts_of_pairs(data.training, data.characteristic_length)
    grave = [doubt.text for doubt in found if doubt.grave]
    if grave and not anyway:
        raise DataError(f"{path}: {'; '.join(grave)} (--anyway fits all the same)")
    return replace(data, doubts=(*data.doubts, *(doubt.text for doubt in found)))


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Name the file of the data in errors of the block, which knows nothing of files.

    Raises:
        DataError: The block raised one; this one names the file, too.
    """
    try:
        yield
    except DataError as error:
        raise DataError(f"{path}: {error}") from None


def row_numbers(text: str, count: int) -> list[int]:
    """Read row numbers and ranges, such as "0,3,10-14".

    Args:
        text: What --rows says.
        count: How many rows there are.

    Raises:
        DataError: The text is no such list, or names a row twice or one that is not there.
    """
    numbers: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        try:
            span = range(int(first), int(last if dash else first) + 1)
        except ValueError:
            raise DataError(f"--rows must be like 0,3,10-14; got {text!r}") from None
        # Before there is a list, which could be of any length.
        if span and span[-1] >= count:
            raise DataError(f"--rows: there is no row {span[-1]}; rows are 0 to {count - 1}")
        numbers.extend(span)
    if len(set(numbers)) != len(numbers) or not numbers:
        raise DataError(f"--rows must name at least one row, and each once; got {text!r}")
    return numbers


def training_data_of_pushes(
    path: Path, selected: str | None, cells: CsvOptions | None = None
) -> TrainingData:
    """Read recorded pushes; the rows that are not selected are held out.

    The first line's `rho_m` [m] gives the characteristic length where it stands.

    Args:
        path: The CSV.
        selected: Its rows to fit, see `row_numbers`; all if not given.
        cells: How its cells are written, and what becomes of bad rows.

    Raises:
        FileError: The file is absent or not valid.
        DataError: There are no such rows.
    """
    pushes = read_pushes(path, cells)
    with naming(path):
        rows = None if selected is None else row_numbers(selected, len(pushes.pairs))
    training = pushes.pairs if rows is None else pushes.rows(rows)
    others = len(pushes.pairs) - len(training)
    support = pushes.support()
    about: dict[str, Any] = {"data": path.name, "rows": "all" if rows is None else rows}
    if pushes.notes:
        about["read"] = list(pushes.notes)
    return TrainingData(
        training=training,
        support=None if support is None else PointContacts(*support),
        held_out=pushes.rest(rows) if rows is not None and others else None,
        characteristic_length=pushes.number("rho_m"),
        normal_force=pushes.number("normal_force_N"),
        recorded=True,
        about=about,
    )


def training_data_of_bag(path: Path, options: argparse.Namespace) -> TrainingData:
    """Read the quasi-static pushes of a bag.

    Args:
        path: The bag.
        options: What `add_bag_options` declares.

    Raises:
        DataError: A topic is not named, or the bag holds no push.
        FileError: The bag cannot be read, or its frames do not fit.
    """
    pushes = pushes_of_bag(path, options)
    about = {
        "data": path.name,
        "wrench_topic": options.wrench_topic,
        "motion_topic": options.motion_topic,
        "selection": {rule: getattr(options, rule) for rule in asdict(Selection())},
        **about_pushes(pushes),
    }
    return TrainingData(
        training=pushes.pairs, frame_id=pushes.frame_id, recorded=True, about=about
    )


def is_bag(path: Path) -> bool:
    """Tell whether a path is a bag: a folder, or a file of one of the storages."""
    return path.is_dir() or path.suffix.lower() in BAG_SUFFIXES


@dataclass(frozen=True)
class Simulation:
    """How pairs are made from a contact; see `fitting.simulation`."""

    motions: int = 2000
    per_facet: int = 150
    load_noise: float = 0.0
    motion_noise: float = 0.0
    seed: int = 0


def training_data_of_contact(
    path: Path, contact: ContactModel, simulation: Simulation, characteristic_length: float | None
) -> TrainingData:
    """Make pairs of a contact, and as many fresh motions without noise to test on.

    Raises:
        DataError: The body is of no size that a model file takes.
    """
    exact = contact.surface
    if characteristic_length is not None:
        scaling = Scaling(characteristic_length, exact.scaling.friction_force)
        exact = PointContacts(exact.points, exact.friction_limits, scaling)
    with naming(path):
        check_scaling(exact.scaling)
    training = simulated_pairs(
        exact,
        simulation.motions,
        simulation.per_facet,
        load_noise=simulation.load_noise,
        motion_noise=simulation.motion_noise,
        seed=simulation.seed,
    )
    loads = {} if contact.load_method is None else {"loads_of_points": contact.load_method}
    x, y = (float(component) for component in contact.reference_point)
    return TrainingData(
        training=training,
        held_out=random_motions(exact, simulation.motions, simulation.seed + 1),
        characteristic_length=exact.scaling.characteristic_length,
        support=exact,
        normal_force=contact.normal_force,
        name=contact.name,
        frame_id=contact.frame_id,
        reference_point=(x, y),
        of_points=contact.of_points,
        symmetry=contact.symmetry,
        doubts=contact.doubts,
        outline=contact.outline,
        about={"data": path.name, **loads, **asdict(simulation)},
    )


def check_scaling(scaling: Scaling) -> None:
    """Refuse data of a size that no model file takes, before they are fitted.

    Raises:
        DataError: A scale is out of the range that `surface_file` reads.
    """
    scales = {
        "a characteristic length [m]": scaling.characteristic_length,
        "a friction force [N]": scaling.friction_force,
    }
    for what, scale in scales.items():
        if not 1.0 / LARGEST_SCALE <= scale <= LARGEST_SCALE:
            raise DataError(
                f"the data make {what} of {scale:.3g}; models take {1.0 / LARGEST_SCALE:g} to "
                f"{LARGEST_SCALE:g}: are the units metres and newtons?"
            )


def check_input(path: Path) -> str:
    """Return what an input is, by its name: CONTACT, BODY, PUSHES or BAG.

    Raises:
        FileError: There is no such file, or it is of no such kind.
    """
    try:
        path.stat()
    except FileNotFoundError:
        raise FileError(f"{path}: there is no such file; accepted is {ACCEPTED}") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}") from None
    suffix = path.suffix.lower()
    if path.is_dir():
        # What holds the files of a bag alone is told by its reader how to be one.
        if not is_bag_folder(path) and not any(map(is_bag, path.iterdir())):
            raise FileError(
                f"{path}: is a folder without a metadata.yaml, so no bag; accepted is {ACCEPTED}"
            )
    elif suffix not in (*SUFFIXES, *TABLE_SUFFIXES, *BAG_SUFFIXES):
        found = f"files that end in {suffix} are" if suffix else "a file without a suffix is"
        raise FileError(f"{path}: {found} not known; accepted is {ACCEPTED}")
    return kind_of_input(path)


def kind_of_input(path: Path) -> str:
    """Return what an input that is there is, by its name: CONTACT, BODY, PUSHES or BAG."""
    if is_bag(path):
        return BAG
    if path.suffix.lower() in BODY_SUFFIXES:
        return BODY
    return CONTACT if path.suffix.lower() in YAML_SUFFIXES else PUSHES


def is_bag_folder(path: Path) -> bool:
    """Tell whether a folder is a ROS 2 bag."""
    return (path / "metadata.yaml").is_file()
