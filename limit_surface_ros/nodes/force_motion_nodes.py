"""Program: the `limit_surface` and the `decay` node in one process and one executor."""

from __future__ import annotations

import sys

from limit_surface_ros.nodes import spin
from limit_surface_ros.nodes.decay_node import DecayNode
from limit_surface_ros.nodes.surface_node import LimitSurfaceNode


def main() -> int:
    """Run both nodes until SIGINT or SIGTERM; return the exit code."""
    return spin.run(lambda: [LimitSurfaceNode(), DecayNode()], __doc__, sys.argv)


if __name__ == "__main__":
    sys.exit(main())
