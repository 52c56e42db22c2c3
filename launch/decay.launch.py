# SPDX-License-Identifier: Apache-2.0
"""Launch the decay node.

ros2 launch limit_surface_ros decay.launch.py models:=/my/decays onset:=/arm/contact_lost
"""

from __future__ import annotations

from typing import List  # noqa: UP035 - launch_ros knows no list[str]

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "limit_surface_ros"
TOPICS = ("onset", "measurement", "wrench")


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and the node."""
    config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "decay.yaml"])
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="of the node"),
        DeclareLaunchArgument(
            "models",
            default_value=f"package://{PACKAGE}/config/decay",
            description="decay model file, or folder of them; model_files in params_file goes "
            "first",
        ),
        DeclareLaunchArgument(
            "surfaces",
            default_value=f"package://{PACKAGE}/config/models",
            description="surface model file, or folder of them; surface_files in params_file "
            "goes first",
        ),
        DeclareLaunchArgument("params_file", default_value=config, description="of the node"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="use /clock"),
        *(
            DeclareLaunchArgument(topic, default_value=f"~/{topic}", description="topic's name")
            for topic in TOPICS
        ),
    ]
    node = Node(
        package=PACKAGE,
        executable="decay_node",
        name="decay",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            {
                "model_files": _one_entry("models"),
                "surface_files": _one_entry("surfaces"),
                "use_sim_time": LaunchConfiguration("use_sim_time"),
            },
            LaunchConfiguration("params_file"),
        ],
        remappings=[(f"~/{topic}", LaunchConfiguration(topic)) for topic in TOPICS],
        output="screen",
    )
    return LaunchDescription([*arguments, node])


def _one_entry(argument: str) -> ParameterValue:
    return ParameterValue(["['", LaunchConfiguration(argument), "']"], value_type=List[str])  # noqa: UP006
