# SPDX-License-Identifier: Apache-2.0
"""The promise of README and docs: every code block runs, in order, as it stands.

A page's blocks run in a folder of their own. Python runs as one program; a page that also holds
bash runs as one bash script, into which each Python block is put together with those before it.
Nodes that a page starts in "another terminal" run in the background until its end. `ros2`, `rviz2`
and `make` are `ros2_stand_in.py` here, which runs the real programs, services and topics. Blocks
marked as text, YAML, C++ or CMake are shown and not run; those that show whole files are included
from files that other tests run or compile.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.response_csv import read_response
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling
from process_helpers import own_domain

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
STAND_IN = Path(__file__).with_name("ros2_stand_in.py")
PAGES = sorted(
    path
    for path in [README, *ROOT.glob("docs/**/*.md")]
    if path.exists() and not {"_build", "generated"} & set(path.relative_to(ROOT).parts)
)
# What the blocks before it print: compared, as `agree` says.
OUTPUT = "output"
# Code that is wider has to be scrolled where the documentation is read.
WIDEST = 88
SHOWN = {
    OUTPUT,
    "text",
    "yaml",
    "cpp",
    "cmake",
    "c++",
    "{toctree}",
    "{literalinclude}",
    "{raw}",
    "{eval-rst}",
    "",
}
FENCE = re.compile(r"^(```+)([^\n`]*)\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?:(?<=\n\n)|^)((?: {4}[^\n]*\n)+)", re.MULTILINE)
NODE = re.compile(r"^ros2 run limit_surface_ros \w+_nodes? ")
# Commands whose effect is outside of a test's reach: they are recognised and passed over.
PASSED_OVER = ("git ", "cd ", "source ", ". ", "sudo ", "apt ", "colcon ", "pip ", "scripts/")


@dataclass(frozen=True)
class Block:
    """A code block of a page."""

    language: str
    text: str


def blocks_of(page: Path) -> list[Block]:
    """Return the blocks that run, in order; an unknown language is an error."""
    text = page.read_text(encoding="utf-8")
    found: list[tuple[int, Block]] = []
    for match in FENCE.finditer(text):
        language = (match[2].split() or [""])[0]
        if language not in SHOWN:
            assert language in ("python", "bash", "console", "sh"), (
                f"{page}: block of {language!r}"
            )
            found.append((match.start(), Block(language, match[3])))
    bare = FENCE.sub(lambda match: "x" * len(match[0]), text)
    if page.name == "README.md":
        for match in INDENTED.finditer(bare):
            lines = match[1].replace("\n    ", "\n").removeprefix("    ")
            found.append((match.start(), Block("bash", lines)))
    return [block for _, block in sorted(found, key=lambda item: item[0])]


def commands_of(block: str) -> list[str]:
    """Return the commands of a bash block, continuations joined, here-documents whole."""
    commands: list[str] = []
    lines = iter(block.splitlines())
    for line in lines:
        command = line
        while command.endswith("\\"):
            command += "\n" + next(lines)
        end = re.search(r"<<'?(\w+)'?", command)
        if end:
            for inside in lines:
                command += "\n" + inside
                if inside == end[1]:
                    break
        commands.append(command)
    return commands


def as_bash(command: str) -> str:
    """Return a command as the test runs it."""
    if command.startswith(PASSED_OVER):
        return f": passed over {shlex.quote(command)}"
    plain = re.sub(r"\s+# .*$", "", command) if "\n" not in command else command
    return f"{plain} &" if NODE.match(plain) else plain


def script_of(blocks: list[Block]) -> str:
    """Return a page as one bash script."""
    end = "code=$?; kill $(jobs -p) 2>/dev/null || true; wait; exit $code"
    parts = ["set -euo pipefail", f"trap '{end}' EXIT"]
    python = ""
    for block in blocks:
        if block.language == "python":
            python += block.text
            parts.append(f"python3 - <<'END_OF_PYTHON'\n{python}END_OF_PYTHON")
        else:
            parts += [as_bash(command) for command in commands_of(block.text)]
    return "\n".join(parts) + "\n"


@pytest.fixture
def environment(tmp_path):
    """An environment in which the page's commands are found, in a ROS domain of its own."""
    commands = tmp_path / "bin"
    commands.mkdir()
    for name in ("ros2", "rviz2", "make"):
        line = f'exec {shlex.quote(sys.executable)} {shlex.quote(str(STAND_IN))} {name} "$@"\n'
        write_atomically(commands / name, f"#!/bin/sh\n{line}")
        (commands / name).chmod(0o755)
    # A link would not find the virtual environment that this Python stands in.
    write_atomically(commands / "python3", f'#!/bin/sh\nexec {shlex.quote(sys.executable)} "$@"\n')
    (commands / "python3").chmod(0o755)
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    return os.environ | {
        "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        **own_domain("documentation"),
    }


@pytest.fixture
def own_files(tmp_path):
    """The files that README takes the reader to have: a model, pushes, a contact, a robot."""
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "examples").symlink_to(ROOT / "examples")
    feet = [[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]]
    body = PointContacts(feet, [1.0, 1.0, 1.0], Scaling(0.05, 3.0))
    write_surface_model(SurfaceModel("mine", body), folder / "model.yaml")
    pairs = random_motions(body, 30, 1)
    rows = np.hstack([pairs.wrenches, pairs.twists])
    heading = "fx_N,fy_N,tau_Nm,vx,vy,omega"
    np.savetxt(folder / "pushes.csv", rows, delimiter=",", header=heading, comments="")
    shown = re.search(r"^```yaml\n(.*?)^```", README.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    (folder / "contact.yaml").write_text(shown[1])
    box = "<collision><geometry><box size='0.12 0.07 0.05'/></geometry></collision>"
    base = f"<link name='base'><inertial><mass value='0.4'/></inertial>{box}</link>"
    friction = "<gazebo reference='base'><mu1>0.35</mu1></gazebo>"
    (folder / "robot.urdf").write_text(f"<robot name='box'>{base}{friction}</robot>")
    return folder


FIRST_HOUR = ROOT / "docs" / "tutorials" / "first_hour.md"
# The first hour has a test of its own.
WITH_CODE = [page for page in PAGES if blocks_of(page) and page != FIRST_HOUR]
# Pages whose blocks take a quarter of a minute on a busy machine run at night.
LONG = {"docs/gallery.md", "docs/how_to/serve_many_objects.md"}


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            page, marks=[pytest.mark.nightly] if str(page.relative_to(ROOT)) in LONG else []
        )
        for page in WITH_CODE
    ],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_every_code_block_of_a_page_runs_and_prints_what_is_shown(page, own_files, environment):
    blocks = blocks_of(page)
    bash = "".join(block.text for block in blocks if block.language != "python")
    if "ros2 " in bash or "rclpy" in "".join(block.text for block in blocks):
        pytest.importorskip("rclpy", reason="rclpy is not installed")
        pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")
    if "make_bag" in bash:
        pytest.importorskip("rosbags", reason="rosbags writes the bag")
    if "plot_" in bash or "reproduce_thesis" in bash:
        pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")
    script = script_of(blocks).replace("/path/to/", f"{own_files}/")
    run = subprocess.run(
        ["bash", "-c", script],
        cwd=own_files,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, f"{run.stdout}\n{run.stderr}"
    assert_shown(page, run.stdout)


FORMATS = [
    (page, match[1], match[2])
    for page in (README, ROOT / "docs" / "reference" / "files.md")
    for match in re.finditer(r"```(yaml|text)\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
]


@pytest.mark.parametrize(("page", "language", "text"), FORMATS)
def test_every_file_that_is_shown_is_read(tmp_path, page, language, text):
    path = tmp_path / "shown"
    path.write_text(text)
    if language == "yaml":
        assert read_contact(path).name
    elif "fx_N" in text:
        assert len(read_pushes(path).pairs) == 2
    else:
        assert len(read_response(path).record.knots) == 2


def test_both_descriptions_of_contacts_and_both_sorts_of_csv_are_shown():
    shown = "".join(text for page, _, text in FORMATS if page.name == "files.md")
    for key in ("friction_limits:", "shape:", "fx_N,", "t,force"):
        assert key in shown


def outputs_of(page: Path) -> list[str]:
    """Return the lines that a page shows as printed, in order; README beside the print()."""
    text = page.read_text(encoding="utf-8")
    if page.name == "README.md":
        return re.findall(r"^print\(.*\)  # (.+)$", text, re.MULTILINE)
    blocks = [match[3] for match in FENCE.finditer(text) if match[2] == OUTPUT]
    return [line for block in blocks for line in block.splitlines()]


def assert_shown(page: Path, stdout: str) -> None:
    """Look for the lines that a page shows in what was printed, in order."""
    printed = iter(stdout.splitlines())
    for shown in outputs_of(page):
        found = any(agree(shown, line) for line in printed)
        assert found, f"{shown}\n\nnot in\n\n{stdout}"


def agree(shown: str, printed: str) -> bool:
    """Tell whether a line is printed as shown, or begins so, but for last digits of numbers.

    A line "... a ... b ..." shows parts: each may stand anywhere in what was printed.
    """
    if shown.startswith("... "):
        parts = shown[4:].removesuffix(" ...").split(" ... ")
        firsts = [re.escape(re.split(r"-?\d", part)[0]) for part in parts]
        return all(
            any(agree(part, printed[match.start() :]) for match in re.finditer(first, printed))
            for part, first in zip(parts, firsts, strict=True)
        )
    number = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")
    words, numbers = number.split(shown), number.findall(shown)
    others, found = number.split(printed), number.findall(printed)
    if [" ".join(word.split()) for word in words[:-1]] != [
        " ".join(word.split()) for word in others[: len(words) - 1]
    ]:
        return False
    if not " ".join(others[len(words) - 1].split()).startswith(" ".join(words[-1].split())):
        return False
    return all(
        abs(float(one) - float(other)) <= 0.03 * max(abs(float(one)), abs(float(other)))
        for one, other in zip(numbers, found, strict=False)
    )


def test_the_first_hour_prints_what_it_shows(tmp_path, environment):
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    pytest.importorskip("limit_surface_interfaces", reason="the interfaces are not built")
    pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")
    run = subprocess.run(
        ["bash", "-c", script_of(blocks_of(FIRST_HOUR))],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, f"{run.stdout}\n{run.stderr}"
    assert_shown(FIRST_HOUR, run.stdout)
    for name in ("triangle.png", "push.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    assert "error_code=100" in run.stdout


def test_a_line_that_is_printed_otherwise_does_not_agree():
    shown = "held out    2000 pairs: mean angle 4.04 deg"
    assert agree(shown, "held out  2000 pairs: mean angle 4.05 deg, velocity error 0.07")
    assert not agree(shown, "held out    2000 pairs: mean angle 5.04 deg")
    assert not agree(shown, "training    2000 pairs: mean angle 4.04 deg")
    inside = "... slips=True, slip_time=4.629 ... earliest=4.3 ..."
    assert agree(inside, "Response(slips=True, slip_time=4.6293791, earliest=4.3, more=1)")
    assert not agree(inside, "Response(slips=True, slip_time=5.6293791, earliest=4.3)")
    assert not agree(inside, "Response(slip_time=4.629)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_code_is_wider_than_the_column_that_it_is_read_in(page):
    for match in FENCE.finditer(page.read_text(encoding="utf-8")):
        for line in match[3].splitlines():
            assert len(line) <= WIDEST, line


# Nothing on a page that prints is left unseen: these show no output because there is none to show.
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.stem)
def test_a_page_that_prints_shows_what(page):
    code = "".join(block.text for block in blocks_of(page))
    prints = re.search(r"print\(|fit_\w+ \w|plot_\w+ \w|check_|service call|_surface \w", code)
    assert outputs_of(page) or not prints


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_brackets_in_commands_stand_in_quotes_as_zsh_wants_them(page):
    for block in blocks_of(page):
        if block.language == "python":
            continue
        for command in commands_of(block.text):
            bare = re.sub(r"'[^']*'|\"[^\"]*\"|\s# .*|<<.*", "", command, flags=re.DOTALL)
            assert "[" not in bare, command


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=lambda page: page.stem)
def test_links_to_files_lead_somewhere(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), target


def test_readme_is_shorter_than_220_lines():
    assert len(README.read_text(encoding="utf-8").splitlines()) < 220


def test_a_block_that_fails_fails_the_page(tmp_path, environment):
    for text in ("ros2 service nonsense", "make no_such_target", "rviz2 -d absent.rviz", "false"):
        script = script_of([Block("bash", text + "\n")])
        run = subprocess.run(["bash", "-c", script], env=environment, capture_output=True)
        assert run.returncode != 0, text
    script = script_of([Block("python", "x = 1\n"), Block("python", "assert x == 2\n")])
    assert subprocess.run(["bash", "-c", script], env=environment, capture_output=True).returncode


def test_here_documents_and_continuations_stay_whole():
    block = "cat > a <<'END'\nros2 run\nEND\n"
    block += "ros2 run limit_surface_ros limit_surface_node \\\n  -p x\n"
    document, node = commands_of(block)
    assert document == "cat > a <<'END'\nros2 run\nEND"
    assert as_bash(node).endswith("-p x &")
