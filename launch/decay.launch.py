# SPDX-License-Identifier: Apache-2.0
"""Start the decay node.

ros2 launch limit_surface_ros decay.launch.py model_files:=/my/decays onset_topic:=/contact_lost
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
        "decay_node",
        ["decay"],
        {"model_files": ("decay", "model_files"), "surface_files": ("decay", "surface_files")},
    )
