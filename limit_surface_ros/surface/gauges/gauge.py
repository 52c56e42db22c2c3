# SPDX-License-Identifier: Apache-2.0
"""Gauges: positive functions, homogeneous of degree one, of scaled loads or motions.

The load factor is a gauge of loads, the dissipation D one of motions: each is the support function
of the other's unit surface. A solver asks a gauge g for no more than what stands here. Columns are
arrays of shape (3, m).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    from limit_surface_ros.checks import Floats

    Vector: TypeAlias = tuple[float, float, float]
    # The entries xx, xy, xz, yy, yz and zz of a symmetric matrix.
    Six: TypeAlias = tuple[float, float, float, float, float, float]
    # Height, gradient and Newton's move at a place in a plane.
    PlaneStep: TypeAlias = tuple[float, tuple[float, float]]


class Turning(NamedTuple):
    """A gauge's values at points x (3, m), with how the direction of its gradient turns there.

    Attributes:
        values: Shape (m,).
        normals: N along the gradients, of any length, shape (3, m).
        matrices: Symmetric K, as six rows xx, xy, xz, yy, yz and zz, shape (6, m): K x is along
            N, and (1 - u u') K / |N| is the derivative of u = N / |N|.
        kinks: Matrices (6, m) of the terms that turn at once, which `matrices` lack: of a trace
            about one at a kink, zero elsewhere; None if there is no kink.
    """

    values: Floats
    normals: Floats
    matrices: Floats
    kinks: Floats | None


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

    def turning(self, points: Floats, null: float = ..., /) -> Turning:
        """Return values and normals at points (3, m), and how the normals turn.

        Args:
            points: Shape (3, m).
            null: Norm of a term, relative to what it could be, up to which it is at its kink.
        """
        ...


@runtime_checkable
class BoundedGauge(Gauge, Protocol):
    """A gauge with an ellipsoid inside its unit surface through each point of it."""

    def ellipsoids(self, points: Floats) -> Floats:
        """Return P (m, 3, 3): the ellipsoids x' P^-1 x = 1 touch the surface at points (3, m)."""
        ...


class ScalarGauge(Protocol):
    """A gauge of one vector at a time, in plain floats; None stands for "this needs care"."""

    def value(self, point: Vector, /) -> float | None:
        """Return the value at a point."""
        ...

    def value_and_normal(self, point: Vector, /) -> tuple[float, Vector] | None:
        """Return the value at a point, and a vector of any length along the gradient."""
        ...

    def turning(self, point: Vector, /) -> tuple[float, Vector, Six] | None:
        """Return value, normal and how that turns, as `Turning` has them, at a point."""
        ...

    def is_vertex(self, point: Vector, /) -> bool:
        """Tell whether a normal that is turned a little, any way, still is one of this point."""
        ...

    def in_plane(
        self, normal: Vector, first: Vector, second: Vector, /
    ) -> Callable[[float, float], PlaneStep | None]:
        """Return a function of the p and q of a point n + p e1 + q e2.

        It returns log g and Newton's move for g in p and q.

        Args:
            normal: n, a unit vector.
            first: e1, a unit vector across n.
            second: e2, a unit vector across both.
        """
        ...
