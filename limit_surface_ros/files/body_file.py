# SPDX-License-Identifier: Apache-2.0
"""Robot descriptions (URDF, SDF): how one of their links stands on the ground, as a contact.

The link stands on what is lowest of its collision shapes along the z axis of its own frame: the
face of a box, the end of a cylinder, the triangles of a mesh that lie in that plane; spheres,
corners and the ends of edges are support points. Its mass presses evenly, or, if the centre of
mass is off the middle, as a rigid body on an elastic ground does. The friction coefficient is `mu`
of the first collision (SDF) or `mu1` of the link's gazebo element (URDF), unless one is given.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

import numpy as np

from limit_surface_ros.errors import FileError, LimitSurfaceError, MissingExtraError
from limit_surface_ros.files.contact_file import ContactModel, doubts_of_contact
from limit_surface_ros.files.mesh_file import read_mesh
from limit_surface_ros.files.regular_file import read_bytes
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.footprint import Footprint, Ground, ground_contact
from limit_surface_ros.surface.contact.patch import ContactPatch, natural_scaling
from limit_surface_ros.surface.contact.statics import support_loads
from limit_surface_ros.surface.contact.symmetry import mirror_axes
from limit_surface_ros.surface.kinds.point_contacts import PointContacts

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

SUFFIXES = (".urdf", ".sdf")
MOST_BYTES = 16 * 1024 * 1024
GRAVITY = 9.80665
# Nested elements of a description at most: none has a dozen.
_DEEPEST = 100
_IDENTITY = np.eye(4)


def read_body(
    path: str | Path,
    link: str | None = None,
    friction_coefficient: float | None = None,
    normal_force: float | None = None,
    cells: int = shapes.DEFAULT_COUNT,
) -> ContactModel:
    """Read how a link of a URDF or SDF stands on the ground.

    Args:
        path: The description.
        link: Name of the link; the only one if not given.
        friction_coefficient: In place of the file's.
        normal_force: [N], in place of the weight of the link's mass.
        cells: About how many an area is cut into.

    Raises:
        FileError: The file is absent, no valid description, or does not say what is needed; the
            message names what is missing and which option gives it.
        MissingExtraError: The link stands on a mesh and shapely is not installed.
    """
    root = _parsed(path)
    found = _link(path, root, link)
    name = found.get("name") or "link"
    place = f"{path}: link {name!r}"
    mu = friction_coefficient or _friction(root, found, name)
    if mu is None:
        raise FileError(f"{place}: states no friction coefficient: give --friction-coefficient")
    mass, centre = _inertia(place, found)
    if normal_force is None and mass is None:
        raise FileError(f"{place}: states no mass: give --normal-force [N]")
    force = normal_force or GRAVITY * (mass or 0.0)
    try:
        contact = ground_contact(_shapes(Path(path), place, found), cells)
        return _model(name, contact, mu, force, centre)
    except (FileError, MissingExtraError):
        raise
    except LimitSurfaceError as error:
        raise FileError(f"{place}: {error}") from None


def _model(
    name: str, contact: Footprint, mu: float, force: float, centre: Floats | None
) -> ContactModel:
    if contact.cells is not None:
        off = centre is not None and bool(
            np.linalg.norm(centre - contact.cells.centroid) > 1e-6 * contact.cells.reach
        )
        patch = ContactPatch.of_shape(contact.cells)
        if off and centre is not None:
            # An elastic ground under a rigid body: a linear pressure, 0 where the body lifts.
            pressed = support_loads(patch.points, force, centre, contact.cells.sizes)
            patch = ContactPatch(patch.points, pressed.loads / force, patch.centroid)
        surface = patch.surface(mu, force)
        reference, method, of_points = patch.centroid, None, False
    else:
        points, of_points = contact.points, True
        middle = points.mean(axis=0) if centre is None else centre
        loads = support_loads(points, force, middle)
        reference, method = points.mean(axis=0), loads.method
        limits = mu * loads.loads
        surface = PointContacts(
            points - reference, limits, natural_scaling(points - reference, limits)
        )
    return ContactModel(
        name=name,
        frame_id=name,
        reference_point=reference,
        normal_force=force,
        surface=surface,
        of_points=of_points,
        symmetry=mirror_axes(surface),
        load_method=method,
        doubts=tuple(doubts_of_contact(surface, mu)),
    )


def _parsed(path: str | Path) -> ET.Element:
    """Return the root of a description without entities, of a bounded depth.

    Raises:
        FileError: It is no XML, declares a document type, or nests too deep.
    """
    content = read_bytes(path, MOST_BYTES, "a robot description")
    checker = expat.ParserCreate()
    depth = 0

    def refuse(*_: object) -> None:
        raise FileError(f"{path}: declares a document type; entities are not read")

    def begin(*_: object) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise FileError(f"{path}: nests elements deeper than {_DEEPEST}")

    def end(*_: object) -> None:
        nonlocal depth
        depth -= 1

    checker.StartDoctypeDeclHandler = refuse
    checker.StartElementHandler = begin
    checker.EndElementHandler = end
    try:
        checker.Parse(content, True)
        root = ET.fromstring(content)
    except (expat.ExpatError, ET.ParseError, ValueError, LookupError) as error:
        raise FileError(f"{path}: is no valid XML: {error}") from None
    if "xacro" in content[:4096].decode("utf-8", "replace") and any(
        "xacro" in each.tag for each in root.iter()
    ):
        raise FileError(f"{path}: is a xacro file: make a URDF of it first: xacro {path} > ...")
    return root


def _link(path: str | Path, root: ET.Element, name: str | None) -> ET.Element:
    """Return the link of that name, or the only one."""
    links = {each.get("name") or "": each for each in root.iter("link") if len(each)}
    names = ", ".join(sorted(links)) or "none"
    if name is None:
        if len(links) == 1:
            return next(iter(links.values()))
        raise FileError(f"{path}: name one of its links by --link: {names}")
    if name not in links:
        raise FileError(f"{path}: has no link {name!r} with anything in it; it has: {names}")
    return links[name]


def _friction(root: ET.Element, link: ET.Element, name: str) -> float | None:
    """Return the friction coefficient of a link, None where nothing states a positive one."""
    texts = [each.text for each in link.iterfind("collision/surface/friction/ode/mu")] + [
        each.text or each.get("value")
        for gazebo in root.iterfind("gazebo")
        if gazebo.get("reference") == name
        for each in gazebo.iterfind("mu1")
    ]
    numbers = [_numbers(name, "mu", text, 1)[0] for text in texts if text]
    return next((number for number in numbers if number > 0.0), None)


def _inertia(place: str, link: ET.Element) -> tuple[float | None, Floats | None]:
    """Return mass [kg] and centre of mass (x, y) [m] of a link, None where it states none."""
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None or mass is None:
        return None, None
    value = _numbers(place, "mass", mass.get("value") or mass.text, 1)[0]
    if not value > 0.0:
        return None, None
    return float(value), _pose(place, inertial)[:2, 3]


def _shapes(path: Path, place: str, link: ET.Element) -> list[Ground]:
    """Return the collision shapes of a link, or the visual ones where it has no others."""
    bodies = link.findall("collision") or link.findall("visual")
    if not bodies:
        raise FileError(f"{place}: has neither collision nor visual geometry")
    return [_shape(path, place, each) for each in bodies]


def _shape(path: Path, place: str, body: ET.Element) -> Ground:
    pose, geometry = _pose(place, body), body.find("geometry")
    for shape in [] if geometry is None else geometry:

        def read(key: str, count: int, shape: ET.Element = shape) -> Floats:
            child = shape.find(key)
            text = shape.get(key) or (None if child is None else child.text)
            return _numbers(place, f"{shape.tag} {key}", text, count)

        if shape.tag == "box":
            return Ground.box(read("size", 3), pose)
        if shape.tag == "cylinder":
            return Ground.cylinder(read("radius", 1)[0], read("length", 1)[0], pose)
        if shape.tag == "sphere":
            return Ground.sphere(read("radius", 1)[0], pose)
        if shape.tag == "mesh":
            uri = shape.find("uri")
            named = shape.get("filename") or (None if uri is None else uri.text) or ""
            scaled = shape.get("scale") is not None or shape.find("scale") is not None
            scale = read("scale", 3) if scaled else np.ones(3)
            return Ground.mesh(read_mesh(_resolved(path, place, named.strip())) * scale, pose)
        raise FileError(
            f"{place}: its shape is {shape.tag!r}; read are box, cylinder, sphere and mesh"
        )
    raise FileError(f"{place}: a collision states no geometry")


def _resolved(path: Path, place: str, named: str) -> Path:
    """Return where a mesh lies: beside the description, or in a folder above of its package."""
    scheme, _, rest = named.rpartition("://")
    if scheme in ("", "file"):
        return path.parent / rest
    if scheme in ("package", "model"):
        package, _, inside = rest.partition("/")
        for folder in path.resolve().parents:
            for candidate in (folder / package / inside, folder / inside):
                if candidate.is_file():
                    return candidate
    raise FileError(f"{place}: its mesh {named!r} was not found in the folders above {path}")


def _pose(place: str, element: ET.Element) -> Floats:
    """Return the pose of an element as a 4x4 matrix; URDF's origin or SDF's pose."""
    origin, pose = element.find("origin"), element.find("pose")
    if origin is not None:
        zeros = "0 0 0"
        shift = _numbers(place, "origin xyz", origin.get("xyz") or zeros, 3)
        angles = _numbers(place, "origin rpy", origin.get("rpy") or zeros, 3)
    elif pose is not None:
        if pose.get("relative_to"):
            raise FileError(f"{place}: poses relative to other frames are not read")
        six = _numbers(place, "pose", pose.text or "0 0 0 0 0 0", 6)
        shift, angles = six[:3], six[3:]
        if pose.get("degrees") in ("true", "1"):
            angles = np.radians(angles)
    else:
        return _IDENTITY
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = shift
    return matrix


def _numbers(place: str, what: str, text: str | None, count: int) -> Floats:
    """Return so many finite numbers of a text.

    Raises:
        FileError: It holds something else.
    """
    try:
        values = np.array((text or "").split(), dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise FileError(f"{place}: {what} must be {count} finite numbers, got {text!r}")
    return values
