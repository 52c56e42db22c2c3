# SPDX-License-Identifier: Apache-2.0
"""What has been worked out stays on disk, keyed by its parameters: a run can be resumed."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import warnings
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros import __version__
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.files.yaml_reader import plain
from limit_surface_ros.plots.canvas import save_figure
from limit_surface_ros.surface.convexity import NotConvexWarning
from limit_surface_ros.thesis.findings import Claim

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from concurrent.futures import Executor

    from limit_surface_ros.thesis.findings import Findings, Study, Table
    from limit_surface_ros.thesis.settings import Settings

RECORD = "record.json"


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
    """

    number: str
    title: str
    folder: Path
    pictures: tuple[str, ...]
    tables: tuple[str, ...]
    claims: tuple[Claim, ...]
    remarks: str


@dataclass(frozen=True)
class Store:
    """A folder of finished figures and fitted surfaces.

    Attributes:
        folder: Where everything goes.
        settings: How much work goes into the figures.
        executor: Where the starts of a fit run; None: in this process.
        on_fit: Called with the name of each fit that is done or was there.
    """

    folder: Path
    settings: Settings
    executor: Executor | None = None
    on_fit: Callable[[str], None] = field(default=lambda name: None)

    def surface(self, name: str, fit: Callable[[], SurfaceModel]) -> SurfaceModel:
        """Return a fitted surface from its file, or fit it and write the file.

        Args:
            name: Of the model and its file under `models/`.
            fit: Makes the model if it is not there, or was made with other settings.
        """
        path = self.folder / "models" / f"{name}.yaml"
        key = self._key(name)
        model = _read_if_there(path)
        if model is None or model.fit.get("key") != key:
            made = fit()
            model = SurfaceModel(name, made.surface, fit={**made.fit, "key": key})
            path.parent.mkdir(parents=True, exist_ok=True)
            write_surface_model(model, path)
        self.on_fit(name)
        return model

    def find(self, study: Study) -> Record | None:
        """Return the record of a figure that is finished with these settings, if there is one."""
        folder = self.folder / study.folder
        try:
            kept = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        if kept.get("key") != self._key(study.number):
            return None
        record = _record_of(study, folder, kept)
        whole = all((folder / name).exists() for name in (*record.pictures, *record.tables))
        return record if whole else None

    def keep(self, study: Study, findings: Findings) -> Record:
        """Write a figure's pictures and tables, and last its record, which makes it count."""
        folder = self.folder / study.folder
        folder.mkdir(parents=True, exist_ok=True)
        (folder / RECORD).unlink(missing_ok=True)
        for name, figure in findings.pictures.items():
            save_figure(figure, folder / f"{name}.png")
        for name, table in findings.tables.items():
            write_atomically(folder / f"{name}.csv", csv_text(table))
        kept = {
            "key": self._key(study.number),
            "pictures": [f"{name}.png" for name in findings.pictures],
            "tables": [f"{name}.csv" for name in findings.tables],
            "claims": [plain(asdict(claim)) for claim in findings.claims],
            "remarks": findings.remarks,
        }
        write_atomically(folder / RECORD, json.dumps(kept, indent=1))
        return _record_of(study, folder, kept)

    def _key(self, name: str) -> str:
        """Return what changes whenever the result may: name, settings, version."""
        parameters = json.dumps([name, asdict(self.settings), __version__])
        return hashlib.sha256(parameters.encode()).hexdigest()[:16]


def csv_text(table: Table) -> str:
    """Return a table as CSV; numbers are written so that they come back bit for bit."""
    columns = {heading: np.asarray(values).tolist() for heading, values in table.items()}
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue()


def _read_if_there(path: Path) -> SurfaceModel | None:
    try:
        with warnings.catch_warnings():
            # Some of the thesis's fits are not convex; that is a finding here and no surprise.
            warnings.simplefilter("ignore", NotConvexWarning)
            return read_surface_model(path)
    except FileError:
        return None


def _record_of(study: Study, folder: Path, kept: Mapping[str, Any]) -> Record:
    return Record(
        number=study.number,
        title=study.title,
        folder=folder,
        pictures=tuple(kept["pictures"]),
        tables=tuple(kept["tables"]),
        claims=tuple(Claim(**claim) for claim in kept["claims"]),
        remarks=kept["remarks"],
    )
