"""What a program fits or compares surfaces on: pairs, and what is known about them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.bag_pushes import Selection, read_bag_pushes
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.fitting.simulation import simulated_pairs
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from collections.abc import Mapping

    from limit_surface_ros.surface.pairs import Pairs

SUFFIXES = (".yaml", ".yml", ".csv")
ACCEPTED = "a contact file (.yaml, .yml), recorded pushes (.csv), or a ROS 2 bag"


@dataclass(frozen=True)
class TrainingData:
    """Pairs to fit, pairs held out, and where they came from.

    Attributes:
        training: What the fit sees.
        held_out: What it does not, if there is any.
        characteristic_length: [m], if the source states it.
        support: Support points that the source states, if it does.
        normal_force: [N], if the source states it.
        reference_point: Of the contact that was simulated [m].
        recorded: Whether the pairs were measured and not simulated.
        about: For the model file.
    """

    training: Pairs
    held_out: Pairs | None = None
    characteristic_length: float | None = None
    support: PointContacts | None = None
    normal_force: float | None = None
    reference_point: tuple[float, float] = (0.0, 0.0)
    recorded: bool = False
    about: Mapping[str, Any] = field(default_factory=dict)


def row_numbers(text: str) -> list[int]:
    """Read row numbers and ranges, such as "0,3,10-14".

    Raises:
        DataError: The text is no such list, or names a row twice.
    """
    numbers: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        try:
            numbers.extend(range(int(first), int(last if dash else first) + 1))
        except ValueError:
            raise DataError(f"rows must be like 0,3,10-14; got {text!r}") from None
    if len(set(numbers)) != len(numbers) or not numbers:
        raise DataError(f"rows must name at least one row, and each once; got {text!r}")
    return numbers


def training_data_of_pushes(path: Path, rows: list[int] | None) -> TrainingData:
    """Read recorded pushes; the rows that are not selected are held out.

    The first line's `rho_m` [m] gives the characteristic length where it stands.
    """
    pushes = read_pushes(path)
    training = pushes.pairs if rows is None else pushes.rows(rows)
    others = len(pushes.pairs) - len(training)
    support = pushes.support()
    return TrainingData(
        training=training,
        support=None if support is None else PointContacts(*support),
        held_out=pushes.rest(rows) if rows is not None and others else None,
        characteristic_length=pushes.number("rho_m"),
        normal_force=pushes.number("normal_force_N"),
        recorded=True,
        about={"data": path.name, "rows": "all" if rows is None else rows},
    )


def training_data_of_bag(
    path: Path, wrench_topic: str | None, motion_topic: str | None, selection: Selection
) -> TrainingData:
    """Read the quasi-static pushes of a bag.

    Raises:
        DataError: A topic is not named.
    """
    if wrench_topic is None or motion_topic is None:
        raise DataError(f"{path}: is a bag: name --wrench-topic and --motion-topic")
    pushes = read_bag_pushes(path, wrench_topic, motion_topic, selection)
    about = {
        "data": path.name,
        "wrench_topic": wrench_topic,
        "motion_topic": motion_topic,
        "selection": asdict(selection),
        "wrenches": pushes.samples,
        "dropped": pushes.dropped,
    }
    return TrainingData(training=pushes.pairs, recorded=True, about=about)


def is_bag(path: Path) -> bool:
    """Tell whether a path is a ROS 2 bag: a folder, or a file of one of the storages."""
    return path.is_dir() or path.suffix.lower() in (".mcap", ".db3")


@dataclass(frozen=True)
class Simulation:
    """How pairs are made from a contact; see `fitting.simulation`."""

    motions: int = 2000
    per_facet: int = 150
    load_noise: float = 0.0
    motion_noise: float = 0.0
    seed: int = 0


def training_data_of_contact(
    path: Path, simulation: Simulation, characteristic_length: float | None
) -> TrainingData:
    """Make pairs from a contact file, and as many fresh motions without noise to test on."""
    contact = read_contact(path)
    exact = contact.surface
    if characteristic_length is not None:
        scaling = Scaling(characteristic_length, exact.scaling.friction_force)
        exact = PointContacts(exact.points, exact.friction_limits, scaling)
    training = simulated_pairs(
        exact,
        simulation.motions,
        simulation.per_facet,
        load_noise=simulation.load_noise,
        motion_noise=simulation.motion_noise,
        seed=simulation.seed,
    )
    x, y = (float(component) for component in contact.reference_point)
    return TrainingData(
        training=training,
        held_out=random_motions(exact, simulation.motions, simulation.seed + 1),
        characteristic_length=exact.scaling.characteristic_length,
        support=exact,
        normal_force=contact.normal_force,
        reference_point=(x, y),
        about={"data": path.name, **asdict(simulation)},
    )


def check_input(path: Path) -> str:
    """Return the suffix of an input that exists.

    Raises:
        FileError: There is no such file.
    """
    if not path.exists():
        raise FileError(f"{path}: there is no such file; accepted is {ACCEPTED}")
    return path.suffix.lower()
