# SPDX-License-Identifier: Apache-2.0
"""ROS 2 nodes: the only place that imports rclpy. Convert, call the core, convert, report."""

from limit_surface_ros.blas_threads import use_one_by_default

use_one_by_default()
