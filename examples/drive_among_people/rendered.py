"""A robot's camera in a rendered world that goes on while the robot decides, and the truth to judge it by."""
import random
import subprocess

import numpy as np
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

CAMERA_M = 1.1  # height
TILT_RAD = -0.1
FPS = 10
GOALS_LOW, GOALS_HIGH = np.array([-2.8, -3.0]), np.array([2.6, 0.3])


def world_of(crowd_yaml, seed):
    """The crowd, each person sooner or later and slower or faster."""
    rng = random.Random(seed)
    world = yaml.safe_load(crowd_yaml.read_text("utf-8"))
    world["movers"] = []
    world["seconds"] = 300
    for person in world["people"]:
        person["delay"] = rng.uniform(0, 6)
        for action in person["actions"]:
            if action["do"] == "walk":
                action["speed"] = round(action.get("speed", 1) * rng.uniform(0.8, 1.2), 2)
    return world


def pose_of(x, y, yaw):
    """T_world_camera of a robot that looks along yaw."""
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
            [ygslam, "simulate", world, "--out", folder, "--size", "320x240", "--format", "png", "--poses", "-", "--seed",
             str(seed), "--quiet"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def look(self, t_s, T):
        """Colour, depth [m]; as files they are gone."""
        numbers = [t_s, *T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]
        self.process.stdin.write(" ".join(f"{x:.9f}" for x in numbers) + "\n")
        self.process.stdin.flush()
        stamp = self.process.stdout.readline().strip()
        files = [self.folder / kind / f"{stamp}.png" for kind in ("rgb", "depth")]
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
        subprocess.run([ygslam, "simulate", world, "--out", folder, "--size", "16x16", "--fps", str(FPS), "--seconds",
                        str(seconds), "--truth", "--quiet"], check=True)
        rows = [np.loadtxt(file)[:, 1:3] for file in sorted((folder / "movers").glob("*.txt"))]
        self.people = np.stack(rows, axis=1)  # frame, person, x y
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
