# SPDX-License-Identifier: Apache-2.0
"""Named models read from files, all or none: what a node serves.

A set is immutable. To load other files, build another set and swap it in: while building fails,
the old one is untouched.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from limit_surface_ros.errors import FileError, UnknownModelError, shortened

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping


# Names in a message, and characters of each; thousands would drown the rest of it.
_LISTED = 20
_NAME = 80


class Named(Protocol):
    """Anything that a model file holds."""

    @property
    def name(self) -> str:
        """By which services ask for it."""
        ...


Model = TypeVar("Model", bound=Named)


class ModelSet(Generic[Model]):
    """Models by name, one of them the default.

    Args:
        models: The models by their names, at least one.
        default: Name of the model that an empty name stands for; empty: the first.
        noun: What a request calls such a model, for messages.

    Raises:
        FileError: There is no model.
        UnknownModelError: The default is not among them.
    """

    def __init__(
        self, models: Mapping[str, Model], default: str = "", noun: str = "model"
    ) -> None:
        """Check that there is a default."""
        self._noun = noun
        self._models = dict(models)
        if not self._models:
            raise FileError("no model file is given; at least one is needed")
        self.default = default or next(iter(self._models))
        self[self.default]

    def __getitem__(self, name: str) -> Model:
        """Return the model of that name; an empty name is the default model's.

        Raises:
            UnknownModelError: No model has that name; the error lists those that are loaded.
        """
        try:
            return self._models[name or self.default]
        except KeyError:
            raise UnknownModelError(
                f"no {self._noun} {shortened(repr(name))} is loaded; loaded are {self.listed()}"
            ) from None

    def __iter__(self) -> Iterator[Model]:
        """Iterate over the models in the order of their files."""
        return iter(self._models.values())

    def __len__(self) -> int:
        """Return the number of models."""
        return len(self._models)

    def joined(self, models: Iterable[Model], default: str = "") -> ModelSet[Model]:
        """Return a set with these models behind; one of the same name takes the other's place.

        Args:
            models: What joins.
            default: Name of the default model; empty: that of this set.

        Raises:
            UnknownModelError: The default is not among them.
        """
        more = {model.name: model for model in models}
        return ModelSet({**self._models, **more}, default or self.default, self._noun)

    def listed(self) -> str:
        """Return the names of the models for people: the first few, and how many more."""
        names = [shortened(name, _NAME) for name in islice(self._models, _LISTED)]
        if len(self) > _LISTED:
            names[-1] += f" and {len(self) - _LISTED} more"
        return ", ".join(names)


def model_paths(entries: Iterable[str | Path]) -> list[Path]:
    """Return the model files that `entries` name: files as they are, folders as their *.yaml.

    Raises:
        FileError: An entry is empty or does not exist, or a folder holds no *.yaml.
    """
    paths: list[Path] = []
    for entry in entries:
        if not str(entry):
            raise FileError("an entry of the model files is empty")
        try:
            paths += _paths_of(Path(entry).expanduser())
        except FileError:
            raise
        except (OSError, RuntimeError, ValueError) as error:
            # No permission, a name too long, no home folder, a NUL character.
            reason = getattr(error, "strerror", None) or error
            raise FileError(f"{entry}: cannot be read: {reason}") from None
    return paths


def _paths_of(path: Path) -> list[Path]:
    if path.is_dir():
        inside = sorted(path.glob("*.yaml"))
        if not inside:
            raise FileError(f"{path}: the folder holds no *.yaml file")
        return inside
    try:
        path.stat()
    except FileNotFoundError:
        raise FileError(f"{path}: no such file or folder") from None
    return [path]


def read_model_set(
    entries: Iterable[str | Path],
    read: Callable[[Path], Model],
    default: str = "",
    noun: str = "model",
) -> ModelSet[Model]:
    """Read all files and folders that `entries` name into one set.

    Args:
        entries: Model files, or folders whose *.yaml are taken.
        read: Reader of one file, such as `read_surface_model`.
        default: Name of the default model; empty: the first.
        noun: What a request calls such a model, for messages.

    Raises:
        FileError: A file is absent or not valid, or two models share a name.
        UnknownModelError: The default is not among the models.
    """
    models: dict[str, Model] = {}
    places: dict[str, Path] = {}
    for path in model_paths(entries):
        model = read(path)
        if model.name in models:
            raise FileError(
                f"{path}: holds a model named {shortened(repr(model.name))}, as "
                f"{places[model.name]} does: "
                "names must differ"
            )
        models[model.name], places[model.name] = model, path
    return ModelSet(models, default, noun)
