# SPDX-License-Identifier: Apache-2.0
"""A folder of recorded pushes for fit_catalogue."""

from pathlib import Path

import numpy as np

from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

# Short fits, one start after the other.
OPTIONS = ["--terms", "2", "--starts", "2"]


def write_objects(folder: Path, count: int) -> list[str]:
    """Write exact pushes of `count` triangles; return the objects' names."""
    folder.mkdir()
    names = [f"object_{i:02d}" for i in range(count)]
    corners = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])
    for i, name in enumerate(names):
        body = PointContacts(corners * (1 + 0.1 * i), np.array([0.5, 0.4, 0.6]), Scaling(0.15))
        pairs = random_motions(body, 40, i)
        rows = np.hstack([pairs.wrenches, pairs.twists])
        lines = ["fx_N,fy_N,tau_Nm,vx,vy,omega", *(",".join(map(repr, r.tolist())) for r in rows)]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    return names


def matrices(folder: Path, names: list[str]) -> list[list]:
    """Return the numbers of the models of these names."""
    return [
        read_surface_model(folder / f"{name}.yaml").surface.matrices.tolist() for name in names
    ]
