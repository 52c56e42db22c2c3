# SPDX-License-Identifier: Apache-2.0
"""What the study of one figure gives: numbers, claims that were checked, and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from limit_surface_ros.thesis.settings import Settings
    from limit_surface_ros.thesis.store import Store

    # Columns of one length by their headings, which give the unit.
    Table: TypeAlias = Mapping[str, ArrayLike]


@dataclass(frozen=True)
class Claim:
    """Something that the thesis's text says, and what came out here.

    Attributes:
        said: What the text says, in this package's own words.
        measured: What was measured, with numbers.
        holds: Whether it holds; None where the measurement cannot decide.
    """

    said: str
    measured: str
    holds: bool | None


@dataclass(frozen=True)
class Findings:
    """All that one figure's study brings out.

    Attributes:
        pictures: Figures by file stem; the one named "thesis" is the counterpart of the figure,
            others go beyond it.
        tables: The numbers behind the pictures, by file stem.
        claims: What the text says about the figure.
        remarks: What a reader should know, a sentence or two.
    """

    pictures: Mapping[str, Figure]
    tables: Mapping[str, Table]
    claims: tuple[Claim, ...] = ()
    remarks: str = ""


@dataclass(frozen=True)
class Study:
    """One figure of the thesis.

    Attributes:
        number: As in "2.14".
        title: What it shows, in this package's own words.
        carry_out: Computes and draws it.
        needs: Names of the fits that it asks the store for, so that progress can count them.
    """

    number: str
    title: str
    carry_out: Callable[[Settings, Store], Findings]
    needs: tuple[str, ...] = field(default=())

    @property
    def folder(self) -> str:
        """Name of its folder, which sorts by number."""
        chapter, figure = self.number.split(".")
        return f"figure_{chapter}_{int(figure):02d}"
