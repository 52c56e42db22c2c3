# SPDX-License-Identifier: Apache-2.0
"""Characteristic roots of a delay system, certified by the argument principle.

Seeds are the cells of a grid around which the phase of the characteristic function turns, and
where such cells touch, the zeros of the function's Taylor polynomial about them, which tell nearly
equal roots apart; Newton's method polishes them all at once; the phase along the box's edge tells
how many there must be. The grid is refined until both agree. A mapping of h on a grid followed by
Newton's method is also how QPmR works [1].

All is done in units of about the largest delay, so that no time scale is better than another.

[1] T. Vyhlidal, P. Zitek, Mapping based algorithm for large-scale computation of quasi-polynomial
    zeros, IEEE Trans. Automatic Control 54, 171-177, 2009, doi 10.1109/TAC.2008.2008345.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from limit_surface_ros.decay.delay.winding import count_zeros
from limit_surface_ros.errors import RangeError, SolverError

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.decay.basis import Complexes
    from limit_surface_ros.decay.delay.system import DelaySystem

# Distance of neighbouring roots far up, in units of the largest delay.
DISTANCE = 2.0 * math.pi
# Grid points for each distance 2 pi / T of neighbouring roots, at first and at most.
FIRST_DENSITY, LAST_DENSITY = 4, 32
MOST_POINTS = 200_000
NEWTON_STEPS = 30
# A cluster of roots is resolved by a Taylor polynomial from so many points on a circle.
CIRCLE_POINTS, MOST_CLUSTERED = 64, 12
# The characteristic function is known to this part of the sum of its terms' sizes.
ROUNDING = 1e-14
# Roots closer than this, in units of the largest delay, cannot be told apart.
SAME_ROOT = 1e-8
# Steps to the left in which right-most roots are looked for, and tries to evade a root there.
EDGE_STEP, LEAST_STEP, EDGE_TRIES = 3.0, 0.05, 4
# Edges that meet a root are moved outward by this part of the distance of roots, and again.
NUDGES = (0.0, 0.05, 0.11, 0.23)
# Left of -REACH / T the feedback has grown by exp(REACH) and fits of exp(lambda t) are hopeless.
REACH = 30.0


def roots_in_box(
    system: DelaySystem, real: tuple[float, float], imag: tuple[float, float]
) -> Complexes:
    """Return all characteristic roots in a box, ordered by imaginary part.

    Args:
        system: The delay system.
        real: Left and right edge [1/s].
        imag: Lower and upper edge [1/s], 0 <= lower < upper; a lower edge of 0 includes the real
            roots.

    Returns:
        Shape (n,), roots with Im >= 0, each polished to rounding. If a root lies on the edge, it
        is included.

    Raises:
        RangeError: The box is empty or lies below the real axis.
        SolverError: The count by the argument principle and the roots found disagree; the error
            tells both.
    """
    (left, right), (low, high) = real, imag
    if not (left < right and 0.0 <= low < high) or not math.isfinite(right - left + high):
        raise RangeError(
            f"the box must have left < right and 0 <= low < high, got Re {real} and Im {imag}"
        )
    unit = _unit(system)
    scaled = system.in_unit_of(unit)
    roots = _in_box(scaled, (left * unit, right * unit), (low * unit, high * unit), unit)
    found: Complexes = roots / unit
    return found


def _in_box(
    system: DelaySystem, real: tuple[float, float], imag: tuple[float, float], unit: float
) -> Complexes:
    """Return the roots in a box, all in units of the largest delay."""
    (left, right), (low, high) = real, imag
    for nudge in NUDGES:
        margin = nudge * DISTANCE
        real_range = (left - margin, right + margin)
        imag_range = (max(0.0, low - margin), high + margin)
        try:
            expected = count_zeros(system.characteristic, real_range, imag_range, 0.1 * DISTANCE)
        except SolverError:
            if nudge == NUDGES[-1]:
                raise
            continue
        roots = _find(system, real_range, imag_range, expected, unit)
        slack = 1e-9 * (1.0 + np.abs(roots))
        inside = (roots.real >= left - slack) & (roots.real <= right + slack)
        inside &= (roots.imag >= low - slack) & (roots.imag <= high + slack)
        found: Complexes = roots[inside]
        return found
    raise AssertionError("unreachable: the last nudge returns or raises")


def first_roots(system: DelaySystem, count: int, left: float | None = None) -> Complexes:
    """Return the roots with the smallest imaginary parts, certified.

    Args:
        system: The delay system.
        count: Number of roots with Im >= 0.
        left: Roots with a smaller real part are passed over [1/s]; -30 / max_delay if not given.

    Returns:
        Shape (count,), ordered by imaginary part.

    Raises:
        RangeError: The count is below 1.
        SolverError: The system has not so many roots there, or they could not be certified.
    """
    _check_count(count)
    _require_delay(system)
    distance = DISTANCE / system.max_delay
    start = -REACH / system.max_delay if left is None else left
    right = right_edge(system)
    high = (count + 1.5) * distance
    for _ in range(6):
        roots = roots_in_box(system, (start, right), (0.0, high))
        if len(roots) >= count:
            return roots[:count]
        high += (count - len(roots) + 1.5) * distance
    raise SolverError(
        f"{count} roots were asked for; {len(roots)} lie in Re >= {start:g}, Im <= {high:g}. "
        f"Ask for fewer, or move the left edge"
    )


def rightmost_roots(system: DelaySystem, count: int) -> Complexes:
    """Return the roots with the largest real parts, certified.

    All roots with Re lambda >= s lie within `system.root_bound(s)`, so that a box holds them all.
    The box grows to the left from the right-most place where roots may be.

    Args:
        system: The delay system.
        count: Number of roots with Im >= 0.

    Returns:
        Shape (count,), ordered by real part, largest first.

    Raises:
        RangeError: The count is below 1.
        SolverError: They could not be certified, or a neutral system's chain holds infinitely
            many as far to the right.
    """
    _check_count(count)
    _require_delay(system)
    right = right_edge(system)
    lowest = min(right, 0.0) - 2.0 * REACH / system.max_delay
    edge, step = right, EDGE_STEP / system.max_delay
    tries = 0
    while edge > lowest:
        edge -= step
        high = system.root_bound(edge) * 1.001
        if not math.isfinite(high):
            # The chain of a neutral system begins on the way: go nearer to it.
            edge, step = edge + step, 0.5 * step
            if step * system.max_delay < LEAST_STEP:
                raise SolverError(
                    f"{count} roots were asked for; left of Re {edge:g} a chain of roots of this "
                    "neutral system goes up without end: give a box"
                )
            continue
        # A root pair counts twice and a real root once: half the count is a safe first look.
        try:
            enough = count_roots(system, (edge, right), (0.0, max(high, step))) >= count
        except SolverError:
            # A root on this edge is inside of the next; a path too long stays too long.
            tries += 1
            if tries >= EDGE_TRIES:
                raise
            edge += 0.63 * step
            continue
        tries = 0
        if not enough:
            continue
        roots = roots_in_box(system, (edge, right), (0.0, max(high, step)))
        if len(roots) >= count:
            return roots[np.argsort(-roots.real, kind="stable")][:count]
    raise SolverError(f"{count} roots were asked for; fewer lie in Re >= {lowest:g}")


def count_roots(system: DelaySystem, real: tuple[float, float], imag: tuple[float, float]) -> int:
    """Return how many roots a box holds by the argument principle; a low edge of 0 is symmetric.

    Raises:
        SolverError: A root lies on the edge of the box.
    """
    unit = _unit(system)
    return count_zeros(
        system.in_unit_of(unit).characteristic,
        (real[0] * unit, real[1] * unit),
        (imag[0] * unit, imag[1] * unit),
        0.1 * DISTANCE,
    )


def right_edge(system: DelaySystem) -> float:
    """Return a real part [1/s] that no root exceeds."""
    unit = _unit(system)
    scaled = system.in_unit_of(unit)
    low, high = 0.0, 1.0
    while not scaled.root_bound(high) <= high:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if scaled.root_bound(middle) <= middle else (middle, high)
    return (high + 1e-3) / unit


def polish(system: DelaySystem, seeds: Complexes, most: float) -> Complexes:
    """Return the roots to which Newton's method leads; seeds that do not converge are dropped.

    Args:
        system: The delay system, in units of its largest delay.
        seeds: Shape (n,).
        most: Longest step; an uncapped step may jump to anywhere.
    """
    z = seeds
    for _ in range(NEWTON_STEPS):
        if len(z) == 0:
            return z
        value, slope = system.characteristic_and_derivative(z)
        step = value / np.where(slope == 0.0, 1.0, slope)
        size = np.abs(step)
        z = z - step * (most / np.maximum(size, most))
        if float(size.max()) < 1e-15 * (1.0 + float(np.abs(z).min())):
            break
    # Beside another root the slope is small, and steps are as large as rounding makes them.
    converged = (size < 1e-11 * (1.0 + np.abs(z))) | (
        np.abs(value) <= ROUNDING * system.magnitude(z)
    )
    roots: Complexes = z[converged & np.isfinite(z)]
    return roots


def _find(
    system: DelaySystem,
    real: tuple[float, float],
    imag: tuple[float, float],
    expected: int,
    unit: float,
) -> Complexes:
    """Refine the grid of seeds until as many roots are found as the box must hold."""
    density = FIRST_DENSITY
    while True:
        step = DISTANCE / density
        seeds = _seeds(system, real, imag, step)
        roots = _distinct(polish(system, seeds, 2.0 * step))
        inside = (roots.real >= real[0]) & (roots.real <= real[1])
        inside &= (roots.imag >= imag[0]) & (roots.imag <= imag[1])
        roots = roots[inside]
        symmetric = imag[0] == 0.0
        found = len(roots) + (int(np.count_nonzero(roots.imag)) if symmetric else 0)
        if found == expected:
            return roots
        density *= 2
        if density > LAST_DENSITY or found > expected:
            box = [tuple(round(edge / unit, 6) for edge in edges) for edges in (real, imag)]
            raise SolverError(
                f"the argument principle counts {expected} roots in Re {box[0]}, Im {box[1]} "
                f"(pairs twice), {found} were found; roots closer to each other than "
                f"{SAME_ROOT / unit:.1g} 1/s, or multiple ones, cannot be told apart"
            )


def _seeds(
    system: DelaySystem, real: tuple[float, float], imag: tuple[float, float], step: float
) -> Complexes:
    """Return starts for Newton's method from the cells of a grid around which h turns."""
    # Half a cell beyond the box: a root just inside its edge is then well inside a cell.
    columns = np.arange(real[0] - 0.5 * step, real[1] + step, step)
    rows = np.arange(imag[0] - 0.5 * step, imag[1] + step, step)
    if len(columns) * len(rows) > MOST_POINTS:
        raise SolverError(
            f"the box of {real[1] - real[0]:.3g} x {imag[1] - imag[0]:.3g}, in units of 1 over "
            f"the largest delay, is too large to search for roots {step:.2g} apart"
        )
    grid = columns + 1j * rows[:, np.newaxis]
    # No root lies further out than the bound at its own real part, and h is much like lambda.
    reach = np.array([system.root_bound(x - step) for x in columns]) + step
    near = np.abs(grid) <= reach
    values = grid.copy()
    values[near] = system.characteristic(grid[near])
    # Phases from corner to corner; around a cell they add up to 2 pi for each zero in it.
    along = np.angle(values[:, 1:] * values[:, :-1].conj())
    across = np.angle(values[1:] * values[:-1].conj())
    turns = along[:-1] + across[:, 1:] - along[1:] - across[:, :-1]
    counts = np.round(turns / (2.0 * np.pi)).astype(np.intp)
    centres = 0.25 * (grid[1:, 1:] + grid[:-1, 1:] + grid[1:, :-1] + grid[:-1, :-1])
    turned = counts > 0
    seeds = [centres[np.abs(turns) > np.pi]]
    labels, clusters = ndimage.label(turned, np.ones((3, 3), dtype=int))
    for index in range(1, clusters + 1):
        cells = labels == index
        total = int(counts[cells].sum())
        if 2 <= total <= MOST_CLUSTERED:
            middle = complex(centres[cells].mean())
            radius = float(np.abs(centres[cells] - middle).max()) + 1.2 * step
            seeds.append(_taylor_zeros(system, middle, radius, total))
    found: Complexes = np.concatenate(seeds)
    return found


def _taylor_zeros(system: DelaySystem, middle: complex, radius: float, count: int) -> Complexes:
    """Return the zeros nearest to a point of the Taylor polynomial of h about it."""
    circle = np.exp(2j * np.pi * np.arange(CIRCLE_POINTS) / CIRCLE_POINTS)
    for _ in range(2):
        values = system.characteristic(middle + radius * circle)
        coefficients = np.fft.fft(values) / CIRCLE_POINTS
        zeros = radius * np.roots(coefficients[CIRCLE_POINTS // 4 :: -1])
        nearest = zeros[np.argsort(np.abs(zeros))[:count]]
        if len(nearest) == 0:
            break
        # Once more about the cluster's middle, so near that the polynomial has all its digits.
        middle, shift = middle + complex(nearest.mean()), complex(nearest.mean())
        nearest = nearest - shift
        radius = min(radius, max(4.0 * float(np.abs(nearest).max()), 1e-2 * radius))
    found: Complexes = np.asarray(middle + nearest, dtype=np.complex128)
    return found


def _distinct(roots: Complexes) -> Complexes:
    """Return each root of the upper half plane once, ordered by imaginary part."""
    upper = roots.real + 1j * np.abs(roots.imag)
    # A pair whose imaginary part is rounding is a real root; nearly double ones have more.
    upper = np.where(upper.imag < 0.1 * SAME_ROOT * (1.0 + np.abs(upper)), upper.real, upper)
    tolerance: Floats = SAME_ROOT * (1.0 + np.abs(upper))
    kept: list[complex] = []
    for index in np.lexsort((upper.real, upper.imag)):
        root = complex(upper[index])
        # Equal roots are neighbours in this order but for rounding of their imaginary parts.
        if all(abs(root - other) > tolerance[index] for other in kept[-8:]):
            kept.append(root)
    return np.array(kept, dtype=np.complex128)


def _unit(system: DelaySystem) -> float:
    """Return the time [s] in which delays are counted: about the largest.

    A power of two, so that nothing is rounded.
    """
    return 2.0 ** round(math.log2(system.max_delay)) if system.max_delay > 0.0 else 1.0


def _require_delay(system: DelaySystem) -> None:
    if system.max_delay == 0.0:
        raise RangeError("a system without delay has one root; roots_in_box finds it")


def _check_count(count: int) -> None:
    if count < 1:
        raise RangeError(f"count must be at least 1, got {count}")
