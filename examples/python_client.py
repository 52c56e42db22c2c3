# SPDX-License-Identifier: Apache-2.0
"""Ask the limit_surface node where a push moves an object, and what push a motion needs.

Start the node first (ros2 run limit_surface_ros limit_surface_node), then run this program.
"""

import sys

import rclpy
from geometry_msgs.msg import TwistStamped, WrenchStamped
from limit_surface_interfaces.msg import ErrorCode
from limit_surface_interfaces.srv import TwistToWrench, WrenchToTwist


def call(node, service_type, name, request):
    """Call a service and return its answer; an error code ends the program with its sentence."""
    client = node.create_client(service_type, name)
    if not client.wait_for_service(timeout_sec=10.0):
        sys.exit(f"there is no service {name}: is the node running?")
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    answer = future.result()
    if answer is None:
        sys.exit(f"service {name} did not answer")
    if answer.error_code != ErrorCode.NONE:
        sys.exit(f"error {answer.error_code}: {answer.error_msg}")
    return answer


def main():
    """Push at (4 N, 1 N) with a moment of 0.05 N m, then ask for a turn on the spot."""
    rclpy.init()
    node = rclpy.create_node("example_client")

    push = WrenchStamped()
    push.header.frame_id = "object"
    push.wrench.force.x, push.wrench.force.y, push.wrench.torque.z = 4.0, 1.0, 0.05
    request = WrenchToTwist.Request(wrench=push)
    answer = call(node, WrenchToTwist, "limit_surface/wrench_to_twist", request)
    twist = answer.twist.twist
    print(f"load factor {answer.load_factor:.3f}: {'slides' if answer.slides else 'sticks'}")
    print(f"direction   {twist.linear.x:.3f} {twist.linear.y:.3f} {twist.angular.z:.3f}")

    turn = TwistStamped()
    turn.header.frame_id = "object"
    turn.twist.angular.z = 1.0
    request = TwistToWrench.Request(twist=turn)
    wrench = call(node, TwistToWrench, "limit_surface/twist_to_wrench", request).wrench.wrench
    print(f"a turn needs {wrench.force.x:.3f} N {wrench.force.y:.3f} N {wrench.torque.z:.4f} N m")

    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
