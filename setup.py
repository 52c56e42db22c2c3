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
    "docs": ["sphinx", "myst-parser", "furo", "sphinx-mathjax-offline", "sphinx-copybutton"],
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
    "plot_push": "limit_surface_ros.tools.plot_push",
    "plot_slide": "limit_surface_ros.tools.plot_slide",
    "plot_surface": "limit_surface_ros.tools.plot_surface",
    "replay_learning": "limit_surface_ros.tools.replay_learning",
    "reproduce_thesis": "limit_surface_ros.tools.reproduce_thesis",
    "ask": "limit_surface_ros.nodes.ask",
    "demo": "limit_surface_ros.nodes.demo",
    "limit_surface_node": "limit_surface_ros.nodes.limit_surface_node",
    "decay_node": "limit_surface_ros.nodes.decay_node",
    "force_motion_nodes": "limit_surface_ros.nodes.force_motion_nodes",
}


def installed_files(folder: str) -> list[tuple[str, list[str]]]:
    """Return data_files entries that install `folder` and the folders in it under share/."""
    files = sorted(path for path in Path(folder).rglob("*") if path.is_file())
    places = sorted({path.parent for path in files})
    return [
        (f"share/{PACKAGE}/{place}", [str(path) for path in files if path.parent == place])
        for place in places
    ]


setup(
    name=PACKAGE,
    version="0.2.0",
    description="Limit surfaces of sliding bodies and decay models, fitted and served over ROS 2",
    license="Apache-2.0",
    maintainer="limit_surface_ros maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed"], f"{PACKAGE}.export": ["templates/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        *installed_files("config"),
        *installed_files("launch"),
    ],
    python_requires=">=3.10",
    install_requires=["numpy>=1.26,<3", "scipy>=1.11,<2", "pyyaml>=6,<7"],
    extras_require=EXTRAS,
    zip_safe=False,
    entry_points={
        # Not the modules themselves: Ctrl-C would end their imports with a traceback.
        "console_scripts": [
            f"{name} = {PACKAGE}.runtime:{module.removeprefix(f'{PACKAGE}.')}"
            for name, module in PROGRAMS.items()
        ],
    },
)
