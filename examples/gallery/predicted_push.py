# SPDX-License-Identifier: Apache-2.0
"""Draw the picture of the README: a push, where three models say that it ends, and where it does.

    scripts/with_ros --with extras -- python3 examples/gallery/predicted_push.py push.png

The body is an L on an even patch. Twenty-five pushes of it are simulated, with noise as in
recordings; an ellipsoid and the automatic fit learn from them. A pusher then takes a path that
none of them knew, and the exact patch says where the body really ends.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from limit_surface_ros.fitting.few_pushes.automatic import fit_automatically
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.plots.canvas import BLACK, BLUE, GREY, VERMILION, new_figure, save_figure
from limit_surface_ros.surface import Pairs
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.sampling import random_motions

# An L of 0.12 m by 0.09 m, about the middle of its bounding box [m].
CORNERS = np.array([[0, 0], [0.12, 0], [0.12, 0.03], [0.03, 0.03], [0.03, 0.09], [0, 0.09]])
CORNERS -= [0.045, 0.03]
PUSHES, NOISE = 25, np.radians(6.0)
PATH = np.array([[-0.10, -0.012], [0.05, -0.01], [0.14, 0.02]])
TIP, FRICTION = 0.006, 0.3
PLACES = (0.0, 0.35, 0.7, 1.0)


def recorded(body, seed):
    """Return pushes of a body whose motions scatter as recorded ones do."""
    pairs = random_motions(body, PUSHES, seed)
    rng = np.random.default_rng(seed)
    unit = body.scaling.twist_unit
    twists = pairs.twists / unit
    twists /= np.linalg.norm(twists, axis=1, keepdims=True)
    twists += NOISE / np.sqrt(2.0) * rng.normal(size=twists.shape)
    wrenches = pairs.wrenches * (1.0 + 0.05 * rng.normal(size=(PUSHES, 1)))
    return Pairs(wrenches, twists * unit)


def placed(outline, pose):
    """Return the corners of an outline at a pose, closed, shape (n + 1, 2) [mm]."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = np.vstack([outline, outline[:1]])
    return 1e3 * (corners @ [[c, s], [-s, c]] + pose[:2])


def main(path):
    """Fit, push, draw."""
    body = ContactPatch.of_shape(shapes.polygon(CORNERS, count=800)).surface(0.35, 10.0)
    pairs = recorded(body, 3)
    search = Search(starts=4, seed=1)
    models = {
        "ellipsoid": fit_power_sum(
            pairs, exponents=[1.0], scaling=body.scaling, search=search
        ).surface,
        "fit_surface --auto": fit_automatically(pairs, scaling=body.scaling).surface,
    }
    outline = Polygon(CORNERS)
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
        lines = {"ellipsoid": (VERMILION, "--"), "fit_surface --auto": (BLUE, "-")}
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
        axes.set_title(f"A push that no model knew, after {PUSHES} noisy pushes", loc="left")
    save_figure(figure, path, 150)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "push.png"))
