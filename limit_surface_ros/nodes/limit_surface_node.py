"""Program: the `limit_surface` node in a process of its own."""

from __future__ import annotations

import sys

from limit_surface_ros.nodes import spin
from limit_surface_ros.nodes.surface_node import LimitSurfaceNode


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code."""
    return spin.run(lambda: [LimitSurfaceNode()], __doc__, sys.argv)


if __name__ == "__main__":
    sys.exit(main())
