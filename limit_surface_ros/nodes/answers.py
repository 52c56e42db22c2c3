# SPDX-License-Identifier: Apache-2.0
"""Errors as services tell them: a code and a sentence."""

from __future__ import annotations

from limit_surface_interfaces.msg import ErrorCode

from limit_surface_ros.errors import LimitSurfaceError


def code_name(error: Exception) -> str:
    """Return the name of the constant of `ErrorCode` that stands for an error.

    What the package did not raise on purpose is a defect of it: INTERNAL.
    """
    return error.code if isinstance(error, LimitSurfaceError) else LimitSurfaceError.code


def error_code(error: Exception) -> int:
    """Return the number of the error's code."""
    return int(getattr(ErrorCode, code_name(error)))


def sentence(error: Exception) -> str:
    """Return what a person should read."""
    if isinstance(error, LimitSurfaceError):
        return str(error)
    return f"defect of limit_surface_ros, please report it: {type(error).__name__}: {error}"
