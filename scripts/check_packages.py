# SPDX-License-Identifier: Apache-2.0
"""Check what the package descriptions promise against the format, the code and each other.

That is: both package.xml, setup.py, CMakeLists.txt, the version wherever it is stated, and the
line of the licence in each file of source.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

from catkin_pkg.package import InvalidPackage, Package, parse_package

ROOT = Path(__file__).resolve().parent.parent
NAME = "limit_surface_ros"
INTERFACES = "limit_surface_interfaces"
# Where source is, what is none there, and how a file of source begins (a script: after #!).
SOURCES = (NAME, INTERFACES, ".ci", "benchmarks", "docs", "examples", "launch", "scripts", "test")
NOT_SOURCE = {"__pycache__", "_build", "generated"}
SOURCE_SUFFIXES = {".py", ".c", ".cpp", ".js"}
LICENCE = "SPDX-License-Identifier: Apache-2.0"
# Modules whose rosdep key is not their own name.
ROSDEP_KEYS = {
    "hypothesis": "python3-hypothesis",
    "numpy": "python3-numpy",
    "pytest": "python3-pytest",
    "scipy": "python3-scipy",
    "yaml": "python3-yaml",
}
# Modules that setup.py names by another name than theirs.
DISTRIBUTIONS = {"cycler": "matplotlib", "mpl_toolkits": "matplotlib", "yaml": "pyyaml"}


def imported_modules(folder: Path) -> dict[str, Path]:
    """Return the top-level modules that the code in `folder` imports, and one file of each."""
    found: dict[str, Path] = {}
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module]
            else:
                continue
            for name in names:
                found.setdefault(name.partition(".")[0], path.relative_to(ROOT))
    helpers = [
        *(ROOT / "scripts").rglob("*.py"),
        *(ROOT / "docs").glob("*.py"),
        *(ROOT / "test").glob("*.py"),
    ]
    own = {NAME, *(path.stem for path in helpers)}
    return {
        name: path
        for name, path in found.items()
        if name not in own and name not in sys.stdlib_module_names
    }


def optional_distributions() -> set[str]:
    """Return what the extras of setup.py bring; package.xml need not know it."""
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "EXTRAS":
            return {name for names in ast.literal_eval(node.value).values() for name in names}
    raise SystemExit("setup.py: EXTRAS not found")


def undeclared(package: Package) -> list[str]:
    """Return a sentence for each import of code or tests that nothing declares."""
    optional = optional_distributions()
    running = {dependency.name for dependency in package.exec_depends}
    testing = running | {dependency.name for dependency in package.test_depends}
    return [
        f"package.xml: {path} imports {module}, but there is no {tag} on"
        f" {ROSDEP_KEYS.get(module, module)}"
        for folder, tag, declared in (
            (NAME, "exec_depend", running),
            ("test", "exec_depend or test_depend", testing),
        )
        for module, path in imported_modules(ROOT / folder).items()
        if ROSDEP_KEYS.get(module, module) not in declared
        and DISTRIBUTIONS.get(module, module) not in optional
    ]


def unlike_cmake(package: Package) -> list[str]:
    """Return a sentence for each package that CMakeLists.txt wants and package.xml does not."""
    text = (ROOT / INTERFACES / "CMakeLists.txt").read_text(encoding="utf-8")
    wanted = set(re.findall(r"find_package\((\w+)", text))
    declared = {
        dependency.name for dependency in [*package.build_depends, *package.buildtool_depends]
    }
    return [
        f"{INTERFACES}/package.xml: CMakeLists.txt finds {name}, but nothing depends on it"
        for name in sorted(wanted - declared)
    ]


def versions(packages: list[Package]) -> dict[str, str]:
    """Return every place that states the version, with what it states."""
    found = {
        str(Path(package.filename).relative_to(ROOT)): package.version for package in packages
    }
    for path, pattern in (
        ("setup.py", r'version="([^"]+)"'),
        (f"{NAME}/__init__.py", r'__version__ = "([^"]+)"'),
        ("CITATION.cff", r"(?m)^version: (.+)$"),
    ):
        match = re.search(pattern, (ROOT / path).read_text(encoding="utf-8"))
        found[path] = match[1] if match else "none"
    return found


def without_licence() -> list[str]:
    """Return a sentence for each file of source that does not begin with its licence."""
    faults = []
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*")):
            parts = path.relative_to(ROOT).parts
            if not path.is_file() or set(parts) & NOT_SOURCE:
                continue
            lines = path.read_bytes()[:400].decode("utf-8", "replace").splitlines()
            script = bool(lines) and lines[0].startswith("#!")
            source = script or path.suffix in SOURCE_SUFFIXES or path.name == "CMakeLists.txt"
            if source and (len(lines) <= script or LICENCE not in lines[script]):
                faults.append(f"{path.relative_to(ROOT)}: its first line must state {LICENCE}")
    return faults


def main() -> int:
    """Print what is wrong and return 1, or return 0."""
    packages: list[Package] = []
    faults: list[str] = []
    for folder in (ROOT, ROOT / INTERFACES):
        warnings: list[str] = []
        try:
            packages.append(parse_package(str(folder), warnings=warnings))
        except InvalidPackage as error:
            faults.append(str(error))
        faults += warnings
    if len(packages) == 2:
        stated = versions(packages)
        if len(set(stated.values())) > 1:
            faults.append(
                "versions differ: " + ", ".join(f"{path} {v}" for path, v in stated.items())
            )
        for package in packages:
            if package.package_format != 3:
                faults.append(f"{package.filename}: format 3 is wanted")
        faults += undeclared(packages[0]) + unlike_cmake(packages[1])
    faults += without_licence()
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
