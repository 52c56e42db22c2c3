# SPDX-License-Identifier: Apache-2.0
"""Draw the picture of the README: a push, where three models say that it ends, and where it does.

    scripts/with_ros --with extras -- python3 examples/gallery/predicted_push.py push.png

The body is an L on an even patch. An ellipsoid and six dissipations, what `fit_surface` makes of a
patch, are fitted to it. A pusher takes a path, and the exact patch says where the body ends. The
program also prints how far both are off in the mean of sixty random pushes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push, simulate_pushes
from limit_surface_ros.plots.canvas import BLACK, BLUE, GREY, VERMILION, new_figure, save_figure
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.sampling import random_motions

# An L of 0.12 m by 0.09 m, about the middle of its bounding box [m].
CORNERS = np.array([[0, 0], [0.12, 0], [0.12, 0.03], [0.03, 0.03], [0.03, 0.09], [0, 0.09]])
CORNERS -= [0.045, 0.03]
MOTIONS = 1000
PATH = np.array([[-0.10, -0.012], [0.05, -0.01], [0.14, 0.02]])
TIP, FRICTION = 0.006, 0.3
PLACES = (0.0, 0.35, 0.7, 1.0)


def placed(outline, pose):
    """Return the corners of an outline at a pose, closed, shape (n + 1, 2) [mm]."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = np.vstack([outline, outline[:1]])
    return 1e3 * (corners @ [[c, s], [-s, c]] + pose[:2])


def mean_errors(body, models, outline):
    """Print how far models are off over random pushes of 0.2 m past the body's middle."""
    rng = np.random.default_rng(0)
    angles = rng.uniform(0.0, 2.0 * np.pi, 60)
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    begin, end = rng.uniform(-0.04, 0.04, (2, 60, 1))
    paths = np.stack([-0.12 * along + begin * across, 0.08 * along + end * across], axis=1)
    poses = np.zeros((60, 3))
    truth = simulate_pushes(body, outline, TIP, FRICTION, poses, paths).end_poses
    touched = truth.any(axis=1)
    for name, surface in models.items():
        off = simulate_pushes(surface, outline, TIP, FRICTION, poses, paths).end_poses - truth
        away = 1e3 * np.hypot(*off[touched, :2].T).mean()
        turned = np.degrees(np.abs(off[touched, 2])).mean()
        print(f"{name}: {away:.2f} mm, {turned:.2f} deg off in {touched.sum()} random pushes")


def main(path):
    """Fit, push, draw."""
    body = ContactPatch.of_shape(shapes.polygon(CORNERS, count=800)).surface(0.35, 10.0)
    pairs = random_motions(body, MOTIONS, 3)
    search = Search(starts=4, seed=1)
    models = {
        "ellipsoid": fit_power_sum(pairs, [1.0], scaling=body.scaling, search=search).surface,
        "six dissipations": fit_dissipation(pairs, 6, scaling=body.scaling, search=search).surface,
    }
    outline = Polygon(CORNERS)
    mean_errors(body, models, outline)
    start = [0.0, 0.0, 0.0]
    truth = simulate_push(body, outline, TIP, FRICTION, start, PATH)
    lengths = np.array(PLACES) * truth.path_lengths[-1]
    with new_figure(7.4, 4.4) as figure:
        axes = figure.add_subplot()
        for place, pose in zip(PLACES, truth.poses_at(lengths), strict=True):
            last = place == PLACES[-1]
            axes.fill(
                *placed(CORNERS, pose).T,
                facecolor="#d9dde2" if last else "none",
                edgecolor=BLACK if last else GREY,
                linewidth=1.6 if last else 0.9,
                label="where it ends" if last else None,
            )
        lines = {"ellipsoid": (VERMILION, "--"), "six dissipations": (BLUE, "-")}
        for name, surface in models.items():
            run = simulate_push(surface, outline, TIP, FRICTION, start, PATH)
            away = 1e3 * np.hypot(*(run.end_pose - truth.end_pose)[:2])
            turned = np.degrees(abs(run.end_pose - truth.end_pose)[2])
            label = f"{name}: {away:.1f} mm, {turned:.1f} deg off"
            print(label)
            color, style = lines[name]
            axes.plot(*placed(CORNERS, run.end_pose).T, style, color=color, label=label)
        axes.plot(*(1e3 * PATH.T), color=BLACK, linewidth=0.9)
        for tip in (PATH[0], PATH[-1]):
            angle = np.linspace(0.0, 2.0 * np.pi, 60)
            circle = 1e3 * (tip + TIP * np.array([np.cos(angle), np.sin(angle)]).T)
            axes.fill(*circle.T, facecolor="white", edgecolor=BLACK, linewidth=0.9)
        axes.set_aspect("equal")
        axes.set_xlabel("x [mm]")
        axes.set_ylabel("y [mm]")
        axes.legend(loc="upper left", frameon=False)
        axes.set_title("A push, and where two models of the contact say that it ends", loc="left")
    save_figure(figure, path, 150)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "push.png"))
