"""A robot's camera in a rendered world that goes on while the robot decides, and the truth to judge it by."""
import random
import subprocess

import numpy as np
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

CAMERA_M, AHEAD_M = 1.1, 0.05  # a camera's height, and its place before the base's middle
TILT_RAD = -0.1
FPS, TRUTH_FPS = 10, 5
WIDTH, HEIGHT, WIDE_DEG = 240, 180, 90  # of an image; as wide as RealSense D455's depth
GOALS_LOW, GOALS_HIGH = np.array([-2.8, -3.0]), np.array([2.6, 0.3])


def world_of(crowd_yaml, seed):
    """The crowd, each person sooner or later and slower or faster, seen by the robot's lens."""
    rng = random.Random(seed)
    world = yaml.safe_load(crowd_yaml.read_text("utf-8"))
    world["intrinsics"] = lens()
    world["movers"] = []
    world["seconds"] = 300
    for person in world["people"]:
        person["delay"] = rng.uniform(0, 6)
        for action in person["actions"]:
            if action["do"] == "walk":
                action["speed"] = round(action.get("speed", 1) * rng.uniform(0.8, 1.2), 2)
    return world


def lens():
    f = WIDTH / 2 / np.tan(np.radians(WIDE_DEG / 2))
    return {"fx": float(f), "fy": float(f), "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "width": WIDTH,
            "height": HEIGHT}


def base_pose(x, y, yaw):
    """T_world_base, on the floor."""
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:2, 3] = x, y
    return T


def camera_on_base(yaw):
    """T_base_camera of a camera that looks along yaw."""
    x, y = AHEAD_M * np.cos(yaw), AHEAD_M * np.sin(yaw)
    forward = np.array([np.cos(yaw) * np.cos(TILT_RAD), np.sin(yaw) * np.cos(TILT_RAD), np.sin(TILT_RAD)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T[:3, 3] = x, y, CAMERA_M
    return T


class Camera:
    """`ygslam simulate --poses -`: a frame for each pose."""

    def __init__(self, ygslam, world, folder, seed):
        self.folder = folder
        self.process = subprocess.Popen(
            [ygslam, "simulate", world, "--out", folder, "--size", f"{WIDTH}x{HEIGHT}", "--format", "jpg", "--poses", "-",
             "--seed", str(seed), "--threads", "1", "--quiet"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def look(self, t_s, T):
        """Colour, depth [m]; as files they are gone."""
        numbers = [t_s, *T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]
        self.process.stdin.write(" ".join(f"{x:.9f}" for x in numbers) + "\n")
        self.process.stdin.flush()
        stamp = self.process.stdout.readline().strip()
        files = [self.folder / "rgb" / f"{stamp}.jpg", self.folder / "depth" / f"{stamp}.png"]
        images = [np.array(Image.open(file)) for file in files]
        for file in files:
            file.unlink()
        return images[0], images[1].astype(np.float32) / 5000

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Truth:
    """Where people are at each frame, and where something stands at the height of the robot."""

    def __init__(self, ygslam, world, folder, seconds):
        subprocess.run([ygslam, "simulate", world, "--out", folder, "--size", "16x16", "--fps", str(TRUTH_FPS),
                        "--seconds", str(seconds), "--truth", "--quiet"], check=True)
        rows = [np.loadtxt(file) for file in sorted((folder / "movers").glob("*.txt"))]
        t_s = np.arange(int((len(rows[0]) - 1) * FPS / TRUTH_FPS)) / FPS
        self.people = np.stack([[np.interp(t_s, row[:, 0] - row[0, 0], row[:, axis]) for axis in (1, 2)] for row in rows])
        self.people = self.people.transpose(2, 0, 1)  # frame, person, x y
        self.furniture = self._points(folder / "static.ply")

    @staticmethod
    def _points(file):
        """Points on the surface of what stands between 0.1 and 1.5 m, every 4 cm."""
        data = file.read_bytes()
        head, body = data.split(b"end_header\n", 1)
        counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
        vertex = np.dtype([("p", "<f4", 3), ("c", "u1", 3)])
        points = np.frombuffer(body, vertex, counts[0])["p"]
        faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1], counts[0] * vertex.itemsize)["v"]
        corners = points[faces]
        band = (corners[:, :, 2].max(1) > 0.1) & (corners[:, :, 2].min(1) < 1.5)
        found = set()
        for a, b, c in corners[band]:
            n = int(max(np.linalg.norm(b - a), np.linalg.norm(c - a)) / 0.04) + 2
            u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
            inside = u + v <= 1
            p = a + u[inside, None] * (b - a) + v[inside, None] * (c - a)
            p = p[(p[:, 2] > 0.1) & (p[:, 2] < 1.5)]
            found.update(map(tuple, np.round(p[:, :2] / 0.04).astype(int)))
        return 0.04 * np.array(sorted(found))

    def goals(self, count, seed):
        """Places with room about them, at least 1.5 m from one to the next; the first is the start."""
        rng = np.random.default_rng(seed)
        goals = []
        while len(goals) <= count:
            at = rng.uniform(GOALS_LOW, GOALS_HIGH)
            clear = np.linalg.norm(self.furniture - at, axis=1).min() > 0.55
            apart = not goals or np.linalg.norm(goals[-1] - at) > 1.5
            alone = bool(goals) or np.linalg.norm(self.people[0] - at, axis=1).min() > 1.2
            if clear and apart and alone:
                goals.append(at)
        return goals
