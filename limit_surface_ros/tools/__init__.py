# SPDX-License-Identifier: Apache-2.0
"""Command line programs."""

from limit_surface_ros.runtime import use_one_blas_thread

use_one_blas_thread()
