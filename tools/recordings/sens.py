"""ScanNet's .sens, version 4: frames of a colour file, depth and a pose one after the other."""
import struct
import zlib

import numpy as np

from .recording import Camera, Colour, Depth, Fault, Recording, read_exactly

COLOUR_KINDS = {0: "rgb8", 1: "png", 2: "jpeg"}
RAW_DEPTH, ZLIB_DEPTH = 0, 1
FRAME_HEAD = struct.Struct("<64x4Q")  # pose, stamps and sizes of colour and depth
PERIOD_NS = 10**9 // 30
MOST_APART_NS = 20 * 10**6  # what ygslam takes for a pair


def matrix(file):
    return np.frombuffer(read_exactly(file, 64, "the head"), "<f4").reshape(4, 4).astype(float)


def pinhole(size, intrinsic):
    return Camera(*size, intrinsic[0, 0], intrinsic[1, 1], intrinsic[0, 2], intrinsic[1, 2])


def scan(file, count, size):
    """(place, colour bytes, depth bytes, stamps in us) of each frame; the images are not read."""
    frames = []
    for i in range(count):
        head = read_exactly(file, FRAME_HEAD.size, f"frame {i} of {count}")
        colour_us, depth_us, colour_bytes, depth_bytes = FRAME_HEAD.unpack(head)
        at = file.tell()
        if at + colour_bytes + depth_bytes > size:
            raise Fault(f"ends early, in frame {i} of {count}")
        frames.append((at, colour_bytes, depth_bytes, colour_us, depth_us))
        file.seek(at + colour_bytes + depth_bytes)
    return frames


def stamps_of(frames):
    """(colour, depth) of each frame in ns, and a note: where the file's cannot be meant, 30 Hz."""
    told = np.array([frame[3:] for frame in frames], dtype=np.uint64)
    if np.all(told < 2**51):
        told = told.astype(np.int64) * 1000
        if np.all(np.diff(told, axis=0) > 0) and np.all(np.abs(told[:, 0] - told[:, 1]) <= MOST_APART_NS):
            return told.tolist(), []
    return ([(i * PERIOD_NS, i * PERIOD_NS) for i in range(len(frames))],
            ["its stamps do not rise pair by pair: frames are taken for 30 a second"])


def depth_of(data, kind, size):
    expected = 2 * size[0] * size[1]
    if kind == ZLIB_DEPTH:
        unpacker = zlib.decompressobj()
        try:
            data = unpacker.decompress(data, expected + 1)
        except zlib.error as error:
            raise Fault(f"damaged depth ({error})") from error
    if len(data) != expected:
        raise Fault("a depth image has another size than was promised")
    return np.frombuffer(data, "<u2").reshape(size[1], size[0])


def images_of(path, frames, stamps, colour_kind, colour_size, depth_kind, depth_size, unit_m):
    with open(path, "rb") as file:
        for (at, colour_bytes, depth_bytes, *_), (colour_ns, depth_ns) in zip(frames, stamps):
            file.seek(at)
            content = read_exactly(file, colour_bytes, "a colour image")
            if colour_kind == "rgb8":
                if len(content) != 3 * colour_size[0] * colour_size[1]:
                    raise Fault("a colour image has another size than was promised")
                content = np.frombuffer(content, np.uint8).reshape(colour_size[1], colour_size[0], 3)
            packed = read_exactly(file, depth_bytes, "a depth image")
            yield Colour(colour_ns, content, colour_kind)
            yield Depth(depth_ns, depth_of(packed, depth_kind, depth_size), unit_m)


def open_recording(path):
    with open(path, "rb") as file:
        _, name_bytes = struct.unpack("<IQ", read_exactly(file, 12, "the head"))
        if name_bytes > 4096:
            raise Fault("is no .sens of version 4, or damaged")
        read_exactly(file, name_bytes, "the head")
        colour_K, T_sensor_colour, depth_K, T_sensor_depth = (matrix(file) for _ in range(4))
        head = struct.Struct("<2i4IfQ")
        colour_kind, depth_kind, *sizes, units, count = head.unpack(
            read_exactly(file, head.size, "the head"))
        colour_size, depth_size = sizes[:2], sizes[2:]
        if colour_kind not in COLOUR_KINDS or depth_kind not in (RAW_DEPTH, ZLIB_DEPTH):
            raise Fault(f"compressed otherwise (colour {colour_kind}, depth {depth_kind}) than raw, PNG, "
                        "JPEG and zlib")
        if not np.isfinite(units) or units <= 0:
            raise Fault(f"a depth of {units:g} units per metre")
        if count == 0:
            raise Fault("has no images")
        frames = scan(file, count, path.stat().st_size)
    stamps, notes = stamps_of(frames)
    cameras = [pinhole(colour_size, colour_K), pinhole(depth_size, depth_K)]
    for camera, name in zip(cameras, ("colour", "depth")):  # before images of that size are made
        camera.check(name)
    if not np.all(np.isfinite(T_sensor_colour)) or abs(np.linalg.det(T_sensor_colour)) < 1e-6:
        raise Fault("the transform between its cameras is no rigid motion")
    # ScanNet's own reader takes the depth camera's for T_colour_depth, and colour's is the identity.
    T_colour_depth = np.linalg.inv(T_sensor_colour) @ T_sensor_depth
    return Recording(*cameras, T_colour_depth,
                     images_of(path, frames, stamps, COLOUR_KINDS[colour_kind], colour_size, depth_kind,
                               depth_size, 1 / units), notes)
