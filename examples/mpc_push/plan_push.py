# SPDX-License-Identifier: Apache-2.0
"""Plan pushes of a box to goal poses with CasADi, and replay each on the box itself.

    scripts/with_ros --with exports -- python3 examples/mpc_push/plan_push.py

The box lies on an even patch of 0.1 m. An ellipsoid, a sum of norms and a dissipation are fitted
to it and exported to CasADi; with each a trajectory is planned in which a pusher sticks to a face.
The path of the pusher is then given to `simulate_push` on the exact patch: how far from the goal
the box ends is what the model's error costs.
"""

from __future__ import annotations

import importlib.util
import tempfile
import warnings
from pathlib import Path

import casadi as ca
import numpy as np

from limit_surface_ros.export.targets import export_surface
from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.sampling import random_motions

SIDE, FRICTION, STEPS = 0.1, 0.4, 30
# Poses (x, y, theta) to which the box is pushed from (0, 0, 0) [m, m, rad].
GOALS = [
    (0.15, 0.0, 0.0),
    (0.15, 0.03, 0.4),
    (0.2, -0.05, -0.5),
    (0.1, 0.05, 0.8),
    (0.2, 0.1, 0.3),
]


def exported(name, surface):
    """Return the module of CasADi functions of a surface."""
    text = export_surface(SurfaceModel(name, surface), "casadi").text
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.py"
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


def plan(model, rho, goal):
    """Return the contact [m] and body poses (STEPS + 1, 3) that end at a goal, and iterations.

    The unknowns are the force at the contact where the model gives motions of loads in closed
    form, and the body's twist where it gives loads of motions: no rootfinder is needed.
    """
    problem = ca.Opti()
    height = problem.variable()
    inputs = problem.variable(2 if model.GAUGE_OF_LOADS else 3, STEPS)
    poses = problem.variable(3, STEPS + 1)
    maps = model.functions(smoothing=1e-4)
    contact = ca.vertcat(-SIDE / 2, height)
    problem.subject_to(problem.bounded(-0.45 * SIDE, height, 0.45 * SIDE))
    problem.subject_to(poses[:, 0] == 0.0)
    problem.subject_to(poses[:, STEPS] == ca.DM(goal))
    span = np.hypot(*goal[:2])
    for k in range(STEPS):
        if model.GAUGE_OF_LOADS:
            force = inputs[:, k]
            wrench = ca.vertcat(force, contact[0] * force[1] - contact[1] * force[0])
            twist = maps["quadratic_twist"](wrench)
        else:
            twist = inputs[:, k]
            wrench = maps["wrench"](twist)
            force = wrench[:2]
            # The force acts at the contact.
            problem.subject_to(wrench[2] == contact[0] * force[1] - contact[1] * force[0])
        problem.subject_to(force[0] >= 0.01 * model.WRENCH_UNIT[0])
        problem.subject_to(problem.bounded(-FRICTION * force[0], force[1], FRICTION * force[0]))
        middle = poses[2, k] + 0.5 * twist[2] / STEPS
        cosine, sine = ca.cos(middle), ca.sin(middle)
        step = ca.vertcat(
            cosine * twist[0] - sine * twist[1], sine * twist[0] + cosine * twist[1], twist[2]
        )
        problem.subject_to(poses[:, k + 1] == poses[:, k] + step / STEPS)
    problem.minimize(ca.sumsqr(inputs[:2, :]) + ca.sumsqr(inputs[-1:, :] * rho))
    first = [1.0, 0.0] if model.GAUGE_OF_LOADS else [span, 0.0, 0.1]
    problem.set_initial(inputs, np.outer(first, np.ones(STEPS)))
    problem.set_initial(poses, np.outer(goal, np.linspace(0.0, 1.0, STEPS + 1)))
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-8}
    problem.solver("ipopt", quiet)
    solution = problem.solve()
    found = np.array([-SIDE / 2, float(solution.value(height))])
    return found, np.asarray(solution.value(poses)).T, solution.stats()["iter_count"]


def replayed(body, contact, poses):
    """Return where the box really ends when the pusher takes the planned path, shape (3,)."""
    half = SIDE / 2
    outline = Polygon([[-half, -half], [half, -half], [half, half], [-half, half]])
    x, y, angle = poses.T
    path = np.array(
        [
            x + np.cos(angle) * contact[0] - np.sin(angle) * contact[1],
            y + np.sin(angle) * contact[0] + np.cos(angle) * contact[1],
        ]
    ).T
    run = simulate_push(body, outline, 0.0, FRICTION, poses[0], path)
    return run.end_pose


def main():
    """Fit, plan, replay, print."""
    body = ContactPatch.of_shape(shapes.rectangle([SIDE, SIDE], count=400)).surface(0.35, 10.0)
    scaling = body.scaling
    pairs = random_motions(body, 800, 1)
    search = Search(starts=2, seed=1)
    models = {
        "ellipsoid": fit_power_sum(pairs, exponents=[1.0], scaling=scaling, search=search).surface,
        "norms_4": fit_power_sum(
            pairs, exponents=[0.5] * 4, scaling=scaling, search=search
        ).surface,
        "dissipation_4": fit_dissipation(pairs, terms=4, scaling=scaling, search=search).surface,
    }
    print("model          goal                    iterations   end, off by")
    for name, surface in models.items():
        module = exported(name, surface)
        for goal in GOALS:
            contact, poses, iterations = plan(module, scaling.characteristic_length, goal)
            end = replayed(body, contact, poses)
            away = 1e3 * np.hypot(*(end[:2] - goal[:2]))
            turned = np.degrees(abs(end[2] - goal[2]))
            print(f"{name:14s} {goal!s:24s} {iterations:6d}     {away:5.1f} mm {turned:5.1f} deg")


if __name__ == "__main__":
    warnings.simplefilter("error", RuntimeWarning)
    main()
