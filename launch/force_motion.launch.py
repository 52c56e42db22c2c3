# SPDX-License-Identifier: Apache-2.0
"""Launch the limit_surface and the decay node in one process.

ros2 launch limit_surface_ros force_motion.launch.py namespace:=left wrench:=/ft

Models are named in the parameter files: both nodes have a parameter `model_files`, and only a
file can tell them apart.
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "limit_surface_ros"
FILES = ("limit_surface", "decay")
# Topics by the argument that renames them, and whose they are.
TOPICS = {
    "wrench": "limit_surface",
    "twist": "limit_surface",
    "onset": "decay",
    "measurement": "decay",
}


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and the process."""
    share = FindPackageShare(PACKAGE)
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="of both nodes"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="use /clock"),
        *(
            DeclareLaunchArgument(
                f"{name}_params_file",
                default_value=PathJoinSubstitution([share, "config", f"{name}.yaml"]),
                description=f"of the node {name}",
            )
            for name in FILES
        ),
        *(
            DeclareLaunchArgument(
                topic, default_value=f"~/{topic}", description=f"topic's name, of the node {node}"
            )
            for topic, node in TOPICS.items()
        ),
    ]
    remaps = []
    for topic, node in TOPICS.items():
        remaps += ["-r", [f"{node}:~/{topic}:=", LaunchConfiguration(topic)]]
    # No name: it would rename both nodes to one.
    process = Node(
        package=PACKAGE,
        executable="force_motion_nodes",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            {"use_sim_time": LaunchConfiguration("use_sim_time")},
            *(LaunchConfiguration(f"{name}_params_file") for name in FILES),
        ],
        ros_arguments=remaps,
        output="screen",
    )
    return LaunchDescription([*arguments, process])
