# SPDX-License-Identifier: Apache-2.0
"""The models that a node serves: read all or none, swapped in one step, prepared ahead."""

from __future__ import annotations

import threading
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Generic

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from limit_surface_ros.errors import FileError, UnknownModelError
from limit_surface_ros.files.model_set import Model, ModelSet, read_model_set
from limit_surface_ros.nodes.serving.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from limit_surface_ros.nodes.serving.parameters import Parameters, Values

_IN_PACKAGE = "package://"


def model_settings(
    folder: str, noun: str, files: str = "model_files", default: str = "default_model"
) -> tuple[Setting, ...]:
    """Return the settings that say which models are served.

    Args:
        folder: Folder of the models that ship with this package.
        noun: What the files hold, for the descriptions.
        files: Name of the parameter that names the files.
        default: Name of the parameter that names the default model.
    """
    return (
        Setting(
            files,
            [f"{_IN_PACKAGE}limit_surface_ros/{folder}"],
            f"YAML files of {noun}, or folders whose *.yaml are taken, as paths or "
            "package://NAME/PATH",
        ),
        Setting(
            default,
            "",
            "Name of the model that an empty name in a request and the topics stand for; "
            "empty: the first",
        ),
    )


class ModelHost(Generic[Model]):
    """The present set of models.

    Args:
        parameters: The node's parameters, which include `model_settings`.
        read: Reader of one file.
        prepare: Does ahead for a model what its first requests would have to wait for, in a thread
            of its own; None: there is nothing.
        warn: Called with what is to be said of a model that is accepted.
        files: Name of the parameter that names the files.
        default: Name of the parameter that names the default model.
        noun: What a request calls such a model, for messages.
        stand_in: Tells which model stands for a default that `add` brings later; "": none does.

    Attributes:
        models: The models; replaced as a whole.
        names: Names of the two parameters.

    Raises:
        FileError: A file is absent or not valid, or two models share a name.
        UnknownModelError: The default is not among the models.
    """

    models: ModelSet[Model]

    def __init__(
        self,
        parameters: Parameters,
        read: Callable[[Path], Model],
        warn: Callable[[str], object],
        files: str = "model_files",
        default: str = "default_model",
        noun: str = "model",
        prepare: Callable[[Model], object] | None = None,
        stand_in: Callable[[str], str] | None = None,
    ) -> None:
        """Read the models that the parameters name."""
        self._noun = noun
        self._stand_in = stand_in
        # The default that is not there yet.
        self._awaited = ""
        self._read = read
        self._warn = warn
        self._prepare_one = prepare
        self._preparing: ModelSet[Model] | None = None
        self._thread: threading.Thread | None = None
        self.names = (files, default)
        # Models that come from no file, which a reload leaves alone.
        self._added: dict[str, Model] = {}
        self._read_last: ModelSet[Model] | None = None
        parameters.on_change(self.names, self._prepare, as_a_set=True)

    def add(self, model: Model) -> None:
        """Serve a model that comes from no file, in place of one of its name."""
        self._added[model.name] = model
        awaited, self._awaited = self._awaited, ""
        self.models = self.models.joined([model], awaited if awaited == model.name else "")

    @property
    def summary(self) -> str:
        """What is loaded, for people."""
        models = self.models
        count = f"{len(models)} loaded from {self.names[0]}"
        return f"{count}: {models.listed()}; default {models.default}"

    @property
    def prepared(self) -> bool:
        """Whether all that is done ahead for the present models is done."""
        return self._thread is None or not self._thread.is_alive()

    def prepare_what_was_read(self) -> None:
        """Do ahead for the models that were read last what can be; not for the node's thread."""
        models = self._read_last
        if models is not None and self._prepare_one is not None:
            for model in models:
                self._prepare_one(model)

    def close(self) -> None:
        """Stop preparing."""
        self._preparing = None

    def _prepare(self, values: Values) -> Callable[[], None]:
        files, default = (values[name] for name in self.names)
        # Warnings belong into the node's log, not to standard error with a line of our source.
        with warnings.catch_warnings(record=True) as raised:
            models, served = self._read_set(files, default)
        for warning in raised:
            self._warn(str(warning.message))
        self._read_last = models

        def apply() -> None:
            self.models = served.joined(self._added.values())
            self._start_preparing(models)

        return apply

    def _read_set(
        self, files: Iterable[str], default: str
    ) -> tuple[ModelSet[Model], ModelSet[Model]]:
        """Return what the files hold, and that with what was added."""
        models = read_model_set(resolved(files), self._read, noun=self._noun)
        stand_in = self._stand_in(default) if self._stand_in is not None else ""
        if stand_in and not self._added:
            self._awaited, default = default, stand_in
        try:
            return models, models.joined(self._added.values(), default)
        except UnknownModelError as error:
            names = " and ".join(self.names)
            raise UnknownModelError(
                f"{self.names[1]}: {error}; set {names} in one request, as `ros2 param load` "
                f"does, or {self.names[1]} to '' first"
            ) from None

    def _start_preparing(self, models: ModelSet[Model]) -> None:
        if self._prepare_one is None:
            return
        self._preparing = models
        self._thread = threading.Thread(
            target=self._prepare_all, args=(models, self._prepare_one), daemon=True
        )
        self._thread.start()

    def _prepare_all(self, models: ModelSet[Model], prepare: Callable[[Model], object]) -> None:
        default = models[""]
        for model in [default, *(model for model in models if model is not default)]:
            if self._preparing is not models:
                return
            try:
                prepare(model)
            except Exception as error:
                # It will be answered by, or refused, when it is asked for.
                self._warn(f"{self._noun} {model.name!r} could not be prepared: {error}")


def resolved(entries: Iterable[str]) -> list[str]:
    """Return the entries with package://NAME/PATH replaced by paths.

    Raises:
        FileError: A package is not installed.
    """
    return [_resolved(entry) for entry in entries]


def _resolved(entry: str) -> str:
    if not entry.startswith(_IN_PACKAGE):
        return entry
    package, _, inside = entry.removeprefix(_IN_PACKAGE).partition("/")
    try:
        share = get_package_share_directory(package)
    except (PackageNotFoundError, LookupError, ValueError):
        raise FileError(f"{entry}: package {package!r} is not installed here") from None
    return str(Path(share) / inside)
