# SPDX-License-Identifier: Apache-2.0
"""The linear systems of pushes are the derivatives of the motion that pushes cause."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from limit_surface_ros.errors import NotFiniteError, RangeError, ShapeError
from limit_surface_ros.motion.linear_push import linearise_push
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.push import pushes
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.motion.round_outlines import Ellipse, SmoothCurve
from push_helpers import KINDS, RECTANGLE, best_differences, ellipsoid, turned

STICK, LEFT, RIGHT, SEPARATE = range(4)
ABOUT = np.array([0.004, -0.007])
FRICTION = 0.5
AXES = np.array([0.06, 0.04])
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def on_ellipse(angles):
    """Return points and inward normals of the ellipse at parameters (n,)."""
    points = AXES * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    inward = -points / AXES**2
    return points, inward / np.linalg.norm(inward, axis=1, keepdims=True)


def clockwise(angle, length):
    """Return the parameter of an ellipse a length further, clockwise."""

    def arc(there):
        speed = quad(
            lambda t: np.hypot(AXES[0] * np.sin(t), AXES[1] * np.cos(t)),
            there,
            angle,
            epsabs=1e-15,
            epsrel=1e-14,
        )
        return speed[0] - length

    return brentq(arc, angle - 1.0, angle + 1.0, xtol=1e-15)


def rates(surface, poses, points, normals, inputs):
    """Return dx/dt (n, 4) of velocities along the normals and to their left."""
    lefts = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    velocities = inputs[:, :1] * normals + inputs[:, 1:] * lefts
    found = pushes(surface, points - ABOUT, normals, FRICTION, velocities)
    return in_frame(poses, points, lefts, velocities, found.twists), found.modes


def in_frame(poses, points, lefts, velocities, twists):
    """Return dx/dt (n, 4) of twists at the reference point, and of pushers' velocities."""
    omega = twists[:, 2:]
    origin = twists[:, :2] + omega * [ABOUT[1], -ABOUT[0]]
    arms = points - ABOUT
    moved = twists[:, :2] + omega * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
    slips = ((velocities - moved) * lefts).sum(axis=1, keepdims=True)
    return np.concatenate([turned(origin, poses[:, 2]), omega, slips], axis=1)


@pytest.fixture(params=KINDS)
def surface(request):
    return KINDS[request.param](np.random.default_rng(3))


def states(rng, count=30):
    poses = rng.normal(size=(count, 3)) * [0.1, 0.1, 2.0]
    angles = rng.uniform(0.0, 2.0 * np.pi, count)
    heading = rng.uniform(-1.5, 1.5, count)
    inputs = 0.05 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return poses, angles, inputs


# Typical sizes: of a place, an angle, and of what the inputs are.
UNITS = np.array([0.05, 0.05, 1.0, 0.05])


def errors(system, rates_at, inputs_size):
    """Return errors (n, columns) of A and B against differences of rates."""
    scale = np.array([1.0, 1.0, 20.0, 1.0])
    columns = [
        (system.a[..., 2], 2, 1.0),
        (system.a[..., 3], 3, 0.05),
        *((system.b[..., k], 4 + k, inputs_size[k]) for k in range(system.b.shape[-1])),
    ]
    size = np.abs(system.rates / scale).max(axis=1)
    found = []
    for derivative, axis, unit in columns:
        mine = derivative * unit / scale
        found.append(
            best_differences(
                lambda h, a=axis, u=unit: rates_at(a, h * u) / scale,
                mine,
                size + np.abs(mine).max(axis=1) + 1e-12,
            )
        )
    assert not system.a[..., :2].any()
    return np.array(found)


def test_velocity_systems_are_what_differences_tend_to(surface):
    poses, angles, inputs = states(np.random.default_rng(1))
    points, normals = on_ellipse(angles)
    system = linearise_push(
        surface, Ellipse(AXES), FRICTION, poses, points, inputs, reference_point=ABOUT
    )
    steps = {}

    def rates_at(axis, h):
        if axis == 3:
            if h not in steps:
                there = np.array([clockwise(angle, h) for angle in angles])
                steps[h] = on_ellipse(there)
            found, modes = rates(surface, poses, *steps[h], inputs)
        else:
            pose, given = poses.copy(), inputs.copy()
            (pose if axis < 4 else given)[:, axis % 4] += h
            found, modes = rates(surface, pose, points, normals, given)
        found[modes != system.modes] = np.nan
        return found

    here, modes = rates(surface, poses, points, normals, inputs)
    assert (modes == system.modes).all()
    assert np.abs(system.rates - here).max() < 1e-12
    worst = errors(system, rates_at, [0.05, 0.05]).max(axis=0)
    assert np.median(worst) <= 1e-9
    assert worst[system.modes != STICK].max() <= 1e-7
    sticks = system.modes == STICK
    # A contact that sticks stays where it is.
    assert not system.rates[sticks, 3].any()
    assert not system.a[sticks, 3].any()
    assert not system.b[sticks, 3].any()
    assert system.smooth.all()


def test_force_systems_are_what_differences_tend_to(surface):
    rng = np.random.default_rng(2)
    poses, angles, _ = states(rng)
    points, normals = on_ellipse(angles)
    force = rng.uniform(-0.4, 0.4, 30)
    inputs = np.stack([np.cos(force), np.sin(force), rng.normal(size=30) * 0.01], axis=1)
    system = linearise_push(
        surface,
        Ellipse(AXES),
        FRICTION,
        poses,
        points,
        inputs,
        kind="force",
        reference_point=ABOUT,
    )

    def rates_at(axis, h):
        pose, given, (place, inward) = poses.copy(), inputs.copy(), (points, normals)
        if axis == 3:
            place, inward = on_ellipse(np.array([clockwise(angle, h) for angle in angles]))
        elif axis == 2:
            pose[:, 2] += h
        else:
            given[:, axis - 4] += h
        lefts = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
        forces = given[:, :1] * inward + given[:, 1:2] * lefts
        (x, y), (fx, fy) = (place - ABOUT).T, forces.T
        twists, _ = surface.quadratic_twist(np.stack([fx, fy, x * fy - y * fx], axis=1))
        found = in_frame(pose, place, lefts, forces, twists)
        found[:, 3] = given[:, 2]
        return found

    assert np.abs(system.rates - rates_at(2, 0.0)).max() < 1e-12
    worst = errors(system, rates_at, [1.0, 1.0, 0.01]).max(axis=0)
    assert np.median(worst) <= 1e-9
    assert np.quantile(worst, 0.9) <= 1e-7
    assert (system.modes == STICK).sum() > 15
    # The force can turn up to the cone's edges.
    edge = np.arctan(FRICTION)
    sticks = system.modes == STICK
    np.testing.assert_allclose(system.margins[sticks, 0], force[sticks] + edge, atol=1e-12)
    np.testing.assert_allclose(system.margins[sticks].sum(axis=1), 2.0 * edge, atol=1e-12)


def test_an_ellipsoid_gives_the_matrices_of_the_papers():
    c, friction = 0.02, 0.3
    body = ellipsoid(c, 1.7)
    pose, contact = [0.3, -0.1, 0.4], [-0.045, 0.013]
    # Hogan and Rodriguez 2020: dx = [R L J' f; slip], L = diag(1, 1, 1/c^2) up to a factor.
    force = np.array([1.0, 0.2, 0.0])
    found = linearise_push(body, RECTANGLE, friction, pose, contact, force, kind="force")
    turn = np.eye(3)
    turn[:2, :2] = turned(np.eye(2), 0.4).T
    jacobian = np.array([[1.0, 0.0, -contact[1]], [0.0, 1.0, contact[0]]])
    matrix = np.diag([1.0, 1.0, c**-2]) / 1.7**2
    np.testing.assert_allclose(found.b[:3, :2], turn @ matrix @ jacobian.T, rtol=1e-12)
    np.testing.assert_allclose(found.b[3], [0.0, 0.0, 1.0])
    # A step to the left of the inward normal +x is along +y: the arm of f_x falls.
    np.testing.assert_allclose(
        found.a[:3, 3], turn @ matrix @ [0.0, 0.0, -1.0], rtol=1e-12, atol=1e-12
    )
    # Their velocity input, sticking: twist = L J' (J L J')^-1 u.
    found = linearise_push(body, RECTANGLE, 5.0, pose, contact, [0.1, 0.01])
    lj = matrix @ jacobian.T
    right = turn @ lj @ np.linalg.inv(jacobian @ lj)
    np.testing.assert_allclose(found.b[:3], right, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("across", [-0.08, -0.01, 0.0, 0.02, 0.09])
def test_the_rates_are_those_of_a_push_along_a_path(across):
    body = KINDS["norms"](np.random.default_rng(8))
    pose, contact = np.array([0.2, 0.1, 0.7]), np.array([-0.045, 0.015])
    velocity = np.array([0.05, across])
    found = linearise_push(body, RECTANGLE, FRICTION, pose, contact, velocity)
    start = turned(contact[np.newaxis], 0.7)[0] + pose[:2]
    way = turned(velocity[np.newaxis], 0.7)[0]
    seconds = 1e-4
    run = simulate_push(
        body, RECTANGLE, 0.0, FRICTION, pose, [start, start + seconds * way], accuracy=1e-12
    )
    np.testing.assert_allclose(
        (run.end_pose - pose) / seconds, found.rates[:3], rtol=1e-3, atol=1e-4
    )
    # Where the pusher then is on the face.
    centre = turned((start + seconds * way - run.end_pose[:2])[np.newaxis], -run.end_pose[2])[0]
    assert (centre[1] - contact[1]) / seconds == pytest.approx(found.rates[3], abs=1e-4)


def test_a_curve_is_linearised_as_the_ellipse_that_it_is_near():
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    curve, ellipse = SmoothCurve(on_ellipse(angles)[0]), Ellipse(AXES)
    poses, places, inputs = states(np.random.default_rng(7), 20)
    body = KINDS["dissipation"](np.random.default_rng(3))
    points, _ = on_ellipse(places)
    mine, right = (
        linearise_push(body, outline, FRICTION, poses, points, inputs)
        for outline in (curve, ellipse)
    )
    np.testing.assert_allclose(mine.a, right.a, atol=1e-3 * np.abs(right.a).max())
    np.testing.assert_allclose(curve.curvatures(points), ellipse.curvatures(points), rtol=1e-3)


def test_vertices_and_pushers_that_leave_have_systems_too():
    body = KINDS["points"](np.random.default_rng(3))
    corner = RECTANGLE.vertices[0]
    found = linearise_push(body, RECTANGLE, 0.4, [0.0, 0.0, 0.0], corner, [0.1, 0.0])
    assert not found.smooth
    assert np.isfinite(found.a).all()
    assert np.isfinite(found.b).all()
    left = linearise_push(body, RECTANGLE, 0.4, [0, 0, 0.3], [-0.045, 0.0], [-0.1, 0.02])
    assert left.modes == SEPARATE
    np.testing.assert_allclose(left.rates, [0.0, 0.0, 0.0, 0.02])
    np.testing.assert_allclose(left.b, [[0, 0], [0, 0], [0, 0], [0, 1]])
    assert not left.a.any()
    for force in ([0.0, 0.0, 0.0], [-1.0, 0.2, 0.0]):
        pulled = linearise_push(
            body, RECTANGLE, 0.4, [0, 0, 0.3], [-0.045, 0.0], force, kind="force"
        )
        assert pulled.modes == SEPARATE
        assert not pulled.rates.any()
        assert np.isfinite(pulled.margins).all()
        # No force has no direction that could turn.
        assert pulled.margins.any() == any(force)


def test_one_state_is_as_many():
    body = KINDS["two powers"](np.random.default_rng(3))
    poses, angles, inputs = states(np.random.default_rng(1), 4)
    points, _ = on_ellipse(angles)
    outline = Ellipse(AXES)
    many = linearise_push(body, outline, FRICTION, poses, points, inputs)
    for row in range(4):
        one = linearise_push(body, outline, FRICTION, poses[row], points[row], inputs[row])
        for name in ("rates", "a", "b", "modes", "margins", "smooth"):
            assert getattr(one, name).shape == getattr(many, name)[row].shape
            np.testing.assert_allclose(
                getattr(one, name), getattr(many, name)[row], rtol=1e-9, atol=1e-12
            )


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"kind": "speed"}, RangeError, "velocity, force"),
        ({"inputs": [0.1, 0.0, 0.0]}, ShapeError, "inputs"),
        ({"poses": [[0.0, 0.0, 0.0]]}, ShapeError, "poses"),
        ({"contacts": [np.nan, 0.0]}, NotFiniteError, "contacts"),
        ({"friction": -1.0}, RangeError, "friction"),
        ({"reference_point": [0.0]}, ShapeError, "reference_point"),
    ],
)
def test_what_is_no_state_is_refused(changed, error, message):
    arguments = {
        "surface": ellipsoid(0.02),
        "outline": Polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]]),
        "friction": 0.3,
        "poses": [0.0, 0.0, 0.0],
        "contacts": [-1.0, 0.0],
        "inputs": [0.1, 0.0],
    } | changed
    with pytest.raises(error, match=message):
        linearise_push(**arguments)
