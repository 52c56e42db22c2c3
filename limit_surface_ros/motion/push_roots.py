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
# Resistance to a turn, in parts of that to a motion of the contact, that is rounding.
_FREE = 1e-14
# Share of finished columns above which the rest is moved together.
_COMPRESS = 0.75


def force_angles(
    section: PlaneSection,
    data: Floats,
    limit: Floats,
    wanted: Floats,
    first: Floats,
    exact: float,
) -> tuple[Floats, Floats, Places]:
    """Return brackets of the angles of the forces, low and high, and modes, each (m,).

    Args:
        section: Of the surface.
        data: Of the contacts, as the section gives it.
        limit: Friction angles [rad], shape (m,).
        wanted: Angles of the pushers' velocities, shape (m,).
        first: Angles to begin with, shape (m,).
        exact: Error of an angle of a velocity that counts as none.
    """
    count = len(limit)
    lows, highs, modes = np.empty(count), np.empty(count), np.full(count, STICK)
    rows = np.arange(count)
    running = np.ones(count, dtype=bool)
    # What is proven: an end of the friction cone is none before it has been tried.
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    width = high
    b = np.clip(first, -limit, limit)
    for step in range(1, _MAX_ROUNDS + 1):
        along, across, h = section.respond(data, b)
        error = np.arctan2(across, along)
        error += b
        error -= wanted
        less = error < 0.0
        low, high = np.where(less, b, low), np.where(less, high, b)
        met = np.abs(error) <= exact
        slides = np.where(less, b >= limit, b <= -limit)
        # A bracket of one direction is a corner, or as steep as one.
        ends = met | slides | (high - low <= _WIDTH)
        ends &= running
        if step == _MAX_ROUNDS:
            ends = running
        if ends.any():
            at, here = rows[ends], b[ends]
            slide = slides[ends] & ~met[ends]
            exactly = slide | met[ends]
            lows[at] = np.where(exactly, here, np.maximum(low[ends], -limit[ends]))
            highs[at] = np.where(exactly, here, np.minimum(high[ends], limit[ends]))
            modes[at] = np.where(slide, np.where(less[ends], SLIDE_LEFT, SLIDE_RIGHT), STICK)
            running = running & ~ends
            active = np.count_nonzero(running)
            if active == 0:
                break
            if active < _COMPRESS * len(running):
                keep = np.flatnonzero(running)
                data, rows, running = data.take(keep, axis=1), rows[keep], running[keep]
                less = less[keep]
                limit, wanted, low, high, b, along, across, h, error, width = (
                    each[keep]
                    for each in (limit, wanted, low, high, b, along, across, h, error, width)
                )
        # Newton's step for g^2 / 2, exact for an ellipsoid, towards the root whatever h is.
        turned = np.sqrt(along * along + across * across) * np.sin(error)
        ahead = h * np.cos(wanted - b)
        ahead += turned * across / along
        turn = np.abs(np.arctan2(turned, ahead))
        b = np.clip(np.where(less, b + turn, b - turn), -limit, limit)
        halve = ~((low < b) & (b < high))
        if step % _PATIENCE == 0:
            halve |= (high - low > 0.5 * width) & np.isfinite(high - low)
            width = high - low
        if halve.any():
            middle = 0.5 * (np.maximum(low, -limit) + np.minimum(high, limit))
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
    # A body on one support point that is pushed there may turn as it likes: it does not.
    turns = largest > _FREE * still
    reach = np.where(turns, 2.0 * still / np.where(turns, largest, 1.0), 0.0)
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
