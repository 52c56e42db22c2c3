# SPDX-License-Identifier: Apache-2.0
"""A thousand pushes of 44 mm in one batch, against loops over single pushes.

A rectangle of 90 x 112 mm, a round tip of 4.75 mm, friction 0.25, random places and directions.
The loop moves the tip by 1 mm, finds the nearest point (`outline.nearest`), asks `push`, and moves
the body: what one writes with the library's pieces but without `simulate_pushes`. The lean loop
has its geometry in plain floats, for this one shape. Error = |dp| + rho |dtheta| of the end pose
[m] against the same push at an accuracy of 1e-8 m. Times are of the processor, medians of turns; a
loop is timed on twenty of the thousand.
"""

from __future__ import annotations

import math
import sys
import time
from statistics import median

import numpy as np

from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.push import push
from limit_surface_ros.motion.rollout import simulate_pushes
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

TIP, FRICTION, LENGTH, COUNT, LOOPED, TURNS = 0.00475, 0.25, 0.044, 1000, 20, 5
CORNERS = np.array([[-0.045, -0.056], [0.045, -0.056], [0.045, 0.056], [-0.045, 0.056]])
OUTLINE = Polygon(CORNERS)
# What is aimed at; the mean error is a twentieth of it or so.
ACCURACIES = (1e-3, 2e-4, 1e-5, 6e-6)


def surfaces() -> dict[str, LimitSurface]:
    """Return one surface of each kind, with the anisotropy that fits to real pushes have."""
    rng = np.random.default_rng(3)
    factors = rng.standard_normal((12, 3, 3))
    forms = factors @ factors.transpose(0, 2, 1) / 3.0 + 0.2 * np.eye(3)
    scaling = Scaling(0.05, 2.0)
    return {
        "ellipsoid": PowerSum.thesis(forms[:1], scaling),
        "3 norms": PowerSum.norms(forms[1:4], scaling),
        "dissipation, 8 terms": Dissipation(forms[4:], scaling),
    }


def runs() -> np.ndarray:
    """Return straight paths (COUNT, 2, 2) that begin where the tip just touches."""
    rng = np.random.default_rng(5)
    side = rng.integers(4, size=COUNT)
    along = np.roll(CORNERS, -1, axis=0) - CORNERS
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    share, angle = rng.uniform(0.05, 0.95, (COUNT, 1)), rng.uniform(-1.1, 1.1, COUNT)
    start = CORNERS[side] + share * along[side] - TIP * inward[side]
    x, y = inward[side].T
    c, s = np.cos(angle), np.sin(angle)
    heading = np.stack([c * x - s * y, s * x + c * y], axis=1)
    return np.stack([start, start + LENGTH * heading], axis=1)


def loop(surface: LimitSurface, path: np.ndarray) -> np.ndarray:
    """Push by steps of 1 mm with the library's pieces; return the end pose (3,)."""
    pose, tip = np.zeros(3), path[0].copy()
    steps = round(LENGTH / 1e-3)
    step = (path[1] - path[0]) / steps
    for _ in range(steps):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        turn = np.array([[c, s], [-s, c]])
        near = OUTLINE.nearest((turn @ (tip - pose[:2]))[np.newaxis])
        twist = push(surface, near.points[0], -near.normals[0], FRICTION, turn @ step).twist
        pose += [*(turn.T @ twist[:2]), twist[2]]
        tip += step
    return pose


def lean_loop(surface: LimitSurface, path: np.ndarray) -> np.ndarray:
    """Do the same with the geometry of this rectangle in plain floats."""
    (tx, ty), (ex, ey) = path.tolist()
    x, y, angle = 0.0, 0.0, 0.0
    steps = round(LENGTH / 1e-3)
    dx, dy = (ex - tx) / steps, (ey - ty) / steps
    (left, bottom), (right, top) = CORNERS[0].tolist(), CORNERS[2].tolist()
    for _ in range(steps):
        c, s = math.cos(angle), math.sin(angle)
        px, py = c * (tx - x) + s * (ty - y), c * (ty - y) - s * (tx - x)
        ux, uy = c * dx + s * dy, c * dy - s * dx
        qx, qy = min(max(px, left), right), min(max(py, bottom), top)
        if (qx, qy) == (px, py):
            # Within: the nearest side.
            depths = (px - left, right - px, py - bottom, top - py)
            side = depths.index(min(depths))
            qx, qy = ((left, py), (right, py), (px, bottom), (px, top))[side]
            normal = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))[side]
        else:
            normal = qx - px, qy - py
        vx, vy, omega = push(surface, (qx, qy), normal, FRICTION, (ux, uy)).twist.tolist()
        x, y, angle = x + c * vx - s * vy, y + s * vx + c * vy, angle + omega
        tx, ty = tx + dx, ty + dy
    return np.array([x, y, angle])


def thread_seconds(call: object) -> float:
    """Return the processor time of a call."""
    begin = time.thread_time()
    call()  # type: ignore[operator]
    return time.thread_time() - begin


def metric(poses: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Return |dp| + rho |dtheta| [m]."""
    away = poses - exact[: len(poses)]
    return np.hypot(*away[:, :2].T) + OUTLINE.mean_radius * np.abs(away[:, 2])


def main() -> int:
    """Print a table for each kind."""
    print(__doc__)
    paths, poses = runs(), np.zeros((COUNT, 3))
    print("### Time of a push along a path\n")
    print(
        "| surface | way | ms a push | times the loop's speed | times the lean loop's "
        "| mean error [m] | 99 % | single pushes |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, surface in surfaces().items():
        surface.prepare()
        batch = {
            f"batch, accuracy {accuracy:g}": lambda accuracy=accuracy, surface=surface: (
                simulate_pushes(surface, OUTLINE, TIP, FRICTION, poses, paths, accuracy=accuracy)
            )
            for accuracy in ACCURACIES
        }
        exact = simulate_pushes(surface, OUTLINE, TIP, FRICTION, poses, paths, accuracy=1e-8)
        ends = {
            "loop over push, 1 mm": np.array([loop(surface, path) for path in paths[:LOOPED]]),
            "lean loop, 1 mm": np.array([lean_loop(surface, path) for path in paths[:LOOPED]]),
        }
        ways = {
            "loop over push, 1 mm": lambda surface=surface: [
                loop(surface, path) for path in paths[:LOOPED]
            ],
            "lean loop, 1 mm": lambda surface=surface: [
                lean_loop(surface, path) for path in paths[:LOOPED]
            ],
            **batch,
        }
        times: dict[str, list[float]] = {way: [] for way in ways}
        for _ in range(TURNS):
            for way, call in ways.items():
                count = LOOPED if way in ends else COUNT
                times[way].append(thread_seconds(call) / count)
        slow, lean = median(times["loop over push, 1 mm"]), median(times["lean loop, 1 mm"])
        for way in ways:
            found = ends[way] if way in ends else batch[way]().end_poses
            errors = metric(found, exact.end_poses)
            calls = 44 if way in ends else batch[way]().evaluations.mean()
            each = median(times[way])
            print(
                f"| {name} | {way} | {1e3 * each:.4f} | {slow / each:.0f} | {lean / each:.0f} "
                f"| {errors.mean():.1e} | {np.quantile(errors, 0.99):.1e} | {calls:.0f} |"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
