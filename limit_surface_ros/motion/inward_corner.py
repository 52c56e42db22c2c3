# SPDX-License-Identifier: Apache-2.0
"""A tip in an inward corner of an outline: it touches two edges, as a pusher of two contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.motion.outcomes import ContactMode, Push
from limit_surface_ros.motion.push import push
from limit_surface_ros.motion.several_contacts import TwoContacts

if TYPE_CHECKING:
    from limit_surface_ros.motion.outline import Outline
    from limit_surface_ros.surface.base import LimitSurface

# Gap, in tolerances, within which a tip counts as at two places of an outline bent inward.
TWO_PLACES = 10.0


class Scene(NamedTuple):
    """What all pushes of a batch share.

    Attributes:
        surface: Of the body.
        outline: In the body's frame.
        reference_point: Of the surface in the body's frame [m].
        edge: Unit force at the left edge of the friction cone, of which the normal is 1.
        tolerance: Of the error of a step [m].
    """

    surface: LimitSurface
    outline: Outline
    reference_point: complex
    edge: complex
    tolerance: float


def push_in_corner(scene: Scene, centre: complex, heading: complex, radius: float) -> Push:
    """Return what a tip of unit velocity does that touches an outline at two places, or one.

    Args:
        scene: The body.
        centre: Of the tip, in the body's frame [m].
        heading: Its unit velocity, in the body's frame.
        radius: Distance at which it touches [m].
    """
    about = np.array([scene.reference_point.real, scene.reference_point.imag])
    ahead = np.array([heading.real, heading.imag])
    at = np.array([centre.real, centre.imag])
    slack = 2.0 * TWO_PLACES * scene.tolerance
    touched = scene.outline.touched(at, radius, slack)
    if len(touched) >= 2:
        feet, outward = (np.array([each[i] for each in touched[:2]]) for i in (0, 1))
        edges, twist = np.full(2, scene.edge), np.append(ahead, 0.0)
        answers = TwoContacts(scene.surface, feet - about, -outward, edges, twist).answers()
        answer = next(answers, None)
        if answer is not None:
            first, second = answer.modes
            mode = second if first is ContactMode.SEPARATE else first
            return Push(answer.twist, mode, answer.wrench)
    # One place, or two so near to each other that what one does is as good.
    near = scene.outline.nearest(at[np.newaxis])
    edge = scene.edge
    friction = edge.imag / edge.real if edge.real > 0.0 else np.inf
    return push(scene.surface, near.points[0] - about, -near.normals[0], friction, ahead)
