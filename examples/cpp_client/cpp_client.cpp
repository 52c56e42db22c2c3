// SPDX-License-Identifier: Apache-2.0
// Ask the limit_surface node where a push moves an object.
// Start the node first (ros2 run limit_surface_ros limit_surface_node), then run this program.
#include <chrono>
#include <cstdio>
#include <memory>

#include "limit_surface_interfaces/msg/error_code.hpp"
#include "limit_surface_interfaces/srv/wrench_to_twist.hpp"
#include "rclcpp/rclcpp.hpp"

using limit_surface_interfaces::msg::ErrorCode;
using limit_surface_interfaces::srv::WrenchToTwist;
using namespace std::chrono_literals;

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  auto node = rclcpp::Node::make_shared("example_client");
  auto client = node->create_client<WrenchToTwist>("limit_surface/wrench_to_twist");
  if (!client->wait_for_service(10s)) {
    RCLCPP_ERROR(node->get_logger(), "there is no such service: is the node running?");
    return 1;
  }

  auto request = std::make_shared<WrenchToTwist::Request>();
  request->wrench.header.frame_id = "object";
  request->wrench.wrench.force.x = 4.0;    // N
  request->wrench.wrench.force.y = 1.0;    // N
  request->wrench.wrench.torque.z = 0.05;  // N m

  auto future = client->async_send_request(request);
  if (rclcpp::spin_until_future_complete(node, future, 10s) !=
    rclcpp::FutureReturnCode::SUCCESS)
  {
    RCLCPP_ERROR(node->get_logger(), "the service did not answer");
    return 1;
  }
  const auto answer = future.get();
  if (answer->error_code != ErrorCode::NONE) {
    RCLCPP_ERROR(node->get_logger(), "error %u: %s", answer->error_code, answer->error_msg.c_str());
    return 1;
  }
  const auto & twist = answer->twist.twist;
  std::printf("load factor %.3f: %s\n", answer->load_factor, answer->slides ? "slides" : "sticks");
  std::printf("direction   %.3f %.3f %.3f\n", twist.linear.x, twist.linear.y, twist.angular.z);
  rclcpp::shutdown();
  return 0;
}
