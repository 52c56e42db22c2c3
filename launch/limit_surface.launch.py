# SPDX-License-Identifier: Apache-2.0
"""Start a node of this package: ros2 launch limit_surface_ros limit_surface.launch.py.

`ros2 launch limit_surface_ros limit_surface.launch.py --show-args` lists what can be given.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the node."""
    config = PathJoinSubstitution(
        [FindPackageShare("limit_surface_ros"), "config", "limit_surface.yaml"]
    )
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="namespace of the node"),
        DeclareLaunchArgument(
            "params_file", default_value=config, description="YAML file of parameters"
        ),
        DeclareLaunchArgument(
            "model_files",
            default_value="[package://limit_surface_ros/config/models]",
            description="model files, or folders of them, as a YAML list",
        ),
        DeclareLaunchArgument(
            "wrench_topic", default_value="~/wrench", description="loads whose motion is wanted"
        ),
        DeclareLaunchArgument(
            "twist_topic", default_value="~/twist", description="motions whose load is wanted"
        ),
        DeclareLaunchArgument(
            "use_sim_time", default_value="false", description="follow the clock on /clock"
        ),
    ]
    # Values in a dictionary are read as YAML: a list stays a list, true a boolean.
    node = Node(
        package="limit_surface_ros",
        executable="limit_surface_node",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            LaunchConfiguration("params_file"),
            {
                "model_files": LaunchConfiguration("model_files"),
                "use_sim_time": LaunchConfiguration("use_sim_time"),
            },
        ],
        remappings=[
            ("~/wrench", LaunchConfiguration("wrench_topic")),
            ("~/twist", LaunchConfiguration("twist_topic")),
        ],
        output="screen",
    )
    return LaunchDescription([*arguments, node])
