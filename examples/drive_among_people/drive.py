"""A robot with cameras drives through a rendered crowd to ten goals, planning on YG-SLAM's plan and forecasts, and once
more on the hits and misses of its depth alone, as planners do that know no people (`ghosts`: on the floor; `octomap`:
OctoMap itself, by pyoctomap).

    PYTHONPATH=build/release/python .venv/bin/python examples/drive_among_people/drive.py out/drive \
        --ygslam build/release/ygslam --seeds 1-20 --plans ygslam octomap [--cameras 4] [--film]

Needs PyYAML, Pillow, SciPy and for `octomap` pyoctomap (`make setup` has them).

Each seed is driven with each plan: a line of JSON each in out/drive/drives.jsonl (what is there is not driven again), a
picture, one of each contact, and with --film a moving one of the plans side by side (drive_1.webp). At the end all drives
are printed as a table. The world does not wait and its people do not step aside: they walk into a robot that stands. Our
robot knows its pose from YG-SLAM, one instance for each camera, which its wheels help: of them it believes whichever is
surest. The others are told the true pose, so that what they run into comes from their plan alone. The base does exactly
what it is told; what its wheels tell of that errs.

A contact: a person's middle within 0.45 m of the robot's, or furniture within its radius. It was driven into where the
robot moved towards it, grazed where the robot moved, but not towards it, walked into where the robot stood. Somebody was
not known where no live object was within 0.6 m of him.
"""
import argparse
import json
import shutil
import tempfile
import time
from collections import deque
from pathlib import Path

import numpy as np
import yaml
import ygslam

from eyes import EyeProcess
from film import film, picture, strip
from ghosts import OctoMapGrid, RayGrid
from planner import Lanes, cost_of, path_to, velocity_of
from rendered import FPS, WIDE_DEG, Truth, base_pose, lens, world_of
from robot import ACCELERATION_MPS2, CONTACTS, RADIUS_M, SPEED_MPS, STOOD_MPS, Contacts, Robot, Wheels
from sights import PERSON_M, Nearby, merged

CROWD = Path(__file__).resolve().parents[2] / "configs" / "worlds" / "crowd.yaml"
REACHED_M, MOST_S_PER_GOAL, LOOK_ROUND_S = 0.35, 30, 4
PATH_EVERY, GRID_EVERY = 4, 8  # frames
STRIP, STRIP_EVERY = 8, 3  # pictures that lead to a contact, frames between them
SHOT_S = 0.5
COLUMNS = ("goals", "of", *CONTACTS, "furniture", "lost_frames", "coasted_frames", "frames", "most_off_m", "metres", "seconds",
           "standing_s")
DEPTH_ALONE = {"ghosts": RayGrid, "octomap": OctoMapGrid}


class Drive:
    """From the start to the last goal, or until the time is over."""

    def __init__(self, options, seed, plan, truth, world, folder):
        self.alone, self.film, self.truth = plan in DEPTH_ALONE, options.film, truth
        start, *self.goals = truth.goals(options.goals, seed)
        first = self.goals[0] - start
        self.robot, self.wheels, self.contacts = Robot(start, np.arctan2(first[1], first[0])), Wheels(seed), Contacts()
        self.T_true = self.T_believed = base_pose(*start, self.robot.yaw)
        self.eyes = [EyeProcess(options, world, folder / f"frames_{plan}_{i}", seed, i, not self.alone)
                     for i in range(options.cameras)]
        self.pinhole = ygslam.CameraModel(**lens())
        self.rays, self.lanes, self.nearby = DEPTH_ALONE.get(plan, RayGrid)(start), Lanes(), Nearby(not self.alone)
        self.room, self.grid, self.clear_m, self.path = None, None, None, []
        self.goal_from, self.straight_m = start, 0
        self.track, self.way_m, self.standing, self.most_off_m, self.states = [], 0.0, 0, 0.0, [[] for _ in self.eyes]
        self.last, self.strips, self.shots = deque(maxlen=STRIP), [], []

    def run(self):
        for k in range(len(self.truth.people)):
            sights = self.look(k)
            people = merged(sights)
            self.judge(k, people)
            if not self.goals:
                break
            people = [] if self.alone else people
            if k % PATH_EVERY == 0 or not self.path:
                self.find_path(k, people)
            self.move(k, sights, people)
            self.remember(k, sights, people)
        for eye in self.eyes:
            eye.close()

    @property
    def here(self):
        return self.T_believed[:2, 3]

    def look(self, k):
        """All cameras at once; then the robot believes the one that is surest, and while all are lost its wheels."""
        T_before, T_odom_before = self.T_true, self.wheels.T_odom_base
        self.T_true = base_pose(*self.robot.at, self.robot.yaw)
        self.wheels.roll(k / FPS, np.linalg.inv(T_before) @ self.T_true)
        step = np.linalg.inv(T_odom_before) @ self.wheels.T_odom_base
        self.T_believed = self.T_true if self.alone else self.T_believed @ step
        for i, eye in enumerate(self.eyes):
            eye.pipe.send((k, self.T_true, self.wheels.T_odom_base, self.T_believed, i == 0 and k % GRID_EVERY == 0))
        sights = [eye.pipe.recv() for eye in self.eyes]
        found = [sight for sight in sights if sight.T_floor_base is not None]
        if found:
            self.T_believed = min(found, key=lambda sight: sight.doubt).T_floor_base
        self.most_off_m = max(self.most_off_m, float(np.linalg.norm(self.here - self.robot.at)))
        for states, sight in zip(self.states, sights):
            states.append(sight.state)
        if self.alone:
            for sight in sights:
                self.rays.add(sight.depth, self.pinhole, sight.T_floor_camera)
        if k % GRID_EVERY == 0:
            self.room = self.rays.grid() if self.alone else sights[0].grid
        return sights

    def judge(self, k, known):
        """By the truth, but for whether a goal was reached."""
        if self.contacts.check(k / FPS, self.robot, self.truth.people[k], self.truth.furniture,
                               [one[0][1] for one in known]):
            self.strips.append((k, list(self.last)))
        self.track.append(self.robot.at.tolist())
        if np.linalg.norm(self.here - self.goals[0]) < REACHED_M:
            self.straight_m += max(0, np.linalg.norm(self.goals[0] - self.goal_from) - REACHED_M)
            self.goals.pop(0)
            self.path, self.goal_from = [], self.here

    def find_path(self, k, people):
        self.grid = self.room.around([self.here, self.goals[0]])
        self.clear_m = self.grid.clearance_m()
        cost = cost_of(self.grid, self.clear_m, self.here, RADIUS_M, SPEED_MPS, people) + self.lanes.cost(k / FPS, self.grid)
        self.path = path_to(self.grid, cost, self.here, self.goals[0])

    def target(self, k, sights):
        """On the path, and the way to turn to."""
        here, yaw = self.here, self.robot.yaw
        self.path = self.path[int(np.argmin([np.linalg.norm(p - here) for p in self.path])):]
        if all(sight.T_floor_base is None for sight in sights):
            return here, yaw
        if k < LOOK_ROUND_S * FPS:  # what comes from the sides? to the left, to the right, and back
            return here, yaw + (0.4 if abs(k / FPS / LOOK_ROUND_S - 0.5) > 0.25 else -0.4)
        target = next((p for p in self.path if np.linalg.norm(p - here) > 0.5), self.path[-1])
        return target, np.arctan2(*(target - here)[::-1]) if np.linalg.norm(target - here) > 0.2 else yaw

    def move(self, k, sights, people):
        places = [one[0][1] for one in people]
        self.lanes.add(k / FPS, places)
        self.way_m += np.linalg.norm(self.robot.velocity) / FPS
        self.nearby.add(k / FPS, self.way_m, self.T_believed, sights, places)
        target, heading = self.target(k, sights)
        velocity = velocity_of(lambda at: self.grid.look_up(self.clear_m, at), self.nearby.points[:, :2], self.here,
                               self.robot.velocity, target, people, SPEED_MPS, ACCELERATION_MPS2, RADIUS_M,
                               RADIUS_M + PERSON_M)
        self.robot.move(velocity, heading)

    def remember(self, k, sights, people):
        """What pictures are made of."""
        self.standing += np.linalg.norm(self.robot.velocity) < STOOD_MPS
        shot = (sights[0].rgb, self.grid, self.path, people, self.here, self.goals[0], self.truth.people[k])
        if k % STRIP_EVERY == 0:
            self.last.append((k, *shot[1:]))
        if self.film and k % round(FPS * SHOT_S) == 0:
            self.shots.append(shot)

    def line(self):
        def frames(state):
            return [[k for k, one in enumerate(states) if one == state] for states in self.states]
        lost = frames("lost")
        return {**self.contacts.counts, "metres": round(self.way_m, 1), "straight_m": round(float(self.straight_m), 1),
                "seconds": round(len(self.track) / FPS, 1), "standing_s": round(self.standing / FPS, 1),
                "lost_frames": sum(map(len, lost)), "coasted_frames": sum(map(len, frames("coasting"))),
                "frames": len(self.track) * len(self.eyes), "all_lost": len(set.intersection(*map(set, lost))),
                "most_off_m": round(self.most_off_m, 3), "contacts": self.contacts.places, "lost": lost}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--seeds", default="1-1")
    parser.add_argument("--goals", type=int, default=10)
    parser.add_argument("--cameras", type=int, default=4, help=f"each {WIDE_DEG} degrees wide, evenly about the base")
    parser.add_argument("--plans", nargs="+", choices=["ygslam", *DEPTH_ALONE], default=["ygslam", "ghosts"])
    parser.add_argument("--film", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "drives.jsonl"
    lines = [json.loads(line) for line in results.read_text("utf-8").splitlines()] if results.exists() else []
    first, last = (int(s) for s in (options.seeds.split("-") * 2)[:2])
    for seed in range(first, last + 1):
        plans = [plan for plan in options.plans if (seed, plan) not in {(line["seed"], line["plan"]) for line in lines}]
        if not plans:
            continue
        films, folder = {}, Path(tempfile.mkdtemp())
        world = folder / "world.yaml"
        world.write_text(yaml.safe_dump(world_of(CROWD, seed)), "utf-8")
        truth = Truth(options.ygslam, world, folder / "truth", MOST_S_PER_GOAL * options.goals)
        for plan in plans:
            began_s, drive = time.monotonic(), Drive(options, seed, plan, truth, world, folder)
            drive.run()
            lines.append({"seed": seed, "plan": plan, "goals": options.goals - len(drive.goals), "of": options.goals,
                          **drive.line(), "took_s": round(time.monotonic() - began_s)})
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(lines[-1]) + "\n")
            title = ", ".join(f"{key} {lines[-1][key]}" for key in ("seed", "plan", *COLUMNS))
            picture(truth, drive.track, truth.goals(options.goals, seed), drive.contacts.places, title).save(
                options.out / f"drive_{seed}_{plan}.png")
            for k, shots in drive.strips:
                strip(shots, FPS).save(options.out / f"contact_{seed}_{plan}_{k}.png")
            films[", ".join([plan, *(f"{lines[-1][key]} {key.replace('_', ' ')}" for key in CONTACTS)])] = \
                drive.shots
        shutil.rmtree(folder)
        if options.film:
            film(films, options.out / f"drive_{seed}.webp", SHOT_S)
    print_table(lines)


def print_table(lines):
    """Every drive, and the sums (of what the pose was off: the most) of each plan."""
    print("| seed | plan | " + " | ".join(name.replace("_", " ") for name in COLUMNS) + " | detour |")
    print("|---|---|" + "---:|" * (len(COLUMNS) + 1))
    for plan in ("ygslam", *DEPTH_ALONE):
        mine = sorted((line for line in lines if line["plan"] == plan), key=lambda line: line["seed"])
        rows = [(line["seed"], line) for line in mine]
        if mine:
            rows.append((f"{len(mine)} seeds", {name: (max if name == "most_off_m" else sum)(line[name] for line in mine)
                                                for name in (*COLUMNS, "straight_m")}))
        for seed, row in rows:
            cells = [f"{row[name]:.5g}" for name in COLUMNS]
            print(f"| {seed} | {plan} | " + " | ".join(cells) + f" | {row['metres'] / max(row['straight_m'], 0.1):.2f} |")


if __name__ == "__main__":
    main()
