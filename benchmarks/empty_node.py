# SPDX-License-Identifier: Apache-2.0
"""The least that a Python node can be: one service that answers. The peer of start-up times."""

import rclpy
from std_srvs.srv import Trigger


def main() -> None:
    """Serve `empty` until the process is killed."""
    rclpy.init()
    node = rclpy.create_node("empty")
    node.create_service(Trigger, "empty", lambda _, response: response)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
