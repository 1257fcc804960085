"""A robot with cameras drives through a rendered crowd to ten goals, planning on YG-SLAM's plan and forecasts, and once
more on the hits and misses of its depth alone, as planners do that know no people (`ghosts`: on the floor; `octomap`:
OctoMap itself, by pyoctomap).

    PYTHONPATH=build/release/python .venv/bin/python examples/drive_among_people/drive.py out/drive \
        --ygslam build/release/ygslam --seeds 1-20 --plans ygslam octomap [--cameras 4] [--film]

Needs PyYAML, Pillow and for `octomap` pyoctomap (`make setup` has them).

Each seed is driven with each plan: a line of JSON each in out/drive/drives.jsonl (what is there is not driven again), a
picture, one of each contact, and with --film a moving one of the plans side by side (drive_1.webp). At the end all drives
are printed as a table. The world does not wait and its people do not step aside: they walk into a robot that stands. Our
robot knows its pose from YG-SLAM, one instance for each camera; the wheels do exactly what they are told, and tell the
tracker. The others are told the true pose, so that what they run into comes from their plan alone.

A contact: a person's middle within 0.45 m of the robot's, or furniture within its radius. It was driven into where the
robot moved towards it, grazed where the robot moved, but not towards it, walked into where the robot stood. Somebody was
not known where no live object was within 0.6 m of him.
"""
import argparse
import json
import multiprocessing
import shutil
import tempfile
import time
from collections import deque
from pathlib import Path

import numpy as np
import yaml
import ygslam
from PIL import Image, ImageDraw

from film import film, strip
from ghosts import OctoMapGrid, RayGrid
from planner import OCCUPIED, Grid, Lanes, coarser, cost_of, grown, path_to, velocity_of
from rendered import FPS, WIDE_DEG, Camera, Truth, base_pose, camera_on_base, lens, world_of
from sights import PERSON_M, Sight, merged

CROWD = Path(__file__).resolve().parents[2] / "configs" / "worlds" / "crowd.yaml"
RADIUS_M, SPEED_MPS, TURN_RPS, ACCELERATION_MPS2 = 0.25, 0.8, 1.0, 1.5
REACHED_M, MOST_S_PER_GOAL = 0.35, 30
HORIZONS_S = (0, 0.5, 1, 1.5, 2)
REMEMBERED_S, STOOD_MPS, LOOK_ROUND_S, NEAR_FRAMES = 3, 0.05, 4, 6
PATH_EVERY, GRID_EVERY = 4, 8  # frames
STRIP, STRIP_EVERY = 8, 3  # pictures that lead to a contact, frames between them
SHOT_S = 0.5
CONTACTS = ("driven_into", "grazed", "walked_into")
COLUMNS = ("goals", "of", *CONTACTS, "furniture", "lost_frames", "frames", "metres", "seconds", "standing_s")
DEPTH_ALONE = {"ghosts": RayGrid, "octomap": OctoMapGrid}


def forecasts(objects, T_floor_world, unseen_s=0):
    """Of each person whether he is seen, and (seconds, place on the floor, sigma). @param unseen_s since the frame."""
    people = []
    for item in objects:
        missing_s = item.missing_frames / FPS + unseen_s
        if item.class_name != "person" or missing_s > REMEMBERED_S:
            continue
        entry = []
        for after_s in HORIZONS_S:
            place, covariance = item.after(after_s + unseen_s)
            on_floor = T_floor_world[:3, :3] @ covariance @ T_floor_world[:3, :3].T
            at = (T_floor_world @ [*place, 1])[:2]
            entry.append((after_s, at, float(np.sqrt(np.linalg.eigvalsh(on_floor[:2, :2])[-1]))))
        people.append((missing_s == 0, entry))
    return people


class Eye:
    """A camera on the base, and what is found in its images alone."""

    def __init__(self, options, world, folder, seed, number, T_floor_base, tracks):
        """@param tracks whether it finds its own pose and people, else it is told the pose. The first makes the plan: a dense
        map for each would be too much."""
        self.T_base_camera = camera_on_base(2 * np.pi * number / options.cameras)
        self.T_floor_first = T_floor_base @ self.T_base_camera  # the map begins at the first camera
        self.camera = Camera(options.ygslam, world, folder, seed)
        self.pinhole = ygslam.CameraModel(**lens())
        self.slam = tracks and ygslam.Slam(self.pinhole, segmenter="builtin", deterministic=True,
                                           options={} if number == 0 else {"run.without": "[dense_map]"})
        self.T_before, self.objects, self.seen_at = None, [], 0

    def look(self, k, T_floor_base, wants_grid):
        """@param T_floor_base the true one."""
        T_now = T_floor_base @ self.T_base_camera
        rgb, depth = self.camera.look(k / FPS, T_now)
        seen = Sight(rgb, depth, T_now, T_floor_base, [], np.empty((0, 2)), None)
        if self.slam:
            wheels = np.eye(4) if self.T_before is None else np.linalg.inv(self.T_before) @ T_now
            result = self.slam.process(rgb, depth, 10**12 + k * 10**9 // FPS, T_last_camera=wheels)
            self.T_before = T_now
            if wants_grid:
                seen.grid = grid_of(self.slam.plan(), self.T_floor_first)
            if result.state == ygslam.State.LOST:
                seen.T_floor_camera = seen.T_floor_base = None
                # Who fills the view is still there.
                seen.people = forecasts(self.objects, self.T_floor_first, (k - self.seen_at) / FPS)
                return seen
            self.objects, self.seen_at = result.objects, k
            seen.people = forecasts(result.objects, self.T_floor_first)
            seen.T_floor_camera = self.T_floor_first @ result.pose
            seen.T_floor_base = seen.T_floor_camera @ np.linalg.inv(self.T_base_camera)
        seen.near = self.what_stands(depth, seen.T_floor_camera)
        return seen

    def what_stands(self, depth, T_floor_camera):
        """At the robot's height within two metres, by this depth alone, in cells of 10 cm."""
        v, u = np.mgrid[2:depth.shape[0]:4, 2:depth.shape[1]:4]
        z, c = depth[v, u], self.pinhole
        rays = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], axis=-1)[(z > 0) & (z < 2)]
        points = rays @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]
        cells = np.floor(points[(points[:, 2] > 0.15) & (points[:, 2] < 1.4), :2] / 0.1)
        return (np.unique(cells, axis=0) + 0.5) * 0.1


class EyeProcess:
    """An eye in a process of its own, so that all look at the same time."""

    def __init__(self, *arguments):
        self.pipe, theirs = multiprocessing.Pipe()
        self.process = multiprocessing.Process(target=self.live, args=(theirs, arguments), daemon=True)
        self.process.start()
        theirs.close()  # so that recv() ends where the process does

    @staticmethod
    def live(pipe, arguments):
        eye = Eye(*arguments)
        while question := pipe.recv():
            pipe.send(eye.look(*question))
        eye.camera.close()

    def close(self):
        self.pipe.send(None)
        self.process.join()


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


def drive(options, seed, kind, truth, world, folder):
    ghosts, began_s = kind in DEPTH_ALONE, time.monotonic()
    start, *goals = all_goals = truth.goals(options.goals, seed)
    first = goals[0] - start
    robot, contacts = Robot(start, np.arctan2(first[1], first[0])), Contacts()
    T_believed = T_before = base_pose(*robot.at, robot.yaw)
    eyes = [EyeProcess(options, world, folder / f"frames_{kind}_{i}", seed, i, T_believed, not ghosts)
            for i in range(options.cameras)]
    pinhole = ygslam.CameraModel(**lens())
    rays, lanes, room, path = DEPTH_ALONE.get(kind, RayGrid)(start), Lanes(), None, []
    track, shots, standing, lost = [], [], 0, [[] for _ in eyes]
    near = deque(maxlen=NEAR_FRAMES)
    last, strips = deque(maxlen=STRIP), []
    since, straight_m = T_believed[:2, 3], 0
    for k in range(len(truth.people)):
        T_now = base_pose(*robot.at, robot.yaw)
        T_believed = T_believed @ np.linalg.inv(T_before) @ T_now  # by the wheels, while no camera knows
        for i, eye in enumerate(eyes):
            eye.pipe.send((k, T_now, i == 0 and k % GRID_EVERY == 0))
        seen = [eye.pipe.recv() for eye in eyes]
        T_believed, T_before = next((s.T_floor_base for s in seen if s.T_floor_base is not None), T_believed), T_now
        for frames, one in zip(lost, seen):
            if one.T_floor_base is None:
                frames.append(k)
        here = T_believed[:2, 3]
        known = merged(seen)
        if contacts.check(k / FPS, robot, truth.people[k], truth.furniture, [one[0][1] for one in known]):
            strips.append((k, list(last)))
        track.append(robot.at.tolist())
        if np.linalg.norm(here - goals[0]) < REACHED_M:
            straight_m += max(0, np.linalg.norm(goals[0] - since) - REACHED_M)
            goals.pop(0)
            path, since = [], here
            if not goals:
                break
        if ghosts:
            for s in seen:
                rays.add(s.depth, pinhole, s.T_floor_camera)
        people = [] if ghosts else known
        lanes.add(k / FPS, [one[0][1] for one in people])
        if k % GRID_EVERY == 0:
            room = rays.grid() if ghosts else seen[0].grid
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
        if seen[0].T_floor_base is None:
            target, heading = here, robot.yaw
        near.append(np.concatenate([s.near for s in seen]))
        velocity = velocity_of(lambda places, grid=grid, solid=solid: grid.look_up(solid, places), np.concatenate(near), here,
                               robot.velocity, target, people, SPEED_MPS, ACCELERATION_MPS2, RADIUS_M, RADIUS_M + PERSON_M)
        robot.move(velocity, heading)
        standing += np.linalg.norm(robot.velocity) < STOOD_MPS
        shot = (seen[0].rgb, grid, path, people, here, goals[0], truth.people[k])
        if k % STRIP_EVERY == 0:
            last.append((k, *shot[1:]))
        if options.film and k % round(FPS * SHOT_S) == 0:
            shots.append(shot)
    for eye in eyes:
        eye.close()
    line = {"seed": seed, "plan": kind, "goals": options.goals - len(goals), "of": options.goals, **contacts.counts,
            "metres": round(float(np.linalg.norm(np.diff(track, axis=0), axis=1).sum()), 1),
            "straight_m": round(float(straight_m), 1),
            "seconds": round(len(track) / FPS, 1), "standing_s": round(standing / FPS, 1),
            "lost_frames": sum(map(len, lost)), "frames": len(track) * len(eyes),
            "all_lost": len(set.intersection(*map(set, lost))), "took_s": round(time.monotonic() - began_s),
            "contacts": contacts.places, "lost": lost}
    return line, {"track": track, "contacts": contacts.places, "truth": truth, "shots": shots, "goals": all_goals,
                  "strips": strips}


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
            line, seen = drive(options, seed, plan, truth, world, folder)
            lines.append(line)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            picture(seen, ", ".join(f"{key} {line[key]}" for key in ("seed", "plan", *COLUMNS))).save(
                options.out / f"drive_{seed}_{plan}.png")
            for k, shots in seen["strips"]:
                strip(shots, FPS).save(options.out / f"contact_{seed}_{plan}_{k}.png")
            films[", ".join([plan, *(f"{line[key]} {key.replace('_', ' ')}" for key in CONTACTS)])] = seen["shots"]
        shutil.rmtree(folder)
        if options.film:
            film(films, options.out / f"drive_{seed}.webp", SHOT_S)
    print_table(lines)


def print_table(lines):
    """Every drive, and the sums of each plan."""
    print("| seed | plan | " + " | ".join(name.replace("_", " ") for name in COLUMNS) + " | detour |")
    print("|---|---|" + "---:|" * (len(COLUMNS) + 1))
    for plan in ("ygslam", *DEPTH_ALONE):
        mine = sorted((line for line in lines if line["plan"] == plan), key=lambda line: line["seed"])
        rows = [(line["seed"], line) for line in mine]
        if mine:
            rows.append((f"{len(mine)} seeds", {name: round(sum(line[name] for line in mine), 1) for name in mine[0]
                                                if name in (*COLUMNS, "straight_m")}))
        for seed, row in rows:
            cells = [f"{row[name]:g}" for name in COLUMNS]
            print(f"| {seed} | {plan} | " + " | ".join(cells) + f" | {row['metres'] / max(row['straight_m'], 0.1):.2f} |")


if __name__ == "__main__":
    main()
