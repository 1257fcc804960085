"""People and other objects: numbers in the frame `map`, and their messages where these are installed."""
from __future__ import annotations

import dataclasses

import numpy as np

from .frames import UNKNOWN

DRIFT_MPS = 0.5  # [m/s] how fast somebody hidden may have left his course


@dataclasses.dataclass(frozen=True)
class MovingObject:
    id: int
    class_name: str
    position_m: np.ndarray  # of a person the point on the floor below him, else the centre of the box
    velocity_mps: np.ndarray
    centre_m: np.ndarray
    size_m: np.ndarray  # along the axes of map
    sigma_m: float  # of the position; not measured: see below
    is_visible: bool


def observed(objects, T_map_world: np.ndarray, frame_s: float = 1 / 30) -> list[MovingObject]:
    """The objects of a result. A tenth of the box's size is taken as the position's standard deviation, and
    DRIFT_MPS times the time since it was last seen is added: the library has no covariance of objects.
    @param frame_s time between two frames."""
    found = []
    for item in objects:
        low, high = np.array(item.min_world_m), np.array(item.max_world_m)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        corners = corners @ T_map_world[:3, :3].T + T_map_world[:3, 3]
        centre = T_map_world[:3, :3] @ item.centre_world_m + T_map_world[:3, 3]
        size = corners.max(axis=0) - corners.min(axis=0)
        position = np.array([centre[0], centre[1], 0.0]) if item.class_name == "person" else centre
        sigma = 0.1 * float(np.max(size)) + DRIFT_MPS * item.missing_frames * frame_s
        found.append(MovingObject(item.id, item.class_name, position, T_map_world[:3, :3] @ item.velocity_world_mps,
                           (corners.max(axis=0) + corners.min(axis=0)) / 2, size, sigma, item.missing_frames == 0))
    return found


def people_message(header, objects: list[MovingObject]):
    """people_msgs/msg/People: positions on the floor. Covariances stand in `objects`, and as tags."""
    from people_msgs.msg import People, Person

    from .messages import point
    return People(header=header, people=[
        Person(name=str(item.id), position=point(item.position_m), velocity=point(item.velocity_mps),
               reliability=1.0 if item.is_visible else 0.5, tagnames=["position_sigma_m"],
               tags=[f"{item.sigma_m:.3f}"])
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
        guess.pose.covariance = np.diag([item.sigma_m**2] * 3 + [UNKNOWN] * 3).reshape(-1)
        entry = Detection3D(header=header, id=str(item.id), results=[guess])
        entry.bbox.center.position, entry.bbox.size = point(item.centre_m), vector(item.size_m)
        message.detections.append(entry)
    return message
