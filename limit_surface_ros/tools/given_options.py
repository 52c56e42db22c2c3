"""Checks of a command line that argparse does not make: options that would do nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable
    from pathlib import Path

MODEL_SUFFIXES = (".yaml", ".yml")


def refuse_unused(
    parser: argparse.ArgumentParser,
    options: argparse.Namespace,
    names: Iterable[str],
    belongs_to: str,
) -> None:
    """Refuse options that were given though they do nothing here.

    Args:
        parser: Knows what the options are where they are not given.
        options: What it read.
        names: Of the options, as attributes.
        belongs_to: What the options are for, for the error.

    Raises:
        RangeError: One of them is not its default.
    """
    for name in names:
        if getattr(options, name) != parser.get_default(name):
            raise RangeError(f"--{name.replace('_', '-')} does nothing here: it is {belongs_to}")


def model_name(output: Path, name: str | None) -> str:
    """Return the name of the model that a program writes, by default that of its file.

    Raises:
        RangeError: The file is not to be YAML, or the name is empty.
    """
    if output.suffix.lower() not in MODEL_SUFFIXES:
        raise RangeError(f"{output}: a model file must end in {' or '.join(MODEL_SUFFIXES)}")
    if name is not None and not name.strip():
        raise RangeError("--name must not be empty")
    return output.stem if name is None else name
