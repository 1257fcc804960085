"""Readings of an IMU: out of sensor_msgs/Imu, into the Slam, from the thread that hears them."""
from __future__ import annotations

import math
import struct

import ygslam

from . import wire

FROM_TF = "tf"
_VALUES = struct.Struct("<37d")  # orientation 4, its covariance 9, angular velocity 3 and 9, acceleration 3 and 9


def reading_of(data: bytes) -> tuple[int, str, list[float], list[float]]:
    """Of a serialised sensor_msgs/Imu: stamp [ns], frame, angular velocity [rad/s], acceleration [m/s2].
    @throws ValueError where the message ends early."""
    head = wire.header(data)
    order = "<" if data[1] & 1 else ">"
    at = 4 + (head.end - 4 + 7) // 8 * 8
    if at + _VALUES.size > len(data):
        raise ValueError("the message ends early")
    values = struct.unpack_from(f"{order}37d", data, at)
    return head.t_ns, head.frame, list(values[13:16]), list(values[25:28])


class ImuInput:
    """@param wanted parameter `imu`: empty, a calibration file, or `tf`: usual noise, its place by /tf_static.
    @throws ygslam.Error for what the file holds."""

    def __init__(self, wanted: str):
        self._file = ygslam.Imu.read(wanted) if wanted and wanted != FROM_TF else None
        self.is_used, self._by_tf = bool(wanted), wanted == FROM_TF
        self.frame, self.received = "", 0

    def what_is_missing(self, camera_frame: str, tree) -> str:
        """Empty if an Imu can be made of what is known."""
        if not self._by_tf:
            return ""
        if not self.frame:
            return "no message on imu yet"
        if tree.transform(camera_frame, self.frame) is None:
            return f"no static transform from {camera_frame} to {self.frame}: publish it, or name a file in imu"
        return ""

    def imu(self, camera_frame: str, tree) -> ygslam.Imu | None:
        if self._by_tf:
            return ygslam.Imu(tree.transform(camera_frame, self.frame))
        return self._file

    def take(self, data: bytes, engine) -> None:
        """@throws ValueError, ygslam.Error for a message that is none."""
        t_ns, frame, rates, accelerations = reading_of(data)
        self.frame = self.frame or frame
        self.received += 1
        if all(map(math.isfinite, rates + accelerations)):
            engine.push_imu(t_ns, rates, accelerations)
