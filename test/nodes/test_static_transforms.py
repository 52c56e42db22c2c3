# SPDX-License-Identifier: Apache-2.0
"""Static transforms of the parameter: parsed, chained, and refused with what is accepted."""

from __future__ import annotations

import numpy as np
import pytest

from limit_surface_ros.errors import FrameError, RangeError
from limit_surface_ros.nodes.messages.static_transforms import StaticTransforms

WRENCH = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])


def test_a_chain_is_followed_up_and_down_the_tree():
    tree = StaticTransforms(
        [
            "world table 1 0 0 0 0 0",
            "table object 0 2 0 0 0 1.5707963267948966",
            "world tool 0 0 3 0 0 0",
        ]
    )
    found = tree.look_up("object", "tool")
    # The tool's origin in the world is (0, 0, 3), the object's (1, 2, 0), turned by 90 degrees.
    np.testing.assert_allclose(found.translation, [-2.0, 1.0, 3.0], atol=1e-12)
    there = tree.look_up("tool", "object").wrench(found.wrench(WRENCH))
    np.testing.assert_allclose(there, WRENCH, atol=1e-12)


def test_a_quaternion_says_the_same_as_angles():
    half = np.sqrt(0.5)
    angles = StaticTransforms(["a b 1 2 3 0 0 1.5707963267948966"]).look_up("a", "b")
    quaternion = StaticTransforms([f"a b 1 2 3 0 0 {half} {half}"]).look_up("a", "b")
    np.testing.assert_allclose(angles.rotation, quaternion.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("texts", "told"),
    [
        ([""], "accepted"),
        (["a b 1 2"], "accepted"),
        (["a b 1 2 3 0 0 zero"], "zero"),
        (["a b 1 2 3 0 0 nan"], "finite"),
        (["a b 1 2 3 0 0 0 0"], "quaternion"),
        (["a c 0 0 0 0 0 0", "b c 0 0 0 0 0 0"], "two parents"),
        (["a b 0 0 0 0 0 0", "b a 0 0 0 0 0 0"], "ancestor"),
        (["a a 0 0 0 0 0 0"], "ancestor"),
    ],
)
def test_what_is_no_tree_is_refused(texts, told):
    with pytest.raises((RangeError, ValueError), match=told):
        StaticTransforms(texts)


def test_frames_that_are_not_joined_are_both_named():
    tree = StaticTransforms(["a b 0 0 0 0 0 0", "c d 0 0 0 0 0 0"])
    with pytest.raises(FrameError, match=r"'d'.*'b'"):
        tree.look_up("b", "d")
    with pytest.raises(FrameError, match=r"'moon'.*'b'"):
        tree.look_up("b", "moon")
