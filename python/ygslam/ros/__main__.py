"""python -m ygslam.ros --ros-args -r rgb/image:=... -p base_frame:=camera_link"""
import sys


def main() -> int:
    try:
        from ygslam.ros import node
    except ImportError as error:
        print(f"error: {error}: source a ROS 2 installation first (docs/ros.md)", file=sys.stderr)
        return 2
    return node.main()


if __name__ == "__main__":
    sys.exit(main())
