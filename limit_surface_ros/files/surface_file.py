# SPDX-License-Identifier: Apache-2.0
"""Surface model files: a limit surface with its name, frame and history, in YAML.

Keys: `schema: 1`, `name`, `kind`, `frame_id`, `reference_point` [m], `characteristic_length` [m],
`friction_force` [N], `normal_force` [N] (optional), `outline` (of the body, optional; see
`outline_section`), `fit` (how the model came about; free), and last the arrays that the kind
declares, with the whole numbers that count them: `terms`, `exponents` and `matrices` of a
power_sum, `terms` and `matrices` of a dissipation, `points` [m] and `friction_limits` [N] of
point_contacts, `coefficients` of a polynomial in the order of
`surface.kinds.polynomial.MONOMIALS`. Because these come last and are counted, a file cut short
anywhere is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from limit_surface_ros.checks import as_name, as_positive
from limit_surface_ros.errors import DataError
from limit_surface_ros.files.outline_section import outline_values, read_outline
from limit_surface_ros.files.section import Section, place_errors
from limit_surface_ros.files.yaml_reader import read_yaml, write_yaml
from limit_surface_ros.surface.convexity import Convexity, is_convex, warn_unless_convex
from limit_surface_ros.surface.kinds import KINDS
from limit_surface_ros.surface.kinds.dissipation_scatter import UncertainSurface, scatter_of
from limit_surface_ros.surface.scaling import Scaling

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.base import FileArray, LimitSurface

SCHEMA = 1
# Scales [m], [N] beyond this and its reciprocal would take answers out of the range of numbers.
LARGEST_SCALE = 1e12


@dataclass(frozen=True)
class SurfaceModel:
    """A limit surface as it is stored and served.

    Attributes:
        name: By which services ask for it.
        surface: The surface itself, in physical units.
        frame_id: Frame in which its wrenches and twists are given.
        reference_point: (x, y) [m] in that frame, about which moments are taken.
        normal_force: Normal force [N] at which the surface holds, if it is known; another weight
            scales the surface.
        fit: How the model came about: objective, data, errors, date, version. Plain values.
        outline: Of the body in that frame, which pushers touch; None if it is not known.

    Raises:
        RangeError: The name or the frame is empty, too long or not printable, or the normal force
            not above zero.
    """

    name: str
    surface: LimitSurface
    frame_id: str = "object"
    reference_point: tuple[float, float] = (0.0, 0.0)
    normal_force: float | None = None
    fit: Mapping[str, Any] = field(default_factory=dict)
    outline: Outline | None = None

    def __post_init__(self) -> None:
        """Check what the surface itself does not know."""
        for key in ("name", "frame_id"):
            as_name(key, getattr(self, key))
        if self.normal_force is not None:
            as_positive("normal_force", self.normal_force)

    @cached_property
    def convexity(self) -> Convexity:
        """Whether the surface is convex: looked at once, when the model is read."""
        return is_convex(self.surface)

    @cached_property
    def uncertain(self) -> UncertainSurface | None:
        """The surface with the scatter of its twists; None if its fit stored none.

        Raises:
            DataError: What stands under `fit: uncertainty` is not what fits write.
        """
        stored = self.fit.get("uncertainty")
        if stored is None:
            return None
        if not isinstance(stored, Mapping):
            raise DataError("fit: uncertainty is not what fits write: no mapping")
        return UncertainSurface(self.surface, scatter_of(stored, self.surface))


def _read_arrays(section: Section, arrays: Sequence[FileArray]) -> dict[str, Any]:
    """Return the arrays of a kind by their keys."""
    found: dict[str, Any] = {}

    def length(axis: int | str | None) -> int | None:
        if not isinstance(axis, str):
            return axis
        return len(found[axis]) if axis in found else section.integer(axis, at_least=1)

    # The array with the most axes first: beside it a wrong count shows best.
    for array in sorted(arrays, key=lambda array: -len(array.shape)):
        shape = tuple(length(axis) for axis in array.shape)
        found[array.key] = section.array(array.key, shape, at_least=array.at_least)
    return found


def _counts(surface: LimitSurface) -> dict[str, int]:
    """Return the whole numbers that a file of this kind gives beside its arrays."""
    keys = {array.key for array in surface.arrays}
    return {
        axis: getattr(surface, array.key).shape[place]
        for array in surface.arrays
        for place, axis in enumerate(array.shape)
        if isinstance(axis, str) and axis not in keys
    }


def read_surface_model(path: str | Path) -> SurfaceModel:
    """Read a surface model; warn once if its surface is not convex.

    Raises:
        FileError: The file is no valid surface model; the message names file, key, what was found
            and what is accepted.
    """
    section = read_yaml(path)
    section.choice("schema", [SCHEMA])
    if "kind" not in section and ("points" in section or "shape" in section):
        raise section.error("kind", "missing; this is a contact file: fit_surface fits it")
    if "rates" in section:
        raise section.error(
            "kind", "this is a decay model: plot_decay draws it and decay_node serves it"
        )
    kind = KINDS[section.choice("kind", list(KINDS))]
    scaling = Scaling(
        *(
            section.number(key, at_least=1.0 / LARGEST_SCALE, at_most=LARGEST_SCALE)
            for key in ("characteristic_length", "friction_force")
        )
    )
    reference_point = section.array("reference_point", (2,), (0.0, 0.0))
    outline = read_outline(section) if "outline" in section else None
    history = section.section("fit", {})
    arrays = _read_arrays(section, kind.arrays)
    surface = place_errors(section, kind.kind, lambda: kind.of_arrays(arrays, scaling))
    model = SurfaceModel(
        name=section.name("name"),
        surface=surface,
        frame_id=section.name("frame_id"),
        reference_point=(float(reference_point[0]), float(reference_point[1])),
        normal_force=section.number("normal_force", None, above=0.0),
        fit=history.values,
        outline=outline,
    )
    section.finish()
    warn_unless_convex(model.convexity, model.name)
    return model


def write_surface_model(model: SurfaceModel, path: str | Path, header: str = "") -> None:
    """Write a surface model, atomically; read back it gives the same numbers bit for bit.

    Args:
        model: The model.
        path: The file, in a folder that exists.
        header: Lines of a comment at the top, such as the command that made the model.

    Raises:
        FileError: The file cannot be written.
    """
    surface = model.surface
    values: dict[str, Any] = {
        "schema": SCHEMA,
        "name": model.name,
        "kind": surface.kind,
        "frame_id": model.frame_id,
        "reference_point": list(model.reference_point),
        "characteristic_length": surface.scaling.characteristic_length,
        "friction_force": surface.scaling.friction_force,
    }
    if model.normal_force is not None:
        values["normal_force"] = model.normal_force
    if model.outline is not None:
        values["outline"] = outline_values(model.outline)
    if model.fit:
        values["fit"] = dict(model.fit)
    arrays = {array.key: getattr(surface, array.key) for array in surface.arrays}
    write_yaml(path, values | _counts(surface) | arrays, header)
