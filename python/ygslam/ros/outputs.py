"""What the node publishes."""
from __future__ import annotations

import collections
import importlib.util

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from . import map_messages, messages, moving_objects
from .frames import Poses, inverse

STEP_S = 0.5  # two frames farther apart tell no velocity

LIVE = QoSProfile(depth=100)  # reliable: those who want best effort get it, too
TF = QoSProfile(depth=100)
KEPT = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def has(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


class Outputs:
    """@param frames (map, odom, base) names."""

    def __init__(self, node, frames: tuple[str, str, str], path_step_m: float, path_length: int):
        self._map, self._odom, self._base = frames
        self.tf = node.create_publisher(TFMessage, "/tf", TF)
        self._odometry = node.create_publisher(Odometry, "~/odometry", LIVE)
        self._pose = node.create_publisher(PoseWithCovarianceStamped, "~/pose", LIVE)
        self._path = node.create_publisher(Path, "~/path", KEPT)
        self._grid = node.create_publisher(OccupancyGrid, "~/map", KEPT)
        self._cloud = node.create_publisher(PointCloud2, "~/cloud", KEPT)
        self._mesh = node.create_publisher(Marker, "~/mesh", KEPT)
        self._status = node.create_publisher(DiagnosticArray, "~/status", LIVE)
        self._people = self._detections = None
        if has("people_msgs"):
            from people_msgs.msg import People
            self._people = node.create_publisher(People, "~/people", LIVE)
        if has("vision_msgs"):
            from vision_msgs.msg import Detection3DArray
            self._detections = node.create_publisher(Detection3DArray, "~/objects", LIVE)
        self._told: dict[str, tuple] = {}  # what tells the room last published from others, by topic
        self._before: tuple[int, np.ndarray] | None = None
        self._path_step_m = path_step_m
        self._walked: collections.deque = collections.deque(maxlen=path_length)
        self.own_stamps: collections.deque[int] = collections.deque(maxlen=200)  # of /tf

    def forget(self) -> None:
        """A new world: the path and what velocities are told from."""
        self._before = None
        self._told.clear()
        self._walked.clear()

    def frame(self, t_ns: int, poses: Poses, is_tracked: bool, with_tf: bool) -> None:
        """First what is waited for."""
        if with_tf:
            self.own_stamps.append(t_ns)
            self.tf.publish(TFMessage(transforms=[
                messages.transform(t_ns, self._map, self._odom, poses.T_map_odom),
                messages.transform(t_ns, self._odom, self._base, poses.T_odom_base)]))
        self._odometry.publish(messages.odometry(t_ns, self._odom, self._base, poses.T_odom_base, poses.covariance,
                                                 poses.seen_covariance, self._step(t_ns, poses, is_tracked)))
        if not is_tracked:
            return
        self._pose.publish(messages.pose_with_covariance(t_ns, self._map, poses.T_map_base, poses.map_covariance))
        if not self._walked or np.linalg.norm(
                self._walked[-1][1][:3, 3] - poses.T_map_base[:3, 3]) >= self._path_step_m:
            self._walked.append((t_ns, poses.T_map_base))

    def _step(self, t_ns: int, poses: Poses, is_tracked: bool):
        before, self._before = self._before, (t_ns, poses.T_odom_base) if is_tracked else None
        if before is None or not is_tracked or not 0 < t_ns - before[0] < STEP_S * 1e9:
            return None
        return inverse(before[1]) @ poses.T_odom_base, (t_ns - before[0]) * 1e-9

    def objects(self, t_ns: int, found: list[moving_objects.MovingObject]) -> None:
        at = messages.header(t_ns, self._map)
        if self._people:
            self._people.publish(moving_objects.people_message(at, found))
        if self._detections:
            self._detections.publish(moving_objects.detections_message(at, found))

    def status(self, message) -> None:
        self._status.publish(message)

    def path(self, t_ns: int) -> None:
        if not self._path.get_subscription_count():
            return
        self._path.publish(Path(header=messages.header(t_ns, self._map), poses=[
            messages.pose_stamped(at_ns, self._map, pose) for at_ns, pose in list(self._walked)]))

    def plan(self, grid) -> None:
        """Kept for those who subscribe later."""
        self._grid.publish(map_messages.occupancy_grid(grid, self._map))

    def room(self, room, T_map_world: np.ndarray, most_triangles: int) -> None:
        """To those who listen, each room once: a latched message serves who comes later. Called again with the
        same room, it serves a topic that nobody heard before."""
        content = (room.t_ns, len(room.vertices), T_map_world.tobytes())

        def tell(publisher, message_of) -> None:
            if self._told.get(publisher.topic_name) != content and publisher.get_subscription_count():
                self._told[publisher.topic_name] = content
                publisher.publish(message_of())

        tell(self._cloud, lambda: map_messages.cloud(map_messages.in_map(room.vertices, T_map_world), room.colors,
                                                     room.t_ns, self._map))
        tell(self._mesh, lambda: map_messages.mesh_of(room, T_map_world, self._map, most_triangles))
