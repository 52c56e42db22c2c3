"""Launch the limit_surface and the decay node in one process.

ros2 launch limit_surface_ros force_motion.launch.py namespace:=left
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "limit_surface_ros"
FILES = ("limit_surface", "decay")


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
    ]
    # No name: it would rename both nodes to one.
    process = Node(
        package=PACKAGE,
        executable="force_motion_nodes",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            {"use_sim_time": LaunchConfiguration("use_sim_time")},
            *(LaunchConfiguration(f"{name}_params_file") for name in FILES),
        ],
        output="screen",
    )
    return LaunchDescription([*arguments, process])
