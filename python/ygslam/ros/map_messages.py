"""Messages of the map: plan, and cloud and mesh of a Room. The frame `map` is the plan's."""
from __future__ import annotations

import array
import struct

import numpy as np
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointCloud2, PointField

from .messages import header

TRIANGLE_LIST = 11


def occupancy_grid(grid, frame: str) -> OccupancyGrid:
    """As nav2's map_server publishes one: -1 unknown, 0 free, 100 occupied; the origin is the lower left corner
    of the first cell. @param grid Slam.plan()."""
    message = OccupancyGrid(header=header(grid.t_ns, frame))
    message.info.map_load_time = message.header.stamp
    message.info.resolution = grid.resolution_m
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x, message.info.origin.position.y = map(float, grid.origin_m)
    message.data = array.array("b", np.ascontiguousarray(grid.cells).tobytes())
    return message


def cloud(points: np.ndarray, colors: np.ndarray, t_ns: int, frame: str) -> PointCloud2:
    """@param points (N, 3) in `frame` [m]. @param colors (N, 3) uint8, r g b."""
    rows = np.empty(len(points), dtype=[("xyz", "<f4", 3), ("bgra", "u1", 4)])
    rows["xyz"] = points
    rows["bgra"] = np.column_stack([colors[:, ::-1], np.full(len(points), 255, np.uint8)])
    fields = [PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=1)
              for name, offset in (("x", 0), ("y", 4), ("z", 8), ("rgb", 12))]
    return PointCloud2(header=header(t_ns, frame), height=1, width=len(points), fields=fields, is_bigendian=False,
                       point_step=16, row_step=16 * len(points), data=array.array("B", rows.tobytes()), is_dense=True)


def in_map(points: np.ndarray, T_map_world: np.ndarray) -> np.ndarray:
    return points @ T_map_world[:3, :3].T.astype(np.float32) + T_map_world[:3, 3].astype(np.float32)


def mesh_marker(corners: np.ndarray, colors: np.ndarray, t_ns: int, frame: str) -> bytes:
    """visualization_msgs/msg/Marker, serialised: as objects, 100,000 corners would hold the interpreter for a
    second. @param corners (N, 3) [m], three of each triangle. @param colors (N, 3) uint8."""
    def text(value: str) -> bytes:
        return struct.pack("<I", len(value) + 1) + value.encode() + b"\0"

    def aligned(data: bytes, to: int) -> bytes:
        return data + b"\0" * (-len(data) % to)

    head = struct.pack("<iI", t_ns // 10**9, t_ns % 10**9) + text(frame)
    head = aligned(aligned(head, 4) + text("mesh"), 4) + struct.pack("<iii", 0, TRIANGLE_LIST, 0)
    head = aligned(head, 8) + struct.pack("<10d4fiI?", 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, False)
    head = aligned(head, 4) + struct.pack("<I", len(corners))
    if len(corners):
        head = aligned(head, 8) + corners.astype("<f8").tobytes()
    rgba = np.column_stack([colors / 255.0, np.ones(len(colors))]).astype("<f4")
    tail = head + struct.pack("<I", len(rgba)) + rgba.tobytes()
    empty = text("")
    for part in (empty, struct.pack("<iI", 0, 0), empty, empty, struct.pack("<II", 0, 0), empty, empty, empty,
                 struct.pack("<I", 0), struct.pack("?", False)):  # texture, text, mesh file
        tail = aligned(tail, 4) + part
    return b"\0\1\0\0" + tail


def mesh_of(room, T_map_world: np.ndarray, frame: str, most_triangles: int) -> bytes:
    triangles = room.triangles
    triangles = triangles[:: max(1, -(-len(triangles) // most_triangles))].reshape(-1)
    return mesh_marker(in_map(room.vertices[triangles], T_map_world), room.colors[triangles], room.t_ns, frame)
