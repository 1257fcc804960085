"""Messages of a frame. Needs the packages of messages, but no rclpy."""
from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion, TransformStamped,
                               Vector3)
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from .frames import UNKNOWN, matrix, quaternion, rotation_vector


def header(t_ns: int, frame: str) -> Header:
    return Header(stamp=Time(sec=t_ns // 10**9, nanosec=t_ns % 10**9), frame_id=frame)


def _quaternion(T) -> Quaternion:
    x, y, z, w = quaternion(T)
    return Quaternion(x=x, y=y, z=z, w=w)


def point(xyz) -> Point:
    return Point(x=float(xyz[0]), y=float(xyz[1]), z=float(xyz[2]))


def vector(xyz) -> Vector3:
    return Vector3(x=float(xyz[0]), y=float(xyz[1]), z=float(xyz[2]))


def pose(T) -> Pose:
    return Pose(position=point(T[:3, 3]), orientation=_quaternion(T))


def transform(t_ns: int, parent: str, child: str, T_parent_child) -> TransformStamped:
    message = TransformStamped(header=header(t_ns, parent), child_frame_id=child)
    message.transform.translation = vector(T_parent_child[:3, 3])
    message.transform.rotation = _quaternion(T_parent_child)
    return message


def matrix_of(message: TransformStamped) -> np.ndarray:
    t, q = message.transform.translation, message.transform.rotation
    return matrix((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))


def odometry(t_ns: int, frame: str, child: str, T_odom_base, covariance, seen_covariance, step=None) -> Odometry:
    """@param seen_covariance without what odom has drifted. @param step (T_before_now, seconds) of the base, for its
    velocity; None = unknown."""
    message = Odometry(header=header(t_ns, frame), child_frame_id=child)
    message.pose.pose = pose(T_odom_base)
    message.pose.covariance = covariance.reshape(-1)
    message.twist.covariance = (UNKNOWN * np.eye(6)).reshape(-1)
    if step is None:
        return message
    T_before_now, seconds = step
    message.twist.twist.linear = vector(T_before_now[:3, 3] / seconds)
    message.twist.twist.angular = vector(rotation_vector(T_before_now) / seconds)
    # Both poses' errors, as if independent: too large rather than too small. Axes of the base.
    both = np.kron(np.eye(2), T_odom_base[:3, :3].T)
    message.twist.covariance = (2 / seconds**2 * both @ seen_covariance @ both.T).reshape(-1)
    return message


def pose_with_covariance(t_ns: int, frame: str, T_map_base, covariance) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped(header=header(t_ns, frame))
    message.pose.pose = pose(T_map_base)
    message.pose.covariance = covariance.reshape(-1)
    return message


def pose_stamped(t_ns: int, frame: str, T) -> PoseStamped:
    return PoseStamped(header=header(t_ns, frame), pose=pose(T))


def status(t_ns: int, name: str, level: int, line: str, values: dict) -> DiagnosticArray:
    """@param level 0 OK, 1 warning, 2 error, 3 stale."""
    entry = DiagnosticStatus(level=bytes([level]), name=name, message=line, hardware_id="ygslam",
                             values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])
    return DiagnosticArray(header=header(t_ns, ""), status=[entry])
