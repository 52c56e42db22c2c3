# SPDX-License-Identifier: Apache-2.0
"""Pushes of every kind of surface are right at every friction and in every direction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from limit_surface_ros.errors import NotFiniteError, RangeError, ShapeError, ZeroVectorError
from limit_surface_ros.motion.push import MODES, ContactMode, push, pushes
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from push_helpers import KINDS, SCALING, Box, mirrored, random_contacts

FRICTIONS = (0.0, 0.3, 1.0, 1.5, 3.0, 10.0, 1e4, 1e8, 1e15, np.inf)
STICK, LEFT, RIGHT = range(3)


def wrong(surface, points, normals, friction, velocities, found):
    """Return which pushes (n,) break a condition of quasi-static pushing."""
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    twists, wrenches, modes = found.twists, found.wrenches, found.modes
    x, y = points.T
    moved = np.stack([twists[:, 0] - twists[:, 2] * y, twists[:, 1] + twists[:, 2] * x], axis=1)
    slip = (velocities - moved) / np.linalg.norm(velocities, axis=1, keepdims=True)
    across, along = (slip * tangents).sum(axis=1), (slip * normals).sum(axis=1)
    side = np.array([0.0, 1.0, -1.0])[modes]
    force = wrenches[:, :2]
    size = np.linalg.norm(force, axis=1)
    normal, tangential = (force * normals).sum(axis=1), (force * tangents).sum(axis=1)
    cosine = 1.0 / np.hypot(1.0, friction)
    sine = friction * cosine if friction < np.inf else 1.0
    power = (wrenches * twists).sum(axis=1)
    most = (surface.wrench_of_twist(twists) * twists).sum(axis=1)
    conditions = [
        power > 0.0,
        normal >= -1e-12 * size,
        np.abs(along) < 1e-11,
        np.where(modes == STICK, np.abs(across) < 1e-11, side * across > 0.0),
        # Within the cone; on its edge when it slides.
        np.abs(tangential) * cosine - normal * sine < 1e-12 * size,
        np.where(
            modes == STICK, True, np.abs(side * tangential * cosine - normal * sine) < 1e-12 * size
        ),
        # The wrench is that of a force through the contact, on the surface, of the most power.
        np.abs(wrenches[:, 2] - x * force[:, 1] + y * force[:, 0]) < 1e-10 * 0.05 * size,
        np.abs(surface.load_factor(wrenches) - 1.0) < 1e-9,
        np.abs(power / most - 1.0) < 1e-9,
    ]
    return ~np.logical_and.reduce(conditions)


@pytest.mark.parametrize("kind", KINDS)
def test_no_push_of_a_hundred_thousand_is_wrong(kind):
    rng = np.random.default_rng(7)
    for _ in range(13):
        surface = KINDS[kind](rng)
        for friction in FRICTIONS:
            points, normals, velocities = random_contacts(rng, 100)
            found = pushes(surface, points, normals, friction, velocities)
            broken = wrong(surface, points, normals, friction, velocities, found)
            assert not broken.any(), (friction, np.flatnonzero(broken))


@pytest.mark.parametrize("friction", [0.0, 0.5, 1.5, 1e4, 1e8, np.inf])
@pytest.mark.parametrize("kind", KINDS)
def test_one_push_is_as_many(kind, friction):
    rng = np.random.default_rng(3)
    surface = KINDS[kind](rng)
    points, normals, velocities = random_contacts(rng, 12)
    found = pushes(surface, points, normals, friction, velocities)
    for row in range(12):
        alone = push(surface, points[row], normals[row], friction, velocities[row])
        assert alone.mode is found[row].mode
        np.testing.assert_allclose(
            alone.twist / SCALING.twist_unit,
            found.twists[row] / SCALING.twist_unit,
            atol=1e-11,
        )
        np.testing.assert_allclose(alone.wrench, found.wrenches[row], atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mirror_swaps_left_and_right(kind):
    rng = np.random.default_rng(11)
    surface = KINDS[kind](rng)
    flip, turned = np.array([1.0, -1.0]), np.array([1.0, -1.0, -1.0])
    seen = mirrored(surface)
    for friction in (0.2, 1.5, 1e6, np.inf):
        points, normals, velocities = random_contacts(rng, 60)
        here = pushes(surface, points, normals, friction, velocities)
        there = pushes(seen, points * flip, normals * flip, friction, velocities * flip)
        np.testing.assert_array_equal(np.array([0, 2, 1])[here.modes], there.modes)
        np.testing.assert_allclose(
            here.twists / SCALING.twist_unit,
            there.twists * turned / SCALING.twist_unit,
            atol=1e-12,
        )


@pytest.mark.parametrize("kind", KINDS)
def test_a_contact_far_from_the_reference_point_is_pushed_as_any_other(kind):
    rng = np.random.default_rng(12)
    surface = KINDS[kind](rng)
    for friction in (0.2, 3.0, 1e15):
        points, normals, velocities = random_contacts(rng, 40)
        points *= 1000.0
        found = pushes(surface, points, normals, friction, velocities)
        assert not wrong(surface, points, normals, friction, velocities, found).any()


@given(seed=st.integers(0, 2**32 - 1))
def test_a_faster_pusher_moves_the_body_faster_and_a_turned_frame_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    limits, feet = rng.uniform(0.2, 2.0, 4), 0.05 * rng.standard_normal((4, 2))
    surface = PointContacts(feet, limits, SCALING)
    points, normals, velocities = random_contacts(rng, 8)
    friction = rng.uniform(0.0, 2.0, 8)
    found = pushes(surface, points, normals, friction, velocities)
    faster = pushes(surface, points, 7.0 * normals, friction, 1e6 * velocities)
    np.testing.assert_allclose(faster.twists, 1e6 * found.twists, rtol=1e-12)
    a = rng.uniform(-np.pi, np.pi)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    turned = pushes(
        PointContacts(feet @ turn.T, limits, SCALING),
        points @ turn.T,
        normals @ turn.T,
        friction,
        velocities @ turn.T,
    )
    np.testing.assert_array_equal(turned.modes, found.modes)
    np.testing.assert_allclose(turned.twists[:, :2], found.twists[:, :2] @ turn.T, atol=1e-11)
    np.testing.assert_allclose(turned.twists[:, 2], found.twists[:, 2], atol=1e-9)


def test_beyond_the_left_edge_by_more_than_half_a_turn_is_right():
    surface = PowerSum(np.eye(3)[np.newaxis], [1.0], Scaling(0.05, 2.0))
    angle = np.radians(-75.0)
    found = push(surface, [-0.1, -0.1], [1.0, 0.0], 1.5, [np.cos(angle), np.sin(angle)])
    assert found.mode is ContactMode.SLIDE_RIGHT
    assert found.twist @ found.wrench > 0.0


def fischer_burmeister(a, b):
    return a + b - np.hypot(a, b)


def complementarity(surface, point, normal, friction, velocity, rng):
    """Return all twists (n, 3) that solve Stewart and Trinkle's conditions, by a root finder.

    Unknown are the twist V, the normal force n, friction both ways (p, q) and the slip l:
    V = degree-one map of the wrench, 0 <= n _|_ approach >= 0, 0 <= p _|_ l + slip >= 0,
    0 <= q _|_ l - slip >= 0, 0 <= l _|_ mu n - p - q >= 0.
    """
    rho, force = surface.scaling.characteristic_length, surface.scaling.friction_force
    tangent = np.array([-normal[1], normal[0]])
    jacobian = np.array([[1.0, 0.0, -point[1] / rho], [0.0, 1.0, point[0] / rho]])

    def residual(unknown):
        n, p, q, slip = unknown
        scaled = jacobian.T @ (n * normal + (p - q) * tangent)
        wrench = scaled * [force, force, force * rho]
        if not np.abs(wrench).max() > 1e-12:
            twist = np.zeros(3)
        else:
            unit, factor = surface.twist_and_load_factor(wrench)
            unit = unit * [1.0, 1.0, rho]
            twist = factor * factor / (scaled @ unit) * unit
        moved = jacobian @ twist - velocity
        return np.array(
            [
                fischer_burmeister(n, moved @ normal),
                fischer_burmeister(p, slip + moved @ tangent),
                fischer_burmeister(q, slip - moved @ tangent),
                fischer_burmeister(slip, friction * n - p - q),
            ]
        ), twist

    found = []
    for _ in range(8):
        start = rng.uniform(0.0, 1.0, 4)
        solved = least_squares(
            lambda z: residual(z)[0], start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=200
        )
        if np.abs(solved.fun).max() < 1e-9:
            found.append(residual(solved.x)[1])
    return np.array(found)


@pytest.mark.parametrize("kind", ["ellipsoid", "norms", "two powers", "polynomial", "dissipation"])
def test_pushes_agree_with_an_independent_complementarity_solve(kind):
    rng = np.random.default_rng(5)
    met = 0
    for friction in (0.2, 0.8, 3.0):
        surface = KINDS[kind](rng)
        points, normals, velocities = random_contacts(rng, 3)
        for point, normal, velocity in zip(points, normals, 100.0 * velocities, strict=True):
            answers = complementarity(surface, point, normal, friction, velocity, rng)
            if not len(answers):
                continue
            met += 1
            twist = push(surface, point, normal, friction, velocity).twist / SCALING.twist_unit
            assert np.abs(answers - twist).max(axis=1).max() < 1e-6
    # The root finder fails now and then; it must not fail so often that nothing is compared.
    assert met >= 5


@pytest.mark.parametrize("friction", [0.4, np.inf])
def test_a_kind_of_which_only_the_maps_are_known_is_pushed(friction):
    rng = np.random.default_rng(2)
    points, normals, velocities = random_contacts(rng, 50)
    found = pushes(Box(), points, normals, friction, velocities)
    slack = wrong(Box(), points, normals, friction, velocities, found)
    assert not slack.any(), np.flatnonzero(slack)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([[0, 0, 0]], [[1, 0]], 0.3, [[1, 0]]), ShapeError, "points"),
        (([[0, 0]], [[0, 0]], 0.3, [[1, 0]]), ZeroVectorError, "index 0"),
        (([[0, 0]], [[1, 0]], -0.1, [[1, 0]]), RangeError, "friction"),
        (([[0, 0]], [[1, 0]], [0.1, float("nan")], [[1, 0]]), ShapeError, "friction"),
        (([[0, 0]], [[1, 0]], [float("nan")], [[1, 0]]), RangeError, "friction"),
        (([[0, 0]], [[1, 0]], 0.3, [[1, float("nan")]]), NotFiniteError, "velocities"),
        (([[0, 0]], [[1, 0], [1, 0]], 0.3, [[1, 0]]), ShapeError, "as many"),
    ],
)
def test_what_are_no_pushes_is_refused(arguments, error, message):
    surface = PowerSum.thesis([np.eye(3)], SCALING)
    with pytest.raises(error, match=message):
        pushes(surface, *arguments)


def test_a_push_at_the_only_support_of_a_body_does_not_turn_it():
    body = PointContacts([[0.01, 0.02]], [1.0], SCALING)
    motions = np.array([[0.0, 1.0], [0.1, 1.0], [-0.07, 0.3]])
    found = pushes(body, [[0.01, 0.02]] * 3, [[0.0, 1.0]] * 3, 0.3, motions)
    np.testing.assert_allclose(found.twists, np.pad(motions, ((0, 0), (0, 1))), atol=1e-9)
    np.testing.assert_allclose(np.hypot(*found.wrenches[:, :2].T), 1.0)
    for motion in motions:
        alone = push(body, [0.01, 0.02], [0.0, 1.0], 0.3, motion)
        np.testing.assert_allclose(alone.twist, [*motion, 0.0], atol=1e-9)
        assert alone.mode is ContactMode.STICK


@pytest.mark.parametrize("friction", [0.0, 1.0, 3.0, np.inf])
@pytest.mark.parametrize("rank", [1, 2])
def test_pushes_whose_friction_cone_ends_in_a_corner_are_right(rank, friction):
    rng = np.random.default_rng(4)
    angles = np.concatenate([[0.0, 1.5707, -1.5707], rng.uniform(-1.5, 1.5, 21)])
    velocities = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for place, side in ((0.0, 1.0), (1.0, -1.0), (2.0, 1.0)):
        point = SCALING.characteristic_length * place * np.array([-1.0, 0.5])
        x, y = (0.0, side) if friction == np.inf else (1.0, side * friction)
        # The first norm does not resist the force at the edge of the cone: a corner is there.
        across = np.array([y, -x, 0.0])
        corner = np.array([x, y, place * (-y - 0.5 * x)])
        rows = np.array([across, np.cross(corner, across)])[:rank]
        surface = PowerSum.norms([rows.T @ rows, np.eye(3)], SCALING)
        points, normals = np.tile(point, (24, 1)), np.tile([1.0, 0.0], (24, 1))
        found = pushes(surface, points, normals, friction, velocities)
        assert not wrong(surface, points, normals, friction, velocities, found).any()
        for row in range(24):
            alone = push(surface, point, [1.0, 0.0], friction, velocities[row])
            assert alone.mode is found[row].mode
        # Where sticking is possible, be it at the edge of the cone alone, the pusher sticks.
        sides = [1.0, -1.0] if friction > 0.0 else [side, side]
        left, right = (
            velocity_angles(point, complex(x, y if each == side else -y), rows) for each in sides
        )
        expected = np.where(angles > left.max(), LEFT, STICK)
        expected[angles < right.min()] = RIGHT
        np.testing.assert_array_equal(found.modes, expected)


def velocity_angles(point, force, rows):
    """Return angles from (1, 0) of velocities at a contact that a force causes.

    Of the body |rows w| + |w| = 1 in scaled variables; at a corner the first norm has gradients
    rows' y with |y| <= 1, of which those on the rim are sampled.
    """
    x, y = point / SCALING.characteristic_length
    load = np.array([force.real, force.imag, x * force.imag - y * force.real])
    norm = np.linalg.norm(rows @ load)
    if norm > 1e-12:
        ys = (rows @ load)[np.newaxis] / norm
    elif len(rows) == 1:
        ys = np.array([[1.0], [-1.0]])
    else:
        turn = np.linspace(0.0, 2.0 * np.pi, 100001)
        ys = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    vx, vy, omega = (load / np.linalg.norm(load) + ys @ rows).T
    moved = vx - omega * y + 1j * (vy + omega * x)
    return np.angle(force) + np.angle(np.conj(force) * moved)


def test_no_pushes_are_no_answers_and_leaving_is_told():
    surface = PowerSum.thesis([np.eye(3)], SCALING)
    assert len(pushes(surface, np.zeros((0, 2)), np.zeros((0, 2)), 0.3, np.zeros((0, 2)))) == 0
    left = pushes(surface, [[0, 0]], [[1, 0]], 0.3, [[-1, 0.5]])[0]
    assert left.mode is MODES[3]
    assert not left.twist.any()
