"""Recordings of the Azure Kinect SDK: Matroska with MJPEG colour, big-endian depth in millimetres and
the device's calibration.json."""
import dataclasses
import json

import numpy as np

from .matroska import Matroska
from .recording import (GOOD_FIT_PX, Camera, Colour, Depth, Fault, Recording, distorted, fit_plumb_bob,
                        plane_grid)

# How the image of each mode is cut out of the one that was calibrated: (size of all of it, scaled to
# the mode's pixels; where the mode's begins).
DEPTH_MODES = {(320, 288): ((512, 512), (96, 90)), (640, 576): ((1024, 1024), (192, 180)),
               (512, 512): ((512, 512), (0, 0)), (1024, 1024): ((1024, 1024), (0, 0))}
COLOUR_MODES = {(1280, 720): ((1280, 960), (0, 120)), (1920, 1080): ((1920, 1440), (0, 180)),
                (2560, 1440): ((2560, 1920), (0, 240)), (2048, 1536): ((2048, 1536), (0, 0)),
                (3840, 2160): ((3840, 2880), (0, 360)), (4096, 3072): ((4096, 3072), (0, 0))}
BROWN_CONRADY = "CALIBRATION_LensDistortionModelBrownConrady"
USUAL_REACH = 1.7  # on the plane z = 1, where the calibration says none


def calibrated(cameras, where):
    for camera in cameras:
        if str(camera["Location"]).startswith("CALIBRATION_CameraLocation" + where):
            return camera
    raise Fault(f"calibration.json has no camera {where}")


def world_to_camera(about):
    T = np.eye(4)
    T[:3, :3] = np.array(about["Rt"]["Rotation"], float).reshape(3, 3)
    T[:3, 3] = about["Rt"]["Translation"]
    return T


def camera_of(about, track, modes, what):
    """(Camera, note)."""
    size = (track.width, track.height)
    if size not in modes:
        raise Fault(f"{what} images of {size[0]} x {size[1]} pixels, which no mode has")
    if about["Intrinsics"]["ModelType"] != BROWN_CONRADY:
        raise Fault(f"calibration.json: {what} distortion of another model than Brown and Conrady's")
    (whole_x, whole_y), (cut_x, cut_y) = modes[size]
    cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, codx, cody, p2, p1 = about["Intrinsics"]["ModelParameters"][:14]
    if what == "colour" and about["SensorWidth"] * 9 == about["SensorHeight"] * 16:
        # Of the 16:9 image, which older devices were calibrated on: a part of the 4:3 one.
        cy, fy = 0.75 * cy + 0.125, 0.75 * fy
    if codx != 0 or cody != 0:
        raise Fault(f"calibration.json: {what} distortion has a centre of its own")
    # Shares of the image from its corner, pixels from the first one's centre.
    camera = Camera(*size, fx * whole_x, fy * whole_y, cx * whole_x - cut_x - 0.5, cy * whole_y - cut_y - 0.5)
    camera.check(what)
    exact = dataclasses.replace(camera, model="rational_polynomial", terms=(k1, k2, p1, p2, k3, k4, k5, k6))
    x, y = plane_grid(about.get("MetricRadius") or USUAL_REACH)
    rms_px, worst_px = fit_plumb_bob(camera, x, y, *distorted(x, y, *exact.terms))
    off = f"off by {rms_px:.2f} px (root mean square; {worst_px:.1f} px at worst)"
    if rms_px > GOOD_FIT_PX:
        return exact, f"{what} distortion keeps its eight terms, which ygslam does not read: five are {off}"
    return camera, f"{what} distortion is written with five terms instead of eight: {off}"


def track_of(file, name):
    for track in file.tracks:
        if track.name == name or file.tags.get(f"K4A_{name}_TRACK") == str(track.number):
            return track
    raise Fault(f"has no track {name}")


def images_of(file, colour, depth, is_jpeg):
    for number, stamp_ns, data in file.blocks():
        if number == colour.number:
            if is_jpeg:
                yield Colour(stamp_ns, bytes(data), "jpeg")
                continue
            if len(data) != 4 * colour.width * colour.height:
                raise Fault("a colour image has another size than was promised")
            yield Colour(stamp_ns, np.frombuffer(data, np.uint8).reshape(colour.height, colour.width, 4), "bgra8")
        elif number == depth.number:
            if len(data) != 2 * depth.width * depth.height:
                raise Fault("a depth image has another size than was promised")
            values = np.frombuffer(data, ">u2").astype(np.uint16)
            yield Depth(stamp_ns, values.reshape(depth.height, depth.width))


def open_recording(path):
    file = Matroska(path)
    colour, depth = track_of(file, "COLOR"), track_of(file, "DEPTH")
    compression = colour.codec[16:20]
    if compression not in (b"MJPG", b"BGRA"):
        raise Fault(f"colour is {compression.decode('latin-1')!r}; MJPG and BGRA can be converted")
    if depth.codec[16:20] != b"b16g":
        raise Fault("depth is not of 16 bits as the SDK writes it")
    try:
        cameras = json.loads(file.attachments.get("calibration.json", b""))["CalibrationInformation"]["Cameras"]
        about_depth, about_colour = calibrated(cameras, "D0"), calibrated(cameras, "PV0")
        depth_camera, depth_note = camera_of(about_depth, depth, DEPTH_MODES, "depth")
        colour_camera, colour_note = camera_of(about_colour, colour, COLOUR_MODES, "colour")
        T = world_to_camera(about_colour) @ np.linalg.inv(world_to_camera(about_depth))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError, np.linalg.LinAlgError) as error:
        raise Fault("calibration.json is missing or damaged") from error
    return Recording(colour_camera, depth_camera, T, images_of(file, colour, depth, compression == b"MJPG"),
                     [colour_note, depth_note])
