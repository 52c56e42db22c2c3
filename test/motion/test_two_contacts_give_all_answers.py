# SPDX-License-Identifier: Apache-2.0
"""A rigid pusher with two contacts: every motion that it can cause, and the turns it holds."""

from itertools import product

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError, ShapeError, ZeroVectorError
from limit_surface_ros.motion.outcomes import ContactMode
from limit_surface_ros.motion.push import push
from limit_surface_ros.motion.several_contacts import stable_turns, two_point_push
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

SCALING = Scaling(0.05, 2.0)


def random_case(rng, on_an_edge):
    """Return points, normals, friction and pusher's twist; the normals alike on one edge."""
    factor = rng.standard_normal((3, 3))
    matrix = factor @ factor.T + 0.1 * np.eye(3)
    if on_an_edge:
        points = np.array([[-0.05, -0.03], [-0.05, rng.uniform(0.0, 0.05)]])
        normals = np.array([[1.0, 0.0], [1.0, 0.0]])
    else:
        points = 0.05 * rng.standard_normal((2, 2))
        angles = rng.uniform(-1.0, 1.0, 2)
        normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    twist = np.array([1.0, rng.uniform(-1, 1), 10.0 * rng.uniform(-1, 1)])
    return matrix, points, normals, rng.uniform(0.0, 1.0), twist


def all_of_a_linear_complementarity_problem(matrix, points, normals, friction, twist):
    """Return all motions (n, 3) by trying every set of active conditions of Stewart and Trinkle's.

    For an ellipsoid the motion is linear in the wrench, as the scale of forces is free.
    """
    rho = SCALING.characteristic_length
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    jacobians = np.array([[[1, 0, -y / rho], [0, 1, x / rho]] for x, y in points])
    scaled = twist * [1, 1, rho]
    n = np.array([normals[i] @ jacobians[i] for i in (0, 1)])
    t = np.array([tangents[i] @ jacobians[i] for i in (0, 1)])
    rows = np.concatenate([n, t, -t])
    problem = np.zeros((8, 8))
    problem[:6, :6] = rows @ matrix @ rows.T
    problem[2:4, 6:] = problem[4:6, 6:] = np.eye(2)
    problem[6:, :2] = friction * np.eye(2)
    problem[6:, 2:4] = problem[6:, 4:6] = -np.eye(2)
    offset = np.concatenate([-rows @ scaled, [0.0, 0.0]])
    found = []
    for active in product((False, True), repeat=8):
        some = np.flatnonzero(active)
        unknown = np.zeros(8)
        if len(some):
            part = problem[np.ix_(some, some)]
            if np.linalg.cond(part) > 1e10:
                continue
            unknown[some] = np.linalg.solve(part, -offset[some])
        rest = problem @ unknown + offset
        if unknown.min() > -1e-9 and rest.min() > -1e-9:
            motion = matrix @ (rows.T @ unknown[:6]) / [1, 1, rho]
            if not any(np.abs(motion - other).max() < 1e-6 for other in found):
                found.append(motion)
    return np.array(found)


def test_the_answers_for_an_ellipsoid_are_those_of_the_linear_complementarity_problem():
    rng = np.random.default_rng(4)
    several = 0
    for case in range(150):
        matrix, points, normals, friction, twist = random_case(rng, case % 3 < 2)
        surface = PowerSum.thesis([matrix], SCALING)
        answers = two_point_push(surface, points, normals, friction, twist)
        ours = np.array([answer.twist for answer in answers])
        theirs = all_of_a_linear_complementarity_problem(matrix, points, normals, friction, twist)
        assert len(ours) >= 1
        several += len(ours) > 1
        for one, others in ((ours, theirs), (theirs, ours)):
            for motion in one:
                assert np.abs(others - motion).max(axis=1).min() < 1e-8, (case, ours, theirs)
    assert several >= 1


@pytest.mark.parametrize("kind", ["norms", "dissipation", "facets"])
def test_every_answer_obeys_the_conditions_and_there_is_one(kind):
    rng = np.random.default_rng(9)
    for case in range(25):
        _, points, normals, friction, twist = random_case(rng, case % 2)
        factors = rng.standard_normal((3, 3, 2 if kind == "facets" else 3))
        matrices = factors @ factors.transpose(0, 2, 1)
        make = PowerSum.norms if kind == "norms" else Dissipation
        surface = make(matrices, SCALING)
        answers = two_point_push(surface, points, normals, friction, twist)
        assert answers
        for answer in answers:
            assert_conditions(surface, points, normals, friction, twist, answer)


def assert_conditions(surface, points, normals, friction, twist, answer):
    size = np.abs(answer.wrench[:2]).max()
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    slip = answer.twist - twist
    at = np.array([[slip[0] - slip[2] * y, slip[1] + slip[2] * x] for x, y in points])
    gap, across = (at * normals).sum(axis=1), (at * tangents).sum(axis=1)
    normal, tangential = ((answer.forces * side).sum(axis=1) for side in (normals, tangents))
    moment = (points[:, 0] * answer.forces[:, 1] - points[:, 1] * answer.forces[:, 0]).sum()
    np.testing.assert_allclose(answer.forces.sum(axis=0), answer.wrench[:2], atol=1e-6 * size)
    assert moment == pytest.approx(answer.wrench[2], abs=1e-6 * size)
    most = surface.wrench_of_twist(answer.twist) @ answer.twist
    assert answer.wrench @ answer.twist == pytest.approx(most, rel=1e-6)
    for contact, mode in enumerate(answer.modes):
        assert normal[contact] >= -1e-9 * size
        assert abs(tangential[contact]) <= friction * normal[contact] + 1e-7 * size
        if mode is ContactMode.SEPARATE:
            assert gap[contact] > -1e-8
            assert normal[contact] == 0.0
            continue
        assert gap[contact] == pytest.approx(0.0, abs=1e-8)
        if mode is ContactMode.STICK:
            assert across[contact] == pytest.approx(0.0, abs=1e-8)
        else:
            # The pusher slides left: the body slips right beneath it, friction drags it left.
            side = 1.0 if mode is ContactMode.SLIDE_LEFT else -1.0
            assert side * across[contact] < 0.0
            assert side * tangential[contact] == pytest.approx(
                friction * normal[contact], abs=1e-7 * size
            )


def test_stable_turns_are_those_of_lynch_and_mason():
    rng = np.random.default_rng(1)
    h, b, c, mu = 0.04, 0.03, 0.035, 0.4
    surface = PowerSum.thesis([np.eye(3)], Scaling(c, 1.0))
    points, normals = [[-h, b], [-h, -b]], [[1, 0], [1, 0]]
    x, y = rng.uniform(-0.3, 0.3, (2, 4000))
    # The sense in which the body's centre moves ahead, along +x.
    rate = np.sign(y)
    twists = np.stack([rate * y, -rate * x, rate], axis=1)
    arm = (h * x - c * c) / y
    expected = (np.abs(x) <= mu * np.abs(y)) & (-b <= arm) & (arm <= b)
    assert 100 < expected.sum() < 3900
    np.testing.assert_array_equal(stable_turns(surface, points, normals, mu, twists), expected)


def test_the_tightest_turn_straight_ahead_is_at_c_squared_over_b():
    h, b, c = 0.04, 0.03, 0.035
    surface = PowerSum.thesis([np.eye(3)], Scaling(c, 1.0))
    for factor, stable in ((1.001, True), (0.999, False)):
        radius = factor * c * c / b
        turn = np.array([radius, 0.0, 1.0])
        assert stable_turns(surface, [[-h, b], [-h, -b]], [[1, 0], [1, 0]], 0.4, turn) == stable


def test_a_pusher_that_leaves_moves_nothing():
    surface = PowerSum.thesis([np.eye(3)], SCALING)
    (answer,) = two_point_push(
        surface, [[-0.05, 0.03], [-0.05, -0.03]], [[1, 0], [1, 0]], 0.4, [-1, 0.2, 0]
    )
    assert answer.modes == (ContactMode.SEPARATE, ContactMode.SEPARATE)
    assert not answer.twist.any()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (([[0, 0]], [[1, 0]], 0.3, [1, 0, 0]), ShapeError),
        (([[0, 0], [0, 1]], [[1, 0], [0, 0]], 0.3, [1, 0, 0]), ZeroVectorError),
        (([[0, 0], [0, 1]], [[1, 0], [1, 0]], -0.3, [1, 0, 0]), RangeError),
        (([[0, 0], [0, 1]], [[1, 0], [1, 0]], 0.3, [1, 0]), ShapeError),
    ],
)
def test_what_is_no_push_of_two_points_is_refused(arguments, error):
    with pytest.raises(error):
        two_point_push(PowerSum.thesis([np.eye(3)], SCALING), *arguments)


@pytest.mark.parametrize("apart", [0.0, 0.02])
def test_two_contacts_on_one_line_push_as_one_does(apart):
    # Their normals give one wrench: no motion slides along both and is told from any other.
    rng = np.random.default_rng(0)
    for _ in range(20):
        matrix, points, normals, _, twist = random_case(rng, on_an_edge=False)
        surface = PowerSum.thesis([matrix], SCALING)
        (x, y), normal = points[0], normals[0]
        velocity = [twist[0] - twist[2] * y, twist[1] + twist[2] * x]
        with np.errstate(all="raise"):
            places, inward = [points[0], points[0] + apart * normal], [normal, normal]
            answers = two_point_push(surface, places, inward, 0.0, twist)
        one = push(surface, points[0], normal, 0.0, velocity).twist
        for answer in answers:
            np.testing.assert_allclose(answer.twist, one, rtol=1e-9, atol=1e-12)
