# SPDX-License-Identifier: Apache-2.0
"""The two searches for a push, each for the root of a function of one number that never falls.

With the load factor in closed form the number is the angle b of the force from the normal, and
the function the angle of the velocity that this force causes, which lies within 90 deg of b:
angles need no unwrapping, and friction may be infinite. With the dissipation in closed form it is
the turning rate, and the function the moment about the contact. Newton's steps, in a bracket, are
taken on the square of the load factor or the dissipation: they are exact for an ellipsoid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats, Places
    from limit_surface_ros.motion.contact_sections import LineSection, PlaneSection

STICK, SLIDE_LEFT, SLIDE_RIGHT, SEPARATE = range(4)

# Error of an angle [rad], or of a moment in parts of the largest, that counts as none.
EXACT = 4e-15
# Width of a bracket, in angles or in parts of the range of turning rates, that cannot be halved.
_WIDTH = 4.5e-16
# A bracket that has not halved in so many steps is halved: beside a kink Newton's steps are short.
_PATIENCE = 3
_MAX_ROUNDS = 400
# Share of finished columns above which the rest is moved together.
_COMPRESS = 0.75


def force_angles(
    section: PlaneSection,
    data: Floats,
    edges: Floats,
    u: Floats,
    w: Floats,
    first: Floats,
    exact: float,
) -> tuple[Floats, Floats, Places]:
    """Return brackets of the angles of the forces, low and high, and modes, each (m,)."""
    count = len(u)
    lows, highs = np.empty(count), np.empty(count)
    modes = np.full(count, STICK)
    limit = np.arctan2(edges[:, 1], edges[:, 0])
    wanted = np.arctan2(w, u)
    rows = np.arange(count)
    low, high = -limit, limit.copy()
    # Whether an end of the bracket has been tried: only then it is known to bracket.
    low_known, high_known = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    b = np.clip(first, low, high)
    width = np.full(count, np.inf)
    running = np.ones(count, dtype=bool)
    cos, sin = edges[:, 0], edges[:, 1]
    for step in range(1, _MAX_ROUNDS + 1):
        at_low, at_high = b <= -limit, b >= limit
        c, s = np.cos(b), np.sin(b)
        at_end = at_low | at_high
        if at_end.any():
            c = np.where(at_end, cos, c)
            s = np.where(at_high, sin, np.where(at_low, -sin, s))
        v_n, v_t, h = section.respond(data, c, s)
        power = v_n * c + v_t * s
        error = b + np.arctan2(c * v_t - s * v_n, power) - wanted
        met = np.abs(error) <= exact
        above = error > 0.0
        left, right = ~above & ~met & at_high, above & ~met & at_low
        high = np.where(above, b, high)
        low = np.where(above, low, b)
        high_known |= above
        low_known |= ~above
        both = low_known & high_known
        done = met | left | right
        narrow = ~done & both & (high - low <= _WIDTH)
        ends = (done | narrow) & running
        if step == _MAX_ROUNDS:
            narrow, ends = ~done, running
        if ends.any():
            at = rows[ends]
            exact_here = ~narrow[ends]
            lows[at] = np.where(exact_here, b[ends], low[ends])
            highs[at] = np.where(exact_here, b[ends], high[ends])
            modes[at] = np.where(left[ends], SLIDE_LEFT, np.where(right[ends], SLIDE_RIGHT, STICK))
            running &= ~ends
            active = np.count_nonzero(running)
            if active == 0:
                break
            if active < _COMPRESS * len(running):
                keep = np.flatnonzero(running)
                data = data.take(keep, axis=1)
                rows = rows[keep]
                low, high, b, u, w, wanted, limit, cos, sin, width = (
                    each[keep] for each in (low, high, b, u, w, wanted, limit, cos, sin, width)
                )
                v_n, v_t, h, power, c, s, error = (
                    each[keep] for each in (v_n, v_t, h, power, c, s, error)
                )
                low_known, high_known, both = low_known[keep], high_known[keep], both[keep]
                running = running[keep]
        across = v_n * w - v_t * u
        along = h * (u * c + w * s) - across * (v_t * c - v_n * s) / power
        turn = np.abs(np.arctan2(across, along))
        b = np.where(error > 0.0, b - turn, b + turn)
        halve = ~((low < b) & (b < high))
        if step % _PATIENCE == 0:
            halve |= both & (high - low > 0.5 * width)
            width = np.where(both, high - low, np.inf)
        if halve.any():
            middle = np.where(
                error > 0.0,
                np.where(low_known, 0.5 * (low + high), low),
                np.where(high_known, 0.5 * (low + high), high),
            )
            b = np.where(halve, middle, b)
    return lows, highs, modes


def turning_rates(
    section: LineSection, lines: Floats, starts: Floats | None, exact: float
) -> tuple[Floats, Floats]:
    """Return brackets of the scaled turning rates of least dissipation, each (m,)."""
    count = lines.shape[1]
    lows, highs = np.zeros(count), np.zeros(count)
    g, place, least = lines.reshape(3, section.terms, -1)
    largest = np.add.reduce(np.sqrt(g))
    still, _, _ = section.dissipation(lines, np.zeros(count))
    # D(V_0 + w d) >= |w| D(d) - D(V_0), which the least does not exceed.
    safe = np.where(largest > 0.0, largest, 1.0)
    reach = np.where(largest > 0.0, 2.0 * still / safe, 0.0)
    # Terms weigh as at rest of the contact.
    weight = g / np.sqrt(np.maximum(g * place * place + least, 1e-300))
    w = np.add.reduce(weight * place) / np.maximum(np.add.reduce(weight), 1e-300)
    if starts is not None:
        w = np.where(np.isfinite(starts), starts, w)
    w = np.clip(w, -reach, reach)
    rows = np.arange(count)
    low, high = -reach, reach.copy()
    width = high - low
    running = np.ones(count, dtype=bool)
    for step in range(1, _MAX_ROUNDS + 1):
        total, moment, stiffness = section.dissipation(lines, w)
        met = np.abs(moment) <= exact * largest
        above = moment > 0.0
        high = np.where(above, w, high)
        low = np.where(above, low, w)
        narrow = high - low <= _WIDTH * np.maximum(np.abs(w), 1e-16 * reach)
        ends = (met | narrow) & running
        if step == _MAX_ROUNDS:
            ends = running
        if ends.any():
            at, exact_here = rows[ends], met[ends]
            lows[at] = np.where(exact_here, w[ends], low[ends])
            highs[at] = np.where(exact_here, w[ends], high[ends])
            running = running & ~ends
            active = np.count_nonzero(running)
            if active == 0:
                break
            if active < _COMPRESS * len(running):
                keep = np.flatnonzero(running)
                lines = lines.take(keep, axis=1)
                rows = rows[keep]
                low, high, w, width, reach, largest, total, moment, stiffness = (
                    each[keep]
                    for each in (low, high, w, width, reach, largest, total, moment, stiffness)
                )
                running = running[keep]
        curvature = moment * moment + total * stiffness
        w = w - total * moment / np.where(curvature > 0.0, curvature, np.inf)
        halve = ~((low < w) & (w < high))
        if step % _PATIENCE == 0:
            halve |= high - low > 0.5 * width
            width = high - low
        w = np.where(halve, 0.5 * (low + high), w)
    return lows, highs
