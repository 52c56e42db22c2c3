# SPDX-License-Identifier: Apache-2.0
"""Each error of the package has one code, and each code of the interfaces a meaning."""

from __future__ import annotations

import pytest

pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")

from limit_surface_interfaces.msg import ErrorCode

from limit_surface_ros import errors
from limit_surface_ros.nodes.serving import answers


def all_errors(kind=errors.LimitSurfaceError):
    yield kind
    for below in kind.__subclasses__():
        yield from all_errors(below)


def constants():
    """Return the constants by name; rosidl keeps them in the message's metaclass."""
    return dict(type(ErrorCode).__dict__["_Metaclass_ErrorCode__constants"])


@pytest.mark.parametrize("kind", list(all_errors()))
def test_every_error_maps_to_a_constant(kind):
    assert kind.code in constants()


def test_every_constant_is_the_code_of_some_error():
    assert set(constants()) - {"NONE"} == {kind.code for kind in all_errors()}


def test_constants_are_all_different():
    values = constants().values()
    assert len(set(values)) == len(values)


def test_what_was_not_raised_on_purpose_is_a_defect():
    assert answers.error_code(KeyError("x")) == ErrorCode.INTERNAL
    assert "report" in answers.sentence(KeyError("x"))
    assert answers.error_code(errors.ZeroVectorError("w")) == ErrorCode.ZERO_VECTOR
    assert answers.sentence(errors.ZeroVectorError("w")) == "w"
