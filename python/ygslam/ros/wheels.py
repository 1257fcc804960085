"""Wheel odometry: out of nav_msgs/Odometry, into the Slam, from the thread that hears it."""
from __future__ import annotations

import math
import struct

import numpy as np
import ygslam

from . import frames, wire
from .imu import FROM_TF


def pose_of(data: bytes) -> tuple[int, str, tuple[float, ...]]:
    """Of a serialised nav_msgs/Odometry: stamp [ns], the frame that moves, x y z qx qy qz qw.
    @throws ValueError where the message ends early."""
    head = wire.header(data)
    order = "<" if data[1] & 1 else ">"
    at = 4 + (head.end - 4 + 3) // 4 * 4
    try:
        (length,) = struct.unpack_from(order + "I", data, at)
        child = data[at + 4:at + 3 + length].decode("utf-8", "replace")
        at = 4 + (at + length + 7) // 8 * 8
        return head.t_ns, child, struct.unpack_from(order + "7d", data, at)
    except struct.error as error:
        raise ValueError("the message ends early") from error


class WheelInput:
    """@param wanted parameter `odom`: empty, a calibration file, or `tf`: usual noise, the camera's place on the frame
    that moves by /tf_static. @throws ygslam.Error for what the file holds."""

    def __init__(self, wanted: str):
        self._file = ygslam.Wheels.read(wanted) if wanted and wanted != FROM_TF else None
        self.is_used, self._by_tf = bool(wanted), wanted == FROM_TF
        self.frame, self.received = "", 0

    def what_is_missing(self, camera_frame: str, tree) -> str:
        """Empty if Wheels can be made of what is known."""
        if not self._by_tf:
            return ""
        if not self.frame:
            return "no message on odom yet"
        if tree.transform(self.frame, camera_frame) is None:
            return f"no static transform from {self.frame} to {camera_frame}: publish it, or name a file in odom"
        return ""

    def wheels(self, camera_frame: str, tree) -> ygslam.Wheels | None:
        if self._by_tf:
            return ygslam.Wheels(tree.transform(self.frame, camera_frame))
        return self._file

    def take(self, data: bytes, engine) -> None:
        """@throws ValueError, ygslam.Error for a message that is none."""
        t_ns, frame, pose = pose_of(data)
        self.frame = self.frame or frame
        self.received += 1
        if all(map(math.isfinite, pose)) and np.linalg.norm(pose[3:]) > 0:
            engine.push_odometry(t_ns, frames.matrix(pose[:3], pose[3:]))
