"""Pictures of point clouds: reads map.ply and draws it with a z-buffer."""
import numpy as np

from .files import InputError

TYPES = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1", "uint8": "u1",
         "ushort": "<u2", "uint16": "<u2", "short": "<i2", "int": "<i4", "uint": "<u4",
         "char": "i1"}
MAX_HEADER = 1 << 14
MAX_POINTS = 2_000_000  # more do not show in pictures of this size


def read_ply(path):
    """Points N x 3 [m] and colours N x 3 (0 to 255) of a binary little-endian PLY, evenly
    thinned to MAX_POINTS.
    @raise InputError naming file and fault."""
    data = path.read_bytes()
    end = data.find(b"end_header\n", 0, MAX_HEADER)
    lines = data[:max(end, 0)].decode("ascii", "replace").splitlines()
    if not lines or lines[0] != "ply" or "format binary_little_endian 1.0" not in lines:
        raise InputError(f"{path}: not a binary little-endian PLY")
    count, fields = 0, []
    for words in (line.split() for line in lines[1:]):
        if words[:2] == ["element", "vertex"]:
            count = int(words[2])
        elif words[:1] == ["property"]:
            if len(words) != 3 or words[1] not in TYPES:
                raise InputError(f"{path}: property '{' '.join(words[1:])}' is not known")
            fields.append((words[2], TYPES[words[1]]))
    kind = np.dtype(fields)
    body = data[end + len(b"end_header\n"):]
    if len(body) < count * kind.itemsize or not {"x", "y", "z", "red"} <= set(kind.names or ()):
        raise InputError(f"{path}: cut short, or without position and colour")
    vertices = np.frombuffer(body, kind, count)
    points = np.stack([vertices[c] for c in "xyz"], 1).astype(np.float32)
    colours = np.stack([vertices[c] for c in ("red", "green", "blue")], 1)
    finite = np.flatnonzero(np.all(np.isfinite(points), axis=1))
    finite = finite[::max(1, -(-len(finite) // MAX_POINTS))]
    return points[finite], colours[finite]


def look_at(eye_m, target_m):
    """Rotation world to camera (x right, y down, z forward) for a world whose y points down."""
    forward = target_m - eye_m
    forward = forward / np.linalg.norm(forward)
    down = np.array([0.0, 1.0, 0.0])
    right = np.cross(down, forward)
    if np.linalg.norm(right) < 1e-6:  # straight down
        right = np.array([1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def view_points(points_m):
    """[(name, eye, target)] for a map in the frame of its first camera: over that camera's
    shoulder, and obliquely from above. Robust against stray points."""
    target = np.median(points_m, axis=0).astype(float)
    radius = float(np.percentile(np.linalg.norm(points_m - target, axis=1), 85)) or 1.0
    shoulder = np.array([0.15 * radius, -0.25 * radius, -0.35 * radius])
    above = target + radius * np.array([0.3, -1.9, -1.4])
    return [("over the first camera's shoulder", shoulder, target),
            ("from above", above, target)]


def render(points_m, colours, eye_m, target_m, size=(640, 480), fov_deg=60.0):
    """An RGBA picture: each point a square as large as 12 mm at its depth, the nearest one wins.
    @return H x W x 4, transparent where nothing is."""
    width, height = size
    focal_px = 0.5 * width / np.tan(np.deg2rad(fov_deg) / 2)
    p_camera = (points_m - eye_m) @ look_at(eye_m, target_m).T
    front = np.flatnonzero(p_camera[:, 2] > 0.1)
    # Far to near: of several points written to one pixel the last, nearest one stays.
    front = front[np.argsort(-p_camera[front, 2], kind="stable")]
    p_camera, shown = p_camera[front], colours[front]
    u = np.round(p_camera[:, 0] / p_camera[:, 2] * focal_px + width / 2).astype(np.int64)
    v = np.round(p_camera[:, 1] / p_camera[:, 2] * focal_px + height / 2).astype(np.int64)
    splat_px = np.clip(np.round(0.006 * focal_px / p_camera[:, 2]), 1, 4).astype(int)
    depth = np.full(width * height, np.inf)
    winner = np.full(width * height, -1)
    for du in range(-4, 5):
        for dv in range(-4, 5):
            inside = ((splat_px >= max(abs(du), abs(dv))) & (u + du >= 0) & (u + du < width)
                      & (v + dv >= 0) & (v + dv < height))
            which = np.flatnonzero(inside)
            pixel = (v[which] + dv) * width + u[which] + du
            nearer = p_camera[which, 2] < depth[pixel]
            depth[pixel[nearer]] = p_camera[which[nearer], 2]
            winner[pixel[nearer]] = which[nearer]
    picture = np.zeros((width * height, 4), np.uint8)
    hit = winner >= 0
    picture[hit, :3] = shown[winner[hit]]
    picture[hit, 3] = 255
    return picture.reshape(height, width, 4)
