# SPDX-License-Identifier: Apache-2.0
"""Contact files: where and how hard a body presses on the ground, in YAML.

Keys: `schema: 1`, `name`, `frame_id` (default "object"), `reference_point` ("centroid", the
default, or [x, y] in metres), `symmetry` ("auto", the default, "none", or a list of the axes x
and y about which a fitted model is to be its own mirror image), and one of two descriptions. All
lengths are metres, forces newtons. `outline` (optional, see `outline_section`) is that of the
body, which pushers touch; if it is not given it is the rim of the shape.

Support points: `points` ([x, y] each) and what each can resist with, one of
  `friction_limits`: mu N of each; `normal_force` of the whole body is optional: it tells at which
    weight the limits hold;
  `friction_coefficient` and `loads`, the normal force of each;
  `friction_coefficient`, `normal_force` of the whole body and its `centre_of_mass` [x, y]: three
    feet or fewer by statics, more as springs, equal ones or of the given `stiffnesses`.

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

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.files.outline_section import outline_of_shape, read_outline
from limit_surface_ros.files.section import place_errors
from limit_surface_ros.files.yaml_reader import read_yaml
from limit_surface_ros.surface.contact import pressure as pressures
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch, natural_scaling
from limit_surface_ros.surface.contact.statics import support_loads
from limit_surface_ros.surface.contact.symmetry import MIRRORS, mirror_axes
from limit_surface_ros.surface.kinds.point_contacts import PointContacts

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.section import Section
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.contact.pressure import Pressure
    from limit_surface_ros.surface.contact.shapes import Cells

SCHEMA = 1
# Cells of a patch at most: more take gigabytes, and loads are exact to 1e-6 long before.
MOST_CELLS = 1_000_000
_OF_FEET = (
    "is for `points`; a patch says where its weight rests by "
    "`pressure: {kind: linear, centre_of_pressure: [x, y]}`"
)
_ACCEPTED = "a contact has either `points` or a `shape`"
# What hardly any body has: characteristic lengths [m], coefficients of friction, angles [rad].
_LONG, _ROUGH, _TURN = 5.0, 2.0, 2.0 * pi


@dataclass(frozen=True, eq=False)
class ContactModel:
    """A body's contact with the ground, as a file gives it.

    Attributes:
        name: Name of the contact.
        frame_id: Frame in which the reference point is given.
        reference_point: About which the surface takes moments [m], shape (2,).
        normal_force: Weight on the contact [N]; None if the file gives friction limits alone.
        surface: Its exact limit surface; another weight is `surface.with_friction_force`.
        of_points: Whether the contact is its support points, and not a patch cut into cells.
        symmetry: Of the axes "x" and "y" those about which a model of it is to be symmetric.
        load_method: How the loads of the feet were found, if they were; see `support_loads`.
        doubts: What is not impossible but looks like a slip, such as other units; sentences.
        outline: Of the body, which pushers touch: given, or the rim of its shape; None otherwise.
    """

    name: str
    frame_id: str
    reference_point: Floats
    normal_force: float | None
    surface: PointContacts
    of_points: bool = False
    symmetry: tuple[str, ...] = ()
    load_method: str | None = None
    doubts: tuple[str, ...] = ()
    outline: Outline | None = None


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
    name = section.name("name")
    frame_id = section.name("frame_id", "object")
    reference = _read_reference_point(section)
    if "points" in section:
        model = _read_points(section, name, frame_id, reference)
    elif "shape" in section:
        if "centre_of_mass" in section:
            raise section.error("centre_of_mass", _OF_FEET)
        model = _read_patch(section, name, frame_id, reference)
    else:
        raise section.error("points", f"missing; {_ACCEPTED}")
    symmetry, unlike = _read_symmetry(section, model.surface)
    if "outline" in section:
        outline: Outline | None = read_outline(section)
    else:
        outline = outline_of_shape(section.section("shape")) if "shape" in section else None
        # It is accepted all the same, and told as such beside a key that is not.
        section.raw("outline", None)
    section.finish()
    return replace(model, symmetry=symmetry, doubts=(*model.doubts, *unlike), outline=outline)


def doubts_of_contact(surface: PointContacts, friction_coefficient: float | None) -> list[str]:
    """Return what of a contact looks like a slip: lengths of other units, impossible friction."""
    doubts = []
    length = surface.scaling.characteristic_length
    if length > _LONG:
        doubts.append(
            f"the friction acts at a mean distance of {length:.3g} m from the reference point: "
            "are the lengths in metres?"
        )
    if friction_coefficient is not None and friction_coefficient > _ROUGH:
        doubts.append(
            f"a friction coefficient of {friction_coefficient:g} is more than rubber has: is it a "
            "percentage, or an angle?"
        )
    return doubts


def _read_symmetry(section: Section, surface: PointContacts) -> tuple[tuple[str, ...], list[str]]:
    """Return the axes of symmetry, and a doubt for each stated one that the contact has not."""
    given = section.raw("symmetry", "auto")
    found = mirror_axes(surface)
    if given == "auto":
        return found, []
    if given == "none":
        return (), []
    if not isinstance(given, list) or any(axis not in MIRRORS for axis in given):
        raise section.error(
            "symmetry", f"must be auto, none, or a list of the axes x and y, got {given!r}"
        )
    stated = tuple(sorted(set(given), key=lambda axis: (axis not in found[:1], axis)))
    return stated, [
        f"symmetry about {axis} is stated, but the contact is not its own mirror image about the "
        f"{axis} axis through the reference point: the model will be symmetric all the same"
        for axis in stated
        if axis not in found
    ]


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
    if "friction_limits" in section or "friction_coefficient" not in section:
        key, mu, method = "friction_limits", None, None
        limits = section.array(key, (len(points),), at_least=0.0)
        force = section.number("normal_force", above=0.0) if "normal_force" in section else None
    else:
        key = "loads" if "loads" in section else "centre_of_mass"
        mu = section.number("friction_coefficient", above=0.0)
        loads, method = _read_loads(section, points)
        limits, force = mu * loads, float(loads.sum())
    chosen = _without_residues(points.mean(axis=0), points) if reference is None else reference

    def build() -> PointContacts:
        arms = points - chosen
        return PointContacts(arms, limits, natural_scaling(arms, limits))

    surface = place_errors(section, key, build)
    return ContactModel(
        name,
        frame_id,
        chosen,
        force,
        surface,
        of_points=True,
        load_method=method,
        doubts=tuple(doubts_of_contact(surface, mu)),
    )


def _read_loads(section: Section, points: Floats) -> tuple[Floats, str | None]:
    """Return the normal forces of the feet [N], shape (n,), and how they were found."""
    if "loads" in section:
        return section.array("loads", (len(points),), at_least=0.0), None
    if "normal_force" not in section or "centre_of_mass" not in section:
        raise section.error(
            "loads",
            "missing; beside points and friction_coefficient stand either the loads of the "
            "points, or normal_force and centre_of_mass of the body",
        )
    force = section.number("normal_force", above=0.0)
    centre = section.array("centre_of_mass", (2,))
    stiffnesses = (
        section.array("stiffnesses", (len(points),)) if "stiffnesses" in section else None
    )
    found = place_errors(
        section, "centre_of_mass", lambda: support_loads(points, force, centre, stiffnesses)
    )
    return found.loads, found.method


def _without_residues(centre: Floats, points: Floats) -> Floats:
    """Return a centre with coordinates that are rounding of zero set to 0."""
    return np.where(np.abs(centre) <= 1e-12 * np.abs(points).max(), 0.0, centre)


def _read_patch(
    section: Section, name: str, frame_id: str, reference: Floats | None
) -> ContactModel:
    mu = section.number("friction_coefficient", above=0.0)
    force = section.number("normal_force", above=0.0)
    count = section.integer("cells", shapes.DEFAULT_COUNT, at_least=1, at_most=MOST_CELLS)
    shape = section.section("shape")
    angle = float(shape.number("angle", 0.0))
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
    surface = patch.surface(mu, force, chosen)
    doubts = doubts_of_contact(surface, mu)
    if abs(angle) > _TURN:
        doubts.append(f"the shape's angle of {angle:g} rad is more than a turn: is it in degrees?")
    return ContactModel(name, frame_id, chosen, force, surface, doubts=tuple(doubts))


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
