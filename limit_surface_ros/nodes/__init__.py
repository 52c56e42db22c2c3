"""ROS 2 nodes: the only place that imports rclpy. Convert, call the core, convert, report."""
