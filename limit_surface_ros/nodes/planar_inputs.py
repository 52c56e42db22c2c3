# SPDX-License-Identifier: Apache-2.0
"""Stamped wrenches and twists to planar ones about a model's reference point, in its frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.errors import RangeError
from limit_surface_ros.nodes import convert
from limit_surface_ros.nodes.settings import Setting
from limit_surface_ros.surface.frames import RigidTransform, out_of_plane, planar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from geometry_msgs.msg import TwistStamped, WrenchStamped
    from limit_surface_interfaces.srv import Push
    from std_msgs.msg import Header

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.nodes.frames import Frames
    from limit_surface_ros.nodes.parameters import Parameters
    from limit_surface_ros.surface.base import LimitSurface

SETTINGS = (
    Setting(
        "normal_force_from",
        "model",
        "What presses the body on its support: `model` takes surfaces as they are, `wrench` "
        "scales them to the force -force.z of each wrench (the body's weight included), "
        "`parameter` to normal_force",
        choices=("model", "wrench", "parameter"),
    ),
    Setting(
        "normal_force",
        1.0,
        "Normal force if normal_force_from is `parameter` [N]",
        minimum=1e-9,
        maximum=1e9,
    ),
    Setting(
        "out_of_plane_tolerance",
        0.1,
        "Part of a wrench or twist outside the plane, relative to the planar part, above which "
        "it is reported",
        minimum=0.0,
        maximum=1e9,
    ),
)


class Planar(NamedTuple):
    """A planar wrench or twist, and the surface that it is for.

    Attributes:
        surface: The model's surface at the present normal force.
        vector: (fx, fy, tau_z) or (vx, vy, omega_z), shape (3,).
    """

    surface: LimitSurface
    vector: Floats


class Contact(NamedTuple):
    """A pusher's contact in the plane of a model, about its reference point.

    Attributes:
        point: (x, y) [m].
        normal: Pointing into the body.
        friction: Coefficient between pusher and body.
        velocity: Of the pusher [m/s].
    """

    point: Sequence[float]
    normal: Sequence[float]
    friction: float
    velocity: Sequence[float]


class PlanarInputs:
    """Turns inputs into what a surface takes.

    Args:
        parameters: The node's parameters, which include `SETTINGS`.
        frames: Transforms to the models' frames.
        report: Told of what is left out and not small: a key and a sentence.
    """

    def __init__(
        self, parameters: Parameters, frames: Frames, report: Callable[[str, str], None]
    ) -> None:
        """Keep what is needed."""
        self._parameters = parameters
        self._frames = frames
        self._report = report

    def wrench(self, model: SurfaceModel, stamped: WrenchStamped) -> Planar:
        """Return a wrench as the model takes it.

        Raises:
            NotFiniteError: A component is NaN or infinite.
            RangeError: A component is out of this world, or nothing presses the body down.
            FrameError: The frame is empty or no transform to the model's is known.
        """
        six = convert.wrench_components(stamped.wrench)
        transform = self._to_reference(model, stamped.header)
        if transform is not None:
            six = transform.wrench(six).tolist()
        pressing = self._parameters["normal_force_from"] == "wrench"
        length = 1.0 / model.surface.scaling.characteristic_length
        self._look_out_of_plane("wrench", out_of_plane(six, length, pressing=pressing))
        return Planar(self._surface(model, -six[2]), _vector("wrench", six))

    def twist(self, model: SurfaceModel, stamped: TwistStamped) -> Planar:
        """Return a twist as the model takes it.

        Raises:
            NotFiniteError: A component is NaN or infinite.
            RangeError: A component is out of this world.
            FrameError: The frame is empty or no transform to the model's is known.
        """
        six = convert.twist_components(stamped.twist)
        transform = self._to_reference(model, stamped.header)
        if transform is not None:
            six = transform.twist(six).tolist()
        length = model.surface.scaling.characteristic_length
        self._look_out_of_plane("twist", out_of_plane(six, length))
        return Planar(self._surface(model, None), _vector("twist", six))

    def contact(self, model: SurfaceModel, request: Push.Request) -> Contact:
        """Return a contact and the pusher's velocity there, in the model's plane.

        Raises:
            NotFiniteError: A number is NaN or infinite.
            RangeError: A number is out of this world.
            FrameError: The frame is empty or no transform to the model's is known.
        """
        point = convert.vector_components("contact", request.contact.point)
        normal = convert.vector_components("normal", request.normal)
        velocity = convert.vector_components("velocity", request.velocity)
        transform = self._to_reference(model, request.contact.header)
        if transform is not None:
            point = transform.point(point).tolist()
            normal = transform.direction(normal).tolist()
            velocity = transform.direction(velocity).tolist()
        friction = convert.checked_number("friction", request.friction)
        return Contact(point[:2], normal[:2], friction, velocity[:2])

    def surface(self, model: SurfaceModel) -> LimitSurface:
        """Return a model's surface where no wrench says how hard the body is pressed."""
        return self._surface(model, None)

    def _to_reference(self, model: SurfaceModel, header: Header) -> RigidTransform | None:
        """Return the transform from a message's frame to axes at the model's reference point.

        A message in the model's own frame is about the reference point already; one in any other
        frame acts at that frame's origin, also where the two frames coincide.
        """
        transform = self._frames.to_model(model.frame_id, header)
        if transform is None or model.reference_point == (0.0, 0.0):
            return transform
        x, y = model.reference_point
        return RigidTransform(np.eye(3), np.array([-x, -y, 0.0])) @ transform

    def _look_out_of_plane(self, what: str, share: float) -> None:
        if share > self._parameters["out_of_plane_tolerance"]:
            self._report(
                f"out-of-plane {what}",
                f"the part of a {what} outside the plane is {share:.2g} of the planar part and "
                "is left out",
            )

    def _surface(self, model: SurfaceModel, pressed: float | None) -> LimitSurface:
        source = self._parameters["normal_force_from"]
        if source == "model" or (source == "wrench" and pressed is None):
            return model.surface
        force = self._parameters["normal_force"] if source == "parameter" else pressed
        if model.normal_force is None:
            raise RangeError(
                f"model {model.name!r} states no normal_force, so it cannot be scaled; state "
                "it in the model's file, or set normal_force_from to model"
            )
        if not force > 0.0:
            raise RangeError(
                f"nothing presses the body on its support: force.z is {-force:g} in the model's "
                "frame and must be below 0 if normal_force_from is wrench"
            )
        return model.surface.scaled(force / model.normal_force)


def _vector(what: str, six: Sequence[float]) -> Floats:
    """Return the planar part; a zero one is for the surface to accept or refuse."""
    vector = planar(six)
    if 0.0 < max(map(abs, vector)) < convert.SMALLEST:
        raise RangeError(
            f"{what} is below {convert.SMALLEST:g} in size, too small for a direction"
        )
    return np.array(vector)
