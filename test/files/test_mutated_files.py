# SPDX-License-Identifier: Apache-2.0
"""Whatever a file holds, its reader gives a result or an error of the package, nothing else."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.errors import LimitSurfaceError, MissingExtraError
from limit_surface_ros.files.bag_pushes import read_bag_pushes
from limit_surface_ros.files.body_file import read_body
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.decay_file import read_decay_model
from limit_surface_ros.files.mesh_file import read_mesh
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.response_csv import read_response
from limit_surface_ros.files.surface_file import (
    SurfaceModel,
    read_surface_model,
    write_surface_model,
)
from limit_surface_ros.surface.convexity import NotConvexWarning
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "config"

PATCH = """schema: 1
name: patch
friction_coefficient: 0.3
normal_force: 4.0
cells: 60
shape: {kind: KIND, centre: [0.01, 0.0], angle: 0.1}
pressure: {kind: PRESSURE}
"""
SHAPES = {
    "disc, radius: 0.05": "rim, power: 3.0",
    "ring, inner_radius: 0.02, outer_radius: 0.05": "uniform",
    "rectangle, size: [0.1, 0.2]": "centre, power: 2.0",
    "ellipse, semi_axes: [0.1, 0.2]": "linear, centre_of_pressure: [0.0, 0.01]",
    "line, start: [0.0, 0.0], end: [0.1, 0.0]": "uniform",
}
PUSHES = """# {"rho_m": 0.05, "normal_force_N": 4.0, "support_points_m_body_frame": [[0.0, 0.1]]}
fx_N,fy_N,tau_Nm,vx,vy,omega
2.1,0.0,0.00,1.0,0.0,0.0
1.6,0.0,0.05,0.8,0.0,12.0
-1.0,1.5,-0.02,-0.6,0.8,-3.0
"""
RESPONSE = "t [ms],force\n" + "".join(
    f"{10 * k},{3.0 * np.exp(-0.05 * k):.5f}\n" for k in range(60)
)
URDF = """<?xml version="1.0"?>
<robot name="crate"><link name="crate">
<inertial><origin xyz="0.01 0 0.05"/><mass value="2.0"/></inertial>
<collision><origin xyz="0 0 0.05" rpy="0 0 0"/><geometry><box size="0.1 0.2 0.1"/></geometry>
</collision></link><gazebo reference="crate"><mu1>0.4</mu1></gazebo></robot>
"""
SDF = """<sdf version="1.9"><model name="can"><link name="can">
<inertial><mass>0.5</mass></inertial>
<collision name="c"><geometry><cylinder><radius>0.03</radius><length>0.1</length></cylinder>
</geometry><surface><friction><ode><mu>0.3</mu></ode></friction></surface></collision>
</link></model></sdf>
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1/1 2/2 4/3\nf 4 3 2 1\n"
STL = """solid a
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1 0
 endloop
endfacet
endsolid
"""
# Characters of a message at most: it may stay in a log for ever.
MOST_TOLD = 2500
# What people, and whoever wants to do harm, put where a number or a name is wanted.
TOKENS = [
    *(
        "",
        " ",
        "\n",
        "\t",
        ",",
        ";",
        ":",
        "#",
        "-",
        "'",
        '"',
        "[",
        "]",
        "{",
        "}",
        "<",
        ">",
        "&",
        "*",
    ),
    *("0", "-1", "1e-3", "1e400", "-1e308", "1e-320", "nan", ".nan", ".inf", "-.inf", "9" * 400),
    *("null", "true", "~", "!!python/object:os.system {}", "!!binary x", "!!set [1]", "<<: *a"),
    *("&a [*a]", "*a", "&a 1", "? [1]", "- - - -", "[" * 300, "{a: " * 300, "- " * 300),
    *("1,5", "35 mm", "010", "1:30", "2024-99-99", "\x00", "\ufeff", "\u2028", "\U0001f600", "ä"),
    *("x" * 20_000, "../../etc/passwd", "/dev/zero", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "&b;"),
]


@dataclass(frozen=True)
class Reader:
    """A reader, valid files of it, and how many of them a quick test takes."""

    read: Callable[[Path], object]
    suffix: str
    samples: Callable[[Path], list[bytes]]
    quick: int = 150


def surface_samples(folder: Path) -> list[bytes]:
    points = PointContacts([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]], [0.5, 0.5, 0.5])
    # (x^2 + y^2 + z^2)^2
    coefficients = [1, 0, 0, 2, 0, 2, 0, 0, 0, 0, 1, 0, 2, 0, 1]
    surfaces = [points, Dissipation([np.eye(3), np.diag([1.0, 2.0, 0.5])])]
    surfaces.append(Polynomial(coefficients))
    path = folder / "sample.yaml"
    found = [each.read_bytes() for each in sorted((CONFIG / "models").glob("*.yaml"))]
    for surface in surfaces:
        write_surface_model(SurfaceModel("sample", surface, fit={"data": "a.csv"}), path)
        found.append(path.read_bytes())
    return found


def contact_samples(_: Path) -> list[bytes]:
    patches = [PATCH.replace("KIND", s).replace("PRESSURE", p) for s, p in SHAPES.items()]
    points = (CONFIG / "contacts" / "triangle_points.yaml").read_bytes()
    return [points, *(patch.encode() for patch in patches)]


def stl_samples(_: Path) -> list[bytes]:
    corners = np.arange(18, dtype="<f4").reshape(2, 9)
    records = b"".join(bytes(12) + row.tobytes() + bytes(2) for row in corners)
    return [STL.encode(), bytes(80) + (2).to_bytes(4, "little") + records]


def bag_samples(folder: Path, storage: str) -> list[bytes]:
    pytest.importorskip("rosbags", reason="the extra 'bags' is not installed")
    from bag_helpers import TIMES, StoragePlugin, steady_push, write_bag

    bag = write_bag(folder / "bag", steady_push(TIMES[:60]), getattr(StoragePlugin, storage))
    return [path.read_bytes() for path in bag.iterdir() if path.suffix != ".yaml"]


def read_bag(path: Path) -> object:
    return read_bag_pushes(path, "/load", "/motion")


READERS = {
    "db3": Reader(read_bag, ".db3", lambda folder: bag_samples(folder, "SQLITE3"), 40),
    "mcap": Reader(read_bag, ".mcap", lambda folder: bag_samples(folder, "MCAP"), 40),
    "surface": Reader(read_surface_model, ".yaml", surface_samples, 60),
    "decay": Reader(
        read_decay_model,
        ".yaml",
        lambda _: [path.read_bytes() for path in sorted((CONFIG / "decay").glob("*.yaml"))],
    ),
    "contact": Reader(read_contact, ".yaml", contact_samples, 60),
    "pushes": Reader(read_pushes, ".csv", lambda _: [PUSHES.encode()]),
    "response": Reader(read_response, ".csv", lambda _: [RESPONSE.encode()]),
    "urdf": Reader(read_body, ".urdf", lambda _: [URDF.encode()], 60),
    "sdf": Reader(read_body, ".sdf", lambda _: [SDF.encode()], 60),
    "obj": Reader(read_mesh, ".obj", lambda _: [OBJ.encode()]),
    "stl": Reader(read_mesh, ".stl", stl_samples),
}


def mutated(sample: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """Return a sample with one to three things changed in it."""
    content = sample
    for _ in range(rng.integers(1, 4)):
        size = len(content)
        first, last = sorted(rng.integers(0, size + 1, 2).tolist())
        short = min(last, first + int(rng.integers(1, 12)))
        match rng.integers(0, 8):
            case 0:  # one bit
                if size:
                    place = int(rng.integers(size))
                    flipped = content[place] ^ (1 << int(rng.integers(8)))
                    content = content[:place] + bytes([flipped]) + content[place + 1 :]
            case 1:  # cut off
                content = content[:first]
            case 2:  # a piece lost
                content = content[:first] + content[last:]
            case 3:  # a piece twice
                content = content[:last] + content[first:]
            case 4:  # bytes of any sort
                content = content[:first] + rng.bytes(4) + content[short:]
            case 5:  # the end of another file
                content = content[:first] + other[min(first, len(other)) :]
            case _:  # a token, in place of a word or between
                token = TOKENS[int(rng.integers(len(TOKENS)))].encode()
                content = content[:first] + token + content[short if rng.integers(2) else first :]
    return content


def outcomes(reader: Reader, folder: Path, count: int) -> Iterator[str]:
    """Read mutated files; yield what came of each."""
    rng = np.random.default_rng(7)
    samples = reader.samples(folder)
    path = folder / f"mutated{reader.suffix}"
    for sample in samples:
        path.write_bytes(sample)
        reader.read(path)
    for number in range(count):
        one, other = (samples[int(i)] for i in rng.integers(0, len(samples), 2))
        path.write_bytes(mutated(one, other, rng))
        told = None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", NotConvexWarning)
                reader.read(path)
        except MissingExtraError as error:
            pytest.skip(str(error))
        except LimitSurfaceError as error:
            told = str(error)
        except BaseException as error:
            shutil.copy(path, f"{path}.{number}")
            raise AssertionError(f"see {path}.{number}") from error
        assert told is None or len(told) < MOST_TOLD, f"file {number}: {told[:300]}"
        yield "read" if told is None else "refused"


@pytest.mark.parametrize("name", READERS)
def test_a_mutated_file_is_read_or_refused_with_an_error_of_the_package(name, tmp_path):
    found = list(outcomes(READERS[name], tmp_path, READERS[name].quick))
    assert {"read", "refused"} <= set(found)


@pytest.mark.nightly
@pytest.mark.parametrize("name", READERS)
def test_ten_thousand_mutated_files_are_read_or_refused(name, tmp_path):
    found = list(outcomes(READERS[name], tmp_path, 10_000))
    assert {"read", "refused"} <= set(found)
