"""Bags for tests, written by the libraries of others (mcap, rosbags) from a folder in TUM layout."""
import dataclasses
import io
import struct

import mcap.writer
import numpy as np
from PIL import Image
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

RGB, DEPTH, INFO = "/camera/color/image_raw", "/camera/depth/image_raw", "/camera/color/camera_info"
STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE1 = get_typestore(Stores.ROS1_NOETIC)
PACKING = {"": mcap.writer.CompressionType.NONE, "lz4": mcap.writer.CompressionType.LZ4,
           "zstd": mcap.writer.CompressionType.ZSTD}


def png_bytes(array):
    out = io.BytesIO()
    Image.fromarray(array).save(out, "PNG")
    return out.getvalue()


@dataclasses.dataclass
class Frame:
    """One pair as arrays."""
    stamp_ns: int
    colour: np.ndarray  # HxWx3, r g b
    depth_mm: np.ndarray  # HxW, uint16


def frames_of(folder, pairs):
    """The pairs of a folder whose depth_scale is 1000."""
    for stamp, colour, _, depth in pairs:
        seconds, _, digits = stamp.partition(".")
        yield Frame(int(seconds) * 10**9 + int(digits.ljust(9, "0")),
                    np.asarray(Image.open(folder / colour).convert("RGB")),
                    np.asarray(Image.open(folder / depth)).astype(np.uint16))


class Messages:
    """Messages of a store (ROS 2 or ROS 1) in any encoding."""

    def __init__(self, store=STORE):
        self.store = store
        self.types = store.types
        self.ros1 = "seq" in self.types["std_msgs/msg/Header"].__dataclass_fields__

    def header(self, stamp_ns, frame="camera"):
        time = self.types["builtin_interfaces/msg/Time"](stamp_ns // 10**9, stamp_ns % 10**9)
        counted = [7] if self.ros1 else []
        return self.types["std_msgs/msg/Header"](*counted, time, frame)

    def image(self, stamp_ns, encoding, array, frame="camera", big_endian=False, padding=0):
        height, width = array.shape[:2]
        rows = np.frombuffer(array.tobytes(), np.uint8).reshape(height, -1)
        rows = np.pad(rows, ((0, 0), (0, padding)))
        return self.types["sensor_msgs/msg/Image"](
            self.header(stamp_ns, frame), height, width, encoding, int(big_endian), rows.shape[1],
            rows.reshape(-1))

    def compressed(self, stamp_ns, form, data, frame="camera"):
        return self.types["sensor_msgs/msg/CompressedImage"](
            self.header(stamp_ns, frame), form, np.frombuffer(data, np.uint8))

    def info(self, stamp_ns, camera, size, model="plumb_bob", terms=(0.0,) * 5, frame="camera"):
        fx, fy, cx, cy = camera
        roi = self.types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        return self.types["sensor_msgs/msg/CameraInfo"](
            self.header(stamp_ns, frame), size[1], size[0], model, np.array(terms),
            np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0]), np.eye(3).reshape(-1),
            np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0]), 0, 0, roi)

    def colour(self, frame, encoding):
        rgb = frame.colour
        alpha = np.full(rgb.shape[:2] + (1,), 9, np.uint8)
        arrays = {"rgb8": rgb, "bgr8": rgb[..., ::-1], "rgba8": np.concatenate([rgb, alpha], 2),
                  "bgra8": np.concatenate([rgb[..., ::-1], alpha], 2)}
        if encoding == "png":
            return self.compressed(frame.stamp_ns, "rgb8; png compressed bgr8", png_bytes(rgb))
        return self.image(frame.stamp_ns, encoding, arrays[encoding], padding=4)

    def depth(self, frame, encoding):
        mm = frame.depth_mm
        if encoding == "32FC1":
            metres = mm.astype(np.float32) * np.float32(1 / 1000)
            return self.image(frame.stamp_ns, encoding, np.where(mm == 0, np.float32("nan"), metres))
        if encoding == "compressedDepth":
            head = struct.pack("<iff", 0, 0, 0)
            return self.compressed(frame.stamp_ns, "16UC1; compressedDepth png", head + png_bytes(mm))
        if encoding == "big":
            return self.image(frame.stamp_ns, "16UC1", mm.astype(">u2"), big_endian=True)
        return self.image(frame.stamp_ns, encoding, mm)


def recording(messages, frames, camera, rgb="rgb8", depth="16UC1", rgb_topic=RGB, depth_topic=DEPTH,
              info_topic=INFO):
    """(topic, stamp, message) of all frames, in order of time, depth first."""
    for frame in frames:
        size = frame.colour.shape[1], frame.colour.shape[0]
        yield depth_topic, frame.stamp_ns, messages.depth(frame, depth)
        if info_topic:
            yield info_topic, frame.stamp_ns, messages.info(frame.stamp_ns, camera, size)
        yield rgb_topic, frame.stamp_ns, messages.colour(frame, rgb)


def write_mcap(path, said, compression="zstd", **how):
    """By the library `mcap`, in chunks unless told otherwise."""
    with open(path, "wb") as file:
        writer = mcap.writer.Writer(file, chunk_size=1 << 20, compression=PACKING[compression], **how)
        writer.start("ros2", "test")
        channels = {}
        for topic, stamp_ns, message in said:
            kind = message.__msgtype__
            if topic not in channels:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], stamp_ns + 5 * 10**6,
                               bytes(STORE.serialize_cdr(message, kind)), stamp_ns + 5 * 10**6)
        writer.finish()
    return path


def write_ros2(path, said, plugin, compression=None):
    """A folder with metadata.yaml, by `rosbags`."""
    writer = Ros2Writer(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(*compression)
    with writer:
        connections = {}
        for topic, stamp_ns, message in said:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], stamp_ns, STORE.serialize_cdr(message, kind))
    return path


def write_ros1(path, said, compression=None):
    """By `rosbags`, of messages of STORE1."""
    writer = Ros1Writer(path)
    if compression:
        writer.set_compression(Ros1Writer.CompressionFormat[compression])
    with writer:
        connections = {}
        for topic, stamp_ns, message in said:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE1)
            writer.write(connections[topic], stamp_ns, STORE1.serialize_ros1(message, kind))
    return path
