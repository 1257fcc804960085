"""Frames of REP 103 and 105 out of those of the library. T_a_b: 4x4, takes points of b to a [m].

Library: `world` and `drift` (Result.T_odom_camera) have the optical axes of the first camera (x right, y down,
z forward). ROS: map, odom and base have x forward, y left, z up; odom is where base was at first.
"""
from __future__ import annotations

import dataclasses

import numpy as np

LEAST = 1e-8  # variance [m^2, rad^2]: filters take no 0, which the first frame has
UNKNOWN = 1e6  # variance [m^2, rad^2] of what nobody knows

# Of the camera's body (x forward, y left, z up) to its optical frame.
T_BODY_OPTICAL = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def matrix(xyz, xyzw) -> np.ndarray:
    """Of a translation [m] and a quaternion, which need not be of unit length."""
    x, y, z, w = np.asarray(xyzw, float) / np.linalg.norm(xyzw)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), xyz[0]],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), xyz[1]],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), xyz[2]],
                     [0, 0, 0, 1]])


def from_roll_pitch_yaw(x, y, z, roll, pitch, yaw) -> np.ndarray:
    """As a URDF's origin: turned about x, then y, then z of the fixed axes [m, rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
                     [-sp, cp * sr, cp * cr, z],
                     [0, 0, 0, 1]])


def inverse(pose: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def quaternion(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """x, y, z, w of the upper left 3x3: by the largest of the four (Shepperd 1978)."""
    m = rotation
    squares = np.array([m[0, 0] - m[1, 1] - m[2, 2], m[1, 1] - m[0, 0] - m[2, 2], m[2, 2] - m[0, 0] - m[1, 1],
                        m[0, 0] + m[1, 1] + m[2, 2]]) + 1
    i = int(np.argmax(squares))
    if i == 3:
        q = [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [0.0, 0, 0, m[k, j] - m[j, k]]
        q[i], q[j], q[k] = squares[i], m[j, i] + m[i, j], m[k, i] + m[i, k]
    x, y, z, w = np.array(q) / np.linalg.norm(q)
    return float(x), float(y), float(z), float(w)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Axis times angle [rad] of the upper left 3x3."""
    q = np.array(quaternion(rotation))
    q = q if q[3] >= 0 else -q
    sine = np.linalg.norm(q[:3])
    return q[:3] * (2.0 if sine < 1e-12 else 2 * np.arctan2(sine, q[3]) / sine)


def moved_covariance(covariance: np.ndarray, rotation: np.ndarray, lever_m: np.ndarray) -> np.ndarray:
    """6x6 (position, rotations about fixed axes) of a point at `lever_m` from the one it is known of.
    @param rotation 3x3 from the old axes to the new ones. @param lever_m in the new axes."""
    x, y, z = lever_m
    jacobian = np.eye(6)
    jacobian[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]  # rotation x lever
    both = np.kron(np.eye(2), rotation)
    return jacobian @ both @ covariance @ both.T @ jacobian.T


@dataclasses.dataclass(frozen=True)
class Poses:
    """What a frame's result says in ROS's frames."""
    T_map_odom: np.ndarray
    T_odom_base: np.ndarray
    T_map_base: np.ndarray
    covariance: np.ndarray  # of T_odom_base, axes of odom
    map_covariance: np.ndarray  # of T_map_base, axes of map
    seen_covariance: np.ndarray  # as covariance, without what odom has drifted


def poses_of(result, T_base_camera: np.ndarray, T_map_world: np.ndarray) -> Poses:
    """@param result of Slam.process(). @param T_base_camera to the optical frame of the colour camera."""
    T_camera_base = inverse(T_base_camera)
    T_odom_base = T_base_camera @ result.T_odom_camera @ T_camera_base
    T_map_odom = T_map_world @ result.T_world_odom @ T_camera_base

    def of_base(covariance, R_new_old, T_old_camera):
        """@param R_new_old from the axes of `covariance` to ROS's."""
        if covariance[0, 0] >= UNKNOWN:  # what is not known stays as large
            return np.asarray(covariance)
        lever = R_new_old @ T_old_camera[:3, :3] @ T_camera_base[:3, 3]
        return moved_covariance(np.asarray(covariance) + LEAST * np.eye(6), R_new_old, lever)

    R_odom, R_map = T_base_camera[:3, :3], T_map_world[:3, :3]
    return Poses(T_map_odom, T_odom_base, T_map_odom @ T_odom_base,
                 of_base(result.covariance, R_odom, result.T_odom_camera),
                 of_base(result.map_covariance, R_map, result.pose),
                 of_base(result.seen_covariance, R_odom, result.T_odom_camera))
