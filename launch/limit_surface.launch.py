# SPDX-License-Identifier: Apache-2.0
"""Start the limit_surface node.

ros2 launch limit_surface_ros limit_surface.launch.py model_files:=/my/models wrench_topic:=/ft
`--show-args` lists what can be given.
"""

import sys
from pathlib import Path

from launch import LaunchDescription

sys.path.insert(0, str(Path(__file__).resolve().parent))

from limit_surface_launching import description


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the process."""
    return description(
        "limit_surface_node",
        ["limit_surface"],
        {"model_files": ("limit_surface", "model_files")},
    )
