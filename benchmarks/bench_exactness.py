# SPDX-License-Identifier: Apache-2.0
"""How exact the maps are: facets, round trips, scales, loads of most power, cells of patches."""

from __future__ import annotations

import numpy as np

from limit_surface_ros.surface import measures, sampling
from limit_surface_ros.surface.contact import shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.kinds.dissipation import Dissipation
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.polynomial import Polynomial
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

MANY = 100_000
TRIANGLE = np.array([[-40, -40], [-40, 80], [80, -40]]) / 150
SCALING = Scaling(0.1, 5.0)
SURFACES, TWISTS, PROBES = 600, 1000, 3000


def random_matrices(rng, terms, rank=3, spread=0.0):
    """Return positive semidefinite matrices, shape (terms, 3, 3)."""
    roots = rng.standard_normal((terms, rank, 3))
    roots *= 10.0 ** rng.uniform(-spread, 0.0, (terms, rank, 1))
    return np.swapaxes(roots, 1, 2) @ roots


def row(what: str, goal: str, measured: object) -> None:
    """Print a row of the table."""
    value = f"{measured:.1e}" if isinstance(measured, float) else measured
    print(f"| {what} | {goal} | {value} |", flush=True)


def support_points() -> None:
    """Three support points, as themselves and as a dissipation."""
    contacts = PointContacts(TRIANGLE, np.full(3, 0.5))
    dissipation = contacts.dissipation()
    motions = sampling.random_motions(contacts, MANY, 1)
    facets = sampling.facet_loads(contacts, MANY // 6, 2)
    difference = np.abs(dissipation.wrench_of_twist(motions.twists) - motions.wrenches).max()
    row(f"3 points: loads of {MANY} motions, dissipation against points", "1e-12", difference)
    for name, surface in (("points", contacts), ("dissipation", dissipation)):
        row(
            f"3 points: twists of {len(facets)} facet loads, {name} [rad]",
            "1e-6",
            float(measures.angle_error(surface, facets).max()),
        )
        row(
            f"3 points: twists of {MANY} loads of motions, {name} [rad]",
            "1e-8",
            float(measures.angle_error(surface, motions).max()),
        )


def round_trips() -> None:
    """Twist to wrench to twist on smooth convex kinds."""
    rng = np.random.default_rng(3)
    quartic = np.array([1, 0, 0, 1 / 3, 0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 3])
    kinds = {
        "thesis, 1 term": PowerSum.thesis(random_matrices(rng, 1), SCALING),
        "thesis, 2 terms": PowerSum.thesis(random_matrices(rng, 2), SCALING),
        "3 norms": PowerSum.norms(random_matrices(rng, 3), SCALING),
        "exponents 0.9, 0.7, 0.6": PowerSum(random_matrices(rng, 3), [0.9, 0.7, 0.6], SCALING),
        "dissipation, 4 terms": Dissipation(random_matrices(rng, 4), SCALING),
        "polynomial": Polynomial(quartic, SCALING),
    }
    for name, surface in kinds.items():
        pairs = sampling.random_motions(surface, MANY, 4)
        angle = float(measures.angle_error(surface, pairs).max())
        row(f"{name}: twist to wrench to twist, {MANY} twists [rad]", "1e-8", angle)


def scales() -> None:
    """The root of H(alpha f) = 1 for loads of all sizes and matrices of all conditions."""
    rng = np.random.default_rng(5)
    worst = 0.0
    for _ in range(200):
        terms = rng.integers(1, 5)
        matrices = random_matrices(rng, terms, rng.integers(2, 4), spread=4.0)
        surface = PowerSum(matrices, rng.uniform(0.05, 1.0, terms), SCALING)
        loads = rng.standard_normal((5000, 3)) * 10.0 ** rng.uniform(-9, 9, (5000, 1))
        on_surface = loads / surface.load_factor(loads)[:, np.newaxis] / SCALING.wrench_unit
        worst = max(worst, float(np.abs(surface.value(on_surface) - 1.0).max()))
    row("H - 1 on 1e6 scaled loads, 1e-9 to 1e9 N, conditions to 1e8", "1e-12", worst)


def most_power() -> None:
    """No load on the surface has more power than the one found."""
    rng = np.random.default_rng(6)
    failures, count, worst = 0, 0, 0.0
    for index in range(SURFACES):
        terms = rng.integers(1, 6)
        rank, spread = (3, 0.0) if index % 2 else (rng.integers(2, 4), 2.0)
        surface = PowerSum(random_matrices(rng, terms, rank, spread), rng.uniform(0.1, 1, terms))
        probes = sampling.random_directions(PROBES, rng)
        if rank == 2 and terms == 1:
            continue
        probes /= surface.load_factor(probes)[:, np.newaxis]
        pairs = sampling.random_motions(surface, TWISTS, rng)
        power = (pairs.wrenches * pairs.twists).sum(axis=1)
        excess = (pairs.twists @ probes.T).max(axis=1) / power - 1.0
        failures += int((excess > 1e-9).sum())
        count += TWISTS
        worst = max(worst, float(excess.max()))
    row(
        f"power sums, exponents 0.1 to 1, 1 to 5 terms, half of them with ranks 2 and conditions "
        f"to 1e4: twists of {count} on {count // TWISTS} surfaces with a better load among "
        f"{PROBES}",
        "0",
        f"{failures} (worst by {max(worst, 0.0):.1e})",
    )


def cells_of_patches() -> None:
    """Error of a patch's loads by its number of cells."""
    print("\n### Loads of a patch by its number of cells, in parts of the friction limit\n")
    print("5000 random motions against 200 000 cells; the goal is 1e-4 with a stated number.\n")
    print("| shape | cells | median | 95 % | largest |\n|---|---|---|---|---|")
    makers = {
        "disc": lambda count: shapes.disc(1.0, count),
        "square": lambda count: shapes.rectangle([2.0, 2.0], count),
        "L": lambda count: shapes.polygon(
            [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], count=count
        ),
    }
    directions = sampling.random_directions(5000, 7)
    for name, maker in makers.items():
        exact = ContactPatch.of_shape(maker(200_000)).surface(1.0, 1.0)
        twists = directions * exact.scaling.twist_unit
        loads = exact.wrench_of_twist(twists)
        for count in (100, 1000, 10_000, 30_000):
            patch = ContactPatch.of_shape(maker(count)).surface(1.0, 1.0)
            difference = (patch.wrench_of_twist(twists) - loads) / exact.scaling.wrench_unit
            figures = measures.quantiles(np.linalg.norm(difference, axis=1))
            quoted = " | ".join(f"{figure:.1e}" for figure in figures)
            print(f"| {name} | {len(patch.points)} | {quoted} |", flush=True)


def main() -> int:
    """Print the tables."""
    print("### Exactness of the maps\n")
    print("| what | goal | largest measured |\n|---|---|---|")
    support_points()
    round_trips()
    scales()
    most_power()
    cells_of_patches()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
