# SPDX-License-Identifier: Apache-2.0
"""Start the limit_surface and the decay node in one process.

ros2 launch limit_surface_ros force_motion.launch.py namespace:=left wrench_topic:=/ft
Here `model_files` are those of limit_surface, `decay_files` those of decay.
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
        "force_motion_nodes",
        ["limit_surface", "decay"],
        {
            "model_files": ("limit_surface", "model_files"),
            "decay_files": ("decay", "model_files"),
            "surface_files": ("decay", "surface_files"),
        },
    )
