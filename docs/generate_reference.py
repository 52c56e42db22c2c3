# SPDX-License-Identifier: Apache-2.0
"""Write the pages of reference that follow from the code, so that they cannot drift from it.

Interfaces from the .srv and .msg files with their comments, parameters from the nodes' tables,
error codes from the errors, programs from their own `--help`, the library from its docstrings.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limit_surface_ros import errors

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).resolve().parent.parent
INTERFACES = ROOT / "limit_surface_interfaces"
LAYERS = ("surface", "decay", "motion", "fitting", "files", "export", "plots")
# Nodes whose modules hold a NAME and a table SETTINGS.
NODES = ("limit_surface_node", "decay_node")


@dataclass
class Interface:
    """What a .msg or .srv file says.

    Attributes:
        name: Its name as in `limit_surface_interfaces/srv/WrenchToTwist`, without the package.
        text: The comment at its top.
        parts: Rows (type, name, comment) of the message, or of request and response.
    """

    name: str
    text: str
    parts: list[list[tuple[str, str, str]]] = field(default_factory=lambda: [[]])


def read_interface(path: Path) -> Interface:
    """Read an interface file; a comment is about the field below it.

    One that an empty line follows is about the file, if it is the first, or what comes next.
    """
    heading: list[str] = []
    comments: list[str] = []
    interface = Interface(f"{path.parent.name}/{path.stem}", "")

    def end_of_comments() -> None:
        if not heading and not any(interface.parts):
            heading.extend(comments)
        elif comments:
            interface.parts[-1].append(("", "", " ".join(comments)))
        comments.clear()

    for line in path.read_text(encoding="utf-8").splitlines():
        code, _, comment = (part.strip() for part in line.partition("#"))
        if code == "---":
            end_of_comments()
            interface.parts.append([])
        elif code:
            kind, _, name = code.partition(" ")
            meaning = " ".join([*comments, comment]).strip()
            interface.parts[-1].append((kind, name.strip(), meaning))
            comments.clear()
        elif line.strip():
            comments.append(comment)
        else:
            end_of_comments()
    interface.text = " ".join(heading)
    return interface


def read_interfaces() -> list[Interface]:
    """Return the package's services and messages."""
    paths = sorted(INTERFACES.glob("srv/*.srv")) + sorted(INTERFACES.glob("msg/*.msg"))
    return [read_interface(path) for path in paths]


def table(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table."""
    cells = [list(heading)]
    cells += [[cell.replace("|", r"\|").replace("\n", " ") for cell in row] for row in rows]
    cells.insert(1, ["---"] * len(cells[0]))
    return "".join(f"| {' | '.join(row)} |\n" for row in cells)


def code(text: str) -> str:
    """Return text as code, or nothing for nothing."""
    return f"`{text}`" if text else ""


def interfaces_page() -> str:
    """Describe every service and message."""
    page = ["# Interfaces\n", "Package `limit_surface_interfaces`.\n"]
    for interface in read_interfaces():
        page.append(f"## {interface.name}\n\n{interface.text}\n")
        titles = ["Request", "Response"] if len(interface.parts) == 2 else [""]
        for title, rows in zip(titles, interface.parts, strict=True):
            if title:
                page.append(f"**{title}**\n")
            page.append(
                table(
                    ("field", "type", "meaning"),
                    ((code(name), code(kind), comment) for kind, name, comment in rows),
                )
                if rows
                else "*(empty)*\n"
            )
    return "\n".join(page)


def error_classes() -> Iterator[type[errors.LimitSurfaceError]]:
    """Yield the package's errors in the order in which they are defined."""
    for _, item in vars(errors).items():
        if inspect.isclass(item) and issubclass(item, errors.LimitSurfaceError):
            yield item


def errors_page() -> str:
    """Describe the error codes, and which of the library's errors each stands for."""
    meanings = read_interface(INTERFACES / "msg" / "ErrorCode.msg")
    rows = []
    for kind, name, comment in meanings.parts[0]:
        constant, _, number = name.partition("=")
        if kind:
            classes = [c.__name__ for c in error_classes() if c.code == constant.strip()]
            rows.append((number, code(constant.strip()), comment, ", ".join(map(code, classes))))
    return (
        "# Error codes\n\n"
        "Every service answers with an `error_code` of `limit_surface_interfaces/msg/ErrorCode` "
        "and a sentence in `error_msg`. The library raises the error in the last column; each "
        "is a `LimitSurfaceError` and the builtin error that fits it.\n\n"
        + table(("code", "constant", "meaning", "error of the library"), rows)
        + "\n```{eval-rst}\n.. automodule:: limit_surface_ros.errors\n```\n"
    )


def parameters_page() -> str:
    """Describe every parameter of every node, from the tables that declare them."""
    page = [
        "# Parameters\n",
        "`ros2 param describe` tells the same on a running node. A value that is not accepted is "
        "refused with the reason and the old one stays.\n",
    ]
    for module_name in NODES:
        try:
            module: Any = importlib.import_module(f"limit_surface_ros.nodes.{module_name}")
        except ModuleNotFoundError as missing:
            if missing.name != f"limit_surface_ros.nodes.{module_name}":
                raise
            continue
        rows = []
        for setting in module.SETTINGS:
            lowest, highest = setting.minimum, setting.maximum
            accepted = setting.constraints
            if lowest is not None or highest is not None:
                low = "-inf" if lowest is None else f"{lowest:g}"
                high = "inf" if highest is None else f"{highest:g}"
                accepted = f"{low} to {high}"
            description = setting.description + (" Read-only." if setting.read_only else "")
            rows.append((code(setting.name), code(repr(setting.default)), accepted, description))
        page.append(f"## Node `{module.NAME}`\n")
        page.append(table(("parameter", "default", "accepted", "meaning"), rows))
    return "\n".join(page)


def programs() -> dict[str, str]:
    """Return the table PROGRAMS of setup.py: each program's name and its module."""
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "PROGRAMS":
            assert node.value is not None
            return dict(ast.literal_eval(node.value))
    raise LookupError("setup.py has no table PROGRAMS")


def help_of(module: str) -> str:
    """Return what a program prints for `--help`."""
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    environment = {
        **os.environ,
        "COLUMNS": "90",
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
    }
    run = subprocess.run(
        [sys.executable, "-c", f"import sys, {module} as m; sys.exit(m.main(['--help']))"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return run.stdout.rstrip()


def programs_page() -> str:
    """Give every command line program's own help."""
    page = [
        "# Programs\n",
        "Each runs by its name, and as `ros2 run limit_surface_ros NAME`. They end with 0, with 1 "
        "when a part of the work failed, and with 2 and one line when the input is at fault.\n",
    ]
    for name, module in sorted(programs().items()):
        if module.startswith("limit_surface_ros.tools."):
            text = re.sub(r"^usage: \S+", f"usage: {name}", help_of(module))
            page.append(f"## {name}\n\n```text\n{text}\n```\n")
    return "\n".join(page)


def library_page(layer: str) -> str:
    """Describe one layer of the library by the docstrings of its modules."""
    package = importlib.import_module(f"limit_surface_ros.{layer}")
    page = [f"# limit_surface_ros.{layer}\n\n{inspect.getdoc(package)}\n"]
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not module.ispkg:
            page.append(f"## {module.name.removeprefix('limit_surface_ros.')}\n")
            page.append(f"```{{eval-rst}}\n.. automodule:: {module.name}\n```\n")
    return "\n".join(page)


def pages() -> dict[str, str]:
    """Return every generated page by its name."""
    made = {
        "interfaces": interfaces_page(),
        "errors": errors_page(),
        "parameters": parameters_page(),
        "programs": programs_page(),
    }
    return made | {f"library_{layer}": library_page(layer) for layer in LAYERS}


def write_pages(folder: Path) -> None:
    """Write the pages that changed, and take away those that are no more."""
    folder.mkdir(parents=True, exist_ok=True)
    made = pages()
    for path in folder.glob("*.md"):
        if path.stem not in made:
            path.unlink()
    for name, text in made.items():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
