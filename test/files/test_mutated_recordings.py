# SPDX-License-Identifier: Apache-2.0
"""Damaged bags and CSV files are read, or refused by the package's errors alone."""

import warnings

import numpy as np
import pytest
from bag_helpers import (
    POSE,
    TIMES,
    WRENCH,
    StoragePlugin,
    loads,
    motion_messages,
    tf_of,
    transform,
    write_bag,
)

from limit_surface_ros.errors import LimitSurfaceError
from limit_surface_ros.files.bag_pushes import BagFrames, read_bag_pushes
from limit_surface_ros.files.bag_topic import read_topic
from limit_surface_ros.files.csv_table import CsvOptions
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.response_csv import read_response
from limit_surface_ros.fitting.plausibility import doubts_of_pairs

FEW, MANY = 4, 500
TEXTS = {
    "pushes": '# {"rho_m": 0.05}\nfx_N,fy_N,tau_Nm,vx,vy,omega\n'
    + "".join(f"{k}.5,1,0.{k},0.1,0.{k},{k}\n" for k in range(9)),
    "units": "fx;fy;tau;vx;vy;omega\n(N);(N);[N mm];mm/s;mm/s;deg/s\n"
    + "".join(f"{k},5;1;0,{k};0,1;0,{k};{k}\n" for k in range(9)),
    "decay": "Model,SCOPE\n\nt [ms],F\n" + "".join(f"{k},{9 - k}.5\n" for k in range(9)),
    "stamps": "".join(f"1700000000,{k}0000000,ft,{9 - k}.5,1\n" for k in range(9)),
    "dates": "t,F\n" + "".join(f"2026-01-01T00:00:0{k}.5Z,{9 - k}\n" for k in range(9)),
}
SPLICES = [b"\x00", b"\xff\xfe", b"nan", b"1e999", b"-", b'"', b",", b";", b"\n", b"#"]
SPLICES += [b"\x80", b"9" * 40, b"x" * 5000]
# Characters of a message at most: it may stay in a log for ever.
MOST_TOLD = 2500


def mutated(content, rng):
    """Return content with a few bytes changed, a part cut out, doubled or spliced in."""
    bytes_ = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, max(len(bytes_), 1)))
        end = min(len(bytes_), at + int(rng.integers(1, 40)))
        how = rng.integers(0, 6)
        if how == 0 and bytes_:
            bytes_[at] = int(rng.integers(0, 256))
        elif how == 1:
            del bytes_[at:end]
        elif how == 2:
            bytes_[at:at] = bytes_[at:end]
        elif how == 3:
            bytes_[at:at] = SPLICES[int(rng.integers(0, len(SPLICES)))]
        elif how == 4 and rng.random() < 0.3:
            del bytes_[at:]
        elif bytes_:
            bytes_[at] ^= 1 << int(rng.integers(0, 8))
    return bytes(bytes_)


def only_errors_of_the_package(read):
    """Run a reader; whatever it raises must be of the package, and say something."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", RuntimeWarning)
        try:
            return read()
        except LimitSurfaceError as error:
            told = str(error)
    assert 0 < len(told) < MOST_TOLD
    return None


def read_texts(path, rng):
    """Read a file as pushes and as a response, with options that may be wrong."""
    cells = CsvOptions(
        [None, ",", ";", "\t", " "][int(rng.integers(0, 5))],
        [None, ".", ","][int(rng.integers(0, 3))],
        bool(rng.integers(0, 2)),
    )
    pushes = only_errors_of_the_package(lambda: read_pushes(path, cells))
    if pushes is not None:
        only_errors_of_the_package(lambda: doubts_of_pairs(pushes.pairs, pushes.number("rho_m")))
        only_errors_of_the_package(pushes.support)
    only_errors_of_the_package(lambda: read_response(path, None, None, cells))
    only_errors_of_the_package(lambda: read_response(path, "t", "F", cells, time_unit="ms"))


def mutate_texts(tmp_path, count):
    rng = np.random.default_rng(0)
    path = tmp_path / "mutant.csv"
    for _ in range(count):
        for text in TEXTS.values():
            path.write_bytes(
                mutated(text.encode(["utf-8", "utf-16"][int(rng.integers(0, 2))]), rng)
            )
            read_texts(path, rng)


def bag_files(tmp_path):
    """Return a bag of each storage, as the files that are to be damaged, with what reads it."""
    times = slice(0, 60)
    tf = "tf2_msgs/msg/TFMessage"
    static = (tf, [tf_of(transform(100.0, "world", "ft", 0.1, 0.0, 0.3))])
    topics = {
        "/load": (WRENCH, loads("ft")[1][times]),
        "/motion": (POSE, motion_messages(POSE)[times]),
        "/tf": (tf, motion_messages(tf)[times]),
        "/tf_static": static,
    }
    assert len(TIMES[times]) == 60
    bags = []
    for storage, name in ((StoragePlugin.SQLITE3, "bag.db3"), (StoragePlugin.MCAP, "bag.mcap")):
        folder = tmp_path / name / "bag"
        folder.parent.mkdir()
        write_bag(folder, topics, storage)
        bags += [(folder, name), (folder, "metadata.yaml")]
    return bags


def mutate_bags(tmp_path, count):
    rng = np.random.default_rng(1)
    for folder, name in bag_files(tmp_path):
        whole = (folder / name).read_bytes()
        frames = BagFrames(body="object", fixed="world")
        assert len(read_bag_pushes(folder, "load", "motion", None, frames).pairs) > 0
        for number in range(count):
            (folder / name).write_bytes(mutated(whole, rng))
            bag = folder if number % 2 or name == "metadata.yaml" else folder / name
            motion = ["/motion", "/tf"][int(rng.integers(0, 2))]
            only_errors_of_the_package(
                lambda: read_bag_pushes(bag, "/load", motion, None, frames)  # noqa: B023
            )
            only_errors_of_the_package(
                lambda: read_topic(bag, "/load", ["wrench.force.x"])  # noqa: B023
            )
        (folder / name).write_bytes(whole)


def test_some_damaged_texts_raise_errors_of_the_package_alone(tmp_path):
    mutate_texts(tmp_path, 10 * FEW)


def test_some_damaged_bags_raise_errors_of_the_package_alone(tmp_path):
    mutate_bags(tmp_path, FEW)


@pytest.mark.nightly
def test_thousands_of_damaged_texts_raise_errors_of_the_package_alone(tmp_path):
    mutate_texts(tmp_path, 600)


@pytest.mark.nightly
def test_thousands_of_damaged_bags_raise_errors_of_the_package_alone(tmp_path):
    mutate_bags(tmp_path, MANY)
