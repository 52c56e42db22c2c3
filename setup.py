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
}

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Limit surfaces of sliding bodies and decay models, fitted offline and served over ROS 2",
    license="Apache-2.0",
    maintainer="limit_surface_ros maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        *(
            (f"share/{PACKAGE}/{folder}", [str(path) for path in Path(folder).iterdir() if path.is_file()])
            for folder in ("config", "launch")
        ),
    ],
    python_requires=">=3.10",
    install_requires=["numpy", "scipy", "pyyaml"],
    extras_require=EXTRAS,
    zip_safe=False,
    entry_points={
        "console_scripts": [
        ],
    },
)
