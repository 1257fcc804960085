"""A recording as MCAP with messages of ROS 2: what `ygslam run` reads from a file or a pipe."""
import math

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.typesys import Stores, get_typestore

from .recording import Colour, Fault

COLOUR_FRAME, DEPTH_FRAME = "camera_color_optical_frame", "camera_depth_optical_frame"
STORE = get_typestore(Stores.ROS2_HUMBLE)


class Counted:
    """A pipe with a position: Writer asks for it."""

    def __init__(self, out):
        self.out, self.at = out, 0

    def write(self, data):
        self.out.write(data)
        self.at += len(data)
        return len(data)

    def tell(self):
        return self.at

    def flush(self):
        self.out.flush()


def ros(name, *fields):
    return STORE.types[name](*fields)


def header(stamp_ns, frame):
    return ros("std_msgs/msg/Header", ros("builtin_interfaces/msg/Time", *divmod(stamp_ns, 10**9)), frame)


def info_message(camera, stamp_ns, frame):
    k = [camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1]
    p = [camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0]
    return ros("sensor_msgs/msg/CameraInfo", header(stamp_ns, frame), camera.height, camera.width,
               camera.model, np.array(camera.terms, float), np.array(k, float), np.eye(3).reshape(-1),
               np.array(p, float), 0, 0, ros("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False))


def image_message(stamp_ns, frame, encoding, array):
    array = np.ascontiguousarray(array)
    data = array.reshape(-1).view(np.uint8)
    return ros("sensor_msgs/msg/Image", header(stamp_ns, frame), array.shape[0], array.shape[1], encoding,
               0, data.size // array.shape[0], data)


def colour_message(image):
    if isinstance(image.content, bytes):
        return ros("sensor_msgs/msg/CompressedImage", header(image.stamp_ns, COLOUR_FRAME),
                   image.encoding, np.frombuffer(image.content, np.uint8))
    return image_message(image.stamp_ns, COLOUR_FRAME, image.encoding, image.content)


def depth_message(image):
    """Millimetres as they are; what has other units becomes metres, as REP 118 has it."""
    values, encoding = image.values, "16UC1"
    if values.dtype != np.uint16:
        values, encoding = values.astype("<f4"), "32FC1"
    elif not math.isclose(image.unit_m, 0.001, rel_tol=1e-6):
        values, encoding = np.where(values == 0, np.nan, values * image.unit_m).astype("<f4"), "32FC1"
    return image_message(image.stamp_ns, DEPTH_FRAME, encoding, values)


def quaternion(rotation):
    """x y z w, from the largest of the four so that nothing is divided by little (Shepperd 1978)."""
    m = np.asarray(rotation)
    trace = np.trace(m)
    squares = np.array([2 * m[0, 0] - trace, 2 * m[1, 1] - trace, 2 * m[2, 2] - trace, trace])
    products = np.array([[0, m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
                         [0, 0, m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
                         [0, 0, 0, m[1, 0] - m[0, 1]], [0, 0, 0, 0]])
    products += products.T
    at = int(np.argmax(squares))
    q = products[at]
    q[at] = 1 + squares[at]
    return q / np.linalg.norm(q)


def transform_message(T_colour_depth, stamp_ns):
    """Where the depth camera is, in the colour camera's frame."""
    transform = ros("geometry_msgs/msg/Transform",
                    ros("geometry_msgs/msg/Vector3", *map(float, T_colour_depth[:3, 3])),
                    ros("geometry_msgs/msg/Quaternion", *map(float, quaternion(T_colour_depth[:3, :3]))))
    return ros("tf2_msgs/msg/TFMessage",
               [ros("geometry_msgs/msg/TransformStamped", header(stamp_ns, COLOUR_FRAME), DEPTH_FRAME,
                    transform)])


class Output:
    def __init__(self, out, chunked):
        self.writer = Writer(Counted(out), compression=CompressionType.ZSTD, use_chunking=chunked,
                             index_types=IndexType.ALL if chunked else IndexType.NONE)
        self.writer.start("ros2", "ygslam convert_recording")
        self.channels = {}

    def say(self, topic, stamp_ns, message):
        kind = message.__msgtype__
        if topic not in self.channels:
            text, _ = STORE.generate_msgdef(kind, ros_version=2)
            schema = self.writer.register_schema(kind, "ros2msg", text.encode())
            self.channels[topic] = self.writer.register_channel(topic, "cdr", schema)
        data = bytes(STORE.serialize_cdr(message, kind))
        self.writer.add_message(self.channels[topic], stamp_ns, data, stamp_ns)


def write_mcap(out, recording, chunked):
    """@return the number of pairs. What came before a Fault is left as a complete recording."""
    output = Output(out, chunked)
    counts = {"colour": 0, "depth": 0}
    try:
        for image in recording.images:
            stamp_ns = image.stamp_ns
            if not 0 <= stamp_ns < 2**31 * 10**9:
                raise Fault(f"a stamp of {stamp_ns} ns")
            if sum(counts.values()) == 0:
                output.say("/tf_static", stamp_ns, transform_message(recording.T_colour_depth, stamp_ns))
            if isinstance(image, Colour):
                counts["colour"] += 1
                output.say("/camera/color/camera_info", stamp_ns,
                           info_message(recording.colour, stamp_ns, COLOUR_FRAME))
                topic = "/camera/color/image_raw"
                topic += "/compressed" if isinstance(image.content, bytes) else ""
                output.say(topic, stamp_ns, colour_message(image))
            else:
                counts["depth"] += 1
                output.say("/camera/depth/camera_info", stamp_ns,
                           info_message(recording.depth, stamp_ns, DEPTH_FRAME))
                output.say("/camera/depth/image_raw", stamp_ns, depth_message(image))
    finally:
        output.writer.finish()
        out.flush()
    for what, count in counts.items():
        if count == 0:
            raise Fault(f"has no {what} images")
    return min(counts.values())
