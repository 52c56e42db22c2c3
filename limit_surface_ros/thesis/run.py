# SPDX-License-Identifier: Apache-2.0
"""Carry out the studies of all figures, one by one; write the page and the table of claims."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from limit_surface_ros import __version__
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.thesis.page import claims_text, page_of
from limit_surface_ros.thesis.records import find_record, keep_record
from limit_surface_ros.thesis.settings import FULL

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from limit_surface_ros.thesis.findings import Study
    from limit_surface_ros.thesis.records import Record
    from limit_surface_ros.thesis.store import Store

PAGE = "index.html"
CLAIMS = "claims.md"


def carry_out(
    studies: Sequence[Study],
    store: Store,
    progress: Callable[[int, int], None] = lambda done, total: None,
    tell: Callable[[str], None] = lambda line: None,
) -> Path:
    """Work out what is not there yet, and write the page.

    Args:
        studies: The figures, in order.
        store: Where results are kept and looked for.
        progress: Called with the steps that are done and all steps; a step is a fit or a figure.
        tell: Called with a line for each figure.

    Returns:
        The page.
    """
    found = [find_record(store, study) for study in studies]
    missing = [study for study, record in zip(studies, found, strict=True) if record is None]
    fits = {name for study in missing for name in study.needs}
    total = len(fits) + len(studies)
    done = len(studies) - len(missing)
    fitted: set[str] = set()

    def count_fit(name: str) -> None:
        fitted.add(name)
        progress(done + len(fitted & fits), total)

    counting = replace(store, on_fit=count_fit)
    records: list[Record] = []
    progress(done, total)
    for study, record in zip(studies, found, strict=True):
        if record is None:
            record = keep_record(counting, study, study.carry_out(store.settings, counting))
            done += 1
            tell(f"{study.number:<5} {study.title}")
        else:
            tell(f"{study.number:<5} {study.title} (was there)")
        records.append(record)
        progress(done + len(fitted & fits), total)
    page = store.folder / PAGE
    write_atomically(page, page_of(records, _subtitle(store)))
    write_atomically(store.folder / CLAIMS, claims_text(records))
    return page


def _subtitle(store: Store) -> str:
    settings = store.settings
    size = "Sizes as in the thesis" if settings == FULL else "A quick run with smaller sizes"
    return (
        f"{size}: {settings.motions} motions and {settings.per_facet} loads a facet to fit, "
        f"{settings.tests} motions to test, {settings.samples} samples of each response, "
        f"seed {settings.seed}. limit_surface_ros {__version__}."
    )
