"""ros2 launch ygslam_ros ygslam.launch.py model:=/path/yolov8n-seg.onnx

Topics as realsense2_camera names them with align_depth.enable:=true.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    camera = "/camera/camera"
    arguments = {"model": "", "segmenter": "", "load_map": "", "map_file": "room.map",
                 "rgb": f"{camera}/color/image_raw", "info": f"{camera}/color/camera_info",
                 "depth": f"{camera}/aligned_depth_to_color/image_raw",
                 # Root of the camera's or the robot's own tree, and where it lies in the frame of the
                 # tracked (colour) camera: x forward, y left, z up [m].
                 "base_frame": "camera_link", "base_x": "0", "base_y": "0", "base_z": "0"}
    values = {name: LaunchConfiguration(name) for name in arguments}
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value) for name, value in arguments.items()),
        Node(package="ygslam_ros", executable="ygslam", name="ygslam", output="screen",
             parameters=[{name: values[name] for name in ("model", "segmenter", "load_map", "map_file")}],
             remappings=[("rgb/image", values["rgb"]), ("rgb/camera_info", values["info"]),
                         ("depth/image", values["depth"])]),
        Node(package="tf2_ros", executable="static_transform_publisher", name="ygslam_base",
             arguments=["--frame-id", "camera", "--child-frame-id", values["base_frame"],
                        "--x", values["base_x"], "--y", values["base_y"], "--z", values["base_z"]]),
    ])
