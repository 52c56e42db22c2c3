# SPDX-License-Identifier: Apache-2.0
"""Triangles of mesh files: STL, binary or text, and OBJ."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.regular_file import read_bytes

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats

SUFFIXES = (".stl", ".obj")
MOST_BYTES = 256 * 1024 * 1024
_HEADER, _RECORD = 84, 50


def read_mesh(path: str | Path) -> Floats:
    """Return the triangles of a mesh, shape (n, 3 corners, 3 coordinates), in the file's unit.

    Raises:
        FileError: The file is absent, of another kind, or holds no finite triangles.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FileError(
            f"{path}: meshes are read from {' and '.join(SUFFIXES)}, not from {suffix or 'this'}: "
            "convert it"
        )
    content = read_bytes(path, MOST_BYTES, "a mesh")
    try:
        triangles = _of_obj(content) if suffix == ".obj" else _of_stl(content)
    except (ValueError, IndexError, OverflowError) as error:
        raise FileError(f"{path}: is no valid {suffix} file: {error}") from None
    if not len(triangles):
        raise FileError(f"{path}: holds no triangle")
    if not np.isfinite(triangles).all():
        raise FileError(f"{path}: has a coordinate that is not finite")
    return triangles


def _of_stl(content: bytes) -> Floats:
    # Binary files may begin with "solid", too: only their length tells them apart.
    count = int.from_bytes(content[80:_HEADER], "little") if len(content) >= _HEADER else -1
    if len(content) == _HEADER + count * _RECORD:
        records = np.frombuffer(content, dtype=np.uint8, offset=_HEADER).reshape(count, _RECORD)
        numbers = records[:, 12:48].copy().view("<f4").astype(np.float64)
        return np.asarray(numbers.reshape(-1, 3, 3))
    words = (line.split() for line in content.decode("utf-8", "replace").splitlines())
    corners = [row[1:4] for row in words if row and row[0] == "vertex"]
    return np.array(corners, dtype=np.float64).reshape(-1, 3, 3)


def _of_obj(content: bytes) -> Floats:
    corners: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in content.decode("utf-8", "replace").splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            corners.append([float(number) for number in rest[:3]])
        elif word == "f":
            # Numbered from 1, or from the last corner backwards; v/vt/vn names normals, too.
            numbers = [int(each.split("/")[0]) for each in rest]
            indices = [n - 1 if n > 0 else len(corners) + n for n in numbers]
            if min(indices, default=0) < 0:
                raise ValueError("a face names a corner that is not there")
            faces += [(indices[0], second, third) for second, third in pairwise(indices[1:])]
    points = np.array(corners, dtype=np.float64).reshape(-1, 3)
    return np.asarray(points[np.array(faces, dtype=np.int64).reshape(-1, 3)])
