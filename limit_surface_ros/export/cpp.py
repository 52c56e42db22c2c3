# SPDX-License-Identifier: Apache-2.0
"""A surface as a C++17 header: all maps and their Jacobians, without any dependency."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limit_surface_ros.export.texts import filled, identifier, nested

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.export.portable import Corner, Portable

_INVERSE = """\
// Load of maximum dissipation: the wrench on the surface with the most power, and its derivative
// by the twist [N s/m, ...] if `jacobian` is not null."""


def cpp_header(model: Portable, name: str, title: str) -> str:
    """Return the header.

    Args:
        model: The numbers of the surface.
        name: The namespace becomes `limit_surface_NAME`.
        title: The first line of the comment on top.
    """
    namespace = f"limit_surface_{identifier(name)}"
    return filled(
        "surface.hpp",
        {
            "TITLE": title,
            "NAMESPACE": namespace,
            "GUARD": f"{namespace.upper()}_HPP_",
            "DATA": _data(model),
            "INVERSE_COMMENT": _INVERSE,
        },
    )


def _data(model: Portable) -> str:
    terms = len(model.roots)
    lines = [
        "// 0: sum of norms, 1: sum of powers, 2: polynomial of degree four.",
        f"constexpr int family = {model.family};",
        "// Whether the gauge is the load factor of scaled loads; else it is the dissipation.",
        f"constexpr bool gauge_of_loads = {_bool(model.gauge_of_loads)};",
        "// Whether the surface is known to be convex.",
        f"constexpr bool convex = {_bool(model.convex)};",
        f"constexpr double characteristic_length = {model.characteristic_length!r};  // rho [m]",
        f"constexpr double friction_force = {model.friction_force!r};  // F0 [N]",
        f"constexpr Vector<double> wrench_unit{_braces(model.wrench_unit)};",
        f"constexpr Vector<double> twist_unit{_braces(model.twist_unit)};",
        f"constexpr std::size_t terms = {terms};",
        "// R_k with A_k = R_k' R_k, these forms, their traces, and the powers p_k of x'A_k x.",
        f"constexpr std::array<Matrix<double>, terms> roots{_matrices(model.roots)};",
        f"constexpr std::array<Matrix<double>, terms> forms{_matrices(model.forms)};",
        f"constexpr std::array<double, terms> sizes{_braces(model.sizes)};",
        f"constexpr std::array<double, terms> exponents{_braces(model.exponents)};",
        "// Of x^4, x^3 y, x^3 m, x^2 y^2, x^2 y m, x^2 m^2, x y^3, x y^2 m, x y m^2, x m^3, y^4,",
        "// y^3 m, y^2 m^2, y m^3, m^4.",
        f"constexpr std::array<double, 15> coefficients{_braces(model.coefficients)};",
        "// Points of gauge 1 over half the sphere.",
        f"constexpr std::array<Vector<double>, {len(model.starts)}> starts{_rows(model.starts)};",
    ]
    lines += [
        f"constexpr std::size_t corner_count = {len(model.corners)};",
        f"constexpr std::array<Corner, corner_count> corners{_corners(model.corners)};",
    ]
    return "\n".join(lines)


def _corners(corners: tuple[Corner, ...]) -> str:
    return "{{\n    " + ",\n    ".join(map(_corner, corners)) + "}}" if corners else "{}"


def _corner(corner: Corner) -> str:
    (first, second), ((a, b), (_, c)) = corner.rows, corner.curvature
    parts = [
        _braces(corner.point),
        _braces(first),
        _braces(second),
        _braces(corner.centre),
        f"{{{{{float(a)!r}, {float(b)!r}, {float(c)!r}}}}}",
        repr(corner.rest),
    ]
    return "{" + ", ".join(parts) + "}"


def _bool(value: bool) -> str:
    return "true" if value else "false"


def _braces(array: Floats) -> str:
    """Return a row as an std::array's initialiser."""
    return "{" + nested(array, "{", "}") + "}" if len(array) else "{}"


def _rows(array: Floats) -> str:
    """Return rows as the initialiser of an std::array of std::arrays."""
    return "{{\n    " + ",\n    ".join(map(_braces, array)) + "}}"


def _matrices(array: Floats) -> str:
    """Return matrices as the initialiser of an std::array of them."""
    if not len(array):
        return "{}"
    each = ["{{" + ", ".join(map(_braces, matrix)) + "}}" for matrix in array]
    return "{{\n    " + ",\n    ".join(each) + "}}"
