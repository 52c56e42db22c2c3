# SPDX-License-Identifier: Apache-2.0
"""A surface as a Python module: of CasADi functions, or of JAX functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limit_surface_ros.export.portable import NORMS, POWERS
from limit_surface_ros.export.texts import filled, identifier, nested

if TYPE_CHECKING:
    from limit_surface_ros.checks import Floats
    from limit_surface_ros.export.portable import Corner, Portable

# Newton's method for the scale of a sum of powers is unrolled: from its start these steps leave
# nothing.
_STEPS = 8
# Steps of Newton's method on the way back, for each smoothing.
_ROUNDS = 8

_CLOSED = {
    True: "The first three",
    False: "The last three",
}
_JAX_CONTENTS = {
    True: """\
    load_factor(wrench)          how far out a wrench lies: from 1 on the body slides
    twist_of_wrench(wrench)      direction of the motion, vx^2 + vy^2 + (rho omega)^2 = 1
    quadratic_twist(wrench)      load factor times its gradient: for an ellipsoid, L times wrench

The wrench of a twist has no closed form for this kind and is not here: `--to cpp`, `casadi` and
`js` have it, and `limit_surface_ros` itself.""",
    False: """\
    dissipation(twist)           the largest power that friction takes at a twist [W]
    wrench_of_twist(twist)       load that a motion needs
    quadratic_wrench(twist)      dissipation times that load: the inverse of quadratic_twist

The twist of a wrench has no closed form for this kind and is not here: `--to cpp`, `casadi` and
`js` have it, and `limit_surface_ros` itself.""",
}
_JAX_FUNCTIONS = {
    True: '''

def load_factor(wrench):
    """Return how far out wrenches (..., 3) lie, shape (...)."""
    return _at(wrench, WRENCH_UNIT)[0]


def twist_of_wrench(wrench):
    """Return the directions of motion (..., 3) under wrenches (..., 3)."""
    _, *n = _at(wrench, WRENCH_UNIT)
    size = jnp.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    return _stacked([each / size for each in n], TWIST_UNIT)


def quadratic_twist(wrench):
    """Return load factor times its gradient (..., 3) at wrenches (..., 3)."""
    value, *n = _at(wrench, WRENCH_UNIT)
    return _stacked([value * each / WRENCH_UNIT[0] for each in n], TWIST_UNIT)''',
    False: '''

def dissipation(twist):
    """Return the power [W] that friction takes at twists (..., 3), shape (...)."""
    return _at(twist, TWIST_UNIT)[0] * WRENCH_UNIT[0]


def wrench_of_twist(twist):
    """Return the loads (..., 3) that twists (..., 3) need."""
    _, *n = _at(twist, TWIST_UNIT)
    return _stacked(n, WRENCH_UNIT)


def quadratic_wrench(twist):
    """Return dissipation times the load (..., 3) at twists (..., 3)."""
    value, *n = _at(twist, TWIST_UNIT)
    return _stacked([value * each * WRENCH_UNIT[0] for each in n], WRENCH_UNIT)''',
}


def casadi_module(model: Portable, name: str, title: str) -> str:
    """Return the text of a module of CasADi functions; see its docstring."""
    values = _numbers(model, name, title)
    values |= {
        "MODULE": identifier(name),
        "CONVEX": repr(model.convex),
        "CLOSED": _CLOSED[model.gauge_of_loads],
        "START": nested(np.asarray(np.linalg.inv(model.mean_conjugate), dtype=np.float64)),
        "CORNERS": f"[{', '.join(_corner(each) for each in model.corners if each.rest == 0.0)}]",
        "REGULAR": nested(_regular(model)),
        "ROUNDS": repr(_ROUNDS if model.family == NORMS else 3 * _ROUNDS),
    }
    return filled("casadi_module.py.in", values)


def jax_module(model: Portable, name: str, title: str) -> str:
    """Return the text of a module of JAX functions; see its docstring."""
    values = _numbers(model, name, title)
    values |= {
        "CONTENTS": _JAX_CONTENTS[model.gauge_of_loads],
        "FUNCTIONS": _JAX_FUNCTIONS[model.gauge_of_loads],
    }
    return filled("jax_module.py.in", values)


def _corner(corner: Corner) -> str:
    """Return a corner in which the answer is exact; others are found by the steps."""
    return f"({nested(corner.point)}, {nested(corner.rows)}, {nested(corner.centre)})"


def _regular(model: Portable) -> Floats:
    """Return a vector (3,) far from every cone: of those of the starts, the farthest."""
    gradients = (
        model.start_gradients / np.linalg.norm(model.start_gradients, axis=1)[:, np.newaxis]
    )
    distance = np.full(len(gradients), np.inf)
    for corner in model.corners:
        power = gradients @ corner.point
        q = gradients @ corner.rows.T / power[:, np.newaxis] - corner.centre
        distance = np.minimum(distance, (q * q).sum(axis=1))
    return np.asarray(gradients[distance.argmax()])


def _numbers(model: Portable, name: str, title: str) -> dict[str, str]:
    lowest = model.exponents.min() if model.family == POWERS else 1.0
    return {
        "TITLE": title,
        "NAME": repr(name),
        "FAMILY": repr(model.family),
        "GAUGE_OF_LOADS": repr(model.gauge_of_loads),
        "WRENCH_UNIT": nested(model.wrench_unit),
        "TWIST_UNIT": nested(model.twist_unit),
        "ROOTS": nested(model.roots) if len(model.roots) else "[]",
        "EXPONENTS": nested(model.exponents) if len(model.exponents) else "[]",
        "COEFFICIENTS": nested(model.coefficients),
        "STEPS": repr(_STEPS if lowest >= 0.5 else 3 * _STEPS),
    }
