# SPDX-License-Identifier: Apache-2.0
"""Slides with mass, slip, and the normal force that holds: accuracy against goals, and time.

Times are those of the processor. Exact means the same program at a tolerance of 1e-12.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
from interleaved import interleaved

from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.errors import SolverError
from limit_surface_ros.fitting.dissipation import fit_dissipation
from limit_surface_ros.fitting.search import Search
from limit_surface_ros.motion.sliding.batch import slides
from limit_surface_ros.motion.sliding.body import SlidingBody
from limit_surface_ros.motion.sliding.inertia import Inertia
from limit_surface_ros.motion.sliding.load import Load
from limit_surface_ros.motion.sliding.slide import slide, slide_stages
from limit_surface_ros.motion.slip import predict_slip, required_share
from limit_surface_ros.motion.stages import finish
from limit_surface_ros.surface.base import LimitSurface
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.sampling import random_motions
from limit_surface_ros.surface.scaling import Scaling

CORNERS = np.array([[-0.04, -0.04], [-0.04, 0.08], [0.08, -0.04]])
RHO, FRICTION = 0.05, 1.5
MASS = 3.0 / 9.81
AT_REST = (0.0, 0.0, 0.0)
FADING = ExponentialSum([-1.0], [1.0])
LOADS = {
    "e^-t": FADING,
    "two exponentials": ExponentialSum([-0.5, -4.0], [0.5, 0.5]),
    "oscillating": ExponentialSum([-0.7, -0.5 + 6.0j], [0.4, 0.6]),
}


def table(title: str, headings: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a Markdown table."""
    print(f"### {title}\n")
    for row in (headings, ["---"] * len(headings), *rows):
        print(f"| {' | '.join(str(cell) for cell in row)} |")
    print(flush=True)


def timed(call: Callable[[], object]) -> tuple[float, object]:
    """Return the processor time of a call [ms] and what it returns."""
    begin = time.process_time()
    result = call()
    return 1e3 * (time.process_time() - begin), result


def fits() -> dict[str, Dissipation]:
    """Return dissipations of 4 and 6 terms of a triangular patch."""
    patch = ContactPatch.of_shape(shapes.polygon(CORNERS))
    surface = patch.surface(friction_coefficient=0.5, normal_force=FRICTION / 0.5)
    pairs = random_motions(surface, 600, 0)
    found = {}
    for terms in (4, 6):
        fit = fit_dissipation(
            pairs, terms, scaling=Scaling(RHO, FRICTION), search=Search(starts=3, seed=0)
        )
        found[f"dissipation, {terms} terms"] = fit.surface
    return found


def random_inertia(rng: np.random.Generator, off_centre: float = 0.03) -> Inertia:
    """Return an inertia of J / (m rho^2) from 0.1 to 5."""
    ratio = np.exp(rng.uniform(np.log(0.1), np.log(5.0)))
    return Inertia(MASS, MASS * RHO**2 * ratio, rng.uniform(-off_centre, off_centre, 2))


def random_twist(rng: np.random.Generator) -> np.ndarray:
    """Return a twist of up to 1.4 m/s and 20 rad/s."""
    angle, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 1.4)
    return np.array([speed * np.cos(angle), speed * np.sin(angle), rng.uniform(-20.0, 20.0)])


def free_slides(surfaces: dict[str, LimitSurface], count: int) -> None:
    """One call a slide: time, and errors against a tolerance of 1e-12."""
    rows = []
    for name, surface in surfaces.items():
        rng = np.random.default_rng(1)
        times, errors = [], []
        for _ in range(count):
            inertia, twist = random_inertia(rng), random_twist(rng)
            spent, found = timed(lambda: slide(surface, inertia, twist))  # noqa: B023
            exact = slide(surface, inertia, twist, tolerance=1e-12)
            times.append(spent)
            away = np.abs(found.pose - exact.pose)
            errors.append(
                [abs(found.time / exact.time - 1.0), away[:2].max(), found.energy_residual]
            )
        median, high = np.quantile(times, [0.5, 0.95])
        worst = np.max(errors, axis=0)
        rows.append((name, f"{median:.2f}", f"{high:.2f}", *(f"{each:.0e}" for each in worst)))
    table(
        f"{count} free slides; goals: 5 ms median, 10 ms for 95 %, T and place within 1e-6",
        ("surface", "median [ms]", "95 % [ms]", "worst T", "worst place [m]", "worst energy"),
        rows,
    )


def bodies_on_points(count: int) -> None:
    """Bodies on 3 to 5 support points, half of them with a dominant one."""
    rng = np.random.default_rng(2)
    times, errors, unsolved, turning = [], [], 0, 0
    for _ in range(count):
        points = rng.uniform(-0.06, 0.06, (int(rng.integers(3, 6)), 2))
        limits = rng.uniform(0.1, 1.0, len(points))
        if rng.random() < 0.5:
            limits[0] = rng.uniform(1.0, 4.0) * limits.sum()
        surface = PointContacts(points, FRICTION * limits / limits.sum(), Scaling(RHO, FRICTION))
        inertia, twist = random_inertia(rng, 0.02), random_twist(rng)
        try:
            spent, found = timed(lambda: slide(surface, inertia, twist))  # noqa: B023
            exact = slide(surface, inertia, twist, tolerance=1e-11)
        except SolverError:
            unsolved += 1
            continue
        times.append(spent)
        errors.append(abs(found.time / exact.time - 1.0))
        vx, vy, turn = found.final_direction
        moves = np.hypot(vx - turn * points[:, 1], vy + turn * points[:, 0])
        turning += moves.min() < 1e-9 * moves.max()
    median, high = np.quantile(times, [0.5, 0.95])
    table(
        f"{count} bodies on support points; goals: none unsolved, 10 ms median",
        ("unsolved", "end turning about a point", "median [ms]", "95 % [ms]", "worst T at 1e-11"),
        [(unsolved, turning, f"{median:.1f}", f"{high:.1f}", f"{max(errors):.0e}")],
    )


def loaded_slides(surface: LimitSurface, count: int) -> None:
    """Loads from rest that die away, turning with the body and fixed in the world."""
    rows = []
    for name, x in LOADS.items():
        for in_world in (False, True):
            rng = np.random.default_rng(3)
            times, errors = [], []
            for _ in range(count):
                body = SlidingBody(surface, random_inertia(rng, 0.02))
                wrench = rng.normal(size=3) * [1.0, 1.0, RHO]
                wrench *= rng.uniform(1.1, 6.0) / surface.load_factor(wrench)
                load = Load(wrench, x, in_world)
                spent, found = timed(lambda: finish(slide_stages(body, AT_REST, load)))  # noqa: B023
                exact = finish(slide_stages(body, AT_REST, load, tolerance=1e-11))
                times.append(spent)
                errors.append(abs(found.time / exact.time - 1.0))
            rows.append(
                (
                    name,
                    "world" if in_world else "body",
                    f"{np.median(times):.1f}",
                    f"{max(times):.0f}",
                    f"{max(errors):.0e}",
                )
            )
    table(
        f"{count} loads from rest, 1.1 to 6 times friction; goals: 15 ms median, 100 ms worst",
        ("load", "fixed in the", "median [ms]", "worst [ms]", "worst T at 1e-11"),
        rows,
    )


def batches(surfaces: dict[str, LimitSurface]) -> None:
    """A thousand slides in one call against one by one, and an ensemble of surfaces."""
    rows = []
    inertia = Inertia(MASS, MASS * RHO**2, (0.01, -0.02))
    for name, surface in surfaces.items():
        rng = np.random.default_rng(4)
        twists = np.array([random_twist(rng) for _ in range(1000)])
        few = twists[:50]
        body = SlidingBody(surface, inertia)
        ways = {
            "batch": lambda: slides(surface, inertia, twists),  # noqa: B023
            "alone": lambda: [finish(slide_stages(body, twist)) for twist in few],  # noqa: B023
        }
        spent = interleaved(ways, rounds=5)
        together = slides(surface, inertia, twists)
        worst = max(
            abs(finish(slide_stages(body, twist)).time / stop - 1.0)
            for twist, stop in zip(few, together.times[:50], strict=True)
        )
        ratio = spent["alone"] / len(few) / (spent["batch"] / len(twists))
        rows.append((name, f"{1e3 * spent['batch']:.0f}", f"{ratio:.0f}", f"{worst:.0e}"))
    table(
        "1000 slides in one call; goal: 15 times one by one",
        ("surface", "batch [ms]", "times one by one", "worst T between them"),
        rows,
    )
    rng = np.random.default_rng(5)
    first = surfaces["dissipation, 4 terms"]
    roots = np.array([np.linalg.cholesky(form).T for form in first.matrices])
    members = []
    for _ in range(200):
        changed = roots * (1.0 + 0.05 * rng.normal(size=roots.shape))
        members.append(Dissipation(np.swapaxes(changed, 1, 2) @ changed, first.scaling))
    twist = np.tile([0.8, 0.2, 12.0], (200, 1))
    spent, found = timed(lambda: slides(members, inertia, twist))
    table(
        "An ensemble of 200 surfaces; goal: 100 ms",
        ("time [ms]", "of it making the bodies [ms]", "sd of T"),
        [
            (
                f"{spent:.0f}",
                f"{timed(lambda: [SlidingBody(each, inertia) for each in members])[0]:.0f}",
                f"{found.times.std() / found.times.mean():.2%}",
            )
        ],
    )


def slips(surface: LimitSurface) -> None:
    """What a load asks of the normal force, and when a grasp slips."""
    kinds = {
        "ellipsoid": PowerSum([np.eye(3)], [1.0], Scaling(0.003, 8.0)),
        "4 norms": PowerSum.norms(
            [np.diag([1.0, 1.0, 1.0 / (k + 1)]) / 16.0 for k in range(4)], Scaling(0.003, 8.0)
        ),
        "dissipation, 4 terms": surface,
    }
    pad = ExponentialSum([0.0, -1.0, -5.0], [0.5, 0.3, 0.2])
    rows = []
    for name, each in kinds.items():
        wrench = np.array([0.6, 0.3, 0.4]) * each.scaling.wrench_unit
        wrench *= 0.8 / each.load_factor(wrench)
        spent = interleaved(
            {
                "rigid": lambda: required_share(each, wrench),  # noqa: B023
                "soft": lambda: required_share(each, wrench, 1.0 / 3.0),  # noqa: B023
                "slip": lambda: predict_slip(each, pad, wrench, 1.0 / 3.0),  # noqa: B023
            }
        )
        rows.append((name, *(f"{1e3 * spent[way]:.3f}" for way in ("rigid", "soft", "slip"))))
    table(
        "The normal force that a load asks for; goal: 0.1 ms for kinds in closed form",
        ("contact", "rigid [ms]", "gamma 1/3 [ms]", "time of slip [ms]"),
        rows,
    )


def imports() -> None:
    """Say whether a free slide loads scipy."""
    code = (
        "import sys, numpy as np\n"
        "from limit_surface_ros.motion.sliding.inertia import Inertia\n"
        "from limit_surface_ros.motion.sliding.slide import slide\n"
        "from limit_surface_ros.surface.kinds.dissipation import Dissipation\n"
        "slide(Dissipation([np.eye(3)]), Inertia(1.0, 1.0), (1.0, 0.0, 1.0))\n"
        "sys.exit(any(name.startswith('scipy') for name in sys.modules))\n"
    )
    loaded = subprocess.run([sys.executable, "-c", code], check=False).returncode
    print(f"A free slide imports {'scipy' if loaded else 'numpy alone'}.\n", flush=True)


def main() -> None:
    """Run all."""
    surfaces = fits()
    free_slides(surfaces, 300)
    bodies_on_points(120)
    loaded_slides(surfaces["dissipation, 4 terms"], 15)
    batches(surfaces)
    slips(surfaces["dissipation, 4 terms"])
    imports()


if __name__ == "__main__":
    main()
