# SPDX-License-Identifier: Apache-2.0
"""What a call of an exported C++ header costs, and how far its answers are from the library's."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from bench_maps import kinds

from limit_surface_ros.export.cpp import cpp_header
from limit_surface_ros.export.portable import portable

CALLS = 4000
COMPILE = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-fno-exceptions"]
PROGRAM = """
#include "model.hpp"
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>
using namespace limit_surface_model;
using Clock = std::chrono::steady_clock;
int main(int, char** argument) {
    std::vector<double> in(3 * CALLS), out(6 * CALLS);
    std::FILE* file = std::fopen(argument[1], "rb");
    if (std::fread(in.data(), sizeof(double), in.size(), file) != in.size()) return 1;
    std::fclose(file);
    const double rho = model::characteristic_length;
    int failed = 0;
    double best[4] = {1e9, 1e9, 1e9, 1e9};
    std::vector<double> slowest(CALLS, 1e9);
    for (int round = 0; round < 7; ++round) {
        for (int map = 0; map < 4; ++map) {
            const auto start = Clock::now();
            for (int i = 0; i < CALLS; ++i) {
                const double* x = &in[3 * i];
                const Vector<double> wrench{x[0], x[1], x[2] * rho}, twist{x[0], x[1], x[2] / rho};
                Vector<double> answer{};
                Matrix<double> jacobian{};
                Status status = Status::ok;
                if (map == 0) status = twist_of_wrench(wrench, answer);
                if (map == 1) status = MAP_BACK(twist, answer, nullptr);
                if (map == 2) status = twist_of_wrench(wrench, answer, &jacobian);
                if (map == 3) status = MAP_BACK(twist, answer, &jacobian);
                failed += status != Status::ok;
                if (map < 2) std::copy(answer.begin(), answer.end(), &out[6 * i + 3 * map]);
            }
            const std::chrono::duration<double> took = Clock::now() - start;
            best[map] = std::min(best[map], took.count() / CALLS);
        }
        for (int i = 0; i < CALLS; ++i) {
            const double* x = &in[3 * i];
            const Vector<double> wrench{x[0], x[1], x[2] * rho}, twist{x[0], x[1], x[2] / rho};
            Vector<double> answer{};
            const auto start = Clock::now();
            failed += twist_of_wrench(wrench, answer) != Status::ok;
            failed += MAP_BACK(twist, answer, nullptr) != Status::ok;
            const std::chrono::duration<double> took = Clock::now() - start;
            slowest[i] = std::min(slowest[i], took.count());
        }
    }
    std::printf("%d %g %g %g %g %g", failed, best[0], best[1], best[2], best[3],
                *std::max_element(slowest.begin(), slowest.end()));
    file = std::fopen(argument[2], "wb");
    std::fwrite(out.data(), sizeof(double), out.size(), file);
    return std::fclose(file);
}
"""


def measured(surface, folder: Path, compiler: str) -> tuple[list[float], np.ndarray, np.ndarray]:
    """Return failures and times [s], the vectors asked, and the answers (CALLS, 6)."""
    model = portable(surface)
    (folder / "model.hpp").write_text(cpp_header(model, "model", "A surface."), encoding="utf-8")
    offered = model.convex or not model.gauge_of_loads
    source = PROGRAM.replace("CALLS", str(CALLS))
    source = source.replace("MAP_BACK", "wrench_of_twist" if offered else "twist_of_wrench")
    (folder / "program.cpp").write_text(source, encoding="utf-8")
    program = folder / "program"
    subprocess.run([compiler, *COMPILE, "-o", program, folder / "program.cpp"], check=True)
    asked = np.random.default_rng(1).normal(size=(CALLS, 3))
    asked.tofile(folder / "in")
    done = subprocess.run(
        [program, folder / "in", folder / "out"], check=True, capture_output=True, text=True
    )
    return (
        [float(each) for each in done.stdout.split()],
        asked,
        np.fromfile(folder / "out").reshape(-1, 6),
    )


def main() -> None:
    """Compile each kind's header, call it, compare."""
    print("### Exported C++ headers, one call\n")
    compiler = shutil.which("g++")
    if compiler is None:
        print("There is no g++ here: not measured.")
        return
    print(
        f"g++ -O2, {CALLS} vectors, the best of seven rounds; errors against the library one\n"
        "by one, in scaled variables. Goals: a closed form at most 1 us, a way back at most 6,\n"
        "no failure, errors at most 1e-12 (1e-9 beside rims).\n"
    )
    print(
        "| kind | twist [us] | wrench | with Jacobian: twist | wrench | slowest pair | failed "
        "| twist error 99 %, most | wrench error |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for name, surface in kinds().items():
        with tempfile.TemporaryDirectory() as folder:
            (failed, *times, slowest), asked, answers = measured(surface, Path(folder), compiler)
        rho = surface.scaling.characteristic_length
        model = portable(surface)
        errors = []
        some = slice(0, CALLS if len(model.roots) < 50 else 400)
        pairs = (
            (answers[:, :3], asked * [1, 1, rho], surface.twist_of_wrench, model.twist_unit),
            (answers[:, 3:], asked / [1, 1, rho], surface.wrench_of_twist, model.wrench_unit),
        )
        for found, vectors, one, unit in pairs:
            if one == surface.wrench_of_twist and model.gauge_of_loads and not model.convex:
                errors.append("not exported")
                continue
            right = np.array([one(each) for each in vectors[some]]) / unit
            size = np.abs(right).max(axis=1)
            error = np.abs(found[some] / unit - right).max(axis=1) / size
            errors.append(f"{np.quantile(error, 0.99):.0e}, {error.max():.0e}")
        cells = [f"{1e6 * each:.2f}" for each in (*times, slowest)]
        print(f"| {name} | {' | '.join(cells)} | {failed:.0f} | {' | '.join(errors)} |")


if __name__ == "__main__":
    main()
