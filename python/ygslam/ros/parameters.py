"""The node's parameters: its own, and every setting of `ygslam config` under its name there."""
from __future__ import annotations

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor

from .. import _command
from .settings import parsed, text_of

OWN = {
    "base_frame": ("base_link", "frame of the robot whose pose is told; the camera hangs below it"),
    "odom_frame": ("odom", "frame that drifts and never jumps (REP 105)"),
    "map_frame": ("map", "frame of the map: z is up, the floor at 0 once it was seen"),
    "camera_pose": ("", "'x y z roll pitch yaw' [m, rad] of the camera (x forward, z up) in base_frame; empty: as "
                        "/tf_static tells it"),
    "publish_tf": (True, "map -> odom -> base_frame on /tf; false where another node publishes odom -> base_frame"),
    "colour_transport": ("raw", "raw, or compressed: rgb/image/compressed"),
    "depth_transport": ("raw", "raw, or compressedDepth or compressed: depth/image/compressedDepth"),
    "depth_registered": (True, "depth has the pixels of the colour camera; false: depth/camera_info and /tf_static "
                               "tell where the depth camera is"),
    "reliability": ("auto", "of the images' subscriptions: reliable, best_effort, or auto: reliable where all "
                            "publishers are, for large images lose parts otherwise"),
    "slop_ms": (20.0, "colour and depth belong together up to this difference of their stamps", 0.0, 1000.0),
    "queue_size": (30, "pairs that wait at most; then the oldest is dropped and counted", 1, 1000),
    "imu": ("", "the camera's IMU on topic imu (docs/inertial.md): an imu.yaml; or tf: its place by /tf_static, usual "
                "noise; empty: none"),
    "odom": ("", "the robot's wheels on topic odom (docs/inertial.md): an odom.yaml; or tf: the camera's place by "
                 "/tf_static, usual noise; empty: none"),
    "model": ("", "network, .onnx or .xml; empty: segmenter"),
    "segmenter": ("", "model, builtin, none; empty: the model, or without one the built-in network"),
    "load_map": ("", "map of an earlier run to go on with"),
    "localize_only": (False, "the loaded map stays as it is"),
    "map_file": ("room.map", "what ~/save_map writes and ~/load_map and ~/localise read; may be set at any time"),
    "map_period_s": (1.0, "how often path, cloud and mesh are published at most", 0.1, 3600.0),
    "map_low_m": (0.1, "heights above the floor that are obstacles in the map: from here", 0.0, 10.0),
    "map_high_m": (1.5, "to here: the robot's height", 0.05, 10.0),
    "floor_at_base": (False, "the floor is where base_frame stands when a new map begins, which is level; false: it "
                             "is found"),
    "mesh_triangles": (200000, "of the mesh, at most; of more every second or third is left out", 1, 10**7),
    "path_step_m": (0.05, "distance of the poses of the path", 0.0, 100.0),
    "path_length": (2000, "poses of the path at most, the newest", 1, 10**6),
    "view": ("", "ADDRESS:PORT of the page that shows the run; empty: none"),
}
CHANGEABLE = {"map_file"}


def _descriptor(meaning: str, low=None, high=None, changeable: bool = False) -> ParameterDescriptor:
    """Dynamic typing: 8 is taken for 8.0, and the range holds for both by the library."""
    described = ParameterDescriptor(description=meaning, read_only=not changeable, dynamic_typing=True)
    if low is not None:
        described.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)]
    return described


def declare(node) -> tuple[dict, dict[str, str]]:
    """@return the values of OWN, and the settings of the library that differ from their defaults."""
    own = {}
    for name, (default, meaning, *limits) in OWN.items():
        described = _descriptor(meaning, *limits, changeable=name in CHANGEABLE)
        value = node.declare_parameter(name, default, described).value
        own[name] = checked(name, value, default, limits)
    options = {}
    for setting in parsed(_command._call("config")):
        value = node.declare_parameter(setting.key, setting.default,
                                       _descriptor(setting.meaning, setting.low, setting.high)).value
        if value != setting.default:
            options[setting.key] = text_of(value)
    return own, options


def checked(name: str, value, default, limits):
    """@throws ValueError naming the parameter."""
    wanted = type(default)
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, wanted) or (wanted is int and isinstance(value, bool)):
        raise ValueError(f"parameter {name}: {value!r}: must be of type {wanted.__name__}")
    if limits and not limits[0] <= value <= limits[1]:
        raise ValueError(f"parameter {name}: {value}: must be from {limits[0]} to {limits[1]}")
    return value
