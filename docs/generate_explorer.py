# SPDX-License-Identifier: Apache-2.0
"""Write the page of limit surfaces to play with that the documentation shows in a frame."""

from __future__ import annotations

from pathlib import Path

from limit_surface_ros.export.explorer import explorer_page
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.surface_file import SurfaceModel, read_surface_model
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.surface.sampling import random_motions

CONFIG = Path(__file__).resolve().parent.parent / "config"


def write_explorer(folder: Path) -> Path:
    """Write explorer.html into a folder of its own, and return the folder."""
    exact = read_surface_model(CONFIG / "models" / "triangle_points.yaml").surface
    norms = read_surface_model(CONFIG / "models" / "triangle_points_norms.yaml").surface
    body = read_contact(CONFIG / "contacts" / "triangle_points.yaml").surface
    fit = fit_power_sum(
        random_motions(body, 1000, 1), [1.0], scaling=exact.scaling, search=Search(2, 1)
    )
    surfaces = {"exact": exact, "norms": norms, "ellipsoid": fit.surface}
    models = [SurfaceModel(name, surface) for name, surface in surfaces.items()]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "explorer.html").write_text(explorer_page(models), encoding="utf-8")
    return folder
