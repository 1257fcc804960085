"""The robot's base, what its wheels tell of its way, and what it touches."""
import numpy as np

from rendered import FPS
from sights import PERSON_M

RADIUS_M, SPEED_MPS, TURN_RPS, ACCELERATION_MPS2 = 0.25, 0.8, 1.0, 1.5
STOOD_MPS = 0.05
CONTACTS = ("driven_into", "grazed", "walked_into")


class Robot:
    """A base that moves in any direction while it turns."""

    def __init__(self, at, yaw):
        self.at, self.yaw, self.velocity = np.array(at, float), yaw, np.zeros(2)

    def move(self, velocity, heading):
        """@param heading to turn to; for both the true axes and the map's are the same but for drift."""
        change = velocity - self.velocity
        most = ACCELERATION_MPS2 / FPS
        self.velocity = self.velocity + change * min(1, most / max(np.linalg.norm(change), 1e-9))
        off = (heading - self.yaw + np.pi) % (2 * np.pi) - np.pi
        self.yaw += float(np.clip(2.5 * off, -TURN_RPS, TURN_RPS)) / FPS
        self.at = self.at + self.velocity / FPS


class Wheels:
    """What four Mecanum wheels tell of the way. They err as those of `ygslam simulate --wheels --wheel-slips 10`: each in
    radius, their distances, by slipping a little all the time, and ten times on 100 m by half a turn's way for 0.4 s."""

    ARM_M = 0.35  # half the track and half the wheelbase
    RADIUS_ERROR, ARM_ERROR, SLIP_M, SLIPS_PER_M, SLIP_S = 0.001, 0.005, 0.001, 0.1, 0.4

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.scales = 1 + self.rng.normal(0, self.RADIUS_ERROR, 4)
        self.told_of = np.linalg.pinv(self._rolls(self.ARM_M * (1 + self.rng.normal(0, self.ARM_ERROR))))
        self.slipping, self.slips_until = 0, 0.0  # which wheel, seconds
        self.T_odom_base = np.eye(4)

    @staticmethod
    def _rolls(arm_m):
        """Ways of the wheels for one of the base ahead, to the left, and a turn."""
        return np.array([[1, -1, -arm_m], [1, 1, arm_m], [1, 1, -arm_m], [1, -1, arm_m]])

    def roll(self, t_s, T_before_now):
        turn = np.arctan2(T_before_now[1, 0], T_before_now[0, 0])
        ahead, left = _turned(-turn / 2) @ T_before_now[:2, 3]
        ways = self._rolls(self.ARM_M) @ [ahead, left, turn]
        if t_s >= self.slips_until and self.rng.uniform() < self.SLIPS_PER_M * np.hypot(ahead, left):
            self.slipping, self.slips_until = self.rng.integers(4), t_s + self.SLIP_S
        told = ways * self.scales + self.rng.normal(0, self.SLIP_M, 4) * np.sqrt(np.abs(ways))
        if t_s < self.slips_until:
            told[self.slipping] += 0.5 * ways[self.slipping]
        *way, turn = self.told_of @ told
        step = np.eye(4)
        step[:2, :2], step[:2, 3] = _turned(turn), _turned(turn / 2) @ way
        self.T_odom_base = self.T_odom_base @ step


def _turned(yaw):
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


class Contacts:
    """Counted once until it is over for a second."""

    def __init__(self):
        self.counts = dict.fromkeys((*CONTACTS, "unseen", "furniture"), 0)
        self.places, self.since = [], {}  # robot, kind, seconds, with whom

    def check(self, t_s, robot, people, furniture, known):
        """@return whether there is a new one."""
        before = len(self.places)
        near = [(f"person {i}", p) for i, p in enumerate(people) if np.linalg.norm(p - robot.at) < RADIUS_M + PERSON_M]
        nearest = furniture[np.argmin(np.linalg.norm(furniture - robot.at, axis=1))]
        if np.linalg.norm(nearest - robot.at) < RADIUS_M:
            near.append(("furniture", nearest))
        for name, place in near:
            if t_s - self.since.get(name, -9) > 1:
                way = (place - robot.at) / max(np.linalg.norm(place - robot.at), 1e-9)
                stood = np.linalg.norm(robot.velocity) < STOOD_MPS
                kind = ("furniture" if name == "furniture" else "walked_into" if stood else
                        "driven_into" if robot.velocity @ way > STOOD_MPS else "grazed")
                self.counts[kind] += 1
                if name != "furniture":
                    self.counts["unseen"] += all(np.linalg.norm(place - k) > 0.6 for k in known)
                self.places.append(([round(x, 2) for x in robot.at], kind, round(t_s, 1), name))
            self.since[name] = t_s
        return len(self.places) > before


