# SPDX-License-Identifier: Apache-2.0
"""Command line programs."""

from limit_surface_ros.blas_threads import use_one_by_default

use_one_by_default()
