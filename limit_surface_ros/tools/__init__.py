# SPDX-License-Identifier: Apache-2.0
"""Command line programs, one a module; what they share is in `common`."""

from limit_surface_ros.runtime import use_one_blas_thread

use_one_blas_thread()
