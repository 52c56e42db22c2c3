# SPDX-License-Identifier: Apache-2.0
"""Whatever a planner gives, it gets an answer or an error of the package, and nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from limit_surface_ros.checks import as_count, as_floats, as_number
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import LimitSurfaceError, RangeError, ShapeError
from limit_surface_ros.fitting.few_pushes.online import OnlineSurface
from limit_surface_ros.fitting.few_pushes.segments import Segments
from limit_surface_ros.motion.holding import holds_from
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.push import motion_cone, push, pushes
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.motion.round_outlines import Ellipse
from limit_surface_ros.surface import Dissipation, PointContacts, PowerSum
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.1, 2.0)
BODY = PointContacts([[-0.1, -0.1], [-0.1, 0.1], [0.1, 0.0]], [1.0, 1.0, 1.0], SCALING)
FORMS = np.array([np.eye(3), np.diag([1.0, 2.0, 3.0])])
KINDS = [BODY, PowerSum.thesis(FORMS, SCALING), Dissipation(FORMS, SCALING)]
DECAY = ExponentialSum([-1.0, -2.0], [0.5, 0.5])
OUTLINE = Polygon([[-0.1, -0.1], [0.1, -0.1], [0.0, 0.15]])
# No number, and no numbers, of each sort.
WRONG = [
    None,
    "text",
    b"x",
    1j,
    10**400,
    {},
    [],
    [1, 2],
    [[1, 2], [3]],
    [10**400] * 3,
    np.array([1 + 1j, 2, 3]),
    np.array(["2020", "2021", "2022"], dtype="datetime64[Y]"),
    np.zeros((2, 3)),
    object(),
]
CALLS = {
    "friction of a push": lambda given: push(BODY, [-0.1, 0], [1, 0], given, [1, 0.2]),
    "friction of a cone": lambda given: motion_cone(BODY, [-0.1, 0], [1, 0], given),
    "friction of pushes": lambda given: pushes(BODY, [[-0.1, 0]], [[1, 0]], given, [[1, 0.2]]),
    "tip": lambda given: simulate_push(
        BODY, OUTLINE, given, 0.3, [0, 0, 0], [[-0.2, 0], [-0.1, 0]]
    ),
    "level": DECAY.time_to_level,
    "start": DECAY.supremum,
    "order": DECAY.derivative,
    "terms": DECAY.truncated,
    "load factor": lambda given: holds_from(DECAY, given),
    "wrench of a segment": lambda given: Segments(SCALING).feed(0.0, given, [1, 0, 0]),
    "turn of a segment": lambda given: Segments(SCALING, turn_deg=given),
    "wrench to learn": lambda given: OnlineSurface(KINDS[2]).add(given, [1, 0, 0]),
    "window": lambda given: OnlineSurface(KINDS[2], window=given),
    "forgetting": lambda given: OnlineSurface(KINDS[2], forgetting=given),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("place", list(CALLS))
def test_what_is_no_number_is_refused_by_the_package(place):
    for given in WRONG:
        # Whole numbers may be of any size.
        if place in ("order", "terms", "window") and type(given) is int:
            continue
        with pytest.raises(LimitSurfaceError):
            CALLS[place](given)


@pytest.mark.parametrize("surface", KINDS, ids=lambda surface: surface.kind)
def test_maps_refuse_what_is_no_vector(surface):
    for given in WRONG[:-2]:
        for call in (surface.load_factor, surface.twist_of_wrench, surface.wrench_of_twist):
            with pytest.raises(LimitSurfaceError):
                call(given)


@pytest.mark.parametrize("surface", KINDS, ids=lambda surface: surface.kind)
@pytest.mark.parametrize("shape", [(0, 3), (2, 0, 3)])
def test_no_rows_are_answered_by_none(surface, shape):
    none = np.empty(shape)
    for call in (surface.twist_of_wrench, surface.wrench_of_twist, surface.gradient_twist):
        assert call(none).shape == shape
    assert surface.load_factor(none).shape == shape[:-1]


def test_checks_of_single_numbers_say_what_is_accepted():
    assert as_number("level", np.float32(2)) == 2.0
    assert as_count("terms", np.int8(2)) == 2
    with pytest.raises(ShapeError, match=r"level must be one number, got shape \(1,\)"):
        as_number("level", [1.0])
    with pytest.raises(RangeError, match=r"terms must be a whole number, got 2\.5"):
        as_count("terms", 2.5)
    with pytest.raises(RangeError, match="terms must be at least 1, got 0"):
        as_count("terms", 0)
    with pytest.raises(ShapeError, match="wrench must be an array of real numbers, got complex"):
        as_floats("wrench", np.array([1j]))


def test_what_surfaces_and_outlines_share_cannot_be_written_to():
    ellipse = Ellipse([0.1, 0.2])
    shared = [SCALING.wrench_unit, SCALING.twist_unit, ellipse.semi_axes, ellipse.centre]
    for array in (*shared, SCALING.twist_by_wrench_unit, SCALING.wrench_by_twist_unit):
        with pytest.raises(ValueError, match="read-only"):
            array *= 2.0
