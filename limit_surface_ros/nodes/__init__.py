# SPDX-License-Identifier: Apache-2.0
"""ROS 2 nodes: the only place that imports rclpy. Convert, call the core, convert, report."""

from limit_surface_ros.runtime import use_one_blas_thread

use_one_blas_thread()
