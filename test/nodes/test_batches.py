# SPDX-License-Identifier: Apache-2.0
"""Many loads or motions in one call: the library's answers, or the first bad row."""

from __future__ import annotations

from array import array

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed")
pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import TwistsToWrenches, WrenchesToTwists

from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.messages import convert


@pytest.fixture
def batch(ros, client_node, model_file):
    """A node with one model, and its two batch services."""
    model, path = model_file(terms=3)
    ros.add(LimitSurfaceNode, files=[path])
    forward = ros.client(client_node, WrenchesToTwists, "/limit_surface/wrenches_to_twists")
    back = ros.client(client_node, TwistsToWrenches, "/limit_surface/twists_to_wrenches")
    return model.surface, forward, back


def vectors(count, seed=0):
    return np.random.default_rng(seed).normal(size=(count, 3)) * [3.0, 3.0, 0.1]


@pytest.mark.parametrize("count", [1, 2, 10_000])
def test_answers_equal_the_library(batch, count):
    surface, forward, back = batch
    wrenches = vectors(count)
    answer = forward(WrenchesToTwists.Request(wrenches=convert.flat_of(wrenches)))
    assert answer.error_code == ErrorCode.NONE
    twists = np.reshape(answer.twists, (-1, 3))
    np.testing.assert_allclose(twists, surface.twist_of_wrench(wrenches), atol=1e-12)
    np.testing.assert_allclose(answer.load_factors, surface.load_factor(wrenches), rtol=1e-12)
    needed = back(TwistsToWrenches.Request(twists=answer.twists))
    expected = surface.wrench_of_twist(twists)
    # In other slices sums round otherwise.
    np.testing.assert_allclose(
        np.reshape(needed.wrenches, (-1, 3)), expected, rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(needed.powers, (expected * twists).sum(axis=1), rtol=1e-12)


def test_more_rows_than_are_accepted_get_a_code_and_the_limit(ros, client_node, model_file):
    _, path = model_file()
    ros.add(LimitSurfaceNode, files=[path], parameters={"max_batch_rows": 100})
    forward = ros.client(client_node, WrenchesToTwists, "/limit_surface/wrenches_to_twists")
    back = ros.client(client_node, TwistsToWrenches, "/limit_surface/twists_to_wrenches")
    for count, code in ((100, ErrorCode.NONE), (101, ErrorCode.OUT_OF_RANGE)):
        flat = convert.flat_of(vectors(count))
        for answer in (
            forward(WrenchesToTwists.Request(wrenches=flat)),
            back(TwistsToWrenches.Request(twists=flat)),
        ):
            assert answer.error_code == code
            assert ("at most 100" in answer.error_msg) == (code != ErrorCode.NONE)


def test_no_rows_are_answered_by_no_rows(batch):
    _, forward, back = batch
    answer, needed = forward(WrenchesToTwists.Request()), back(TwistsToWrenches.Request())
    assert answer.error_code == needed.error_code == ErrorCode.NONE
    assert len(answer.twists) == len(answer.load_factors) == len(needed.wrenches) == 0


@pytest.mark.parametrize(
    ("spoil", "code", "told"),
    [
        (lambda flat: flat.pop(), ErrorCode.BAD_SHAPE, "multiple of 3"),
        (lambda flat: flat.__setitem__(3 * 7 + 1, np.nan), ErrorCode.NOT_FINITE, "row 7"),
        (lambda flat: flat.__setitem__(3 * 8, -np.inf), ErrorCode.NOT_FINITE, "row 8"),
        (lambda flat: flat.__setitem__(3 * 9, 1e308), ErrorCode.OUT_OF_RANGE, "row 9"),
        (
            lambda flat: flat.__setitem__(slice(30, 33), array("d", [0, 0, 0])),
            ErrorCode.ZERO_VECTOR,
            "row 10",
        ),
        (
            lambda flat: flat.__setitem__(slice(33, 36), array("d", [5e-324, 0, 0])),
            ErrorCode.OUT_OF_RANGE,
            "row 11",
        ),
    ],
)
def test_the_first_bad_row_is_named(batch, spoil, code, told):
    _, forward, back = batch
    flat = convert.flat_of(vectors(20))
    spoil(flat)
    for answer in (
        forward(WrenchesToTwists.Request(wrenches=flat)),
        back(TwistsToWrenches.Request(twists=flat)),
    ):
        assert answer.error_code == code
        assert told in answer.error_msg


def test_an_unknown_model_is_refused(batch):
    _, forward, _ = batch
    answer = forward(WrenchesToTwists.Request(model="sofa", wrenches=[1.0, 0.0, 0.0]))
    assert answer.error_code == ErrorCode.UNKNOWN_MODEL


def test_a_million_rows_are_answered(batch):
    surface, forward, _ = batch
    wrenches = vectors(1_000_000)
    answer = forward(WrenchesToTwists.Request(wrenches=convert.flat_of(wrenches)))
    assert answer.error_code == ErrorCode.NONE
    last = surface.twist_of_wrench(wrenches[-1])
    np.testing.assert_allclose(answer.twists[-3:], last, atol=1e-12)
