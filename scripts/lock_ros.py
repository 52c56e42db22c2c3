# SPDX-License-Identifier: Apache-2.0
"""Write requirements/ros.lock: every wheel of ROS that ros.txt stands for, with its hashes.

Run it where ros.txt is installed (`scripts/with_ros python3 scripts/lock_ros.py`) after a change
of the ROS lines there, and look at what changed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from importlib.metadata import distributions
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.10", "3.11", "3.12", "3.13")
PLATFORM = "manylinux_2_28_x86_64"
HEADER = """\
# Written by scripts/lock_ros.py: the wheels of ROS for Python {first} to {last}, by their hashes.
# What is installed is what was tried: pip refuses a file that differs in one bit.
"""


def installed() -> list[str]:
    """Return what is installed of ROS, as name==version."""
    found = {(each.metadata["Name"], each.version) for each in distributions()}
    return sorted(f"{name}=={version}" for name, version in found if name.startswith("ros-"))


def chosen(python: str, lines: list[str]) -> list[dict]:
    """Return what pip would download for a Python: its report's entries."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        subprocess.run(
            [
                *(sys.executable, "-m", "pip", "install", "--quiet", "--dry-run"),
                *("--ignore-installed", "--no-deps", "--only-binary=:all:", "--target", folder),
                *("--python-version", python, "--platform", PLATFORM),
                *("--platform", "manylinux2014_x86_64", "--report", str(report), *lines),
            ],
            check=True,
            capture_output=True,
        )
        entries: list[dict] = json.loads(report.read_text(encoding="utf-8"))["install"]
        return entries


def main() -> int:
    """Write the lock."""
    hashes: dict[str, set[str]] = defaultdict(set)
    lines = installed()
    for python in PYTHONS:
        for entry in chosen(python, lines):
            name, version = entry["metadata"]["name"], entry["metadata"]["version"]
            digest = entry["download_info"]["archive_info"]["hashes"]["sha256"]
            hashes[f"{name}=={version}"].add(digest)
    parts = [
        " \\\n".join([line, *(f"    --hash=sha256:{digest}" for digest in sorted(digests))])
        for line, digests in sorted(hashes.items())
    ]
    header = HEADER.format(first=PYTHONS[0], last=PYTHONS[-1])
    (ROOT / "requirements" / "ros.lock").write_text(header + "\n".join(parts) + "\n")
    print(f"requirements/ros.lock: {len(parts)} packages, {sum(map(len, hashes.values()))} wheels")
    return 0


if __name__ == "__main__":
    sys.exit(main())
