# SPDX-License-Identifier: Apache-2.0
"""Pairs that cannot be what their columns say are told, with the cause; sound ones are not."""

import re

import numpy as np
import pytest

from limit_surface_ros.fitting.plausibility import doubts_of_pairs, lengths_of
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

FEET = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])


def body(size=1.0, force=4.1):
    limits = np.full(3, force / 3.0)
    return PointContacts(size * FEET, limits, Scaling(0.05 * size, force))


def pushes(count=50, size=1.0, force=4.1, scatter=0.05, seed=0):
    """Return pushes of a body on three feet, with the scatter of real ones."""
    exact = random_motions(body(size, force), count, seed)
    rng = np.random.default_rng(seed + 1)
    unit = np.array([1.0, 1.0, 0.05 * size])
    noise = scatter * rng.normal(size=(count, 3))
    return Pairs(exact.wrenches + force * noise * unit, exact.twists)


def texts(pairs, length=None):
    return [doubt.text for doubt in doubts_of_pairs(pairs, length)]


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("seed", range(4))
def test_sound_pushes_raise_no_doubt(size, seed):
    assert texts(pushes(size=size, seed=seed), 0.05 * size) == []
    assert texts(pushes(15, size=size, seed=seed)) == []


def test_both_lengths_are_that_of_the_body():
    known = lengths_of(*(getattr(pushes(200), what) for what in ("wrenches", "twists")))
    assert known.of_loads == pytest.approx(0.08, rel=0.2)
    assert known.of_motions == pytest.approx(known.of_loads, rel=0.25)
    assert known.possible


SLIPS = {
    "tau is in N mm": ([1, 1, 1e3], [1, 1, 1]),
    "omega is in deg/s": ([1, 1, 1], [1, 1, 180 / np.pi]),
    "vx, vy are in mm/s": ([1, 1, 1], [1e3, 1e3, 1]),
    "tau is in N mm and vx, vy are in mm/s": ([1, 1, 1e3], [1e3, 1e3, 1]),
    "forces are mirrored against velocities": ([1, -1, 1], [1, 1, 1]),
    "moments point against turning rates": ([1, 1, -1], [1, 1, 1]),
    "forces point against velocities": ([-1, -1, -1], [1, 1, 1]),
}


@pytest.mark.parametrize("cause", SLIPS)
@pytest.mark.parametrize("seed", range(3))
def test_slips_of_units_axes_and_signs_are_named(cause, seed):
    good = pushes(seed=seed)
    loads, motions = SLIPS[cause]
    (doubt,) = doubts_of_pairs(Pairs(good.wrenches * loads, good.twists * motions))
    assert doubt.grave
    assert cause in doubt.text


@pytest.mark.parametrize("angle", [90.0, -60.0, 135.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_sensor_that_is_turned_is_told_with_its_angle(angle, seed):
    good = pushes(seed=seed)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turned = good.wrenches @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    (doubt,) = doubts_of_pairs(Pairs(turned, good.twists))
    assert doubt.grave
    told = re.search(r"forces are turned by about (-?\d+) deg", doubt.text)
    assert float(told[1]) == pytest.approx(angle, abs=8.0)


def test_swapped_columns_are_named():
    good = pushes()
    (doubt,) = doubts_of_pairs(Pairs(good.twists, good.wrenches))
    assert doubt.grave
    assert "columns of wrench and twist are swapped" in doubt.text


def test_a_length_that_is_stated_in_millimetres_is_named():
    assert "0.05" not in texts(pushes(), 0.05)
    (told,) = texts(pushes(), 50.0)
    assert "stated as 50 m" in told
    assert "it is in millimetres" in told


def test_a_bias_is_named_with_its_size():
    good = pushes()
    (told,) = texts(Pairs(good.wrenches + np.array([1.5, -1.0, 0.03]), good.twists))
    assert "the sensor has a bias" in told
    assert texts(Pairs(good.wrenches + np.array([0.1, -0.1, 0.002]), good.twists)) == []


@pytest.mark.parametrize("omega", [0.0, 0.01])
def test_pushes_that_never_turn_the_body_are_named(omega):
    rng = np.random.default_rng(0)
    directions = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    going = np.column_stack([np.cos(directions), np.sin(directions), 0.0 * directions])
    wrenches = 4.0 * going + np.array([0.0, 0.0, 5e-4]) * rng.normal(size=(24, 1))
    twists = 0.05 * going + np.array([0.0, 0.0, omega]) * rng.normal(size=(24, 1))
    (doubt,) = doubts_of_pairs(Pairs(wrenches, twists))
    assert doubt.grave
    assert "pushes never turn the body" in doubt.text


def test_few_pairs_show_nothing():
    assert texts(pushes(5)) == []


@pytest.mark.parametrize(("first", "second"), [(0, 1), (0, 2), (1, 2)])
@pytest.mark.parametrize("part", ["wrench", "twist"])
@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_two_swapped_columns_are_named(first, second, part, size):
    order = [0, 1, 2]
    order[first], order[second] = second, first
    sound = pushes(size=size)
    swapped = (
        Pairs(sound.wrenches[:, order], sound.twists)
        if part == "wrench"
        else Pairs(sound.wrenches, sound.twists[:, order])
    )
    names = [["fx", "fy", "tau"][place] for place in (first, second)]
    assert f"the columns {' and '.join(names)}, or" in texts(swapped)[0]
