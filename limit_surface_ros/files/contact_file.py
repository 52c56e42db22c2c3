# SPDX-License-Identifier: Apache-2.0
"""Contact files: where and how hard a body presses on the ground, in YAML.

Keys: `schema: 1`, `name`, `frame_id` (default "object"), `reference_point` ("centroid", the
default, or [x, y] in metres), and one of two descriptions. All lengths are metres, forces newtons.

Support points: `points` ([x, y] each) and `friction_limits` (mu N of each); `normal_force` of the
whole body is optional: it tells at which weight the limits hold.

A patch: `friction_coefficient`, `normal_force` of the whole body, `cells` (about how many, default
1000, at most a million) and
  `shape`: a `kind` with its own keys, and for all `centre` [x, y] and `angle` in radians
    polygon: vertices, holes      disc: radius          ring: inner_radius, outer_radius
    ellipse: semi_axes            rectangle: size       line: start, end
    bitmap: pressures (rows from the top), cell; it takes no `pressure`
  `pressure`: a `kind` with its own keys; uniform if not given
    uniform      linear: centre_of_pressure      rim: power      centre: power
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.section import place_errors
from limit_surface_ros.files.yaml_reader import read_yaml
from limit_surface_ros.surface.contact import pressure as pressures
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch, natural_scaling
from limit_surface_ros.surface.kinds.point_contacts import PointContacts

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.section import Section
    from limit_surface_ros.surface.contact.pressure import Pressure
    from limit_surface_ros.surface.contact.shapes import Cells

SCHEMA = 1
# Cells of a patch at most: more take gigabytes, and loads are exact to 1e-6 long before.
MOST_CELLS = 1_000_000


_ACCEPTED = "a contact has either `points` or a `shape`"


@dataclass(frozen=True, eq=False)
class ContactModel:
    """A body's contact with the ground, as a file gives it.

    Attributes:
        name: Name of the contact.
        frame_id: Frame in which the reference point is given.
        reference_point: About which the surface takes moments [m], shape (2,).
        normal_force: Weight on the contact [N]; None if the file gives friction limits alone.
        surface: Its exact limit surface; another weight is `surface.with_friction_force`.
    """

    name: str
    frame_id: str
    reference_point: Floats
    normal_force: float | None
    surface: PointContacts


def read_contact(path: str | Path) -> ContactModel:
    """Read a contact file.

    Raises:
        FileError: The file is no valid contact; the message names file, key, what was found and
            what is accepted.
        MissingExtraError: The shape is a polygon and shapely is not installed.
    """
    section = read_yaml(path)
    _refuse_models(section)
    section.choice("schema", [SCHEMA])
    name = section.text("name")
    frame_id = section.text("frame_id", "object")
    reference = _read_reference_point(section)
    if "points" in section:
        model = _read_points(section, name, frame_id, reference)
    elif "shape" in section:
        model = _read_patch(section, name, frame_id, reference)
    else:
        raise section.error("points", f"missing; {_ACCEPTED}")
    section.finish()
    return model


def _refuse_models(section: Section) -> None:
    """Name what takes a file that is no contact, but a model."""
    if "kind" in section:
        kind, program = (
            ("decay", "plot_decay") if "rates" in section else ("surface", "plot_surface")
        )
        raise section.error("kind", f"this is a {kind} model: {program} draws it; {_ACCEPTED}")


def _read_reference_point(section: Section) -> Floats | None:
    """Return the reference point, None for the centroid."""
    given = section.raw("reference_point", "centroid")
    if given == "centroid":
        return None
    if isinstance(given, str):
        raise section.error(
            "reference_point", f"must be centroid, or [x, y] in metres, got {given!r}"
        )
    point: Floats = section.array("reference_point", (2,))
    return point


def _read_points(
    section: Section, name: str, frame_id: str, reference: Floats | None
) -> ContactModel:
    points = section.array("points", (None, 2))
    limits = section.array("friction_limits", (len(points),), at_least=0.0)
    force = section.number("normal_force", above=0.0) if "normal_force" in section else None
    chosen = points.mean(axis=0) if reference is None else reference

    def build() -> PointContacts:
        arms = points - chosen
        return PointContacts(arms, limits, natural_scaling(arms, limits))

    return ContactModel(
        name, frame_id, chosen, force, place_errors(section, "friction_limits", build)
    )


def _read_patch(
    section: Section, name: str, frame_id: str, reference: Floats | None
) -> ContactModel:
    mu = section.number("friction_coefficient", above=0.0)
    force = section.number("normal_force", above=0.0)
    count = section.integer("cells", shapes.DEFAULT_COUNT, at_least=1, at_most=MOST_CELLS)
    shape = section.section("shape")
    cells, mapped = place_errors(section, "shape", lambda: _read_shape(shape, count))
    shape.finish()
    if mapped is None:
        described = section.section("pressure", {"kind": "uniform"})
        pressure = place_errors(section, "pressure", lambda: _read_pressure(described))
        described.finish()
    else:
        pressure = mapped
    patch = place_errors(section, "pressure", lambda: ContactPatch.of_shape(cells, pressure))
    chosen = patch.centroid if reference is None else reference
    return ContactModel(name, frame_id, chosen, force, patch.surface(mu, force, chosen))


def _read_shape(section: Section, count: int) -> tuple[Cells, Pressure | None]:
    """Return the cells of a shape, and the pressure that came with it if any."""
    kind = section.choice("kind", [*_SHAPES, "bitmap"])
    mapped: Pressure | None = None
    if kind == "bitmap":
        image = section.raw("pressures")
        first = image[0] if isinstance(image, list) and image else None
        columns = len(first) if isinstance(first, list) else None
        rows = section.array("pressures", (None, columns))
        cells, values = shapes.bitmap(rows, section.number("cell", above=0.0))
        mapped = _given(values)
    else:
        cells = _SHAPES[kind](section, count)
    centre = section.array("centre", (2,), np.zeros(2))
    return cells.placed(centre, section.number("angle", 0.0)), mapped


def _given(values: Floats) -> Pressure:
    return lambda _: values


def _read_polygon(section: Section, count: int) -> Cells:
    holes = section.raw("holes", [])
    vertices = section.array("vertices", (None, 2))
    if not isinstance(holes, list):
        raise section.error("holes", f"must be a list of boundaries, got {holes!r}")
    return shapes.polygon(vertices, holes, count)


_SHAPES: dict[str, Callable[[Section, int], Cells]] = {
    "polygon": _read_polygon,
    "disc": lambda s, n: shapes.disc(s.number("radius", above=0.0), n),
    "ring": lambda s, n: shapes.ring(
        s.number("inner_radius", at_least=0.0), s.number("outer_radius", above=0.0), n
    ),
    "ellipse": lambda s, n: shapes.ellipse(s.array("semi_axes", (2,)), n),
    "rectangle": lambda s, n: shapes.rectangle(s.array("size", (2,)), n),
    "line": lambda s, n: shapes.line(s.array("start", (2,)), s.array("end", (2,)), n),
}


def _read_pressure(section: Section) -> Pressure:
    kind = section.choice("kind", ["uniform", "linear", "rim", "centre"])
    if kind == "linear":
        return pressures.linear(section.array("centre_of_pressure", (2,)))
    if kind == "rim":
        return pressures.rim(section.number("power", 4.0, above=0.0))
    if kind == "centre":
        return pressures.centre_heavy(section.number("power", 2.0, above=0.0))
    return pressures.uniform
