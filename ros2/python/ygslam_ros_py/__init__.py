"""`ros2 run ygslam_ros_py ygslam`: what `python -m ygslam.ros` does."""


def main() -> int:
    from ygslam.ros.__main__ import main as run
    return run()
