# SPDX-License-Identifier: Apache-2.0
"""What a surface can be exported to: a registry of targets, each a text and what it leaves out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from limit_surface_ros.errors import RangeError
from limit_surface_ros.export.cpp import cpp_header
from limit_surface_ros.export.javascript import javascript_module
from limit_surface_ros.export.mjcf import mujoco_model
from limit_surface_ros.export.portable import portable
from limit_surface_ros.export.python_modules import casadi_module, jax_module
from limit_surface_ros.export.simulators import fit_ellipsoid, match_single_contact
from limit_surface_ros.export.texts import comment

if TYPE_CHECKING:
    from limit_surface_ros.files.surface_file import SurfaceModel

# Targets by name, with the suffix of their files.
SUFFIXES = {
    "cpp": ".hpp",
    "casadi": ".py",
    "jax": ".py",
    "js": ".mjs",
    "mujoco": ".xml",
    "ellipsoid": ".yaml",
}


@dataclass(frozen=True)
class Exported:
    """A surface's text for a target.

    Attributes:
        text: What to write.
        notes: What one should know of it, a line each.
    """

    text: str
    notes: tuple[str, ...]


def export_surface(model: SurfaceModel, target: str, spheres: int = 4) -> Exported:
    """Return the text of a surface for a target.

    Args:
        model: The surface with its name, frame and normal force.
        target: One of `SUFFIXES`.
        spheres: How many spheres stand for the body in MuJoCo, 1 to 32.

    Raises:
        RangeError: The target is no such one, or the number of spheres another.
        DataError: The surface's kind cannot be exported.

    Example:
        >>> from limit_surface_ros.files.surface_file import SurfaceModel
        >>> from limit_surface_ros.surface import PowerSum
        >>> model = SurfaceModel("disc", PowerSum([[[1, 0, 0], [0, 1, 0], [0, 0, 2]]], [1.0]))
        >>> "namespace limit_surface_disc" in export_surface(model, "cpp").text
        True
    """
    surface, name = model.surface, model.name
    x, y = model.reference_point
    title = comment(
        f"Limit surface {name} ({surface.kind}): frame {model.frame_id}, "
        f"reference point ({x:g}, {y:g}) m."
    )
    if target == "mujoco":
        text = mujoco_model(surface, name, title.replace("--", "-"), model.normal_force, spheres)
        return Exported(text, _simulator_notes(model))
    if target == "ellipsoid":
        return _ellipsoid(model, title)
    texts = {
        "cpp": cpp_header,
        "casadi": casadi_module,
        "jax": jax_module,
        "js": javascript_module,
    }
    if target not in texts:
        raise RangeError(f"no target {target!r}; there are {', '.join(SUFFIXES)}")
    numbers = portable(surface)
    notes = []
    if not numbers.convex:
        notes.append(
            f"the load of a twist is not exported: {numbers.not_convex}, "
            "and a search may end in the lower of several answers"
        )
    elif target == "jax":
        notes.append("closed forms only: see the top of the file")
    return Exported(texts[target](numbers, name, title), tuple(notes))


def _simulator_notes(model: SurfaceModel) -> tuple[str, ...]:
    """Return how one contact of other simulators would be matched, and how far off it would be."""
    single = match_single_contact(model.surface)
    force, moment = single.force, single.moment
    return (
        f"one contact instead: friction force {force:.4g} N, largest moment {moment:.4g} N m",
        f"  MuJoCo, condim 4, elliptic: torsional friction {moment / force:.4g} m times the "
        f"sliding coefficient: {single.ellipsoid}",
        f"  SDF (ODE): patch_radius {moment / force * 16.0 / (3.0 * 3.141592653589793):.4g} m "
        f"with equal coefficients; PhysX: minTorsionalPatchRadius {moment / force:.4g} m: "
        f"{single.prism}",
    )


def _ellipsoid(model: SurfaceModel, title: str) -> Exported:
    found = fit_ellipsoid(model.surface)
    rows = "\n".join(f"  - [{', '.join(map(repr, row))}]" for row in found.matrix.tolist())
    text = (
        f"# {title}\n"
        "# The closest ellipsoid f'L f = 1, for planners that take twist = L wrench:\n"
        f"# {found.audit}.\n"
        f"# Rows and columns: fx [N], fy [N], tau_z [N m].\n"
        f"L:\n{rows}\n"
        f"mean_error_deg: {found.audit.mean!r}\n"
        f"error_95_deg: {found.audit.high!r}\n"
    )
    return Exported(text, (str(found.audit),))
