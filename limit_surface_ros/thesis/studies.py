# SPDX-License-Identifier: Apache-2.0
"""All figures that are rebuilt, in the thesis's order."""

from __future__ import annotations

from limit_surface_ros.thesis import (
    beyond_decays,
    beyond_surfaces,
    decay_fits,
    decay_system,
    exact_surfaces,
    more_functions,
    surface_errors,
    surface_fits,
)

STUDIES = (
    *decay_system.STUDIES,
    *decay_fits.STUDIES,
    *more_functions.STUDIES,
    *exact_surfaces.STUDIES,
    *surface_fits.STUDIES,
    *surface_errors.STUDIES,
    *beyond_decays.STUDIES,
    *beyond_surfaces.STUDIES,
)
