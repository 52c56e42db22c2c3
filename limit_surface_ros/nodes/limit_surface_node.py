# SPDX-License-Identifier: Apache-2.0
"""The `limit_surface` node in a process of its own: wrench to twist and twist to wrench."""

from __future__ import annotations

import sys

from limit_surface_ros.nodes import spin
from limit_surface_ros.nodes.model_node import COMMON_SETTINGS
from limit_surface_ros.nodes.surface_node import NAME, SETTINGS, LimitSurfaceNode


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    tables = {NAME: [*SETTINGS, *COMMON_SETTINGS]}
    return spin.run(lambda: [LimitSurfaceNode()], tables, __doc__, sys.argv)


if __name__ == "__main__":
    sys.exit(main())
