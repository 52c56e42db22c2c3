# SPDX-License-Identifier: Apache-2.0
"""Stamped wrenches and twists to planar ones about a model's reference point, and back.

One rule: what is stamped in a frame acts at that frame's origin, the model's own frame included,
and answers stand in the model's frame, at its origin. A surface takes and gives vectors about the
model's reference point (x, y), so that here moments and velocities are moved between the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from limit_surface_ros.checks import as_name
from limit_surface_ros.errors import RangeError, shortened
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.serving.settings import Setting
from limit_surface_ros.surface.frames import RigidTransform, out_of_plane

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from geometry_msgs.msg import TwistStamped, WrenchStamped
    from limit_surface_interfaces.srv import Push
    from std_msgs.msg import Header

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.files.surface_file import SurfaceModel
    from limit_surface_ros.nodes.messages.frames import Frames
    from limit_surface_ros.nodes.models.model_host import ModelHost
    from limit_surface_ros.nodes.serving.parameters import Parameters, Values
    from limit_surface_ros.surface.base import LimitSurface


# What is learnt of a model is of the same body, and named by this behind the model's name.
LEARNT = "_learnt"


def frames_by_model(texts: Iterable[str]) -> dict[str, str]:
    """Return the frames that 'model=frame' texts give to models; the last = divides the two.

    Raises:
        RangeError: A text is not understood, a frame begins or ends with a space, or a model is
            named twice.
    """
    frames: dict[str, str] = {}
    for text in texts:
        model, _, frame = text.rpartition("=")
        if not (model.strip() and frame.strip()) or frame != frame.strip():
            raise RangeError(
                f"{shortened(text)!r}: accepted is 'model=frame', no space about the ="
            )
        as_name("frame", frame)
        if model in frames:
            raise RangeError(f"model {shortened(model)!r} is given two frames")
        frames[model] = frame
    return frames


def _check_prefix(text: str) -> None:
    if text:
        as_name("prefix", text)


SETTINGS = (
    Setting(
        "frame_prefix",
        "",
        "Put before the frame_id of every model file, such as 'left/' for the left of two robots",
        check=_check_prefix,
    ),
    Setting(
        "frame_ids",
        [],
        "Frames of single models in place of those of their files, each 'model=frame', such as "
        "'box=box_12' for a perceived object, of what is learnt of them too; frame_prefix is not "
        "put before them",
        check=frames_by_model,
    ),
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


# Where (x, y, rotation about z) stand among six components.
_PLANE = np.ix_([0, 1, 5], [0, 1, 5])


@dataclass(frozen=True)
class InputPolicy:
    """What the parameters say of inputs; made anew when one changes.

    Attributes:
        frame_prefix: Put before the models' frames.
        frames: Frames of single models, by their names.
        normal_force_from: `model`, `wrench` or `parameter`.
        normal_force: If from `parameter` [N].
        out_of_plane_tolerance: Share of the planar part above which the rest is reported.
    """

    frame_prefix: str
    frames: Mapping[str, str]
    normal_force_from: str
    normal_force: float
    out_of_plane_tolerance: float

    @classmethod
    def of(cls, values: Values) -> InputPolicy:
        """Return the policy of parameter values."""
        return cls(
            values["frame_prefix"],
            frames_by_model(values["frame_ids"]),
            values["normal_force_from"],
            values["normal_force"],
            values["out_of_plane_tolerance"],
        )

    def frame_of(self, model: SurfaceModel) -> str:
        """Return the frame in which a model is served."""
        frame = self.frames.get(model.name) or self.frames.get(model.name.removesuffix(LEARNT))
        return frame or self.frame_prefix + model.frame_id

    def surface_of(self, model: SurfaceModel, pressing: float | None = None) -> LimitSurface:
        """Return a model's surface under the force that presses the body down.

        Args:
            model: The model.
            pressing: What a wrench says of that force [N]; None: no wrench is there.

        Raises:
            RangeError: The model cannot be scaled, or nothing presses the body down.
        """
        source = self.normal_force_from
        if source == "model" or (source == "wrench" and pressing is None):
            return model.surface
        force = self.normal_force if source == "parameter" else pressing
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


class Planar(NamedTuple):
    """A planar wrench or twist about a model's reference point, and the surface that it is for.

    Attributes:
        surface: The model's surface at the present normal force.
        vector: (fx, fy, tau_z) or (vx, vy, omega_z), shape (3,).
        frame: Frame of the answer.
    """

    surface: LimitSurface
    vector: Floats
    frame: str


class PlanarInput:
    """Turns messages into what a surface takes, and what it gives into messages' numbers.

    Attributes:
        policy: What the parameters say.
        frames: Transforms to the models' frames.

    Args:
        parameters: The node's parameters, which include `SETTINGS`.
        frames: Transforms to the models' frames.
        report: Told of what is left out and not small: a key and a sentence.
        host: Whose `models` are served.
    """

    policy: InputPolicy

    def __init__(
        self,
        parameters: Parameters,
        frames: Frames,
        report: Callable[[str, str], None],
        host: ModelHost[SurfaceModel],
    ) -> None:
        """Follow the parameters."""
        self.frames = frames
        self._report = report
        self._host = host
        parameters.on_change([setting.name for setting in SETTINGS], self._prepare)

    async def wrench(self, model: SurfaceModel, stamped: WrenchStamped) -> Planar:
        """Return a stamped wrench as the model takes it.

        Raises:
            NotFiniteError: A component is NaN or infinite.
            RangeError: A component is larger than 1e100, or nothing presses the body down.
            FrameError: The frame is empty or no transform to the model's is known.
        """
        policy = self.policy
        six = convert.wrench_components(stamped.wrench)
        frame = policy.frame_of(model)
        if stamped.header.frame_id != frame:
            transform = await self.frames.to_frame(frame, stamped.header)
            if transform is not None:
                six = transform.wrench(six).tolist()
        fx, fy, fz, tx, ty, tz = six
        x, y = model.reference_point
        # tau - r x f: about the reference point in place of the frame's origin.
        six = fx, fy, fz, tx - y * fz, ty + x * fz, tz - (x * fy - y * fx)
        share = out_of_plane(
            six,
            1.0 / model.surface.scaling.characteristic_length,
            pressing=policy.normal_force_from == "wrench",
        )
        if share > policy.out_of_plane_tolerance:
            self._report_share("wrench", share)
        return Planar(policy.surface_of(model, -fz), _vector("wrench", six), frame)

    async def twist(self, model: SurfaceModel, stamped: TwistStamped) -> Planar:
        """Return a stamped twist as the model takes it.

        Raises:
            NotFiniteError: A component is NaN or infinite.
            RangeError: A component is larger than 1e100.
            FrameError: The frame is empty or no transform to the model's is known.
        """
        policy = self.policy
        six = convert.twist_components(stamped.twist)
        frame = policy.frame_of(model)
        if stamped.header.frame_id != frame:
            transform = await self.frames.to_frame(frame, stamped.header)
            if transform is not None:
                six = transform.twist(six).tolist()
        vx, vy, vz, wx, wy, wz = six
        x, y = model.reference_point
        # v + omega x r: of the reference point in place of the frame's origin.
        six = vx - wz * y, vy + wz * x, vz + wx * y - wy * x, wx, wy, wz
        share = out_of_plane(six, model.surface.scaling.characteristic_length)
        if share > policy.out_of_plane_tolerance:
            self._report_share("twist", share)
        return Planar(policy.surface_of(model), _vector("twist", six), frame)

    async def rows_matrix(self, what: str, model: SurfaceModel, header: Header) -> Floats | None:
        """Return what takes rows of a batch to the model's reference point.

        Args:
            what: "wrench" or "twist".
            model: The model.
            header: The batch's; an empty frame is the model's.

        Returns:
            A matrix to multiply rows by, shape (3, 3); None: rows are about it already.

        Raises:
            FrameError: No transform to the model's frame is known.
        """
        frame = self.policy.frame_of(model)
        moved = np.eye(6)[[0, 1, 5]]
        if header.frame_id and header.frame_id != frame:
            transform = await self.frames.to_frame(frame, header)
            moved = transform.wrench(moved) if what == "wrench" else transform.twist(moved)
            rho = model.surface.scaling.characteristic_length
            length = 1.0 / rho if what == "wrench" else rho
            share = max(out_of_plane(row, length) for row in moved.tolist())
            if share > self.policy.out_of_plane_tolerance:
                self._report_share(what, share)
        elif model.reference_point == (0.0, 0.0):
            return None
        return moved[:, [0, 1, 5]] @ _to_reference(what, model)

    async def contact(self, model: SurfaceModel, request: Push.Request) -> tuple[Any, ...]:
        """Return a contact in the model's plane, about its reference point.

        Returns:
            Point [m], normal, friction, and the pusher's velocity [m/s].

        Raises:
            NotFiniteError: A number is NaN or infinite.
            RangeError: A number is larger than 1e100.
            FrameError: No transform to the model's frame is known.
        """
        point = convert.vector_components("contact", request.contact)
        normal = convert.vector_components("normal", request.normal)
        velocity = convert.vector_components("velocity", request.velocity)
        # From 0 to infinity: `push` looks at it.
        friction = request.friction
        frame, header = self.policy.frame_of(model), request.header
        if header.frame_id and header.frame_id != frame:
            transform = await self.frames.to_frame(frame, header)
            if transform is not None:
                point = transform.point(point).tolist()
                normal = transform.direction(normal).tolist()
                velocity = transform.direction(velocity).tolist()
        x, y = model.reference_point
        return (point[0] - x, point[1] - y), normal[:2], friction, velocity[:2]

    async def transform(self, model: SurfaceModel, header: Header) -> RigidTransform:
        """Return the transform from a header's frame to axes at a model's reference point.

        Args:
            model: The model.
            header: Of what was asked; an empty frame is the model's.

        Raises:
            FrameError: No transform to the model's frame is known.
        """
        x, y = model.reference_point
        moved = RigidTransform(np.eye(3), np.array([-x, -y, 0.0]))
        frame = self.policy.frame_of(model)
        if not header.frame_id or header.frame_id == frame:
            return moved
        transform = await self.frames.to_frame(frame, header)
        return moved if transform is None else moved @ transform

    def _report_share(self, what: str, share: float) -> None:
        self._report(
            f"out-of-plane {what}",
            f"the part of a {what} outside the plane is {share:.2g} of the planar part and "
            "is left out",
        )

    def _prepare(self, values: Values) -> Callable[[], None]:
        policy = InputPolicy.of(values)

        def apply() -> None:
            self.policy = policy
            served = {model.name.removesuffix(LEARNT) for model in self._host.models}
            for name in policy.frames:
                if name.removesuffix(LEARNT) not in served:
                    self._report(
                        "frame of no model",
                        f"frame_ids names a model {shortened(repr(name))}, and none of that name "
                        "is loaded",
                    )

        return apply


def prepare_surface(model: SurfaceModel) -> None:
    """Do ahead what the first requests would have to wait for."""
    model.surface.prepare()
    if model.uncertain is not None:
        model.uncertain.prepare()


def wrench_at_origin(model: SurfaceModel, wrench: Sequence[float]) -> tuple[float, ...]:
    """Return a wrench about the reference point as it is at the origin of the model's frame."""
    fx, fy, tau = map(float, wrench)
    x, y = model.reference_point
    return fx, fy, tau + x * fy - y * fx


def twist_at_origin(model: SurfaceModel, twist: Sequence[float]) -> tuple[float, ...]:
    """Return a twist at the reference point as it is at the origin of the model's frame."""
    vx, vy, omega = map(float, twist)
    x, y = model.reference_point
    return vx + omega * y, vy - omega * x, omega


def covariance_at_origin(model: SurfaceModel, covariance: Floats) -> Floats:
    """Return a twist's covariance at the reference point as it is at the frame's origin.

    Args:
        model: The model.
        covariance: Of (vx, vy, omega_z), shape (3, 3).

    Returns:
        That of all six components, row-major as geometry_msgs has it, shape (36,).
    """
    six = np.zeros((6, 6))
    moved = _to_reference("twist", model)
    # Rows are multiplied from the right: to the origin it is the inverse, of opposite shifts.
    back = 2.0 * np.eye(3) - moved
    six[_PLANE] = back.T @ covariance @ back
    return six.ravel()


def rows_at_origin(what: str, model: SurfaceModel) -> Floats | None:
    """Return what takes rows about the reference point to the origin; None: they are the same."""
    if model.reference_point == (0.0, 0.0):
        return None
    return np.linalg.inv(_to_reference(what, model))


def _to_reference(what: str, model: SurfaceModel) -> Floats:
    """Return the matrix that rows about the frame's origin are multiplied by."""
    x, y = model.reference_point
    if what == "wrench":
        return np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-y, x, 1.0]])


def _vector(what: str, six: Sequence[float]) -> Floats:
    """Return the planar part; a zero one is for the surface to accept or refuse."""
    vector = six[0], six[1], six[5]
    if 0.0 < max(map(abs, vector)) < convert.SMALLEST:
        raise RangeError(
            f"{what} is below {convert.SMALLEST:g} in size, too small for a direction"
        )
    return np.array(vector)
