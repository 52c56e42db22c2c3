# SPDX-License-Identifier: Apache-2.0
"""Surfaces and data can be compared only where they are about one point of one frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limit_surface_ros.errors import DataError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

# Reference points that are no further apart are one [m]: rounding of what people write.
_APART = 1e-6


class About(NamedTuple):
    """What the moments and motions in a file are about.

    Attributes:
        path: The file.
        frame_id: The frame.
        point: Reference point in it [m], shape (2,).
    """

    path: Path
    frame_id: str
    point: Sequence[float]

    def __str__(self) -> str:
        """Return it in words."""
        x, y = self.point
        return f"{self.path} is about ({x:g}, {y:g}) m in frame {self.frame_id!r}"


def require_one_point(files: Sequence[About]) -> None:
    """Refuse files that are about different points or frames.

    Raises:
        DataError: The first is about another point or frame than one of the others.
    """
    for other in files[1:]:
        first = files[0]
        apart = np.linalg.norm(np.subtract(other.point, first.point))
        if other.frame_id != first.frame_id or apart > _APART:
            raise DataError(
                f"{first}, {other}: the same wrench is another load there; "
                "only what is about one point of one frame can be compared. Write reference_point "
                "into the contact, or into the model of pushes that were recorded about that point"
            )
