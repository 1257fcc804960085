"""Wheel odometry: out of nav_msgs/Odometry, into the Slam, from the thread that hears it."""
from __future__ import annotations

import math
import struct

import numpy as np
import ygslam

from . import frames, wire
from .placed_sensor import PlacedSensor


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


class WheelInput(PlacedSensor):
    topic, kind = "odom", ygslam.Wheels

    def frames(self, camera_frame: str) -> tuple[str, str]:
        return self.frame, camera_frame

    def take(self, data: bytes, engine) -> None:
        """@throws ValueError, ygslam.Error for a message that is none."""
        t_ns, frame, pose = pose_of(data)
        self.note(frame)
        if all(map(math.isfinite, pose)) and np.linalg.norm(pose[3:]) > 0:
            engine.push_odometry(t_ns, frames.matrix(pose[:3], pose[3:]))
