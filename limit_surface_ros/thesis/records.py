# SPDX-License-Identifier: Apache-2.0
"""Finished figures on disk: their pictures, tables and claims, kept until settings change."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.regular_file import json_object, read_text
from limit_surface_ros.files.yaml_reader import plain
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.thesis.findings import Claim

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from limit_surface_ros.thesis.findings import Findings, Study, Table
    from limit_surface_ros.thesis.store import Store

RECORD = "record.json"
# A record holds claims and names of files [bytes].
_MOST = 2**20


@dataclass(frozen=True)
class Record:
    """What the page shows of one figure.

    Attributes:
        number: As in "2.14".
        title: What it shows.
        folder: Where its files lie.
        pictures: PNG files in the folder, the counterpart of the figure first.
        tables: CSV files in the folder.
        claims: What the text says about the figure, and what was measured.
        remarks: What a reader should know.
        captions: What stands above each picture; may be empty.
        listings: Texts that are shown as they stand, by their headings.
    """

    number: str
    title: str
    folder: Path
    pictures: tuple[str, ...]
    tables: tuple[str, ...]
    claims: tuple[Claim, ...]
    remarks: str
    captions: tuple[str, ...]
    listings: Mapping[str, str]


def find_record(store: Store, study: Study) -> Record | None:
    """Return the record of a figure that is finished with these settings, if there is one."""
    folder = store.folder / study.folder
    try:
        kept = json_object(read_text(folder / RECORD, _MOST, "a record"), str(folder / RECORD))
        if kept.get("key") != store.key(study.number):
            return None
        record = _record_of(study, folder, kept)
    except (FileError, LookupError, TypeError):
        # Not there, or written by somebody else: it is worked out anew.
        return None
    whole = all((folder / name).exists() for name in (*record.pictures, *record.tables))
    return record if whole else None


def keep_record(store: Store, study: Study, findings: Findings) -> Record:
    """Write a figure's pictures and tables, and last its record, which makes it count."""
    folder = store.folder / study.folder
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORD).unlink(missing_ok=True)
    for name, figure in findings.pictures.items():
        save_figure(figure, folder / f"{name}.png")
    for name, table in findings.tables.items():
        write_atomically(folder / f"{name}.csv", csv_text(table))
    kept = {
        "key": store.key(study.number),
        "pictures": [f"{name}.png" for name in findings.pictures],
        "tables": [f"{name}.csv" for name in findings.tables],
        "claims": [plain(asdict(claim)) for claim in findings.claims],
        "remarks": findings.remarks,
        "captions": [
            findings.captions.get(name, "" if name == "thesis" else "Beyond the thesis")
            for name in findings.pictures
        ],
        "listings": dict(findings.listings),
    }
    write_atomically(folder / RECORD, json.dumps(kept, indent=1))
    return _record_of(study, folder, kept)


def csv_text(table: Table) -> str:
    """Return a table as CSV; numbers are written so that they come back bit for bit."""
    columns = {heading: np.asarray(values).tolist() for heading, values in table.items()}
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue()


def _record_of(study: Study, folder: Path, kept: Mapping[str, Any]) -> Record:
    return Record(
        number=study.number,
        title=study.title,
        folder=folder,
        pictures=tuple(kept["pictures"]),
        tables=tuple(kept["tables"]),
        claims=tuple(Claim(**claim) for claim in kept["claims"]),
        remarks=kept["remarks"],
        captions=tuple(kept["captions"]),
        listings=dict(kept["listings"]),
    )
