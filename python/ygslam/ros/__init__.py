"""The ROS 2 node: `python -m ygslam.ros` (docs/ros.md). Nothing here is imported by `import ygslam`; rclpy and
messages are needed by `node`, `outputs`, `map_messages` and `messages` alone."""
