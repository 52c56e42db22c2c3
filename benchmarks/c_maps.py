# SPDX-License-Identifier: Apache-2.0
"""The maps as a plain loop in C (c_maps.c), compiled when a benchmark asks for it."""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.surface.gauges.quartic import Quartic
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.linalg import root_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.base import LimitSurface

SOURCE = Path(__file__).with_name("c_maps.c")
FLAGS = ["-O3", "-march=native", "-shared", "-fPIC"]


def compiler() -> list[str] | None:
    """Return the command of a C compiler: $CC, or the first of cc, gcc and clang."""
    for command in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        words = shlex.split(command)
        if words and shutil.which(words[0]):
            return words
    return None


def compiled() -> ctypes.CDLL | None:
    """Compile c_maps.c and load it; None where there is no C compiler.

    Raises:
        subprocess.CalledProcessError: The compiler refuses the source.
    """
    command = compiler()
    if command is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "c_maps.so"
        subprocess.run([*command, *FLAGS, str(SOURCE), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def map_in_c(
    library: ctypes.CDLL, surface: LimitSurface
) -> tuple[str, Callable[[Floats], Floats]]:
    """Return the name of the surface's map in closed form, and that map as a loop in C.

    Sums of powers must be norms or of the thesis's family.

    It takes contiguous rows (n, 3).
    """
    wrench_unit, twist_unit = surface.scaling.wrench_unit, surface.scaling.twist_unit
    if isinstance(surface, PowerSum):
        roots = np.array([root_of(matrix) for matrix in surface.matrices])
        powers = surface.exponents
        constants = [roots, len(powers), wrench_unit, twist_unit]
        if (powers == 0.5).all():
            return "twist_of_wrench", _loop(library.norm_sum_twists, constants)
        degree = len(powers)
        whole = np.rint(degree * powers).astype(np.intc)
        constants = [roots, whole, degree, *constants[1:]]
        return "twist_of_wrench", _loop(library.power_sum_twists, constants)
    if isinstance(surface, Polynomial):
        constants = [Quartic(surface.coefficients).second, wrench_unit, twist_unit]
        return "twist_of_wrench", _loop(library.quartic_twists, constants)
    roots = np.array([root_of(form) for form in surface.scaled_forms])
    constants = [roots, len(roots), twist_unit, wrench_unit]
    return "wrench_of_twist", _loop(library.norm_sum_wrenches, constants)


def _loop(function: Any, constants: list[Any]) -> Callable[[Floats], Floats]:
    """Return a loop in C with its constants, arrays or whole numbers, as a map of rows."""
    kept = [each if isinstance(each, int) else np.ascontiguousarray(each) for each in constants]

    def address(array: Floats) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def mapped(rows: Floats) -> Floats:
        out = np.empty_like(rows)
        given = [ctypes.c_int(each) if isinstance(each, int) else address(each) for each in kept]
        function(*given, address(rows), address(out), ctypes.c_size_t(len(rows)))
        return out

    return mapped
