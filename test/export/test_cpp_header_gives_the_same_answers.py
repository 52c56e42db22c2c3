# SPDX-License-Identifier: Apache-2.0
"""The promise of `--to cpp`: the library's answers to rounding, without allocation or warning."""

import shutil
import subprocess

import numpy as np
import pytest

from export_models import MODELS, SCALING, scaled_error, vectors
from limit_surface_ros.export.cpp import cpp_header
from limit_surface_ros.export.portable import portable
from limit_surface_ros.surface import PowerSum

COMPILER = shutil.which("g++")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no g++ on this machine")
FLAGS = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-fno-exceptions"]
COUNT = 1500
COLUMNS = 32
PROGRAM = """
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>
static long allocations = 0;
void* operator new(std::size_t size) { ++allocations; return std::malloc(size); }
void operator delete(void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
int main(int count, char** argument) {
    std::FILE* file = std::fopen(argument[1], "rb");
    double size = 0.0;
    if (std::fread(&size, sizeof size, 1, file) != 1 || count != 4) return 1;
    const int rows = static_cast<int>(size), which = std::atoi(argument[3]);
    std::vector<double> in(rows * 3), out(rows * COLUMNS);
    if (std::fread(in.data(), sizeof(double), in.size(), file) != in.size()) return 1;
    std::fclose(file);
    const long before = allocations;
    switch (which) { CASES }
    if (allocations != before) return 2;
    file = std::fopen(argument[2], "wb");
    std::fwrite(out.data(), sizeof(double), out.size(), file);
    return std::fclose(file);
}
"""
CASE = """
    case INDEX: {
        using namespace limit_surface_NAME;
        for (int i = 0; i < rows; ++i) {
            const double* x = &in[3 * i];
            double* row = &out[COLUMNS * i];
            const double rho = model::characteristic_length;
            const Vector<double> wrench{x[0], x[1], x[2] * rho}, twist{x[0], x[1], x[2] / rho};
            Vector<double> answer{};
            Matrix<double> jacobian{};
            double factor = 0.0;
            row[0] = static_cast<double>(load_factor(wrench, factor));
            row[1] = factor;
            row[2] = static_cast<double>(twist_of_wrench(wrench, answer, &jacobian));
            for (int k = 0; k < 3; ++k) row[3 + k] = answer[k];
            for (int k = 0; k < 9; ++k) row[6 + k] = jacobian[k / 3][k % 3];
            row[15] = static_cast<double>(wrench_of_twist(twist, answer, &jacobian));
            for (int k = 0; k < 3; ++k) row[16 + k] = answer[k];
            for (int k = 0; k < 9; ++k) row[19 + k] = jacobian[k / 3][k % 3];
            row[28] = static_cast<double>(load_factor_gradient(wrench, answer));
            for (int k = 0; k < 3; ++k) row[29 + k] = answer[k];
        }
        break;
    }
"""


def compiled(folder, source):
    """Compile a program without a warning and return its path."""
    (folder / "program.cpp").write_text(source, encoding="utf-8")
    subprocess.run(
        [COMPILER, *FLAGS, "-o", folder / "program", folder / "program.cpp"], check=True
    )
    return folder / "program"


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Return what asks the headers of all surfaces, compiled once, by name and vectors (m, 3)."""
    folder = tmp_path_factory.mktemp("headers")
    source, cases = "", ""
    for index, (name, surface) in enumerate(MODELS.items()):
        header = cpp_header(portable(surface), name, "A surface.")
        (folder / f"{name}.hpp").write_text(header, encoding="utf-8")
        source += f'#include "{name}.hpp"\n'
        cases += CASE.replace("INDEX", str(index)).replace("NAME", name)
    source += PROGRAM.replace("CASES", cases)
    program = compiled(folder, source.replace("COLUMNS", str(COLUMNS)))

    def ask(name, asked):
        np.concatenate([[len(asked)], asked.ravel()]).tofile(folder / "in")
        which = str(list(MODELS).index(name))
        subprocess.run([program, folder / "in", folder / "out", which], check=True)
        return np.fromfile(folder / "out").reshape(len(asked), COLUMNS)

    return ask


@pytest.mark.parametrize("name", MODELS)
def test_maps_and_jacobians_are_those_of_the_library_one_by_one(name, answers):
    surface = MODELS[name]
    rho = SCALING.characteristic_length
    wrench_unit, twist_unit = SCALING.wrench_unit, SCALING.twist_unit
    # The library is slow where a facet is only nearly there: it solves in ever smaller steps.
    count = COUNT // 10 if "nearly" in name else COUNT
    asked = vectors(name, count)
    found = answers(name, asked)
    assert not found[:, [0, 2, 15, 28]].any(), "each map has an answer to each vector"
    wrenches, twists = asked * [1.0, 1.0, rho], asked / [1.0, 1.0, rho]
    factors = np.array([surface.load_factor(each) for each in wrenches])
    assert np.abs(found[:, 1] / factors - 1.0).max() < 1e-12
    twist_error = scaled_error(
        found[:, 3:6], np.array([surface.twist_of_wrench(each) for each in wrenches]), twist_unit
    )
    wrench_error = scaled_error(
        found[:, 16:19], np.array([surface.wrench_of_twist(each) for each in twists]), wrench_unit
    )
    for error in (twist_error, wrench_error):
        # Beside the rim of a facet the answer itself turns as fast as rounding lets it; where one
        # is all but there that is so within it, too.
        assert np.quantile(error, 0.75 if "nearly" in name else 0.99) < 1e-12
        assert error.max() < 1e-9
    # Jacobians by identities: they take the vector itself to zero, and are those of differences.
    some = slice(0, count - 2)
    unit = np.multiply.outer(twist_unit, 1.0 / wrench_unit)
    by_wrench = found[some, 6:15].reshape(-1, 3, 3) / unit
    loads = wrenches[some] / wrench_unit
    sizes = np.abs(by_wrench).max(axis=(1, 2)) * np.linalg.norm(loads, axis=1) + 1e-30
    kept = np.abs(np.einsum("mij,mj->mi", by_wrench, loads)).max(axis=1) / sizes
    assert np.quantile(kept, 0.99) < (1e-8 if "nearly" in name else 1e-10)
    by_twist = found[some, 19:28].reshape(-1, 3, 3) * unit
    assert np.abs(by_twist - np.swapaxes(by_twist, 1, 2)).max() < 1e-9 * np.abs(by_twist).max()
    gradient = found[:, 29:32]
    euler = (gradient * wrenches).sum(axis=1) / found[:, 1] - 1.0
    assert np.abs(euler).max() < 1e-12


@pytest.mark.parametrize(
    "name", ["ellipsoid", "thesis_3_convex", "norms_4", "dissipation_4", "polynomial"]
)
def test_jacobians_are_what_differences_of_the_library_tend_to(name, answers):
    surface = MODELS[name]
    rho = SCALING.characteristic_length
    wrench_unit, twist_unit = SCALING.wrench_unit, SCALING.twist_unit
    asked = vectors(name, 40)[:-2]
    found = answers(name, asked)
    step = 1e-6
    for row, vector in zip(found, asked, strict=True):
        for start, stop, unit_in, unit_out, one in (
            (6, 15, wrench_unit, twist_unit, surface.twist_of_wrench),
            (19, 28, twist_unit, wrench_unit, surface.wrench_of_twist),
        ):
            at = vector * ([1.0, 1.0, rho] if unit_in is wrench_unit else [1.0, 1.0, 1.0 / rho])
            right = np.empty((3, 3))
            for axis in range(3):
                move = np.zeros(3)
                move[axis] = step * unit_in[axis] * np.linalg.norm(at / unit_in)
                right[:, axis] = (one(at + move) - one(at - move)) / (2.0 * move[axis])
            scale = np.multiply.outer(unit_out, 1.0 / unit_in)
            error = np.abs((row[start:stop].reshape(3, 3) - right) / scale).max()
            assert error < 1e-7 * np.abs(right / scale).max()


def test_points_at_rest_answer_with_their_facet(answers):
    # Loads of a rotation about the first support point, up to what that point can take.
    surface = MODELS["triangle"]
    x, y = surface.points[0]
    rotation = np.array([y, -x, 1.0])
    rest = surface.wrench_of_twist(rotation)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)[:, np.newaxis]
    radius = 0.5 * np.sqrt(np.linspace(0.0, 0.99, 200))[:, np.newaxis]
    forces = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    loads = rest + np.column_stack([forces, x * forces[:, 1] - y * forces[:, 0]])
    asked = loads / [1.0, 1.0, SCALING.characteristic_length]
    found = answers("triangle", asked)
    unit = rotation / np.linalg.norm(rotation / SCALING.twist_unit)
    assert np.abs((found[:, 3:6] - unit) / SCALING.twist_unit).max() < 1e-12
    assert np.abs(found[:, 1] - 1.0).max() < 1e-12
    assert np.abs(found[:, 6:15]).max() == 0.0


def test_what_is_no_vector_is_told_by_a_status(tmp_path):
    header = cpp_header(portable(MODELS["dissipation_4"]), "model", "A surface.")
    (tmp_path / "model.hpp").write_text(header, encoding="utf-8")
    program = compiled(
        tmp_path,
        """
#include "model.hpp"
using namespace limit_surface_model;
int main() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Vector<double> answer{7.0, 7.0, 7.0};
    double factor = 7.0;
    if (twist_of_wrench(Vector<double>{0.0, 0.0, 0.0}, answer) != Status::zero_vector) return 1;
    if (wrench_of_twist(Vector<double>{0.0, nan, 0.0}, answer) != Status::not_finite) return 2;
    if (answer[0] != 7.0) return 3;
    const Vector<double> zero{};
    if (load_factor(zero, factor) != Status::ok || factor != 0.0) return 4;
    Vector<float> single{1.0f, 0.0f, 0.0f};
    if (twist_of_wrench(single, single) != Status::ok) return 5;
    static_assert(noexcept(load_factor(answer, factor)), "no map throws");
    return 0;
}
""",
    )
    assert subprocess.run([program], check=False).returncode == 0


def test_the_load_of_a_twist_of_a_dented_surface_does_not_compile(tmp_path):
    rows = np.array([np.diag([1.0, 1.0, 1.0]), np.diag([40.0, 0.01, 0.01])])
    surface = PowerSum(rows, [1.0, 0.25], SCALING)
    model = portable(surface)
    assert not model.convex
    (tmp_path / "model.hpp").write_text(cpp_header(model, "model", "A surface."))
    source = '#include "model.hpp"\nusing namespace limit_surface_model;\nint main() {{ {} }}'
    compiled(
        tmp_path,
        source.format(
            "Vector<double> t; return int(twist_of_wrench(Vector<double>{1, 1, 1}, t));"
        ),
    )
    (tmp_path / "program.cpp").write_text(
        source.format("Vector<double> x{{1, 1, 1}}, y; return int(wrench_of_twist(x, y));")
    )
    refused = subprocess.run(
        [COMPILER, *FLAGS, "-o", tmp_path / "program", tmp_path / "program.cpp"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert refused.returncode != 0
    assert "not certified convex" in refused.stderr


def test_a_dual_number_carries_derivatives_through_every_map(tmp_path):
    header = cpp_header(portable(MODELS["thesis_3_convex"]), "model", "A surface.")
    (tmp_path / "model.hpp").write_text(header, encoding="utf-8")
    program = compiled(
        tmp_path,
        """
#include "model.hpp"
#include <cstdio>
namespace ad {
struct Dual {
    double v{}, d{};
    Dual() = default;
    Dual(double x) : v(x) {}
    Dual(double x, double y) : v(x), d(y) {}
};
inline double value_of(const Dual& x) { return x.v; }
inline Dual operator+(Dual a, Dual b) { return {a.v + b.v, a.d + b.d}; }
inline Dual operator-(Dual a, Dual b) { return {a.v - b.v, a.d - b.d}; }
inline Dual operator-(Dual a) { return {-a.v, -a.d}; }
inline Dual operator*(Dual a, Dual b) { return {a.v * b.v, a.v * b.d + a.d * b.v}; }
inline Dual operator/(Dual a, Dual b) { return {a.v / b.v, (a.d - a.v / b.v * b.d) / b.v}; }
inline Dual& operator+=(Dual& a, Dual b) { a = a + b; return a; }
inline Dual sqrt(Dual a) { const double r = std::sqrt(a.v); return {r, 0.5 * a.d / r}; }
inline Dual exp(Dual a) { const double r = std::exp(a.v); return {r, r * a.d}; }
inline Dual log(Dual a) { return {std::log(a.v), a.d / a.v}; }
}
using namespace limit_surface_model;
template <class Map>
double worst(Map map, Vector<double> at) {
    double error = 0.0;
    Vector<double> plain{};
    Matrix<double> jacobian{};
    map(at, plain, &jacobian);
    for (int axis = 0; axis < 3; ++axis) {
        Vector<ad::Dual> x{at[0], at[1], at[2]}, y{};
        x[axis].d = 1.0;
        map(x, y, static_cast<Matrix<ad::Dual>*>(nullptr));
        for (int i = 0; i < 3; ++i) {
            double size = 0.0;
            for (double each : jacobian[i]) size = std::fmax(size, std::fabs(each));
            error = std::fmax(error, std::fabs(y[i].d - jacobian[i][axis]) / size);
            error = std::fmax(error, std::fabs(y[i].v - plain[i]));
        }
    }
    return error;
}
int main() {
    const auto forth_map = [](auto& x, auto& y, auto* j) { twist_of_wrench(x, y, j); };
    const auto back_map = [](auto& x, auto& y, auto* j) { wrench_of_twist(x, y, j); };
    const double there = worst(forth_map, {1.0, -0.4, 0.03});
    const double back = worst(back_map, {0.3, 1.0, -9.0});
    std::printf("%g %g", there, back);
    return there < 1e-11 && back < 1e-10 ? 0 : 1;
}
""",
    )
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
