"""Readings of an IMU: out of sensor_msgs/Imu, into the Slam, from the thread that hears them."""
from __future__ import annotations

import math
import struct

import ygslam

from . import wire
from .placed_sensor import PlacedSensor

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


class ImuInput(PlacedSensor):
    topic, kind = "imu", ygslam.Imu

    def frames(self, camera_frame: str) -> tuple[str, str]:
        return camera_frame, self.frame

    def take(self, data: bytes, engine) -> None:
        """@throws ValueError, ygslam.Error for a message that is none."""
        t_ns, frame, rates, accelerations = reading_of(data)
        self.note(frame)
        if all(map(math.isfinite, rates + accelerations)):
            engine.push_imu(t_ns, rates, accelerations)
