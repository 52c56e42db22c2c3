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


VERDICTS = ("holds", "holds partly", "does not hold")


@dataclass(frozen=True)
class Claim:
    """Something that the thesis's text says, and what came out here.

    Attributes:
        said: What the text says, in this package's own words.
        measured: What was measured, with numbers.
        holds: Whether all of it holds.
        partly: Whether part of it does, where not all does.
    """

    said: str
    measured: str
    holds: bool
    partly: bool = False

    @property
    def verdict(self) -> str:
        """In words: one of `VERDICTS`."""
        return VERDICTS[0 if self.holds else 1 if self.partly else 2]


@dataclass(frozen=True)
class Findings:
    """All that one figure's study brings out.

    Attributes:
        pictures: Figures by file stem; the one named "thesis" is the counterpart of the figure,
            others go beyond it.
        tables: The numbers behind the pictures, by file stem.
        claims: What the text says about the figure.
        remarks: What a reader should know, a sentence or two.
        captions: What stands above a picture, by its file stem; none above that named "thesis",
            "Beyond the thesis" above others.
        listings: Texts that are shown as they stand, by their headings.
    """

    pictures: Mapping[str, Figure]
    tables: Mapping[str, Table]
    claims: tuple[Claim, ...] = ()
    remarks: str = ""
    captions: Mapping[str, str] = field(default_factory=dict)
    listings: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """One figure of the thesis.

    Attributes:
        number: As in "2.14"; "B.1" is the first of what the thesis leaves to later work.
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
