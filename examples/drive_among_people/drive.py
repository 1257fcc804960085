"""A robot with cameras drives through a rendered crowd to ten goals, planning on YG-SLAM's plan and forecasts, and once
more on the hits and misses of its depth alone, as planners do that know no people (`ghosts`: on the floor; `octomap`:
OctoMap itself, by pyoctomap).

    PYTHONPATH=build/release/python .venv/bin/python examples/drive_among_people/drive.py out/drive \
        --ygslam build/release/ygslam --seeds 1-20 [--plans ygslam octomap] [--cameras 3] [--film]

Needs PyYAML and Pillow (`make setup` has them).

Each seed is driven with each plan; a line of JSON each in out/drive/drives.jsonl, a picture, and with --film a moving
one of the plans side by side (drive_1.webp). The world does not wait and its people do not step aside: they walk into a
robot that stands. Poses are YG-SLAM's in both cases, one instance for each camera; the robot's wheels do exactly what
they are told, and tell the tracker.

A contact: a person's middle within 0.45 m of the robot's, or furniture within its radius. It was driven into where the
robot moved towards it, grazed where the robot moved, but not towards it, walked into where the robot stood. Somebody was
not known where no live object was within 0.6 m of him.
"""
import argparse
import json
import shutil
import tempfile
from collections import deque
from pathlib import Path

import numpy as np
import yaml
import ygslam
from PIL import Image, ImageDraw

from film import film
from ghosts import OctoMapGrid, RayGrid
from planner import OCCUPIED, Grid, Lanes, coarser, cost_of, grown, path_to, velocity_of
from rendered import FPS, WIDE_DEG, Camera, Truth, base_pose, camera_on_base, lens, world_of

CROWD = Path(__file__).resolve().parents[2] / "configs" / "worlds" / "crowd.yaml"
RADIUS_M, SPEED_MPS, TURN_RPS, ACCELERATION_MPS2 = 0.25, 0.8, 1.0, 1.5
PERSON_M, REACHED_M, MOST_S_PER_GOAL = 0.2, 0.35, 30
HORIZONS_S = (0, 0.5, 1, 1.5, 2)
REMEMBERED_S, STOOD_MPS, LOOK_ROUND_S, NEAR_FRAMES = 3, 0.05, 4, 6
PATH_EVERY, GRID_EVERY = 4, 8  # frames
SHOT_S = 0.5
CONTACTS = ("driven_into", "grazed", "walked_into")
DEPTH_ALONE = {"ghosts": RayGrid, "octomap": OctoMapGrid}


def forecasts(objects, T_floor_world):
    """Of each person (seconds, place on the floor, sigma)."""
    people = []
    for item in objects:
        if item.class_name != "person" or item.missing_frames > REMEMBERED_S * FPS:
            continue
        entry = []
        for after_s in HORIZONS_S:
            place, covariance = item.after(after_s)
            on_floor = T_floor_world[:3, :3] @ covariance @ T_floor_world[:3, :3].T
            at = (T_floor_world @ [*place, 1])[:2]
            entry.append((after_s, at, float(np.sqrt(np.linalg.eigvalsh(on_floor[:2, :2])[-1]))))
        people.append(entry)
    return people


class Eye:
    """A camera on the base, and what is found in its images alone."""

    def __init__(self, ygslam_program, world, folder, seed, yaw, T_floor_base, *, plans):
        """@param plans whether it makes the plan: a dense map for each would be too much."""
        self.T_base_camera = camera_on_base(yaw)
        self.T_floor_first = T_floor_base @ self.T_base_camera  # the map begins at the first camera
        self.camera = Camera(ygslam_program, world, folder, seed)
        self.pinhole = ygslam.CameraModel(**lens())
        self.slam = ygslam.Slam(self.pinhole, segmenter="builtin", deterministic=True,
                                options={} if plans else {"run.without": "[dense_map]"})
        self.T_before, self.lost, self.people, self.near = None, 0, [], deque(maxlen=NEAR_FRAMES)

    def look(self, k, T_floor_base):
        """@param T_floor_base the true one. @return that which was found, or None."""
        T_now = T_floor_base @ self.T_base_camera
        self.rgb, self.depth = self.camera.look(k / FPS, T_now)
        wheels = np.eye(4) if self.T_before is None else np.linalg.inv(self.T_before) @ T_now
        result = self.slam.process(self.rgb, self.depth, 10**12 + k * 10**9 // FPS, T_last_camera=wheels)
        self.T_before, self.people = T_now, []
        self.near.append(np.empty((0, 2)))
        if result.state == ygslam.State.LOST:
            self.lost += 1
            return None
        self.people = forecasts(result.objects, self.T_floor_first)
        self.T_floor_camera = self.T_floor_first @ result.pose
        self.near[-1] = self.what_stands()
        return self.T_floor_camera @ np.linalg.inv(self.T_base_camera)

    def what_stands(self):
        """At the robot's height within two metres, by the last depth alone, in cells of 10 cm."""
        v, u = np.mgrid[2:self.depth.shape[0]:4, 2:self.depth.shape[1]:4]
        z, c = self.depth[v, u], self.pinhole
        rays = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], axis=-1)[(z > 0) & (z < 2)]
        points = rays @ self.T_floor_camera[:3, :3].T + self.T_floor_camera[:3, 3]
        cells = np.floor(points[(points[:, 2] > 0.15) & (points[:, 2] < 1.4), :2] / 0.1)
        return (np.unique(cells, axis=0) + 0.5) * 0.1


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


class Contacts:
    """Counted once until it is over for a second."""

    def __init__(self):
        self.counts = dict.fromkeys((*CONTACTS, "unseen", "furniture"), 0)
        self.places, self.since = [], {}

    def check(self, t_s, robot, people, furniture, known):
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
                self.places.append((robot.at.tolist(), kind, round(t_s, 1), name))
            self.since[name] = t_s


def drive(options, seed, kind, truth, world, folder):
    ghosts = kind in DEPTH_ALONE
    start, *goals = all_goals = truth.goals(options.goals, seed)
    first = goals[0] - start
    robot, contacts = Robot(start, np.arctan2(first[1], first[0])), Contacts()
    T_believed = T_before = base_pose(*robot.at, robot.yaw)
    eyes = [Eye(options.ygslam, world, folder / f"frames_{kind}_{i}", seed, 2 * np.pi * i / options.cameras, T_believed,
                plans=i == 0 and not ghosts) for i in range(options.cameras)]
    rays, lanes, room, path = DEPTH_ALONE.get(kind, RayGrid)(start), Lanes(), None, []
    track, shots, standing, blind = [], [], 0, 0
    for k in range(len(truth.people)):
        T_now = base_pose(*robot.at, robot.yaw)
        T_believed = T_believed @ np.linalg.inv(T_before) @ T_now  # by the wheels, while no camera knows
        found = [eye.look(k, T_now) for eye in eyes]
        T_believed, T_before = next((T for T in found if T is not None), T_believed), T_now
        blind += all(T is None for T in found)
        here = T_believed[:2, 3]
        known = [one for eye in eyes for one in eye.people]
        contacts.check(k / FPS, robot, truth.people[k], truth.furniture, [one[0][1] for one in known])
        track.append(robot.at.tolist())
        if np.linalg.norm(here - goals[0]) < REACHED_M:
            goals.pop(0)
            path = []
            if not goals:
                break
        if ghosts:
            for eye, T in zip(eyes, found):
                if T is not None:
                    rays.add(eye.depth, eye.pinhole, eye.T_floor_camera)
        people = [] if ghosts else known
        lanes.add(k / FPS, [one[0][1] for one in people])
        if k % (PATH_EVERY if ghosts else GRID_EVERY) == 0:
            room = rays.grid() if ghosts else grid_of(eyes[0].slam.plan(), eyes[0].T_floor_first)
        if k % PATH_EVERY == 0 or not path:
            grid = room.around([here, goals[0]])
            solid = grown(grid.cells == OCCUPIED, RADIUS_M / grid.cell_m)
            cost = cost_of(grid, here, RADIUS_M, SPEED_MPS, people) + lanes.cost(k / FPS, grid)
            path = path_to(grid, cost, here, goals[0])
        path = path[int(np.argmin([np.linalg.norm(p - here) for p in path])):]
        target = next((p for p in path if np.linalg.norm(p - here) > 0.5), path[-1])
        heading = np.arctan2(*(target - here)[::-1]) if np.linalg.norm(target - here) > 0.2 else robot.yaw
        if k < LOOK_ROUND_S * FPS:  # what comes from the sides? to the left, to the right, and back
            target, heading = here, robot.yaw + (0.4 if abs(k / FPS / LOOK_ROUND_S - 0.5) > 0.25 else -0.4)
        if found[0] is None:
            target, heading = here, robot.yaw
        near = np.concatenate([places for eye in eyes for places in eye.near])
        velocity = velocity_of(lambda places, grid=grid, solid=solid: grid.look_up(solid, places), near, here, robot.velocity,
                               target, people, SPEED_MPS, ACCELERATION_MPS2, RADIUS_M, RADIUS_M + PERSON_M)
        robot.move(velocity, heading)
        standing += np.linalg.norm(robot.velocity) < STOOD_MPS
        if options.film and k % round(FPS * SHOT_S) == 0:
            shots.append((eyes[0].rgb, grid, path, people, here, goals[0], truth.people[k]))
    for eye in eyes:
        eye.camera.close()
    line = {"seed": seed, "plan": kind, "goals": options.goals - len(goals), **contacts.counts,
            "metres": round(float(np.linalg.norm(np.diff(track, axis=0), axis=1).sum()), 1),
            "seconds": round(len(track) / FPS, 1), "standing_s": round(standing / FPS, 1),
            "lost_frames": sum(eye.lost for eye in eyes), "frames": len(track) * len(eyes), "all_lost": blind}
    return line, {"track": track, "contacts": contacts.places, "truth": truth, "shots": shots, "goals": all_goals}


def grid_of(plan, T_true_world):
    """The library's plan in the building's axes, 10 cm."""
    nothing = Grid(np.full((2, 2), -1, np.int8), (0, 0), 0.1)
    if plan is None or not (plan.cells != -1).any():  # no floor was seen yet
        return nothing
    T = T_true_world @ plan.T_world_floor
    fine = Grid(plan.cells, plan.origin_m, plan.resolution_m)
    places = np.concatenate([fine.middles(), np.zeros((*plan.cells.shape, 1))], axis=2) @ T[:3, :3].T + T[:3, 3]
    known = plan.cells != -1
    low = places[known][:, :2].min(axis=0)
    size = np.ceil((places[known][:, :2].max(axis=0) - low) / plan.resolution_m).astype(int)[::-1] + 1
    cells = np.full(size, -1, np.int8)
    for what in (0, 100):  # what stands there is written last
        x, y = ((places[plan.cells == what][:, :2] - low) / plan.resolution_m).astype(int).T
        cells[y, x] = what
    return coarser(Grid(cells, low, plan.resolution_m), max(1, round(0.1 / plan.resolution_m)))


def picture(seen, title, scale=90):
    """From above: furniture grey, people's ways blue, the drive green, goals numbered, contacts red (driven) and orange."""
    truth = seen["truth"]
    low, high = np.array([-4.7, -4.3]), np.array([4.7, 2.2])
    size = tuple(int(x) for x in (high - low) * scale)
    image = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(image)

    def at(p):
        return (p[0] - low[0]) * scale, size[1] - (p[1] - low[1]) * scale
    for p in truth.furniture:
        x, y = at(p)
        draw.rectangle([x - 2, y - 2, x + 2, y + 2], fill=(150, 150, 150))
    for person in range(truth.people.shape[1]):
        draw.line([at(p) for p in truth.people[:len(seen["track"]), person]], fill=(150, 180, 240), width=2)
    draw.line([at(p) for p in seen["track"]], fill=(20, 140, 60), width=4)
    for i, goal in enumerate(seen["goals"]):
        x, y = at(goal)
        draw.ellipse([x - 11, y - 11, x + 11, y + 11], outline="black", fill="white")
        draw.text((x - 5, y - 6), "S" if i == 0 else str(i), fill="black")
    for place, kind, t_s, _ in seen["contacts"]:
        x, y = at(place)
        draw.ellipse([x - 12, y - 12, x + 12, y + 12], outline=(220, 0, 0) if kind == "driven_into" else (230, 150, 0), width=4)
        draw.text((x + 14, y - 5), f"{t_s}", fill="black")
    draw.text((8, 6), title, fill="black")
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--seeds", default="1-1")
    parser.add_argument("--goals", type=int, default=10)
    parser.add_argument("--cameras", type=int, default=3, help=f"each {WIDE_DEG} degrees wide, evenly about the base")
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
            line, seen = drive(options, seed, plan, truth, world, folder)
            lines.append(line)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            picture(seen, ", ".join(f"{key} {value}" for key, value in line.items())).save(
                options.out / f"drive_{seed}_{plan}.png")
            films[", ".join([plan, *(f"{line[key]} {key.replace('_', ' ')}" for key in CONTACTS)])] = seen["shots"]
        shutil.rmtree(folder)
        if options.film:
            film(films, options.out / f"drive_{seed}.webp", SHOT_S)
    print_sums(lines)


def print_sums(lines):
    names = list(next(iter(lines)))[2:] if lines else []
    print("| " + " | ".join(["plan", "drives", *(name.replace("_", " ") for name in names)]) + " |")
    print("|---|" + "---:|" * (1 + len(names)))
    for plan in ("ygslam", *DEPTH_ALONE):
        mine = [line for line in lines if line["plan"] == plan]
        if mine:
            sums = [f"{sum(line[name] for line in mine):g}" for name in names]
            print("| " + " | ".join([plan, str(len(mine)), *sums]) + " |")


if __name__ == "__main__":
    main()
