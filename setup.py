# SPDX-License-Identifier: Apache-2.0
"""Build description of the ament_python package limit_surface_ros."""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "limit_surface_ros"

EXTRAS = {
    "progress": ["tqdm"],
    "plots": ["matplotlib"],
    "shapes": ["shapely"],
    "bags": ["rosbags"],
    "cluster": ["dask", "distributed"],
    "peers": ["cvxpy"],
    "exports": ["casadi", "jax", "mujoco"],
    "docs": ["sphinx", "myst-parser", "furo", "sphinx-mathjax-offline"],
}

# Each program's name and the module whose main() it runs.
PROGRAMS: dict[str, str] = {
    "explore_surface": "limit_surface_ros.tools.explore_surface",
    "check_pushes": "limit_surface_ros.tools.check_pushes",
    "fit_catalogue": "limit_surface_ros.tools.fit_catalogue",
    "compare_surfaces": "limit_surface_ros.tools.compare_surfaces",
    "export_surface": "limit_surface_ros.tools.export_surface",
    "fit_surface": "limit_surface_ros.tools.fit_surface",
    "fit_decay": "limit_surface_ros.tools.fit_decay",
    "compare_decays": "limit_surface_ros.tools.compare_decays",
    "plot_decay": "limit_surface_ros.tools.plot_decay",
    "plot_slide": "limit_surface_ros.tools.plot_slide",
