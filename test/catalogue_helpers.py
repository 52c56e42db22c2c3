"""A folder of recorded pushes, and fit_catalogue as a process of its own."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from limit_surface_ros.files.surface_file import read_surface_model
from limit_surface_ros.surface.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

REPOSITORY = Path(__file__).parents[1]
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


def until(condition, what: str, seconds: float = 60.0):
    """Wait for a condition; return what it gives."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.02)
    return value


def started(module: str, *arguments: object, **options) -> subprocess.Popen:
    """Start a module; see `started_python`."""
    return started_python("-m", module, *arguments, **options)


def started_python(*arguments: object, **options) -> subprocess.Popen:
    """Start Python with arguments, as the leader of a process group of its own."""
    paths = [str(REPOSITORY), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env=environment,
        start_new_session=True,
        text=True,
        **options,
    )


def group_is_gone(group: int) -> bool:
    """Tell whether no process of a group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False
