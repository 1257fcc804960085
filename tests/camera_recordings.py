"""Recordings as cameras' own software makes them, written here after the published formats."""
import io
import json
import struct
import zipfile
import zlib

import numpy as np
from PIL import Image
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_typestore

from bags import png_bytes

ROS1 = get_typestore(Stores.ROS1_NOETIC)


def jpeg_bytes(array):
    out = io.BytesIO()
    Image.fromarray(array).save(out, "JPEG", quality=95)
    return out.getvalue()


def intrinsic(fx, fy, cx, cy):
    return np.array([[fx, 0, cx, 0], [0, fy, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "<f4")


def sens(frames, colour_camera, depth_camera, T_colour_depth=None, jpeg=False, units=1000, stamps=True,
         T_device_colour=None):
    """ScanNet's, version 4. Of frames: stamp_ns, colour, depth_mm."""
    T_device = np.eye(4) if T_device_colour is None else T_device_colour
    T = T_device @ (np.eye(4) if T_colour_depth is None else T_colour_depth)
    colour, depth = frames[0].colour, frames[0].depth_mm
    data = struct.pack("<IQ", 4, 6) + b"a test"
    for matrix in (intrinsic(*colour_camera), T_device, intrinsic(*depth_camera), T):
        data += np.asarray(matrix, "<f4").tobytes()
    data += struct.pack("<2i4IfQ", 2 if jpeg else 1, 1, colour.shape[1], colour.shape[0], depth.shape[1],
                        depth.shape[0], units, len(frames))
    for frame in frames:
        image = jpeg_bytes(frame.colour) if jpeg else png_bytes(frame.colour)
        packed = zlib.compress(frame.depth_mm.astype("<u2").tobytes())
        stamp_us = frame.stamp_ns // 1000 if stamps else 0
        data += np.eye(4, dtype="<f4").tobytes()
        data += struct.pack("<4Q", stamp_us, stamp_us, len(image), len(packed)) + image + packed
    return data + struct.pack("<Q", 0)  # no inertial measurements


def r3d(path, frames, camera, compress, **about):
    """Record3D's. @param compress that of LZFSE."""
    colour, depth = frames[0].colour, frames[0].depth_mm
    fx, fy, cx, cy = camera
    told = {"w": colour.shape[1], "h": colour.shape[0], "dw": depth.shape[1], "dh": depth.shape[0],
            "fps": 60, "K": [fx, 0, 0, 0, fy, 0, cx, cy, 1],
            "frameTimestamps": [frame.stamp_ns * 1e-9 for frame in frames], **about}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", json.dumps({k: v for k, v in told.items() if v is not None}))
        for i, frame in enumerate(frames):
            metres = frame.depth_mm.astype("<f4") / np.float32(1000)
            archive.writestr(f"rgbd/{i}.jpg", jpeg_bytes(frame.colour))
            archive.writestr(f"rgbd/{i}.depth", compress(metres.tobytes()))
            archive.writestr(f"rgbd/{i}.conf", compress(bytes(frame.depth_mm.size)))
    return path


def element(kind, content):
    """Of Matroska, with a size of eight bytes."""
    number = kind.to_bytes((kind.bit_length() + 7) // 8, "big")
    return number + (len(content) | 1 << 56).to_bytes(8, "big") + content


def unsigned(kind, value):
    return element(kind, value.to_bytes(max(1, (value.bit_length() + 7) // 8), "big"))


def kinect_calibration(colour_terms, depth_terms, rotation, translation):
    def camera(where, terms, size, R, t):
        return {"Location": "CALIBRATION_CameraLocation" + where, "MetricRadius": 1.7,
                "SensorWidth": size[0], "SensorHeight": size[1],
                "Rt": {"Rotation": np.asarray(R).reshape(-1).tolist(), "Translation": list(t)},
                "Intrinsics": {"ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
                               "ModelParameterCount": 14, "ModelParameters": list(terms)}}
    return {"CalibrationInformation": {"Cameras": [
        camera("D0", depth_terms, (1024, 1024), np.eye(3), (0, 0, 0)),
        camera("PV0", colour_terms, (4096, 3072), rotation, translation)]}}


def mkv(frames, calibration, colour_codec=b"MJPG", scale_ns=1000):
    """The Azure Kinect SDK's: two tracks, a cluster for each pair, blocks in both of their wrappings."""
    def track(number, name, image, codec):
        header = struct.pack("<IiiHH4sIiiII", 40, image.shape[1], image.shape[0], 1, 16, codec, 0, 0, 0, 0, 0)
        video = unsigned(0xB0, image.shape[1]) + unsigned(0xBA, image.shape[0])
        return element(0xAE, unsigned(0xD7, number) + element(0x536E, name) + element(0x86, b"V_MS/VFW/FOURCC")
                       + element(0x63A2, header) + element(0xE0, video))

    def block(number, image):
        return bytes([0x80 | number]) + struct.pack(">hB", 0, 0x80) + image
    parts = element(0x1549A966, unsigned(0x2AD7B1, scale_ns))
    parts += element(0x1654AE6B, track(1, b"COLOR", frames[0].colour, colour_codec)
                     + track(2, b"DEPTH", frames[0].depth_mm, b"b16g"))
    parts += element(0xEC, bytes(100))  # what was left free
    parts += element(0x1941A469, element(0x61A7, element(0x466E, b"calibration.json") +
                                         element(0x465C, json.dumps(calibration).encode())))
    for frame in frames:
        depth = frame.depth_mm.astype(">u2").tobytes()
        parts += element(0x1F43B675, unsigned(0xE7, frame.stamp_ns // scale_ns)
                         + element(0xA3, block(1, jpeg_bytes(frame.colour)))
                         + element(0xA0, element(0xA1, block(2, depth))))
    return element(0x1A45DFA3, element(0x4282, b"matroska")) + element(0x18538067, parts)


def realsense(path, frames, cameras, transforms, units_m=0.001, models=("Brown Conrady",) * 2,
              terms=((0.0,) * 5,) * 2):
    """The RealSense SDK's, packed by lz4. Pairs are of colour and depth; transforms are geometry_msgs'
    (translation, x y z w) from the reference stream, or None."""
    types = dict(ROS1.types)
    time, first = types["builtin_interfaces/msg/Time"], 1

    def header(stamp_ns):
        return types["std_msgs/msg/Header"](0, time(*divmod(stamp_ns, 10**9)), "0")

    def image(stamp_ns, array, encoding):
        rows = np.frombuffer(array.tobytes(), np.uint8)
        return types["sensor_msgs/msg/Image"](header(stamp_ns), *array.shape[:2], encoding, 0,
                                              rows.size // array.shape[0], rows)
    writer = Ros1Writer(path)
    writer.set_compression(Ros1Writer.CompressionFormat.LZ4)
    with writer:
        connections = {}

        def say(topic, stamp_ns, message):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS1)
            writer.write(connections[topic], stamp_ns, ROS1.serialize_ros1(message, kind))
        sensors = ("/device_0/sensor_1/Color_0", "/device_0/sensor_0/Depth_0")
        shapes = frames[0].colour.shape, frames[0].depth_mm.shape
        for sensor, (fx, fy, cx, cy), shape, model, d in zip(sensors, cameras, shapes, models, terms):
            region = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
            say(sensor + "/info/camera_info", first, types["sensor_msgs/msg/CameraInfo"](
                header(0), *shape[:2], model, np.array(d), np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0]),
                np.zeros(9), np.zeros(12), 0, 0, region))
        if units_m:
            say("/device_0/sensor_0/option/Depth Units/value", first, types["std_msgs/msg/Float32"](units_m))
        for sensor, transform in zip(sensors, transforms):
            if transform:
                say(sensor + "/tf/0", first, types["geometry_msgs/msg/Transform"](
                    types["geometry_msgs/msg/Vector3"](*transform[0]),
                    types["geometry_msgs/msg/Quaternion"](*transform[1])))
        for i, frame in enumerate(frames):
            say(sensors[1] + "/image/data", 10**7 * (2 * i + 1), image(frame.stamp_ns, frame.depth_mm, "mono16"))
            say(sensors[0] + "/image/data", 10**7 * (2 * i + 2), image(frame.stamp_ns, frame.colour, "rgb8"))
    return path
