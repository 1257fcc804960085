"""People and other objects: numbers in the frame `map`, and their messages where these are installed."""
from __future__ import annotations

import dataclasses

import numpy as np

from .frames import UNKNOWN

SOON_S = 1.0  # of the forecast that `people` has


@dataclasses.dataclass(frozen=True)
class MovingObject:
    id: int
    class_name: str
    position_m: np.ndarray  # of a person the point on the floor below his middle, else the middle of what is seen
    velocity_mps: np.ndarray
    centre_m: np.ndarray
    size_m: np.ndarray  # along the axes of map
    covariance_m2: np.ndarray  # (3, 3) of the position
    soon_m: np.ndarray  # where it will be in SOON_S, as `position_m`
    soon_covariance_m2: np.ndarray
    is_visible: bool


def observed(objects, T_map_world: np.ndarray) -> list[MovingObject]:
    """The objects of a result."""
    R = T_map_world[:3, :3]

    def placed(item, after_s):
        place, covariance = item.after(after_s)
        at = R @ place + T_map_world[:3, 3]
        return np.array([at[0], at[1], 0.0]) if item.class_name == "person" else at, R @ covariance @ R.T
    found = []
    for item in objects:
        low, high = np.array(item.min_world_m), np.array(item.max_world_m)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        corners = corners @ R.T + T_map_world[:3, 3]
        size = corners.max(axis=0) - corners.min(axis=0)
        position, covariance = placed(item, 0)
        found.append(MovingObject(item.id, item.class_name, position, R @ item.body_velocity_world_mps,
                                  (corners.max(axis=0) + corners.min(axis=0)) / 2, size, covariance,
                                  *placed(item, SOON_S), item.missing_frames == 0))
    return found


def people_message(header, objects: list[MovingObject]):
    """people_msgs/msg/People: positions on the floor. It has no place for covariances: tags have them, of now and of the
    forecast, as xx xy yy [m2]."""
    from people_msgs.msg import People, Person

    from .messages import point

    def floor_covariance(covariance):
        return " ".join(f"{x:.4f}" for x in (covariance[0, 0], covariance[0, 1], covariance[1, 1]))
    return People(header=header, people=[
        Person(name=str(item.id), position=point(item.position_m), velocity=point(item.velocity_mps),
               reliability=1.0 if item.is_visible else 0.5, tagnames=["covariance_m2", "in_1s_m", "in_1s_covariance_m2"],
               tags=[floor_covariance(item.covariance_m2), f"{item.soon_m[0]:.3f} {item.soon_m[1]:.3f}",
                     floor_covariance(item.soon_covariance_m2)])
        for item in objects if item.class_name == "person"])


def detections_message(header, objects: list[MovingObject]):
    """vision_msgs/msg/Detection3DArray: boxes along the axes of map."""
    from vision_msgs.msg import Detection3D, Detection3DArray, ObjectHypothesisWithPose

    from .messages import point, vector
    message = Detection3DArray(header=header)
    for item in objects:
        guess = ObjectHypothesisWithPose()
        guess.hypothesis.class_id, guess.hypothesis.score = item.class_name, 1.0 if item.is_visible else 0.5
        guess.pose.pose.position = point(item.centre_m)
        covariance = np.diag([UNKNOWN] * 6)
        covariance[:3, :3] = item.covariance_m2
        guess.pose.covariance = covariance.reshape(-1)
        entry = Detection3D(header=header, id=str(item.id), results=[guess])
        entry.bbox.center.position, entry.bbox.size = point(item.centre_m), vector(item.size_m)
        message.detections.append(entry)
    return message
