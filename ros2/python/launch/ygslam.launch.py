"""ros2 launch ygslam_ros_py ygslam.launch.py base_frame:=base_link

Topics as realsense2_camera names them with align_depth.enable:=true. docs/ros.md of YG-SLAM has all parameters;
`ros2 param describe /ygslam NAME` tells what one means.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

CAMERA = "/camera/camera"
TOPICS = {"rgb/image": f"{CAMERA}/color/image_raw", "rgb/camera_info": f"{CAMERA}/color/camera_info",
          "depth/image": f"{CAMERA}/aligned_depth_to_color/image_raw",
          "depth/camera_info": f"{CAMERA}/aligned_depth_to_color/camera_info", "imu": f"{CAMERA}/imu", "odom": "/odom"}
TEXTS = {"base_frame": "camera_link", "odom_frame": "odom", "map_frame": "map", "camera_pose": "", "imu": "", "odom": "",
         "model": "", "segmenter": "", "load_map": "", "map_file": "room.map", "colour_transport": "raw", "depth_transport": "raw",
         "reliability": "auto"}
FLAGS = {"depth_registered": "true", "publish_tf": "true", "localize_only": "false", "use_sim_time": "false"}


def generate_launch_description():
    names = {topic: topic.replace("/", "_") for topic in TOPICS}  # rgb_image:=... on the command line
    for topic in ("imu", "odom"):  # they are the parameters, too: a file of the place, or tf
        names[topic] = f"{topic}_topic"
    arguments = {**TEXTS, **FLAGS, **{names[topic]: given for topic, given in TOPICS.items()}}
    values = {name: LaunchConfiguration(name) for name in arguments}
    parameters = {name: ParameterValue(values[name], value_type=bool if name in FLAGS else str)
                  for name in (*TEXTS, *FLAGS)}
    # The compressed form of a topic lies below it.
    remappings = [*((topic, values[names[topic]]) for topic in TOPICS),
                  ("rgb/image/compressed", [values["rgb_image"], "/compressed"]),
                  ("depth/image/compressed", [values["depth_image"], "/compressed"]),
                  ("depth/image/compressedDepth", [values["depth_image"], "/compressedDepth"])]
    return LaunchDescription([
        *(DeclareLaunchArgument(name, default_value=value) for name, value in arguments.items()),
        Node(package="ygslam_ros_py", executable="ygslam", name="ygslam", output="screen", parameters=[parameters],
             remappings=remappings)])
