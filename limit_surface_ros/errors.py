# SPDX-License-Identifier: Apache-2.0
"""The package's one family of errors.

Every error that the package raises on purpose derives from `LimitSurfaceError` *and* from the
builtin that fits it, so that library users may catch either. `code` names the constant of
`limit_surface_interfaces/msg/ErrorCode` by which a service reports the error; a test holds that
map total.
"""

from __future__ import annotations

from typing import ClassVar

# Files of requirements/ that bring an extra into a clone, where that is not extras.txt.
_GROUPS = {"peers": "bench"}
# Characters at most of a message, and of a name that is repeated in one.
_LONGEST = 2000
LONGEST_NAME = 200


def shortened(text: str, most: int = LONGEST_NAME) -> str:
    """Return a text for a message, in UTF-8 and cut in its middle to `most` characters.

    What others chose, such as a name, may be a megabyte long, and stays in a log for ever. Bytes
    of a file's name that are no UTF-8 become backslashes and digits: messages of ROS take none.
    """
    text = text.encode("utf-8", "backslashreplace").decode()
    if len(text) <= most:
        return text
    cut = f" ... {len(text)} characters ... "
    begin = (most - len(cut) + 1) // 2
    return text[:begin] + cut + text[len(text) - (most - len(cut) - begin) :]


class LimitSurfaceError(Exception):
    """Base of every error that this package raises on purpose."""

    code: ClassVar[str] = "INTERNAL"

    def __str__(self) -> str:
        """Return the message, of which a file or a caller may have chosen a part, in bounds."""
        return shortened(super().__str__(), _LONGEST)


class ShapeError(LimitSurfaceError, ValueError):
    """An array has the wrong shape or cannot be read as numbers."""

    code = "BAD_SHAPE"


class NotFiniteError(LimitSurfaceError, ValueError):
    """A number is NaN or infinite."""

    code = "NOT_FINITE"


class ZeroVectorError(LimitSurfaceError, ValueError):
    """A wrench or twist is zero, so that it has no direction."""

    code = "ZERO_VECTOR"


class RangeError(LimitSurfaceError, ValueError):
    """A number lies outside the range that is accepted for it."""

    code = "OUT_OF_RANGE"


class MatrixError(LimitSurfaceError, ValueError):
    """A matrix is not symmetric positive semidefinite where it must be."""

    code = "BAD_MODEL"


class GeometryError(LimitSurfaceError, ValueError):
    """A contact patch is empty, degenerate or carries no load."""

    code = "BAD_MODEL"


class OutlineError(GeometryError):
    """The outline of a body crosses itself or encloses nothing, or a tip begins deep within it."""

    code = "BAD_DATA"


class DataError(LimitSurfaceError, ValueError):
    """Recorded or simulated data cannot support what is asked of them."""

    code = "BAD_DATA"


class FileError(LimitSurfaceError, ValueError):
    """A file cannot be read or written; the message names file, place and what is accepted."""

    code = "BAD_FILE"


class UnknownModelError(LimitSurfaceError, LookupError):
    """No model of that name is loaded."""

    code = "UNKNOWN_MODEL"


class FrameError(LimitSurfaceError, ValueError):
    """A message's frame is empty or is not the model's, and no transform is known."""

    code = "UNKNOWN_FRAME"


class TransformTooOldError(FrameError):
    """A message's stamp is older than all transforms that are remembered."""

    code = "TRANSFORM_TOO_OLD"


class TransformTooNewError(FrameError):
    """A message's stamp is newer than the transforms that have arrived."""

    code = "TRANSFORM_TOO_NEW"


class UnavailableError(LimitSurfaceError, RuntimeError):
    """A node is ending, locked, or has too much to do: the request itself may be right."""

    code = "UNAVAILABLE"


class SolverError(LimitSurfaceError, ArithmeticError):
    """A numerical method could not certify its answer."""

    code = "NO_CONVERGENCE"


class UnstableError(LimitSurfaceError, ArithmeticError):
    """A response would give, or a delay system has, growing solutions."""

    code = "BAD_MODEL"


class NoOnsetError(LimitSurfaceError, ValueError):
    """A decay model starts at zero, so that it cannot be scaled to an onset."""

    code = "BAD_MODEL"


class ClusterError(LimitSurfaceError, ConnectionError):
    """A cluster cannot be reached, is lost on the way, or is not fit for the work."""

    code = "INTERNAL"


class MissingExtraError(LimitSurfaceError, ImportError):
    """An optional library is absent; the message tells how to install it and names its extra."""

    code = "INTERNAL"

    def __init__(self, library: str, extra: str) -> None:
        """Name the missing `library` and the `extra` of setup.py that it belongs to."""
        super().__init__(
            f"{library} is needed here and is not installed: pip install {library} "
            f"(in a clone: scripts/with_ros --with {_GROUPS.get(extra, 'extras')} COMMAND; "
            f"it is of the optional extra '{extra}')"
        )
