# SPDX-License-Identifier: Apache-2.0
"""Gauges: positive functions, homogeneous of degree one, of scaled loads or motions.

The load factor is a gauge of loads, the dissipation D one of motions: each is the support function
of the other's unit surface. A solver asks a gauge g for no more than what stands here. Columns are
arrays of shape (3, m).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats

    Vector: TypeAlias = tuple[float, float, float]
    # Height, gradient and Newton's move at a place in a plane.
    PlaneStep: TypeAlias = tuple[float, tuple[float, float], tuple[float, float]]


class FirstOrder(Protocol):
    """A gauge with its gradient."""

    def values_and_normals(self, points: Floats, /) -> tuple[Floats, Floats]:
        """Return the values (m,) at points (3, m) and vectors (3, m) along the gradients.

        These may have any length; what is at a kink adds nothing to them.
        """
        ...


class Gauge(FirstOrder, Protocol):
    """A positive function, homogeneous of degree one, smooth but for kinks."""

    def values(self, points: Floats, /) -> Floats:
        """Return the values (m,) at points (3, m)."""
        ...

    def derivatives(self, points: Floats, smoothing: Floats, /) -> tuple[Floats, Floats, Floats]:
        """Return the values (m,), gradients (3, m) and Hessians (3, 3, m).

        Args:
            points: Shape (3, m).
            smoothing: Relative size to which kinks are rounded, shape (m,); may be 0.
        """
        ...


@runtime_checkable
class BoundedGauge(Gauge, Protocol):
    """A gauge with an ellipsoid inside its unit surface through each point of it."""

    def ellipsoids(self, points: Floats) -> Floats:
        """Return P (m, 3, 3): the ellipsoids x' P^-1 x = 1 touch the surface at points (3, m)."""
        ...

    def along_ellipsoids(self, points: Floats, normals: Floats) -> Floats:
        """Return P n (3, m) for normals n (3, m), with P as `ellipsoids` gives it."""
        ...


class ScalarGauge(Protocol):
    """A gauge of one vector at a time, in plain floats; None stands for "this needs care"."""

    def value(self, point: Vector, /) -> float | None:
        """Return the value at a point."""
        ...

    def value_and_normal(self, point: Vector, /) -> tuple[float, Vector] | None:
        """Return the value at a point, and a vector of any length along the gradient."""
        ...

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector, /
    ) -> Callable[[float, float], PlaneStep | None]:
        """Return a function of the p and q of a point n + p e1 + q e2.

        It returns log g, its gradient, and Newton's move for g in p and q.

        Args:
            normal: n, a unit vector.
            first: e1, a unit vector across n.
            second: e2, a unit vector across both.
        """
        ...
