# SPDX-License-Identifier: Apache-2.0
"""Pushes along a path against the simulator MuJoCo (skipped where it is not installed).

Exact corners: a rectangle of 90 x 112 mm on four point feet is pushed by a ball of 4.75 mm radius
at 10 mm/s over 44 mm. Our side has the four feet as the exact model, so that nothing is fitted.
The quasi-static answer does not depend on the ground's friction; MuJoCo's does, as load moves
between soft feet, so that low friction is the fair check, and a higher one shows the difference.
MuJoCo runs with its default solver and contacts, elliptic cones and steps of 2 ms; its tolerance
is finer than by default, as it counts in parts of the mean inertia, which the tip's makes large.

Real runs (../shared/data/mit_pushes, skipped where absent): the first runs of some sets, on feet
at the vertices of the outline, 0.85 kg, friction with the ground by the median of the recorded
forces; ours with the dissipation model that is fitted to the set's recorded pairs.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from bench_pushes import DATA, RECIPES, columns, errors, read_table

from limit_surface_ros.fitting.few_pushes.recipe import FitContext
from limit_surface_ros.motion.outline import Polygon
from limit_surface_ros.motion.rollout import simulate_pushes
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.pairs import Pairs
from limit_surface_ros.surface.scaling import Scaling

TIP, SPEED, STEP, MASS, GRAVITY, HEIGHT = 0.00475, 0.01, 0.002, 0.85, 9.81, 0.012
CORNERS = np.array([[-0.045, -0.056], [0.045, -0.056], [0.045, 0.056], [-0.045, 0.056]])
SETS = ("abs_rect1", "abs_tri3", "plywood_hex", "plywood_tri1")
# Of ours in the comparison of times: finer than the two agree, and the default.
ACCURACIES = (2e-4, 1e-5)
EXACT_RUNS, REAL_RUNS, SETTLE = 12, 12, 0.1
# Of the tip [kg]: what pushes back changes its speed within a step by next to nothing.
HEAVY = 1e3


def scene(corners: np.ndarray, ground: float, friction: float) -> str:
    """Return an MJCF model of a prism on a ball foot at each corner, and of the tip."""
    foot = 0.001
    feet = "\n".join(
        f'<geom name="foot{place}" type="sphere" size="{foot}" '
        f'pos="{x:.9g} {y:.9g} {foot}" mass="0" contype="0" conaffinity="0"/>'
        for place, (x, y) in enumerate(corners)
    )
    pairs = "\n".join(
        f'<pair geom1="foot{place}" geom2="floor" condim="3" friction="{ground} {ground}"/>'
        for place in range(len(corners))
    )
    vertices = " ".join(
        f"{x:.9g} {y:.9g} {z}" for z in (0.001, HEIGHT) for x, y in corners.tolist()
    )
    inertia = MASS * np.square(corners).sum(axis=1).mean() / 3.0
    return f"""
<mujoco>
  <option timestep="{STEP}" cone="elliptic" gravity="0 0 -{GRAVITY}" tolerance="1e-12"/>
  <asset><mesh name="prism" vertex="{vertices}"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1" contype="0" conaffinity="0"/>
    <body name="body">
      <freejoint/>
      <inertial pos="0 0 0.002" mass="{MASS}"
        diaginertia="{inertia / 2} {inertia / 2} {inertia}"/>
      <geom name="side" type="mesh" mesh="prism" mass="0" contype="0" conaffinity="0"/>
      {feet}
    </body>
    <body name="tip" pos="0 0 {TIP}">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <geom name="ball" type="sphere" size="{TIP}" mass="{HEAVY}" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <contact>
    {pairs}
    <pair geom1="ball" geom2="side" condim="3" friction="{friction} {friction}"/>
  </contact>
</mujoco>"""


def simulate(mujoco: Any, model: Any, start: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Push once; return the end pose (3,)."""
    data = mujoco.MjData(model)
    data.qpos[:2] = start[:2]
    data.qpos[3:7] = [np.cos(start[2] / 2), 0.0, 0.0, np.sin(start[2] / 2)]
    data.qpos[7:9] = path[0]
    for _ in range(round(SETTLE / STEP)):
        # The feet settle while the tip waits.
        data.qpos[7:9], data.qvel[6:8] = path[0] - [1.0, 1.0], 0.0
        mujoco.mj_step(model, data)
    way = path[1] - path[0]
    length = float(np.hypot(*way))
    steps = round(length / SPEED / STEP)
    for step in range(steps):
        data.qpos[7:9] = path[0] + step / steps * way
        data.qvel[6:8] = SPEED * way / length
        mujoco.mj_step(model, data)
    w, _, _, z = data.qpos[3:7]
    return np.array([*data.qpos[:2], 2.0 * np.arctan2(z, w)])


def batch_seconds(surface: PointContacts, paths: np.ndarray, accuracy: float) -> float:
    """Return our processor time for one of a thousand pushes [s]."""
    many = np.tile(paths, (1 + 1000 // len(paths), 1, 1))[:1000]
    times = []
    for _ in range(5):
        begin = time.thread_time()
        simulate_pushes(
            surface, Polygon(CORNERS), TIP, 0.25, np.zeros((1000, 3)), many, accuracy=accuracy
        )
        times.append(time.thread_time() - begin)
    return float(np.median(times)) / 1000


def exact_corners(mujoco: Any, ground: float) -> None:
    """Print how far both are apart on the same four feet."""
    rng = np.random.default_rng(4)
    limit = ground * MASS * GRAVITY
    surface = PointContacts(CORNERS, np.full(4, limit / 4), Scaling(0.0718, limit))
    share, angle = rng.uniform(-0.8, 0.8, EXACT_RUNS), rng.uniform(-0.6, 0.6, EXACT_RUNS)
    starts = np.stack([np.full(EXACT_RUNS, -0.045 - TIP - 5e-4), 0.056 * share], axis=1)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    paths = np.stack([starts, starts + 0.044 * heading], axis=1)
    poses = np.zeros((EXACT_RUNS, 3))
    model = mujoco.MjModel.from_xml_string(scene(CORNERS, ground, 0.25))
    begin = time.thread_time()
    theirs = np.array(
        [simulate(mujoco, model, pose, path) for pose, path in zip(poses, paths, strict=True)]
    )
    slow = (time.thread_time() - begin) / EXACT_RUNS
    ours = simulate_pushes(surface, Polygon(CORNERS), TIP, 0.25, poses, paths).end_poses
    surface.prepare()
    quick = [batch_seconds(surface, paths, accuracy) for accuracy in ACCURACIES]
    apart = errors(ours, theirs, float(np.hypot(*CORNERS[0])))
    moved = errors(ours, poses, 0.0)
    print(
        f"| {ground:g} | {apart[:, 0].mean():.2f} | {apart[:, 1].mean():.2f} "
        f"| {apart[:, 0].max():.2f} | {apart[:, 1].max():.2f} | {moved[:, 0].mean():.1f} "
        f"| {moved[:, 1].mean():.1f} | {1e3 * slow:.0f} | {1e3 * quick[0]:.3f} "
        f"| {slow / quick[0]:.0f} | {1e3 * quick[1]:.3f} | {slow / quick[1]:.0f} |",
        flush=True,
    )


def real_runs(mujoco: Any, name: str) -> None:
    """Print the errors of both on the first runs of a set."""
    about, pairs = read_table(DATA / f"{name}_pairs.csv")
    taken = Pairs(columns(pairs, "fx_N", "fy_N", "tau_Nm"), columns(pairs, "vx", "vy", "omega"))
    force = float(np.median(np.hypot(*taken.wrenches[:, :2].T)))
    surface, _ = FitContext(taken, Scaling(about["rho_m"], force)).fit(
        RECIPES["dissipation, 8 terms"]
    )
    told, table = read_table(DATA / f"{name}_runs.csv")
    rows = slice(0, REAL_RUNS)
    starts = columns(table, "x0", "y0", "th0")[rows]
    true = columns(table, "x1", "y1", "th1")[rows]
    paths = columns(table, "tip_x0", "tip_y0", "tip_x1", "tip_y1")[rows].reshape(-1, 2, 2)
    outline = Polygon(told["outline_m_body_frame"])
    friction, rho = told["pusher_friction_of_peer"], told["rho_m"]
    ours = simulate_pushes(surface, outline, told["tip_radius_m"], friction, starts, paths)
    ground = min(force / (MASS * GRAVITY), 1.0)
    model = mujoco.MjModel.from_xml_string(scene(outline.vertices, ground, friction))
    theirs = np.array(
        [simulate(mujoco, model, pose, path) for pose, path in zip(starts, paths, strict=True)]
    )
    mine, others = (errors(ends, true, rho).mean(axis=0) for ends in (ours.end_poses, theirs))
    print(
        f"| {name} | {mine[0]:.2f} / {mine[1]:.2f} / {mine[2]:.2f} "
        f"| {others[0]:.2f} / {others[1]:.2f} / {others[2]:.2f} |",
        flush=True,
    )


def main() -> int:
    """Print both tables."""
    print(__doc__)
    if importlib.util.find_spec("mujoco") is None:
        print("skipped: MuJoCo is not installed: pip install mujoco (extra `exports`)")
        return 0
    import mujoco

    print("### The same four feet: how far MuJoCo's end poses are from ours\n")
    print(
        "| ground friction | mm | deg | worst mm | worst deg | moved mm | turned deg "
        "| MuJoCo, ms a push | ours, accuracy 0.2 mm | ratio | ours, 0.01 mm | ratio |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for ground in (0.16, 0.6):
        exact_corners(mujoco, ground)
    if not DATA.is_dir():
        print("\nreal runs skipped: the recorded pushes are not at ../shared/data/mit_pushes")
        return 0
    print(f"\n### Real runs, the first {REAL_RUNS} of a set: mm / deg / metric\n")
    print("| set | dissipation, 8 terms | MuJoCo on the outline's vertices |")
    print("|---|---|---|")
    for name in SETS:
        real_runs(mujoco, name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
