"""Recordings of the RealSense SDK: ROS 1 bags with topics and messages of its own."""
import re

import numpy as np
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .recording import (GOOD_FIT_PX, Camera, Colour, Depth, Fault, Recording, distorted, fit_plumb_bob,
                        pixel_grid, plane_grid)

STREAM = re.compile(r"/device_0/sensor_(\d+)/(Depth|Color)_0/(image/data|info/camera_info|tf/0)")
UNITS = re.compile(r"/device_0/sensor_(\d+)/option/Depth Units/value")
COLOUR_KINDS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
DEPTH_KINDS = ("mono16", "16UC1")
WIDEST = 1.7  # of the lenses that are fitted, on the plane z = 1


def types_of(connections):
    """The messages as the file itself describes them."""
    store, found = get_typestore(Stores.EMPTY), {}
    for connection in connections:
        found.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store.register(found)
    return store


def matrix_of(message):
    """4x4 of a geometry_msgs/Transform."""
    q, t = message.rotation, message.translation
    x, y, z, w = np.array([q.x, q.y, q.z, q.w]) / max(1e-9, np.linalg.norm([q.x, q.y, q.z, q.w]))
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = [t.x, t.y, t.z]
    return T


def camera_of(info, what):
    """(Camera, notes): the five terms of each model of the SDK are k1 k2 p1 p2 k3."""
    K, terms = np.array(info.K, float), [float(d) for d in info.D][:5]
    terms += [0.0] * (5 - len(terms))
    camera = Camera(int(info.width), int(info.height), K[0], K[4], K[2], K[5])
    camera.check(what)
    model = info.distortion_model.replace("_", " ").lower()
    if not any(terms):
        return camera, []
    if model == "brown conrady":
        camera.terms = tuple(terms)
        return camera, []
    if model == "inverse brown conrady":  # from the image to the lens
        xd, yd = pixel_grid(camera)
        x, y = distorted(xd, yd, *terms)
    elif model == "modified brown conrady":  # tangential terms of what was moved radially
        x, y = plane_grid(WIDEST)
        xr, yr = distorted(x, y, terms[0], terms[1], 0, 0, terms[4])
        r2 = x * x + y * y
        xd = xr + 2 * terms[2] * xr * yr + terms[3] * (r2 + 2 * xr * xr)
        yd = yr + 2 * terms[3] * xr * yr + terms[2] * (r2 + 2 * yr * yr)
    else:
        raise Fault(f"{what} distortion of model '{info.distortion_model[:40]}', which ygslam does not read")
    rms_px, worst_px = fit_plumb_bob(camera, x, y, xd, yd)
    off = f"off by {rms_px:.2f} px (root mean square; {worst_px:.1f} px at worst)"
    if rms_px > GOOD_FIT_PX:
        raise Fault(f"{what} distortion of model '{info.distortion_model[:40]}': in ygslam's it is {off}")
    return camera, [f"{what} distortion is written in another model: {off}"]


def pixels_of(message, pixel_type, channels):
    """Without the bytes that pad rows."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    used = width * channels * np.dtype(pixel_type).itemsize
    if step < used or len(message.data) < step * height or height < 1 or width < 1:
        raise Fault("an image has another size than was promised")
    rows = np.asarray(message.data)[:step * height].reshape(height, step)[:, :used]
    shape = (height, width) if channels == 1 else (height, width, channels)
    return np.ascontiguousarray(rows).view(pixel_type).reshape(shape)


def image_of(message, stream, unit_m):
    stamp = message.header.stamp
    stamp_ns = int(stamp.sec) * 10**9 + int(stamp.nanosec)
    kind = message.encoding
    if stream == "Depth":
        if kind not in DEPTH_KINDS:
            raise Fault(f"depth is '{kind[:40]}'; Z16 can be converted")
        return Depth(stamp_ns, pixels_of(message, ">u2" if message.is_bigendian else "<u2", 1).astype(np.uint16),
                     unit_m)
    if kind not in COLOUR_KINDS:
        raise Fault(f"colour is '{kind[:40]}'; {', '.join(COLOUR_KINDS)} can be converted")
    return Colour(stamp_ns, pixels_of(message, np.uint8, COLOUR_KINDS[kind]), kind)


class Bag:
    def __init__(self, path):
        self.path, self.topics = path, {}
        with Reader(path) as reader:
            for connection in reader.connections:
                if found := STREAM.fullmatch(connection.topic):
                    self.topics.setdefault((found[2], found[3]), []).append(connection)
                elif found := UNITS.fullmatch(connection.topic):
                    self.topics.setdefault(("units", found[1]), []).append(connection)
            for stream in ("Color", "Depth"):
                for what in ("image/data", "info/camera_info"):
                    if (stream, what) not in self.topics:
                        raise Fault(f"has no topic {stream}_0/{what}: is no recording of the RealSense SDK with "
                                    "colour and depth")
            self.store = types_of([c for of_one in self.topics.values() for c in of_one])

    def messages(self, *keys):
        """(connection, message) in order of time."""
        wanted = [c for key in keys for c in self.topics.get(key, [])]
        with Reader(self.path) as reader:
            for connection, _, data in reader.messages(wanted) if wanted else ():
                yield connection, self.store.deserialize_ros1(data, connection.msgtype)

    def first(self, *key):
        """The first message of a topic, or None."""
        return next((message for _, message in self.messages(key)), None)

    def unit_m(self):
        sensor = STREAM.fullmatch(self.topics["Depth", "image/data"][0].topic)[1]
        told = self.first("units", sensor)
        return (0.001, ["its unit of depth is not told and taken for a millimetre"]) if told is None \
            else (round(float(told.data), 9), [])

    def T_from_reference(self, stream):
        told = self.first(stream, "tf/0")
        return None if told is None else matrix_of(told)

    def images(self, unit_m):
        keys = [(stream, "image/data") for stream in ("Color", "Depth")]
        for connection, message in guarded(self.messages(*keys)):
            yield image_of(message, STREAM.fullmatch(connection.topic)[2], unit_m)


def guarded(messages):
    """What the library says of damage, in one line."""
    while True:
        try:
            item = next(messages)
        except StopIteration:
            return
        except Fault:
            raise
        except Exception as error:  # damage raises whatever the place it hits does
            text = " ".join(str(error).split())[:120]
            raise Fault(f"is damaged or not closed ({text or type(error).__name__})") from error
        yield item


def read_head(path):
    bag = Bag(path)
    colour, colour_notes = camera_of(bag.first("Color", "info/camera_info"), "colour")
    depth, depth_notes = camera_of(bag.first("Depth", "info/camera_info"), "depth")
    unit_m, unit_notes = bag.unit_m()
    if not 1e-6 <= unit_m <= 1:
        raise Fault(f"a depth unit of {unit_m:g} m")
    notes = colour_notes + depth_notes + unit_notes
    to_colour, to_depth = bag.T_from_reference("Color"), bag.T_from_reference("Depth")
    if to_colour is None or to_depth is None:
        notes.append("where its cameras are is not told: depth is taken for registered to colour")
        to_colour = to_depth = np.eye(4)
    yield Recording(colour, depth, to_colour @ np.linalg.inv(to_depth), bag.images(unit_m), notes)


def open_recording(path):
    return next(guarded(read_head(path)))
