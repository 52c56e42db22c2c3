# SPDX-License-Identifier: Apache-2.0
"""An onset as it came in: the load at t = 0, and how it dies away from there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.decay.response import Response
from limit_surface_ros.errors import ZeroVectorError
from limit_surface_ros.nodes.messages import convert
from limit_surface_ros.nodes.messages.convert import fill_stamp, nanoseconds

if TYPE_CHECKING:
    from geometry_msgs.msg import WrenchStamped

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.estimation import EstimationOptions
    from limit_surface_ros.files.decay_file import DecayModel


class Onset:
    """One load and its response.

    Args:
        message: The load; its stamp is t = 0.
        model: The decay model that it follows.
        now: Node time [ns], which an unset stamp stands for.
        options: How far measurements are trusted over the model.
        length: Length [m] by which torques are divided to be weighed against forces.

    Attributes:
        message: The load, with its stamp set.
        model: The decay model that it follows.
        start: Time of the onset [ns].
        load: (fx, fy, fz, tau_x, tau_y, tau_z) in [N, N, N, N m, N m, N m], shape (6,).
        response: How it dies away.
        off_axis: Part of the last measured load that is not along the onset's, relative to it.

    Raises:
        NotFiniteError: A component is NaN or infinite.
        RangeError: A component is larger than 1e100, the stamp is before time zero, or the frame
            is longer than names are.
        ZeroVectorError: The load is zero.
        NoOnsetError: The model starts at zero.
    """

    def __init__(
        self,
        message: WrenchStamped,
        model: DecayModel,
        now: int,
        options: EstimationOptions,
        length: float,
    ) -> None:
        """Check the load and start the response."""
        self.load = np.array(convert.wrench_components(message.wrench))
        if not np.abs(self.load).max() >= convert.SMALLEST:
            raise ZeroVectorError("an onset must not be zero: nothing would die away")
        convert.copied_frame(message.header.frame_id)
        self.start = nanoseconds(message.header.stamp) or now
        self.message = message
        fill_stamp(message.header.stamp, self.start)
        self.model = model
        self.response = Response(model.sum, model.max_error, options, model.bounds)
        self.off_axis = 0.0
        weights = 1.0 / np.array([1.0, 1.0, 1.0, length, length, length])
        self._weights = weights / np.linalg.norm(weights * self.load)

    def fraction(self, load: Floats) -> float:
        """Return how much of the onset is in a measured load, shape (6,), in the onset's frame."""
        along = self._weights * self.load
        measured = self._weights * load
        fraction = float(along @ measured)
        # The squares of a norm may overflow: a wrong sensor tells what is beyond all sense.
        self.off_axis = math.hypot(*(measured - fraction * along))
        return fraction
