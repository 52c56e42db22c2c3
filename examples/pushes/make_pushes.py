# SPDX-License-Identifier: Apache-2.0
"""Make `l_shape.csv`: pushes of the L of `examples/contacts`, as a robot would record them.

    scripts/with_ros -- python3 examples/pushes/make_pushes.py examples/pushes/l_shape.csv

The robot pushes at a random place of the side, up to 35 deg beside its normal, with a finger of
friction 0.3. Loads and motions are about the centroid, where the model's moments are. Loads carry
3 % of noise, motions 6 %, which is what a force sensor and a camera leave in a mean over a push.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from limit_surface_ros.files.atomic_write import write_atomically
from limit_surface_ros.files.contact_file import read_contact
from limit_surface_ros.motion.push import push

CONTACT = Path(__file__).resolve().parents[1] / "contacts" / "l_shape.yaml"
PUSHES, SEED = 60, 4
FRICTION, SIDEWAYS = 0.3, np.radians(35.0)
LOAD_NOISE, MOTION_NOISE = 0.03, 0.06


def places_on(corners, count, rng):
    """Return random points of a polygon's sides and the normals into it; corners go left round."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    chosen = rng.choice(len(corners), count, p=lengths / lengths.sum())
    points = corners[chosen] + rng.uniform(0.05, 0.95, (count, 1)) * sides[chosen]
    along = sides[chosen] / lengths[chosen, None]
    return points, np.column_stack([-along[:, 1], along[:, 0]])


def main(path):
    """Push, add noise, write."""
    contact = read_contact(CONTACT)
    rng = np.random.default_rng(SEED)
    rho = contact.surface.scaling.characteristic_length
    rows = []
    corners = contact.outline.drawn()
    points, normals = places_on(corners, PUSHES, rng)
    for point, normal in zip(points - contact.reference_point, normals, strict=True):
        angle = rng.uniform(-SIDEWAYS, SIDEWAYS)
        c, s = np.cos(angle), np.sin(angle)
        velocity = 0.02 * np.array([[c, -s], [s, c]]) @ normal
        found = push(contact.surface, point, normal, FRICTION, velocity)
        unit = np.array([1.0, 1.0, rho])
        load = found.wrench / unit
        motion = found.twist * unit
        load = load + LOAD_NOISE * np.linalg.norm(load) * rng.normal(size=3)
        motion = motion + MOTION_NOISE * np.linalg.norm(motion) * rng.normal(size=3)
        rows.append([*(load * unit), *(motion / unit)])
    about = {"rho_m": round(rho, 5), "normal_force_N": contact.normal_force}
    lines = [f"# {json.dumps(about)}", "fx_N,fy_N,tau_Nm,vx,vy,omega"]
    lines += [",".join(f"{number:.5f}" for number in row) for row in rows]
    write_atomically(path, "\n".join(lines) + "\n")
    print(f"{len(rows)} pushes into {path}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "l_shape.csv"))
