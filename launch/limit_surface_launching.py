# SPDX-License-Identifier: Apache-2.0
"""What the launch files of this package share: one vocabulary of arguments for all programs.

An argument that is left empty is not passed on, so that parameter files and the nodes' own
defaults count; one that is given counts more than a parameter file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from launch import LaunchContext

PACKAGE = "limit_surface_ros"
# Topics by the argument that renames them, as their node calls them.
TOPICS = {
    "limit_surface": {
        "wrench_topic": "~/wrench",
        "twist_topic": "~/twist",
        "predicted_twist_topic": "~/predicted_twist",
        "predicted_twist_with_covariance_topic": "~/predicted_twist_with_covariance",
        "required_wrench_topic": "~/required_wrench",
        "surface_topic": "~/surface",
        "push_topic": "~/push",
        "push_path_topic": "~/push_path",
    },
    "decay": {
        "onset_topic": "~/onset",
        "measurement_topic": "~/measurement",
        "falling_wrench_topic": "~/wrench",
        "value_topic": "~/value",
        "forecast_topic": "~/forecast",
        "time_left_topic": "~/time_left",
        "held_wrench_topic": "~/held_wrench",
        "required_normal_force_topic": "~/required_normal_force",
    },
}
SHARED_TOPICS = {"tf_topic": "/tf", "tf_static_topic": "/tf_static"}
COMMON = {
    "namespace": ("", "namespace of the nodes"),
    "params_file": ("", "YAML file of parameters; counts more than the nodes' defaults"),
    "use_sim_time": ("", "true: follow the clock on /clock; empty: as params_file says"),
    "log_level": ("", "such as debug or warn; empty: info"),
    "respawn": ("false", "true: start the process again when it ends"),
}


def description(
    program: str, nodes: Sequence[str], lists: Mapping[str, tuple[str, str]]
) -> LaunchDescription:
    """Return a launch description of one process.

    Args:
        program: The executable.
        nodes: Names of its nodes.
        lists: Arguments that give a parameter of one node a list of texts: by argument, the node's
            name and the parameter's.
    """
    arguments = [
        *(_argument(name, *rest) for name, rest in COMMON.items()),
        *(
            _argument(name, "", f"{parameter} of the node {node}, as a YAML list; empty: as is")
            for name, (node, parameter) in lists.items()
        ),
        *(
            _argument(name, topic, f"topic of the node {node}")
            for node in nodes
            for name, topic in TOPICS[node].items()
        ),
        *(
            _argument(name, topic, "topic of transforms, such as 'tf' for the namespace's own")
            for name, topic in SHARED_TOPICS.items()
        ),
    ]

    def process(context: LaunchContext) -> list[Node]:
        def given(name: str) -> str:
            return LaunchConfiguration(name).perform(context)

        rules = []
        for node in nodes:
            for name, topic in TOPICS[node].items():
                if given(name) != topic:
                    rules += ["-r", f"{node}:{topic}:={given(name)}"]
        for name, topic in SHARED_TOPICS.items():
            if given(name) != topic:
                rules += ["-r", f"{topic}:={given(name)}"]
        if given("params_file"):
            rules += ["--params-file", given("params_file")]
        # After the file: what is given by name counts more.
        if given("use_sim_time"):
            rules += ["-p", f"use_sim_time:={given('use_sim_time')}"]
        for name, (node, parameter) in lists.items():
            if given(name):
                rules += ["-p", f"{node}:{parameter}:={_list(given(name))}"]
        if given("log_level"):
            rules += ["--log-level", given("log_level")]
        # No name: it would rename all nodes of the process to one.
        return [
            Node(
                package=PACKAGE,
                executable=program,
                namespace=given("namespace"),
                ros_arguments=rules,
                respawn=yaml.safe_load(given("respawn")) is True,
                output="screen",
            )
        ]

    return LaunchDescription([*arguments, OpaqueFunction(function=process)])


def _argument(name: str, default: str, description: str) -> DeclareLaunchArgument:
    return DeclareLaunchArgument(name, default_value=default, description=description)


def _list(text: str) -> str:
    """Return a YAML list of texts; a single text is a list of one."""
    value = yaml.safe_load(text)
    return str([str(item) for item in value] if isinstance(value, list) else [text])
