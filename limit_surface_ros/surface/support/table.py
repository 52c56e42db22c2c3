# SPDX-License-Identifier: Apache-2.0
"""The support function of a surface as a table, from which support points are read.

The power of the best point, D(n) = max n.x over a surface, is a gauge itself, with the point as
its gradient. A table of quintic polynomials holds D on half the sphere, and a point read from it
is almost right. The gauge's gradient there is the normal for which it is *exactly* right; from
that normal to the wanted one a step along the table's curvature leads. How much error a step
leaves is measured for each cell when the table is made; after a longer step than that allows,
another gradient measures it.

A surface that is not convex may have several points with the wanted normal, and a gradient does
not say which is the best. There a cell is read only if one sheet of the surface serves all of it.
"""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.surface.linalg import squared_lengths

if TYPE_CHECKING:
    from limit_surface_ros.checks import Bools, Floats, Places
    from limit_surface_ros.surface.gauges.gauge import FirstOrder
    from limit_surface_ros.surface.support.solvers import SupportSolver

# Cells of the table along each axis of the chart.
CELLS = 80
# Powers of x and y in a cell's polynomial, those of y one after the other for each of x.
_DEGREE = 5
_POWERS = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
_PLANE = [_POWERS.index(powers) for powers in ((0, 0), (1, 0), (0, 1))]
# Derivatives along x and y of what is read: the height, its slopes and its second derivatives.
_ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
# Vectors for which one is solved to make a table.
SAMPLES = (2 * CELLS + 1) ** 2
# Steps along the curvature until a point counts as hard.
STEPS = 6
# Share of the columns below which those that do not settle soon, as beside a kink, are left.
_FEW_LEFT = 0.04
# Lengths in the chart of steps that prove a point in any cell, and in none.
_SHORT_STEP, _LONG_STEP = 1e-10, 1e-5
# Between these a step is the last if it leaves errors below these: in the chart, which is the part
# of a step that is known of the cell, and off the surface, which grows with a step's square. Both
# are known of few places in a cell, so that more is taken.
STEP_ERROR = 3e-11
_OFF = 1e-12
# Length of a step that never leads from the surface by more than rounding.
NEAR = 1e-7
_ROUNDING = 1e-15
MORE = 4.0
# Error of a cell's polynomial, in parts of D, above which two sheets may meet in the cell: their
# slopes differ there, and a slope within a cell is about a hundredth of that on the chart.
_SMOOTH = 1e-6


class SupportTable:
    """The support function D of a surface g(x) = 1, on a stereographic chart.

    A normal n with n_z >= 0 is (|n| + n_z) w, where w = (a, b, (1 - a^2 - b^2) / 2) and
    (a, b) = (n_x, n_y) / (|n| + n_z) lies in the unit disc. With h(a, b) = D(w) the point is

        x = (h_a + a z, h_b + b z, z),   z = 2 (h - a h_a - b h_b) / (1 + a^2 + b^2).

    The surface is its own mirror image: -n has the point -x.
    """

    def __init__(self, gauge: FirstOrder, solver: SupportSolver, *, convex: bool = True) -> None:
        """Fit the polynomials to points that the solver finds, and try them between these.

        Args:
            gauge: The gauge g.
            solver: For its support points.
            convex: Whether a point with the wanted normal is the answer for that alone.

        Raises:
            SolverError: A point could not be certified.
        """
        self._gauge = gauge
        places = _grid(np.linspace(-1.0, 1.0, 2 * CELLS + 1))
        normals = _normals(places)
        points, height = solver.solve(normals)
        slopes = points[:2] - points[2] * places
        samples = np.array([height, *slopes / CELLS]).reshape(3, 2 * CELLS + 1, -1)
        coefficients, misfit = _quintics(samples)
        # Height and slopes in the middle of a cell are most of those elsewhere in it. What is lost
        # of the rest in single precision is mended by the steps that follow.
        self._planes = coefficients[_PLANE]
        coefficients[_PLANE] = 0.0
        with np.errstate(over="ignore", under="ignore"):
            self._coefficients = coefficients.astype(np.float32)
        # A cell that proves nothing, as within a corner's cone, is not worth reading.
        self._useful: Bools = np.ones(CELLS**2, dtype=bool)
        self._last_step: Floats = np.full(CELLS**2, _SHORT_STEP)
        middles = _normals(_grid((np.arange(2 * CELLS) + 0.5) / CELLS - 1.0))
        _, certain = self.points(middles)
        self._last_step = np.asarray(_of_cells(self._last_steps(middles)).min(axis=0))
        if convex:
            self._useful = np.asarray(_of_cells(certain).any(axis=0))
        else:
            smooth = misfit <= _SMOOTH * np.abs(samples[0]).max()
            self._useful = np.asarray(_of_cells(certain).all(axis=0) & smooth)

    def points(self, normals: Floats) -> tuple[Floats, Bools]:
        """Return points (3, m) for vectors (3, m), none zero, and which are certain (m,)."""
        # A normal below the equator has the place of its opposite.
        sign = np.copysign(1.0, normals[2])
        place = np.asarray(normals[:2] / (sign * _lengths(normals) + normals[2]))
        cell, within = _cells_of(place)
        certain = self._useful.take(cell)
        # What runs out of digits or numbers on the way ends as not certain.
        with np.errstate(all="ignore"):
            if certain.all():
                points, certain = self._prove(place, cell, within)
            else:
                points = np.zeros_like(normals)
                some = np.flatnonzero(certain)
                if len(some):
                    found = self._prove(
                        place.take(some, axis=1), cell.take(some), within.take(some, axis=1)
                    )
                    points[:, some], certain[some] = found
        points *= sign
        return points, certain

    def cell(self, number: int) -> tuple[list[float], float] | None:
        """Return the derivatives of h (21) in a cell's middle, and how long a last step may be.

        None stands for a cell that proves nothing.
        """
        if not self._useful[number]:
            return None
        derivatives: list[float] = self._coefficients[:, number].tolist()
        for place, derivative in zip(_PLANE, self._planes[:, number].tolist(), strict=True):
            derivatives[place] = derivative
        return derivatives, float(self._last_step[number])

    def _prove(self, place: Floats, cell: Places, within: Floats) -> tuple[Floats, Bools]:
        """Return points (3, m) for places (2, m) in cells (m,), and which are certain (m,)."""
        points, local = self._read(place, cell, within)
        points, away = self._step(points, place, local)
        last_step = self._last_step.take(cell)
        certain = away <= last_step
        todo = np.flatnonzero(~certain)
        before = away.take(todo)
        for _ in range(STEPS - 1):
            if len(todo) == 0:
                break
            points[:, todo], away = self._step(
                *(each.take(todo, axis=1) for each in (points, place, local))
            )
            done = away <= last_step.take(todo)
            # Or the step before has left so little that this one leaves nothing.
            done |= (away <= NEAR) & (MORE * away * away <= STEP_ERROR * before)
            certain[todo] = done
            few = len(todo) < _FEW_LEFT * len(certain) and 2 * np.count_nonzero(done) < len(todo)
            if few:
                break
            todo, before = todo[~done], away[~done]
        return points, certain

    def _last_steps(self, normals: Floats) -> Floats:
        """Return how long a last step may be (m,), by what one leaves at normals (3, m)."""
        place = _chart(normals)
        with np.errstate(all="ignore"):
            points, local = self._read(place, *_cells_of(place))
            points, first = self._step(points, place, local)
            values, _ = self._gauge.values_and_normals(points)
            _, second = self._step(points, place, local)
            straight = STEP_ERROR / MORE * first / second
            off = np.maximum(np.abs(values - 1.0) - _ROUNDING, 0.0)
            near = first * np.sqrt(_OFF / MORE / off)
            allowed = np.minimum(straight, near)
        # NaN, of a step from nowhere, is a hard place.
        allowed[~(allowed > _SHORT_STEP)] = _SHORT_STEP
        return np.asarray(np.minimum(allowed, _LONG_STEP))

    def _step(self, points: Floats, place: Floats, local: Floats) -> tuple[Floats, Floats]:
        """Return points (3, m) nearer to the right ones, and how far these were on the chart (m,).

        That is the larger of the distances along its axes.
        """
        values, normals = self._gauge.values_and_normals(points)
        points = points / values
        away = place - _chart(normals)
        # Moves are short: the digits that single precision keeps of them are enough.
        a, b, lift, h_aa, h_ab, h_bb = local
        da, db = away.astype(np.float32)
        z = points[2].astype(np.float32)
        rise_a = h_aa * da + h_ab * db
        rise_b = h_ab * da + h_bb * db
        rise = a * rise_a + b * rise_b + z * (a * da + b * db)
        rise *= -lift
        points[0] += rise_a + a * rise + z * da
        points[1] += rise_b + b * rise + z * db
        points[2] += rise
        return points, np.maximum(*np.abs(away))

    def _read(self, place: Floats, cell: Places, within: Floats) -> tuple[Floats, Floats]:
        """Return points (3, m) at places (2, m), and what is there (6, m).

        That is a, b, 2 / (1 + a^2 + b^2), h_aa, h_ab and h_bb, in single precision.

        Args:
            place: On the chart.
            cell: Numbers of the cells there, shape (m,).
            within: The places within these, from -1 to 1, shape (2, m).
        """
        local: Any = np.empty((6, len(cell)), dtype=np.float32)
        rest, local[3:] = self._derivatives(cell, within)
        height, slope_a, slope_b = self._planes.take(cell, axis=1)
        (x, y), (a, b) = within, place
        height += slope_a * x
        height += slope_b * y
        height += rest[0]
        slope_a += rest[1]
        slope_b += rest[2]
        slope_a *= CELLS
        slope_b *= CELLS
        lift = 2.0 / (1.0 + a * a + b * b)
        local[:2], local[2] = place, lift
        points: Floats = np.empty((3, len(cell)))
        z = points[2]
        np.multiply(lift, height - a * slope_a - b * slope_b, out=z)
        np.multiply(place, z, out=points[:2])
        points[0] += slope_a
        points[1] += slope_b
        return points, local

    def _derivatives(self, cell: Places, within: Floats) -> tuple[Any, Any]:
        """Return h, h_a, h_b (3, m) less a plane, and h_aa, h_ab, h_bb (3, m) within cells.

        The plane is that in the cell's middle; these three are in the cell's own units.
        A polynomial that holds its own derivatives at the middle of the cell has those elsewhere
        as sums of the same products, but of later coefficients.
        """
        powers: Any = np.empty((_DEGREE + 1, 2, len(cell)), dtype=np.float32)
        powers[0] = 1.0
        powers[1] = within
        for power in range(2, _DEGREE + 1):
            np.multiply(powers[power - 1], powers[1], out=powers[power])
            powers[power] *= 1.0 / power
        in_a, in_b = powers[:, 0], powers[:, 1]
        read = self._coefficients.take(cell, axis=1)
        # For each power of a, the sums over powers of b, of the first and second derivative, too.
        sums: Any = np.empty((3, _DEGREE + 1, len(cell)), dtype=np.float32)
        row = 0
        for power in range(_DEGREE + 1):
            count = _DEGREE + 1 - power
            for order in range(min(3, count)):
                _sum_of_products(
                    read[row + order : row + count], in_b[: count - order], sums[order, power]
                )
            row += count
        found: Any = np.empty((2, 3, len(cell)), dtype=np.float32)
        for place_of, (order_a, order_b) in zip(found.reshape(6, -1), _ORDERS, strict=True):
            last = _DEGREE + 1 - order_b
            _sum_of_products(sums[order_b, order_a:last], in_a[: last - order_a], place_of)
        found[1] *= CELLS**2
        return found[0], found[1]


def _cells_of(place: Floats) -> tuple[Places, Floats]:
    """Return the cells' numbers (m,) of places (2, m), and where within these they are (2, m)."""
    count = (0.5 * CELLS) * (place + 1.0)
    index = np.minimum(count.astype(np.intp), CELLS - 1)
    count -= index
    row, column = index
    return row * CELLS + column, 2.0 * count - 1.0


def _grid(ticks: Floats) -> Floats:
    """Return all places (2, t * t) with both coordinates among the ticks (t,)."""
    return np.array([each.ravel() for each in np.meshgrid(ticks, ticks, indexing="ij")])


def _normals(places: Floats) -> Floats:
    """Return the normals w (3, m) of places (2, m) on the chart."""
    a, b = places
    return np.array([a, b, 0.5 * (1.0 - a * a - b * b)])


def _chart(normals: Floats) -> Floats:
    """Return (a, b), shape (2, m), of normals (3, m) that are not (0, 0, -1)."""
    return np.asarray(normals[:2] / (_lengths(normals) + normals[2]))


def _lengths(vectors: Floats) -> Floats:
    """Return the lengths (m,) of vectors (3, m)."""
    return np.sqrt(squared_lengths(vectors))


def _sum_of_products(first: Any, second: Any, out: Any) -> None:
    """Write the sums (m,) of products of rows (k, m) with rows (k, m)."""
    np.einsum("km,km->m", first, second, out=out)


def _of_cells(middles: Any) -> Any:
    """Return what holds in the middles of the quarters of each cell, shape (4, cells)."""
    quarters = middles.reshape(CELLS, 2, CELLS, 2)
    return np.asarray(np.moveaxis(quarters, 2, 1).reshape(-1, 4).T)


def _quintics(samples: Floats) -> tuple[Floats, Floats]:
    """Return the polynomials that fit nine points of each cell.

    Args:
        samples: Heights and slopes along x and y, for cells from -1 to 1, on a grid of their
            corners and middles, shape (3, 2 n + 1, 2 n + 1).

    Returns:
        The polynomials' derivatives in the cells' middles, shape (21, cells), and the largest
        error at the nine points, shape (cells,).
    """
    i, j = np.array(_POWERS).T
    x, y = _grid(np.array([-1.0, 0.0, 1.0]))[:, :, np.newaxis]
    model = np.concatenate(
        [x**i * y**j, i * x ** np.maximum(i - 1, 0) * y**j, j * x**i * y ** np.maximum(j - 1, 0)]
    )
    last = samples.shape[1] - 2
    data = np.array(
        [
            sample[row : row + last : 2, column : column + last : 2].ravel()
            for sample in samples
            for row in range(3)
            for column in range(3)
        ]
    )
    coefficients = np.linalg.pinv(model) @ data
    misfit = np.abs(model @ coefficients - data).max(axis=0)
    factorials = np.array([[factorial(i) * factorial(j)] for i, j in _POWERS])
    return factorials * coefficients, misfit
