"""The maps as a plain loop in C (c_maps.c), compiled when a benchmark asks for it."""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.surface.power_sum import PowerSum

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


def twists_in_c(library: ctypes.CDLL, surface: PowerSum) -> Callable[[Floats], Floats]:
    """Return the surface's twist_of_wrench for contiguous rows (n, 3), as a loop in C."""
    roots = np.ascontiguousarray(surface._roots)
    powers = np.ascontiguousarray(surface.exponents)
    wrench_unit = np.ascontiguousarray(surface.scaling.wrench_unit)
    twist_unit = np.ascontiguousarray(surface.scaling.twist_unit)
    terms = ctypes.c_int(len(powers))

    def address(array: Floats) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def twists(rows: Floats) -> Floats:
        out = np.empty_like(rows)
        data = address(wrench_unit), address(twist_unit), address(rows), address(out)
        count = ctypes.c_size_t(len(rows))
        if (powers == 0.5).all():
            library.norm_sum_twists(address(roots), terms, *data, count)
        else:
            library.power_sum_twists(address(roots), address(powers), terms, *data, count)
        return out

    return twists
