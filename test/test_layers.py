# SPDX-License-Identifier: Apache-2.0
"""Layers hold: a module imports only from its own layer and those below; only nodes know ROS."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

import limit_surface_ros

PACKAGE = "limit_surface_ros"
ROOT = Path(limit_surface_ros.__file__).parent
LAYERS = ["surface", "decay", "motion", "fitting", "files", "export"]
TOPS = ["nodes", "tools", "plots", "thesis"]
ROS = {
    "rclpy",
    "ament_index_python",
    "limit_surface_interfaces",
    "builtin_interfaces",
    "diagnostic_msgs",
    "geometry_msgs",
    "nav_msgs",
    "rcl_interfaces",
    "std_msgs",
    "std_srvs",
    "tf2_ros",
    "visualization_msgs",
}
INTERFACES = "the interfaces are not built"
LEARNING_PROCESS = "limit_surface_ros.nodes.limit_surface.learning_process"
MODULES = sorted(ROOT.rglob("*.py"))


def layer_of(parts: tuple[str, ...]) -> str:
    """Return the layer of a module's path inside the package; "" for errors and checks."""
    return parts[0] if len(parts) > 1 else ""


def allowed(layer: str) -> set[str]:
    """Return the layers that a layer may import from."""
    if layer == "":
        return {""}
    if layer in TOPS:
        # Programs that make pictures are tools, and need plots; one rebuilds the thesis.
        more = {"tools": ["plots", "thesis"], "thesis": ["plots"]}
        return {"", *LAYERS, layer, *more.get(layer, [])}
    return {"", *LAYERS[: LAYERS.index(layer) + 1]}


def imported(path: Path) -> list[str]:
    """Return the dotted names that a module imports, wherever it does."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return names


def dotted(path: Path) -> str:
    """Return the name by which a module is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join((PACKAGE, *parts)).removesuffix(".__init__")


def own_layer(name: str) -> str | None:
    """Return the layer of an import from this package, None for others."""
    first, *rest = name.split(".")
    if first != PACKAGE:
        return None
    return rest[0] if rest and (ROOT / rest[0]).is_dir() else ""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_imports_only_from_its_own_layer_and_those_below(path):
    layer = layer_of(path.relative_to(ROOT).parts)
    for name in imported(path):
        below = own_layer(name)
        assert below is None or below in allowed(layer), f"{layer or 'base'} imports {name}"
        if layer != "nodes":
            assert name.split(".")[0] not in ROS, f"{layer or 'base'} imports {name}"


def test_nodes_never_import_what_fits_but_for_the_learner_that_is_asked_to():
    for path in MODULES:
        if layer_of(path.relative_to(ROOT).parts) != "nodes":
            continue
        names = [name for name in imported(path) if own_layer(name) == "fitting"]
        if dotted(path) == LEARNING_PROCESS:
            # Imported by the process that learns: it needs no ROS.
            assert not [name for name in imported(path) if name.split(".")[0] in ROS]
        elif path.name == "learning.py":
            # Inside a function: nodes that do not learn start without it.
            tree = ast.parse(path.read_text(encoding="utf-8"))
            at_start = [node.module for node in tree.body if isinstance(node, ast.ImportFrom)]
            assert not [name for name in at_start if own_layer(name) == "fitting"]
            assert all(".few_pushes." in name or ".workers." in name for name in names)
        else:
            assert not names


def test_only_one_program_rebuilds_the_thesis():
    for path in MODULES:
        parts = path.relative_to(ROOT).parts
        if parts[0] != "thesis" and parts != ("tools", "reproduce_thesis.py"):
            assert not [name for name in imported(path) if own_layer(name) == "thesis"], path


def test_no_imports_go_in_a_circle():
    names = {dotted(path) for path in MODULES}
    graph = {
        dotted(path): {
            module
            for name in imported(path)
            for module in (name, name.rpartition(".")[0])
            # Whoever imports a module of a package imports the package, and not the other way.
            if module in names and not dotted(path).startswith(f"{module}.")
        }
        - {dotted(path)}
        for path in MODULES
    }
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail(f"a circle of imports: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("room", ["surface", "nodes"])
def test_no_folder_is_a_maze(room):
    for folder in (ROOT / room, *(ROOT / room).rglob("*/")):
        modules = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
        assert len(modules) <= 10, f"{folder.name} has {len(modules)} modules"


def run(code: str) -> None:
    """Run code in an interpreter of its own."""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_everything_but_nodes_imports_with_ros_blocked():
    modules = [
        dotted(path) for path in MODULES if layer_of(path.relative_to(ROOT).parts) != "nodes"
    ]
    run(
        f"import sys\nfor name in {sorted(ROS)}:\n    sys.modules[name] = None\n"
        f"import importlib\nfor name in {modules}:\n    importlib.import_module(name)\n"
    )


def test_nodes_start_without_what_is_slow_to_import():
    pytest.importorskip("rclpy", reason="rclpy is not installed")
    # In a clone the folder of that name can be imported, too: as an empty package.
    interfaces = pytest.importorskip("limit_surface_interfaces.msg", reason=INTERFACES)
    if not hasattr(interfaces, "ErrorCode"):
        pytest.skip(INTERFACES)
    modules = [
        dotted(path) for path in MODULES if layer_of(path.relative_to(ROOT).parts) == "nodes"
    ]
    modules.remove(LEARNING_PROCESS)
    run(
        f"import importlib, sys\nfor name in {modules}:\n    importlib.import_module(name)\n"
        "slow = {'scipy', 'matplotlib', 'tqdm', 'limit_surface_ros.fitting'}\n"
        "assert not slow & set(sys.modules), slow & set(sys.modules)\n"
    )
