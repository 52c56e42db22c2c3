# SPDX-License-Identifier: Apache-2.0
"""Derivatives of pushes: how motion and load change with pusher, contact and friction.

Within a mode the answer of `push` is smooth wherever the surface is. With J the map from twists
to velocities at the contact and u the pusher's velocity:

- A sticking pusher: J V = u, and the load of V has no moment about the contact. Where loads are
  the gradient of a dissipation D, V moves along the line of motions with that velocity so that
  the moment stays zero. Elsewhere W = J' f, f the force for which J kappa(J' f) = u with kappa =
  `quadratic_twist`, whose Jacobian K gives dV/du = K J' (J K J')^-1: the matrix of pusher-slider
  models, K. M. Lynch and M. T. Mason, IJRR 1996, doi:10.1177/027836499601500602, for any surface.
- A sliding one: the load is along an edge of the friction cone, and the motion is scaled so that
  the contact keeps up along the normal: the chain rule with `twist_jacobian`.
- One that leaves: nothing changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.motion.push import pushes
from limit_surface_ros.motion.push_batch import contact_velocities, loads_at
from limit_surface_ros.motion.push_checks import (
    as_complex,
    friction_edges,
    same_pairs,
    unit_normals,
)
from limit_surface_ros.motion.push_roots import SEPARATE, SLIDE_LEFT, SLIDE_RIGHT, STICK
from limit_surface_ros.surface.shape import DissipationShape

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from limit_surface_ros.checks import Bools, Complexes, Floats, Places
    from limit_surface_ros.surface.base import LimitSurface

# What derivatives are taken by, in the order of the columns here.
_VELOCITY, _POINT, _NORMAL, _FRICTION = slice(0, 2), slice(2, 4), 4, 5
_COLUMNS = 6
# Part of its size by which a load may be off the gradient at its motion; beyond, the motion is at
# a kink of the dissipation: a support point is at rest.
_KINK = 1e-7
# Size to which kinks are rounded, in parts of a motion's.
_ROUNDING = 1e-10
# Determinant of a matrix of unit trace below which it has no inverse.
_SINGULAR = 1e-28
_QUARTER = 0.5 * np.pi
# Width of a range of angles [rad] that a turn passes unseen.
_PASSED = 1e-12


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of three components, of n pushes or one.

    Attributes:
        by_velocity: By the pusher's velocity [m/s], shape (..., 3, 2).
        by_point: By the contact point [m], the normal kept, shape (..., 3, 2).
        by_normal: By the angle of the normal, counterclockwise [rad], shape (..., 3).
        by_friction: By the coefficient of friction, shape (..., 3).
    """

    by_velocity: Floats
    by_point: Floats
    by_normal: Floats
    by_friction: Floats


@dataclass(frozen=True, eq=False)
class PushDerivatives:
    """Outcomes of pushes, how they change, and how near the next modes are.

    Attributes:
        twists: Of the bodies at the reference point, (vx, vy, omega_z) in [m/s, m/s, rad/s],
            shape (..., 3).
        wrenches: Of the pushers on the bodies, (fx, fy, tau_z) in [N, N, N m], shape (..., 3).
        modes: Places in `MODES`: 0 stick, 1 slide left, 2 slide right, 3 separate; shape (...).
        twist: Derivatives of the twists.
        wrench: Derivatives of the wrenches.
        margins: Angles [rad] by which the pusher's velocity can turn to the right, and to the
            left, before the mode is another, shape (..., 2).
        next_modes: Which modes these are, shape (..., 2).
        smooth: Where the surface has a derivative. Elsewhere, as where a support point rests, the
            derivatives are those of what is smooth there; shape (...).
    """

    twists: Floats
    wrenches: Floats
    modes: NDArray[np.intp]
    twist: Derivatives
    wrench: Derivatives
    margins: Floats
    next_modes: NDArray[np.intp]
    smooth: Bools


def push_derivatives(
    surface: LimitSurface,
    points: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike,
    velocities: ArrayLike,
) -> PushDerivatives:
    """Return how pushes come out, as `pushes` does, and their derivatives.

    At the border of two modes the derivatives are those of the mode that the push is in.

    Args:
        surface: Limit surface of the body; it should be convex.
        points: Contact points about the reference point [m], shape (2,) or (n, 2).
        normals: Normals of the contacts, pointing into the body, of any length, as many.
        friction: Coefficients of friction between pusher and body, from 0 to infinity, one for
            all or shape (n,).
        velocities: Of the pusher [m/s], as many.

    Raises:
        ShapeError: An array has another shape.
        NotFiniteError: A number other than a coefficient of friction is NaN or infinite.
        ZeroVectorError: A normal is zero.
        RangeError: A coefficient is negative or NaN.
        DataError: The kind of surface has no derivatives in closed form.

    Example:
        >>> import numpy as np
        >>> from limit_surface_ros.surface.kinds.power_sum import PowerSum
        >>> body = PowerSum.thesis([np.eye(3)])
        >>> found = push_derivatives(body, [-0.5, 0.0], [1.0, 0.0], 0.3, [0.1, 0.0])
        >>> found.twist.by_velocity.round(12).tolist()
        [[1.0, 0.0], [0.0, 0.8], [0.0, -0.4]]
    """
    (place, normal, moved), lead = same_pairs(
        points=points, normals=normals, velocities=velocities
    )
    edges = friction_edges(friction, len(place))
    inward = as_complex(unit_normals(normal))
    found = pushes(surface, place, normal, friction, moved)
    twist, wrench = (np.zeros((len(place), 3, _COLUMNS)) for _ in range(2))
    smooth = np.ones(len(place), dtype=bool)
    in_closed_form = isinstance(surface.shape, DissipationShape)
    stuck = _sticking_by_turning if in_closed_form else _sticking_by_force
    points_, velocities_ = as_complex(place), as_complex(moved)
    for mode, tangents in (
        (STICK, stuck),
        (SLIDE_LEFT, _sliding),
        (SLIDE_RIGHT, _sliding),
    ):
        rows = np.flatnonzero(found.modes == mode)
        if len(rows):
            some = _Found(
                points_[rows],
                inward[rows],
                edges[rows] if mode == SLIDE_LEFT else np.conj(edges[rows]),
                velocities_[rows],
                found.twists[rows],
                found.wrenches[rows],
                1.0 if mode == SLIDE_LEFT else -1.0,
            )
            twist[rows], wrench[rows], smooth[rows] = tangents(surface, some)
    right, left = (
        np.clip(_edge_angles(surface, points_, inward, edge), -_QUARTER, _QUARTER)
        for edge in (np.conj(edges), edges)
    )
    angles = np.angle(np.conj(inward) * velocities_)
    margins, following = margins_between(angles, right, left, found.modes)
    margins[velocities_ == 0.0] = 0.0
    return PushDerivatives(
        found.twists.reshape(*lead, 3),
        found.wrenches.reshape(*lead, 3),
        found.modes.reshape(lead),
        _split(twist, lead),
        _split(wrench, lead),
        margins.reshape(*lead, 2),
        following.reshape(*lead, 2),
        smooth.reshape(lead),
    )


class _Found(NamedTuple):
    """Pushes of one mode (m,) with their answers.

    Edges are unit forces along the edges of friction cones of which the normal is 1, on the
    `side` to which the pusher slides: 1 for the left.
    """

    points: Complexes
    normals: Complexes
    edges: Complexes
    velocities: Complexes
    twists: Floats
    wrenches: Floats
    side: float


def _split(columns: Floats, lead: tuple[int, ...]) -> Derivatives:
    columns = columns.reshape(*lead, 3, _COLUMNS)
    return Derivatives(
        *(columns[..., part] for part in (_VELOCITY, _POINT, _NORMAL, _FRICTION)),
    )


def _sticking_by_turning(surface: LimitSurface, at: _Found) -> tuple[Floats, Floats, Bools]:
    """Return derivatives (m, 3, 6) of twists and wrenches where D is in closed form, and smooth.

    V = V_0 + w d, with J V = u and d the turn about the contact: its load keeps d' grad D(V) = 0.
    Where a support point rests, w has two derivatives, one to each side, and gets their mean.
    """
    loads, hessians = _rounded(surface, at.twists)
    off = np.abs((loads - at.wrenches) / surface.scaling.wrench_unit).max(axis=1)
    rests = off > _KINK * np.abs(at.wrenches / surface.scaling.wrench_unit).max(axis=1)
    count, rate = len(at.twists), at.twists[:, 2]
    turn = np.stack([at.points.imag, -at.points.real, np.ones(count)], axis=1)
    # How V_0 changes, and how much moment that d's own change adds.
    start, moment = np.zeros((count, 3, _COLUMNS)), np.zeros((count, _COLUMNS))
    start[:, 0, 0] = start[:, 1, 1] = 1.0
    start[:, 1, 2], start[:, 0, 3] = -rate, rate
    moment[:, 2], moment[:, 3] = -at.wrenches[:, 1], at.wrenches[:, 0]
    curved = np.einsum("mi,mij->mj", turn, hessians)
    stiffness = (curved * turn).sum(axis=1)
    moment += np.einsum("mj,mjc->mc", curved, start)
    firm = stiffness > 0.0
    turned = -np.where(firm, 1.0 / np.where(firm, stiffness, 1.0), 0.0)[:, np.newaxis] * moment
    twist = start + turn[:, :, np.newaxis] * turned[:, np.newaxis]
    if rests.any():
        # The load leaps with what rests: the other points' share has a derivative.
        _, hessians[rests] = surface.wrench_jacobian(at.twists[rests])
    return twist, hessians @ twist, firm & ~rests


def _rounded(surface: LimitSurface, twists: Floats) -> tuple[Floats, Floats]:
    """Return gradients (m, 3) and Hessians (m, 3, 3) of D with its kinks rounded a little."""
    unit_in, unit_out = surface.scaling.twist_unit, surface.scaling.wrench_unit
    scaled = twists / unit_in
    size = np.abs(scaled).max(axis=1)
    assert isinstance(surface.shape, DissipationShape)
    _, loads, hessians = surface.shape.dissipation.derivatives(
        (scaled / size[:, np.newaxis]).T.copy(), np.full(len(size), _ROUNDING)
    )
    units = np.multiply.outer(unit_out, 1.0 / unit_in)
    return loads.T * unit_out, (hessians / size).transpose(2, 0, 1) * units


def _sticking_by_force(surface: LimitSurface, at: _Found) -> tuple[Floats, Floats, Bools]:
    """Return derivatives (m, 3, 6) of twists and wrenches by K = d kappa / d W, and smooth.

    Here W = D(V) times the wrench on the surface, for which kappa(W) = V.
    """
    _, k = surface.quadratic_twist(at.wrenches)
    count, rate = len(at.twists), at.twists[:, 2]
    power = (at.twists * at.wrenches).sum(axis=1)
    loads = power[:, np.newaxis] * at.wrenches
    jacobian = np.zeros((count, 2, 3))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
    jacobian[:, 0, 2], jacobian[:, 1, 2] = -at.points.imag, at.points.real
    kj = k @ jacobian.swapaxes(1, 2)
    # What u and the contact demand beyond what the load's moved arm gives.
    arm, wanted = np.zeros((count, 3, _COLUMNS)), np.zeros((count, 2, _COLUMNS))
    arm[:, 2, 2], arm[:, 2, 3] = loads[:, 1], -loads[:, 0]
    wanted[:, 0, 0] = wanted[:, 1, 1] = 1.0
    wanted[:, 1, 2], wanted[:, 0, 3] = -rate, rate
    wanted -= kj.swapaxes(1, 2) @ arm
    forces, firm = _solve(jacobian @ kj, wanted)
    moved = arm + jacobian.swapaxes(1, 2) @ forces
    twist = k @ moved
    # w = W / D(V), and dD = w . dV.
    gained = np.einsum("mi,mic->mc", at.wrenches, twist)
    wrench = moved - at.wrenches[:, :, np.newaxis] * gained[:, np.newaxis]
    wrench /= power[:, np.newaxis, np.newaxis]
    return twist, wrench, firm & surface.is_smooth_at(at.wrenches)


def _solve(matrices: Floats, right: Floats) -> tuple[Floats, Bools]:
    """Return S^-1 r for symmetric S (m, 2, 2) and r (m, 2, c), zero where S is singular."""
    size = np.maximum(matrices[:, 0, 0] + matrices[:, 1, 1], 1e-300)
    (a, b), (_, d) = matrices.transpose(1, 2, 0) / size
    determinant = a * d - b * b
    regular = determinant > _SINGULAR
    adjoint = np.array([[d, -b], [-b, a]]).transpose(2, 0, 1)
    inverse = (
        adjoint * np.where(regular, 1.0 / np.where(regular, determinant, 1.0), 0.0)[:, None, None]
    )
    return np.asarray(inverse @ (right / size[:, None, None])), np.asarray(regular)


def _sliding(surface: LimitSurface, at: _Found) -> tuple[Floats, Floats, Bools]:
    """Return derivatives (m, 3, 6) of twists and wrenches where the pusher slides, and smooth."""
    force = at.normals * at.edges
    loads = loads_at(at.points, force)
    units, jacobians = surface.twist_jacobian(loads)
    x, y = (each[:, np.newaxis] for each in (at.points.real, at.points.imag))
    # The force turns with the normal, and away from it by d atan(mu) / d mu = cos^2.
    turned = np.zeros((len(force), _COLUMNS))
    turned[:, _NORMAL] = 1.0
    turned[:, _FRICTION] = at.side * at.edges.real**2
    fx, fy = -force.imag[:, np.newaxis] * turned, force.real[:, np.newaxis] * turned
    moved = np.stack([fx, fy, x * fy - y * fx], axis=1)
    moved[:, 2, 2] += force.imag
    moved[:, 2, 3] -= force.real
    motions = jacobians @ moved
    # q and a: what the unit twist and the pusher move along the normal.
    caused = np.conj(at.normals) * contact_velocities(at.points, units)
    wanted = np.conj(at.normals) * at.velocities
    nx, ny, rate = at.normals.real, at.normals.imag, units[:, 2]
    dvx, dvy = motions[:, 0] - y * motions[:, 2], motions[:, 1] + x * motions[:, 2]
    dq = nx[:, np.newaxis] * dvx + ny[:, np.newaxis] * dvy
    dq[:, 2] += ny * rate
    dq[:, 3] -= nx * rate
    dq[:, _NORMAL] += caused.imag
    da = np.zeros_like(dq)
    da[:, 0], da[:, 1], da[:, _NORMAL] = nx, ny, wanted.imag
    share = wanted.real / caused.real
    dshare = (da - share[:, np.newaxis] * dq) / caused.real[:, np.newaxis]
    twist = units[:, :, np.newaxis] * dshare[:, np.newaxis]
    twist += share[:, np.newaxis, np.newaxis] * motions
    # w = load / g, and dg / g = V . dload / V . load; a body that turns freely needs no force.
    power = (units * loads).sum(axis=1)
    held = power > 0.0
    size = np.where(held, np.hypot(at.wrenches[:, 0], at.wrenches[:, 1]), 0.0)
    gained = np.einsum("mi,mic->mc", units, moved) / np.where(held, power, 1.0)[:, np.newaxis]
    wrench = moved - loads[:, :, np.newaxis] * gained[:, np.newaxis]
    return twist, wrench * size[:, np.newaxis, np.newaxis], surface.is_smooth_at(loads)


def margins_between(
    angles: Floats, right: Floats, left: Floats, modes: Places
) -> tuple[Floats, Places]:
    """Return angles (m, 2) to the next modes, to the right and to the left, and these modes.

    From right to left about the normal come slides to the right, sticks and slides to the left;
    from 90 deg on either side the pusher leaves.

    Args:
        angles: Of the pushers' velocities from the normals [rad], shape (m,).
        right: Where slides to the right end and sticks begin, -90 deg at least, shape (m,).
        left: Where sticks end and slides to the left begin, 90 deg at most, shape (m,).
        modes: Of the pushes, shape (m,).
    """
    angle = np.where((modes == SEPARATE) & (angles < 0.0), angles + 2.0 * np.pi, angles)
    quarter, rows = np.full_like(left, _QUARTER), np.arange(len(left))
    # By mode, the borders of its velocities to the right and to the left.
    low = np.stack([right, left, -quarter, quarter])[modes, rows]
    high = np.stack([left, quarter, right, 3.0 * quarter])[modes, rows]
    margins = np.maximum(np.stack([angle - low, high - angle], axis=1), 0.0)
    # Sticking velocities may reach 90 deg, or be a single direction that a turn passes.
    leave, sticks = np.full_like(modes, SEPARATE), left - right > _PASSED
    slides_right, slides_left = right > -_QUARTER, left < _QUARTER
    to_right = [
        np.where(slides_right, SLIDE_RIGHT, SEPARATE),
        np.where(sticks, STICK, SLIDE_RIGHT),
        leave,
        np.where(slides_left, SLIDE_LEFT, STICK),
    ]
    to_left = [
        np.where(slides_left, SLIDE_LEFT, SEPARATE),
        leave,
        np.where(sticks, STICK, SLIDE_LEFT),
        np.where(slides_right, SLIDE_RIGHT, STICK),
    ]
    return margins, np.stack([np.stack(each)[modes, rows] for each in (to_right, to_left)], axis=1)


def _edge_angles(
    surface: LimitSurface, points: Complexes, normals: Complexes, edges: Complexes
) -> Floats:
    """Return the angles from the normals of velocities that forces along edges cause."""
    force = normals * edges
    caused = contact_velocities(points, surface.twist_of_wrench(loads_at(points, force)))
    # Within 90 deg of the force.
    return np.asarray(np.angle(edges) + np.angle(np.conj(force) * caused))
