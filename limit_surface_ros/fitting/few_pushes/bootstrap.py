# SPDX-License-Identifier: Apache-2.0
"""The Bayesian bootstrap of a fit: refits with random weights of the pushes.

The Bayesian bootstrap (Rubin 1981, doi:10.1214/aos/1176345338) draws each push's weight from an
exponential distribution. The surfaces of many such refits spread as the data allow; that is less
than real pushes scatter (see `dissipation_scatter`): 13 % of them lay within that of 25 refits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limit_surface_ros.errors import DataError, RangeError, SolverError
from limit_surface_ros.fitting.few_pushes.recipe import FitContext
from limit_surface_ros.surface.kinds import KINDS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Executor

    from numpy.typing import ArrayLike

    from limit_surface_ros.checks import Floats
    from limit_surface_ros.fitting.few_pushes.mixture import Mixture
    from limit_surface_ros.fitting.search import Progress
    from limit_surface_ros.surface.base import LimitSurface
    from limit_surface_ros.surface.kinds.point_contacts import PointContacts
    from limit_surface_ros.surface.pairs import Pairs
    from limit_surface_ros.surface.scaling import Scaling


def bootstrap(
    pairs: Pairs,
    mixture: Mixture,
    count: int,
    *,
    scaling: Scaling | None = None,
    support: PointContacts | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> tuple[LimitSurface, ...]:
    """Return the surfaces of `count` refits of one mixture.

    Args:
        pairs: Recorded pushes.
        mixture: How to fit.
        count: How many refits, at least 2.
        scaling: Characteristic length and friction force; chosen from the pairs if not given.
        support: Known support points, for recipes whose prior they are.
        seed: Of weights and random starts.
        executor: Where refits run; here and one by one if not given.
        progress: Called with (refits done, refits in all) after each.

    Raises:
        RangeError: `count` is below 2.
        DataError: The pushes cannot determine a surface.
        SolverError: Fewer than two refits pass through the loads.
    """
    if count < 2:
        raise RangeError(f"a bootstrap needs at least 2 refits, got {count}")
    weights = np.random.default_rng([seed, count]).exponential(size=(count, len(pairs)))
    weights /= weights.mean(axis=1, keepdims=True)
    tasks = [(FitContext(pairs, scaling, support, each, seed), mixture) for each in weights]
    if executor is None:
        found = (_refit(*task) for task in tasks)
    else:
        futures = [executor.submit(_refit, *task) for task in tasks]
        found = (future.result() for future in futures)
    surfaces: tuple[LimitSurface, ...] = ()
    for done, surface in enumerate(found, start=1):
        if surface is not None:
            surfaces += (surface,)
        if progress is not None:
            progress(done, count)
    if len(surfaces) < 2:
        raise SolverError(f"no refits of the {mixture} pass through the loads")
    return surfaces


def _refit(context: FitContext, mixture: Mixture) -> LimitSurface | None:
    try:
        return mixture.fit(context)[0]
    except SolverError:
        # Weights under which the fit is lost: the others show the spread.
        return None


def twist_spread(surfaces: Sequence[LimitSurface], wrench: ArrayLike) -> Floats:
    """Return how far the surfaces' twists lie from their mean, root mean square [rad].

    Args:
        surfaces: At least 2, of one scaling.
        wrench: Shape (..., 3), (fx, fy, tau_z) in [N, N, N m].

    Returns:
        Shape (...), angles in scaled variables.

    Raises:
        DataError: There are fewer than 2 surfaces.
    """
    if len(surfaces) < 2:
        raise DataError(f"a spread needs at least 2 surfaces, got {len(surfaces)}")
    unit = surfaces[0].scaling.twist_unit
    twists = np.array([surface.twist_of_wrench(wrench) for surface in surfaces]) / unit
    mean = twists.mean(axis=0)
    mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
    angles = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(twists - mean, axis=-1), 1.0))
    return np.asarray(np.sqrt(np.mean(angles**2, axis=0)))


def stored_surfaces(surfaces: Sequence[LimitSurface]) -> dict[str, Any]:
    """Return the surfaces of a bootstrap as plain values for a model file.

    Arrays before the last of the kind, as exponents, are stored once if all surfaces share them.
    """
    first = surfaces[0]
    values: dict[str, Any] = {"kind": first.kind}
    for array in first.arrays:
        each = [getattr(surface, array.key).tolist() for surface in surfaces]
        shared = array is not first.arrays[-1] and all(one == each[0] for one in each)
        values[array.key] = each[0] if shared else each
    return values


def surfaces_of(stored: Mapping[str, Any], scaling: Scaling) -> tuple[LimitSurface, ...]:
    """Return the surfaces that `stored_surfaces` put into a model file's `fit: bootstrap`.

    Args:
        stored: What stands there.
        scaling: The model's.

    Raises:
        DataError: It is not what `stored_surfaces` makes.
    """
    try:
        kind = KINDS[stored["kind"]]
        count = len(stored[kind.arrays[-1].key])
        # Refits need not have the same number of terms.
        columns = {
            array.key: [stored[array.key]] * count
            if _depth(stored[array.key]) == len(array.shape)
            else stored[array.key]
            for array in kind.arrays
        }
        return tuple(
            kind.of_arrays({key: each[index] for key, each in columns.items()}, scaling)
            for index in range(count)
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise DataError(f"fit: bootstrap holds no surfaces: {error}") from None


def _depth(values: Any) -> int:
    """Return how deep lists are nested in the first places of each other."""
    return 1 + _depth(values[0]) if isinstance(values, list) and values else 0
