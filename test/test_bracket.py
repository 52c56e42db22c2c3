# SPDX-License-Identifier: Apache-2.0
"""A bracket shrinks around the root, across jumps and along flat parts too."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.bracket import root_bracket

places = st.integers(-999, 999).map(lambda number: number / 1000)


@given(root=places, power=st.sampled_from([1, 3, 9]))
def test_a_smooth_root_is_found_to_the_width(root, power):
    low, high = root_bracket(
        lambda x: math.copysign(abs(x - root) ** power, x - root), -1, 1, 1e-12
    )
    assert low <= root <= high
    assert high - low <= 1e-12


@given(root=places, below=st.floats(-1e9, -1e-9), above=st.floats(1e-9, 1e9))
def test_a_jump_is_bracketed(root, below, above):
    low, high = root_bracket(lambda x: below if x < root else above, -1.0, 1.0, 1e-12)
    assert low <= root <= high
    assert high - low <= 1e-12


def test_a_value_that_counts_as_zero_ends_the_search_there():
    calls = []

    def function(x):
        calls.append(x)
        return x - 0.25

    assert root_bracket(function, -1.0, 1.0, 0.0, exact=1e-12) == (0.25, 0.25)
    assert len(calls) < 6


@pytest.mark.parametrize("root", [0.3, 1e-300, 12345.6789])
def test_a_width_of_zero_ends_at_neighbouring_numbers(root):
    low, high = root_bracket(lambda x: x - root, -1.0, 1e6, 0.0)
    assert low <= root <= high
    assert high <= math.nextafter(low, math.inf)


def test_few_values_are_needed_where_the_function_is_smooth():
    calls = []

    def function(x):
        calls.append(x)
        return math.tanh(3.0 * (x - 0.1))

    root_bracket(function, -1.0, 1.0, 1e-13, exact=1e-14)
    assert len(calls) <= 15


def test_a_bracket_ends_where_the_function_counts_as_straight():
    def function(x):
        return math.tanh(3.0 * (x - 0.1))

    low, high = root_bracket(function, -1.0, 1.0, 1e-13, exact=1e-14, straight=1e-6)
    assert low < 0.1 < high
    assert high - low > 1e-13
    assert -function(low) * function(high) <= 1e-6
