# SPDX-License-Identifier: Apache-2.0
"""Draw the pictures of the gallery: `make gallery`.

    scripts/with_ros --with extras -- python3 examples/gallery/make_gallery.py FOLDER [NAME...]

For each contact of `examples/contacts` four panels: the contact and how it is pressed, the limit
surface in load space, a section of it with what an ellipsoid makes of it, and where a tip that
passes beside the middle pushes the body. Of the gripper's pad, which nothing pushes, a second
section stands there.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.power_sum import fit_power_sum
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.motion.rollout import simulate_push
from limit_surface_ros.plots.canvas import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    VERMILION,
    new_figure,
    save_figure,
)
from limit_surface_ros.plots.surface_view import draw_solid, section_curve
from limit_surface_ros.surface.sampling import random_motions

CONTACTS = Path(__file__).resolve().parents[1] / "contacts"
# What nobody pushes.
GRIPPED = {"gripper_pad"}
MOTIONS = 800
FRICTION = 0.3
PLACES = (0.0, 0.5, 1.0)
LABELS = ("$f_x$ [N]", "$f_y$ [N]", r"$\tau_z$ [N m]")


def models_of(contact):
    """Return the models by name: exact, what `fit_surface` makes of a patch, and an ellipsoid."""
    pairs = random_motions(contact.surface, MOTIONS, 3)
    how = {"scaling": contact.surface.scaling, "search": Search(starts=6, seed=1)}
    models = {"exact": contact.surface}
    if not contact.of_points:
        models["six dissipations"] = fit_dissipation(pairs, 6, **how).surface
    models["ellipsoid"] = fit_power_sum(pairs, [1.0], **how).surface
    return models


def draw_contact(axes, contact):
    """Draw where the body stands, the darker the more rests there, and its outline [mm]."""
    points = 1e3 * (contact.surface.points + contact.reference_point)
    limits = contact.surface.friction_limits
    size = 260.0 if contact.of_points else 5.0
    axes.scatter(*points.T, s=size * limits / limits.max(), color=BLUE, linewidths=0)
    if contact.outline is not None:
        corners = 1e3 * contact.outline.drawn()
        axes.plot(*np.vstack([corners, corners[:1]]).T, color=BLACK, linewidth=1.2)
    axes.plot(*(1e3 * contact.reference_point), "+", color=VERMILION, markersize=10)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.1)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", title="contact")


def draw_sections(axes, models, components):
    """Draw one section of all models."""
    styles = {
        "exact": {"color": SKY, "linewidth": 5.0},
        "six dissipations": {"color": BLUE, "linestyle": "-"},
        "ellipsoid": {"color": VERMILION, "linestyle": "--"},
    }
    for name, surface in models.items():
        curve = section_curve(surface, components)
        axes.plot(*np.vstack([curve, curve[:1]]).T, label=name, **styles[name])
    across = LABELS[({0, 1, 2} - set(components)).pop()].split(" [")[0]
    axes.set(
        xlabel=LABELS[components[0]],
        ylabel=LABELS[components[1]],
        title=f"section {across} = 0",
    )


def draw_push(axes, models, contact):
    """Draw a body on its way, and where the ellipsoid says that it ends."""
    outline = contact.outline
    size = outline.mean_radius
    path = size * np.array([[-1.6, 0.3], [0.9, 0.45]])
    tip = 0.08 * size
    about = contact.reference_point

    def pushed(surface):
        start = [0.0, 0.0, 0.0]
        return simulate_push(surface, outline, tip, FRICTION, start, path, reference_point=about)

    truth = pushed(models["exact"])
    for place in PLACES:
        pose = truth.poses_at(np.array([place * truth.path_lengths[-1]]))[0]
        last = place == PLACES[-1]
        axes.fill(
            *placed(outline, pose).T,
            facecolor="#d9dde2" if last else "none",
            edgecolor=BLACK if last else GREY,
            linewidth=1.2,
        )
    axes.plot(*placed(outline, pushed(models["ellipsoid"]).end_pose).T, "--", color=VERMILION)
    axes.plot(*(1e3 * path.T), color=BLACK, linewidth=0.9)
    axes.plot(*(1e3 * path[-1]), "o", color=BLACK, markersize=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [mm]", ylabel="y [mm]", title="pushed along a path")


def placed(outline, pose):
    """Return an outline at a pose, closed, shape (n + 1, 2) [mm]."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    corners = outline.drawn()
    return 1e3 * (np.vstack([corners, corners[:1]]) @ [[c, s], [-s, c]] + pose[:2])


def draw(path):
    """Return the picture of a contact file: narrow, so that a phone shows its letters."""
    contact = read_contact(path)
    models = models_of(contact)
    with new_figure(5.2, 5.6) as figure:
        draw_contact(figure.add_subplot(2, 2, 1), contact)
        solid = figure.add_subplot(2, 2, 2, projection="3d")
        draw_solid(solid, models["exact"], color=SKY, zoom=0.85)
        solid.set_title("limit surface", y=1.0)
        section = figure.add_subplot(2, 2, 3)
        draw_sections(section, models, (0, 2))
        last = figure.add_subplot(2, 2, 4)
        if contact.name in GRIPPED:
            draw_sections(last, models, (1, 2))
        else:
            draw_push(last, models, contact)
        handles, labels = section.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def main(folder, names):
    """Draw all contacts, or those that are named."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(CONTACTS.glob("*.yaml")):
        if not names or path.stem in names:
            save_figure(draw(path), folder / f"{path.stem}.png", 130)
            print(f"{folder / path.stem}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "gallery"), sys.argv[2:])
