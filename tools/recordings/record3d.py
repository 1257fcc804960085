"""Record3D's .r3d: a ZIP archive of JPEGs, LZFSE-compressed depth in metres, and `metadata`, a JSON."""
import json
import math
import zipfile
import zlib

import liblzfse
import numpy as np

from .recording import MOST_IMAGE_BYTES, Camera, Colour, Depth, Fault, Recording

# Depth of recordings that do not say its size, by the number of pixels: LiDAR, and the front camera.
OLD_SIZES = {256 * 192: (192, 256), 640 * 480: (480, 640)}


def member(archive, name):
    """A file's content."""
    try:
        if archive.getinfo(name).file_size > MOST_IMAGE_BYTES:
            raise Fault(f"{name} is too large")
        return archive.read(name)
    except KeyError as error:
        raise Fault(f"{name} is missing") from error
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise Fault(f"{name} is damaged ({error})") from error


def number_of(about, key):
    value = about.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise Fault(f"metadata: {key} is no number")
    return value


def numbers_of(about, key):
    try:
        return np.array(about[key], dtype=float)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise Fault(f"metadata: {key} is no list of numbers") from error


def read_depth(archive, name):
    try:
        data = liblzfse.decompress(member(archive, name))
    except liblzfse.error as error:
        raise Fault(f"{name} is damaged ({error})") from error
    if len(data) % 4 != 0:
        raise Fault(f"{name} has {len(data)} bytes")
    return np.frombuffer(data, "<f4")


def depth_size(about, pixels, is_upright):
    if "dw" in about:
        return int(number_of(about, "dw")), int(number_of(about, "dh"))
    if pixels not in OLD_SIZES:
        raise Fault(f"depth images of {pixels} pixels, whose width is not told")
    return OLD_SIZES[pixels] if is_upright else OLD_SIZES[pixels][::-1]


def stamps_of(about, frames):
    if "frameTimestamps" in about:
        told = numbers_of(about, "frameTimestamps")
        if told.shape != (frames,) or not np.all(np.abs(told) < 2**31):
            raise Fault(f"metadata: frameTimestamps are not those of {frames} frames")
        return [round(t * 1e9) for t in told.tolist()]
    period_ns = 1e9 / max(1.0, number_of(about, "fps"))
    return [round(i * period_ns) for i in range(frames)]


def images_of(path, stamps, size):
    with zipfile.ZipFile(path) as archive:
        for i, stamp_ns in enumerate(stamps):
            yield Colour(stamp_ns, member(archive, f"rgbd/{i}.jpg"), "jpeg")
            depth = read_depth(archive, f"rgbd/{i}.depth")
            if depth.size != size[0] * size[1]:
                raise Fault(f"rgbd/{i}.depth has another size than was promised")
            yield Depth(stamp_ns, depth.reshape(size[1], size[0]))


def open_recording(path):
    try:
        archive = zipfile.ZipFile(path)
    except zipfile.BadZipFile as error:
        raise Fault(f"is no .r3d, or cut off ({error})") from error
    with archive:
        try:
            about = json.loads(member(archive, "metadata"))
        except (ValueError, RecursionError) as error:
            raise Fault("metadata is no JSON") from error
        if not isinstance(about, dict):
            raise Fault("metadata is no JSON object")
        names = set(archive.namelist())
        frames = 0
        while f"rgbd/{frames}.jpg" in names:
            frames += 1
        if frames == 0:
            raise Fault("has no images under rgbd/")
        width, height = int(number_of(about, "w")), int(number_of(about, "h"))
        K = numbers_of(about, "K")
        if K.size != 9:
            raise Fault("metadata: K is no 3 x 3 matrix")
        first = read_depth(archive, "rgbd/0.depth")
    K = K.reshape(3, 3).T  # column by column
    colour = Camera(width, height, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    colour.check("colour")
    dw, dh = size = depth_size(about, first.size, height > width)
    sx, sy = dw / width, dh / height
    # ARKit gives depth as the colour camera would see it, of fewer pixels.
    depth = Camera(dw, dh, colour.fx * sx, colour.fy * sy, (colour.cx + 0.5) * sx - 0.5,
                   (colour.cy + 0.5) * sy - 0.5)
    notes = []
    if "perFrameIntrinsicCoeffs" in about:
        focal = numbers_of(about, "perFrameIntrinsicCoeffs").reshape(-1)[::4]
        if focal.size and np.ptp(focal) > 0.01 * abs(colour.fx):
            notes.append("its focal length changes by more than 1 %; that of K is taken")
    return Recording(colour, depth, np.eye(4), images_of(path, stamps_of(about, frames), size), notes)
