# SPDX-License-Identifier: Apache-2.0
"""Derivatives of pushes are what differences tend to, and obey what theory says of them."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, NotFiniteError, ShapeError
from limit_surface_ros.motion.outcomes import MODES, ContactMode
from limit_surface_ros.motion.push import push, pushes
from limit_surface_ros.motion.push_derivatives import push_derivatives
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling
from push_helpers import (
    KINDS,
    SCALING,
    Box,
    best_differences,
    mirrored,
    random_contacts,
    turned,
)

STICK, LEFT, RIGHT, SEPARATE = range(4)
SIZES = SCALING.twist_unit, SCALING.wrench_unit
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def stacked(derivatives):
    """Return derivatives (n, 3, 6) by velocity, point, normal and friction."""
    return np.concatenate(
        [
            derivatives.by_velocity,
            derivatives.by_point,
            derivatives.by_normal[..., np.newaxis],
            derivatives.by_friction[..., np.newaxis],
        ],
        axis=-1,
    )


def contact_jacobians(points):
    jacobians = np.zeros((len(points), 2, 3))
    jacobians[:, 0, 0] = jacobians[:, 1, 1] = 1.0
    jacobians[:, 0, 2], jacobians[:, 1, 2] = -points[:, 1], points[:, 0]
    return jacobians


def every_push(kind, friction, count=60, seed=5):
    rng = np.random.default_rng(seed)
    surface = KINDS[kind](rng)
    contacts = random_contacts(rng, count)
    return surface, contacts, push_derivatives(surface, *contacts[:2], friction, contacts[2])


@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0, 10.0, np.inf])
@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_what_differences_tend_to(kind, friction):
    surface, (points, normals, velocities), found = every_push(kind, friction)
    # Of typical size: velocity, contact, normal and friction.
    units = [0.01, 0.01, 0.05, 0.05, 1.0]
    if 0.0 < friction < np.inf:
        units.append(friction)

    def moved(axis, step):
        change = np.zeros(6)
        change[axis] = step * units[axis]
        more = pushes(
            surface,
            points + change[2:4],
            turned(normals, change[4]),
            friction + change[5] if change[5] else friction,
            velocities + change[:2],
        )
        values = np.stack([more.twists / SIZES[0], more.wrenches / SIZES[1]], axis=1)
        # Beyond a change of the mode there is no derivative.
        values[more.modes != found.modes] = np.nan
        return values

    values = np.stack([found.twists / SIZES[0], found.wrenches / SIZES[1]], axis=1)
    mine = np.stack(
        [stacked(found.twist) / SIZES[0][:, None], stacked(found.wrench) / SIZES[1][:, None]], 1
    )
    errors = []
    for axis, unit in enumerate(units):
        derivative = mine[..., axis] * unit
        size = np.abs(derivative).max(axis=2) + np.abs(values).max(axis=2) + 1e-300
        errors.append(best_differences(lambda h, a=axis: moved(a, h), derivative, size))
    worst = np.max(errors, axis=(0, 2))
    assert found.smooth[found.modes != SEPARATE].all()
    slides = (found.modes == LEFT) | (found.modes == RIGHT)
    assert slides.sum() > 3
    # Beside rims of facets the differences straddle two pieces of the surface.
    assert worst[slides].max() <= (1e-8 if kind in ("facets", "points") else 1e-9)
    sticks = found.modes == STICK
    if friction > 0.0:
        # The search for the sticking force leaves noise in its differences.
        assert sticks.sum() > 3
        assert np.median(worst[sticks]) <= 1e-9
        assert worst[sticks].max() <= 1e-6
    assert not mine[found.modes == SEPARATE].any()


@pytest.mark.parametrize("kind", KINDS)
def test_the_contact_follows_a_sticking_pusher(kind):
    _, (points, _, velocities), found = every_push(kind, 1.0, 200)
    sticks = found.modes == STICK
    jacobians, twists = contact_jacobians(points)[sticks], found.twists[sticks]
    by_velocity, by_point = found.twist.by_velocity[sticks], found.twist.by_point[sticks]
    # J dV/du = 1, and J dV/dp = -(dJ/dp) V.
    assert np.abs(jacobians @ by_velocity - np.eye(2)).max() < 1e-10
    arms = np.zeros_like(by_point[:, :2])
    arms[:, 0, 1], arms[:, 1, 0] = twists[:, 2], -twists[:, 2]
    assert np.abs(jacobians @ by_point - arms).max() < 1e-9 * np.abs(arms).max()
    # What turns the normal or the cone's edges is not felt within the cone.
    for derivatives in (found.twist, found.wrench):
        assert not derivatives.by_normal[sticks].any()
        assert not derivatives.by_friction[sticks].any()
    # The load stays a force at the contact: a moved one has the old force's moment.
    force, change = found.wrench.by_velocity[sticks][:, :2], found.wrench.by_velocity[sticks][:, 2]
    x, y = points[sticks].T
    moment = (x * force[:, 1].T - y * force[:, 0].T).T
    size = np.abs(moment).max(axis=1, keepdims=True) + 0.05 * np.abs(force).max(axis=1)
    assert np.abs((change - moment) / size).max() < 1e-6
    assert (velocities[sticks] != 0.0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_motions_grow_with_the_velocity_and_loads_stay_on_the_surface(kind):
    for friction in (0.0, 0.4, np.inf):
        _, (_, normals, velocities), found = every_push(kind, friction, 200, seed=6)
        pushed = found.modes != SEPARATE
        along = np.einsum("nij,nj->ni", found.twist.by_velocity, velocities)
        assert np.abs((along - found.twists) / SIZES[0]).max() < 1e-10 * 0.01 * 1e3
        kept = np.einsum("nij,nj->ni", found.wrench.by_velocity, velocities)
        size = np.abs(found.wrench.by_velocity / SIZES[1][:, None]).max(axis=(1, 2)) * 0.01
        assert (np.abs(kept / SIZES[1]).max(axis=1) <= 1e-7 * size + 1e-12).all()
        # The twist is normal to the surface: no change of the load on it has power.
        for change in np.moveaxis(stacked(found.wrench)[pushed], 2, 0):
            twists = found.twists[pushed] / SIZES[0]
            loads = change / SIZES[1]
            power = np.abs((twists * loads).sum(axis=1))
            most = np.linalg.norm(twists, axis=1) * np.linalg.norm(loads, axis=1)
            assert (power <= 1e-6 * most + 1e-14).all()
        # A slide does not feel what the pusher does along the face.
        slides = (found.modes == LEFT) | (found.modes == RIGHT)
        tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
        across = np.einsum("nij,nj->ni", found.twist.by_velocity, tangents)[slides]
        assert np.abs(across / SIZES[0]).max() < 1e-12


def test_a_sticking_push_of_an_ellipsoid_is_in_closed_form():
    rng = np.random.default_rng(2)
    surface = KINDS["ellipsoid"](rng)
    points, normals, velocities = random_contacts(rng, 300)
    found = push_derivatives(surface, points, normals, 2.0, velocities)
    unit = SCALING.wrench_unit
    matrix = surface.matrices[0] / np.multiply.outer(unit, unit)
    jacobians = contact_jacobians(points)
    lj = matrix @ jacobians.swapaxes(1, 2)
    right = lj @ np.linalg.inv(jacobians @ lj)
    sticks = found.modes == STICK
    assert sticks.sum() > 100
    error = (found.twist.by_velocity - right)[sticks] / SIZES[0][:, None]
    assert np.abs(error).max() < 1e-11 * np.abs(right[sticks] / SIZES[0][:, None]).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_mirror_swaps_left_and_right(kind):
    rng = np.random.default_rng(11)
    surface = KINDS[kind](rng)
    points, normals, velocities = random_contacts(rng, 100)
    found = push_derivatives(surface, points, normals, 0.7, velocities)
    flip, other = np.array([1.0, -1.0]), np.array([1.0, -1.0, -1.0])
    seen = push_derivatives(
        mirrored(surface), points * flip, normals * flip, 0.7, velocities * flip
    )
    swap = np.array([STICK, RIGHT, LEFT, SEPARATE])
    assert (seen.modes == swap[found.modes]).all()
    # Velocity and point flip across the mirror, a turn of the normal goes the other way.
    columns = np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
    for mine, its, unit in (
        (found.twist, seen.twist, SIZES[0]),
        (found.wrench, seen.wrench, SIZES[1]),
    ):
        right = stacked(mine) * other[:, None] * columns / unit[:, None]
        error = np.abs(stacked(its) / unit[:, None] - right).max(axis=(1, 2))
        size = np.abs(right).max(axis=(1, 2))
        assert np.quantile(error / (size + 1.0), 0.95) < 1e-9
    np.testing.assert_allclose(seen.margins, found.margins[:, ::-1], atol=1e-9)
    assert (seen.next_modes == swap[found.next_modes[:, ::-1]]).all()


@pytest.mark.parametrize("friction", [0.0, 0.4, 2.0, np.inf])
@pytest.mark.parametrize("kind", ["ellipsoid", "norms", "dissipation", "points"])
def test_margins_reach_to_the_next_modes(kind, friction):
    rng = np.random.default_rng(4)
    surface = KINDS[kind](rng)
    points, normals, velocities = random_contacts(rng, 200)
    velocities[::5] *= -1.0
    found = push_derivatives(surface, points, normals, friction, velocities)
    for side, sign in enumerate((-1.0, 1.0)):
        margin = found.margins[:, side]
        for share, modes in ((1.0 - 1e-6, found.modes), (1.0 + 1e-6, found.next_modes[:, side])):
            turn = sign * (margin * share + (1e-9 if share > 1.0 else -1e-9))
            there = pushes(surface, points, normals, friction, turned(velocities, turn)).modes
            wide = margin > 1e-6
            assert ((there == modes) | ~wide).all()


def test_a_support_point_at_rest_gives_the_mean_of_both_sides():
    surface = PointContacts(
        [[0.05, 0.05], [-0.05, 0.05], [-0.05, -0.05], [0.05, -0.05]], [0.5] * 4, SCALING
    )
    contact = [-0.05, 0.0], [1.0, 0.0], 10.0

    def at(across):
        return push_derivatives(surface, *contact, [0.05, -0.1 + across])

    # Across the arm from the contact to the first support point: it does not move.
    rest, left, right = at(0.0), at(1e-6), at(-1e-6)
    assert not rest.smooth
    assert left.smooth
    assert right.smooth
    mean = 0.5 * (left.twist.by_velocity + right.twist.by_velocity)
    assert np.abs(left.twist.by_velocity - right.twist.by_velocity).max() > 0.5
    np.testing.assert_allclose(rest.twist.by_velocity, mean, atol=1e-3)
    assert np.isfinite(stacked(rest.wrench)).all()
    # Many pushes find the load that one does: a force at the contact.
    _, fy, torque = rest.wrenches
    assert torque == pytest.approx(-0.05 * fy, abs=1e-12)
    alone = push(surface, *contact, [0.05, -0.1]).wrench
    np.testing.assert_allclose(rest.wrenches, alone, atol=5e-3)


FEW_POINTS = {
    "one point": PointContacts([[0.01, 0.02]], [1.0], SCALING),
    "two points": PointContacts([[0.05, 0.0], [-0.05, 0.0]], [1.0, 1.0], SCALING),
    "two points of flat norms": PowerSum.norms(
        [np.diag([1.0, 1.0, 0.0]), np.diag([0.0, 1.0, 1.0])], SCALING
    ),
    "a steep term": PowerSum([np.eye(3), np.diag([1.0, 0.0, 0.0])], [0.5, 2.0 / 3.0], SCALING),
    "small": PowerSum(np.eye(3)[np.newaxis], [1.0], Scaling(1e-9, 1e-100)),
    "large": PowerSum(np.eye(3)[np.newaxis], [1.0], Scaling(1e9, 1e100)),
}


@pytest.mark.parametrize("body", FEW_POINTS)
def test_derivatives_are_finite_where_surfaces_have_none(body):
    surface = FEW_POINTS[body]
    rho = surface.scaling.characteristic_length
    places = np.array([[-1.0, 0.0], [-1.0, 0.2], [0.0, -1.0], [1.0, 0.0], [0.0, 0.0]]) * rho
    for friction in (0.1, 0.3, 10.0, 1e6):
        for velocity in ([1.0, 0.0], [1.0, 0.2], [0.0, 1.0], [0.0, 0.0], [1e-100, 1e-100]):
            for normal in ([1.0, 0.0], [0.0, 1.0]):
                found = push_derivatives(surface, places, [normal] * 5, friction, [velocity] * 5)
                for derivatives in (found.twist, found.wrench):
                    assert np.isfinite(stacked(derivatives)).all()
                assert np.isfinite(found.margins).all()
                assert found.smooth.dtype == bool


def test_one_push_is_as_many():
    surface, (points, normals, velocities), found = every_push("norms", 0.5, 6)
    for row in range(6):
        one = push_derivatives(surface, points[row], normals[row], 0.5, velocities[row])
        assert one.twists.shape == (3,)
        assert one.twist.by_velocity.shape == (3, 2)
        assert one.twist.by_normal.shape == (3,)
        assert one.margins.shape == (2,)
        assert (
            MODES[int(one.modes)]
            is push(surface, points[row], normals[row], 0.5, velocities[row]).mode
        )
        np.testing.assert_allclose(stacked(one.twist), stacked(found.twist)[row], rtol=1e-9)
    assert MODES[SEPARATE] is ContactMode.SEPARATE


def test_what_is_no_push_is_refused():
    surface = KINDS["norms"](np.random.default_rng(1))
    with pytest.raises(ShapeError, match="points, normals, velocities"):
        push_derivatives(surface, [0.0, 0.0], [[1.0, 0.0]], 0.3, [1.0, 0.0])
    with pytest.raises(ShapeError, match="friction"):
        push_derivatives(surface, [[0.0, 0.0]], [[1.0, 0.0]], [0.3, 0.4], [[1.0, 0.0]])
    with pytest.raises(NotFiniteError, match="velocities"):
        push_derivatives(surface, [0.0, 0.0], [1.0, 0.0], 0.3, [np.nan, 0.0])


def test_a_kind_without_derivatives_is_refused():
    with pytest.raises(DataError, match="no derivatives"):
        push_derivatives(Box(), [-0.05, 0.0], [1.0, 0.0], 0.3, [1.0, 0.0])
