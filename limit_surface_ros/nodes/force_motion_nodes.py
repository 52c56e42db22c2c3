# SPDX-License-Identifier: Apache-2.0
"""The `limit_surface` and the `decay` node in one process and one executor.

A parameter given as -p NAME:=VALUE goes to both; -p limit_surface:NAME:=VALUE and
-p decay:NAME:=VALUE, or a parameter file, address one; in a namespace only the file does.
"""

from __future__ import annotations

import sys

from limit_surface_ros.nodes import decay_node, limit_surface_node
from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.nodes.limit_surface_node import LimitSurfaceNode
from limit_surface_ros.nodes.models.model_node import COMMON_SETTINGS
from limit_surface_ros.nodes.serving import spin


def main() -> int:
    """Run both nodes until SIGINT or SIGTERM; return the exit code."""
    modules = limit_surface_node, decay_node
    tables = {module.NAME: [*module.SETTINGS, *COMMON_SETTINGS] for module in modules}
    text = "\n".join([__doc__, *(module.HELP for module in modules)])
    return spin.run(lambda: [LimitSurfaceNode(), DecayNode()], tables, text, sys.argv)


if __name__ == "__main__":
    sys.exit(main())
