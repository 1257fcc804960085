"""A robot with a camera drives through a rendered crowd to ten goals, planning on YG-SLAM's plan and forecasts, and once
more on the hits and misses of its depth alone, as planners do that know no people (`ghosts`: on the floor; `octomap`:
OctoMap itself, by pyoctomap).

    PYTHONPATH=build/release/python .venv/bin/python examples/drive_among_people/drive.py out/drive \
        --ygslam build/release/ygslam --seeds 1-20 [--plans ygslam octomap] [--film]

Needs PyYAML and Pillow (`make setup` has them).

Each seed is driven with each plan; a line of JSON each in out/drive/drives.jsonl, a picture, and with --film a moving
one of the plans side by side (drive_1.webp). The world does not wait and
its people do not step aside: they walk into a robot that stands. Poses are YG-SLAM's in both cases; the robot's wheels
do exactly what they are told, and tell the tracker. A contact: a person's middle within 0.45 m of the robot's, or
furniture within its radius; it was driven into where the robot moved towards it. Somebody was not known where no live
object was within 0.6 m of him: mostly, the camera (62 degrees wide) looked elsewhere.
"""
import argparse
import json
import shutil
import tempfile
from pathlib import Path

import numpy as np
import yaml
import ygslam
from PIL import Image, ImageDraw

from film import film
from ghosts import OctoMapGrid, RayGrid
from planner import OCCUPIED, Grid, coarser, cost_of, grown, path_to, velocity_of
from rendered import FPS, Camera, Truth, pose_of, world_of

CROWD = Path(__file__).resolve().parents[2] / "configs" / "worlds" / "crowd.yaml"
RADIUS_M, SPEED_MPS, TURN_RPS, ACCELERATION_MPS2 = 0.25, 0.6, 1.0, 1.5
PERSON_M, REACHED_M, MOST_S = 0.2, 0.35, 240
HORIZONS_S = (0, 0.5, 1, 1.5, 2)
SHOT_S = 0.5
DEPTH_ALONE = {"ghosts": RayGrid, "octomap": OctoMapGrid}


def forecasts(objects, T_floor_world):
    """Of each person (seconds, place on the floor, sigma)."""
    people = []
    for item in objects:
        if item.class_name != "person" or item.faded:
            continue
        entry = []
        for after_s in HORIZONS_S:
            place, covariance = item.after(after_s)
            on_floor = T_floor_world[:3, :3] @ covariance @ T_floor_world[:3, :3].T
            at = (T_floor_world @ [*place, 1])[:2]
            entry.append((after_s, at, float(np.sqrt(np.linalg.eigvalsh(on_floor[:2, :2])[-1]))))
        people.append(entry)
    return people


class Robot:
    """A base that moves in any direction while it turns; the camera looks ahead of it."""

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
        self.driven, self.walked, self.furniture, self.unseen, self.places = 0, 0, 0, 0, []
        self.since = {}

    def check(self, t_s, robot, people, furniture, known):
        near = [(f"person {i}", p) for i, p in enumerate(people) if np.linalg.norm(p - robot.at) < RADIUS_M + PERSON_M]
        nearest = furniture[np.argmin(np.linalg.norm(furniture - robot.at, axis=1))]
        if np.linalg.norm(nearest - robot.at) < RADIUS_M:
            near.append(("furniture", nearest))
        for name, place in near:
            if t_s - self.since.get(name, -9) > 1:
                if name != "furniture":
                    self.unseen += all(np.linalg.norm(place - k) > 0.6 for k in known)
                towards = robot.velocity @ (place - robot.at) > 0.03
                if name == "furniture":
                    self.furniture += 1
                elif towards:
                    self.driven += 1
                else:
                    self.walked += 1
                self.places.append((robot.at.tolist(), name, bool(towards)))
            self.since[name] = t_s


def intrinsics(sequence, width=320, height=240):
    """Of the same camera with images of another size."""
    said = dict(line.split()[:2] for line in (sequence / "calibration.txt").read_text("utf-8").splitlines()
                if line[:1].islower())
    fx, fy, cx, cy, w, h = (float(said[key]) for key in ("fx", "fy", "cx", "cy", "width", "height"))
    return {"fx": fx * width / w, "fy": fy * height / h, "cx": (cx + 0.5) * width / w - 0.5,
            "cy": (cy + 0.5) * height / h - 0.5, "width": width, "height": height}


def drive(options, seed, kind, folder):
    ghosts = kind in DEPTH_ALONE
    world = folder / "world.yaml"
    world.write_text(yaml.safe_dump(world_of(CROWD, seed)), "utf-8")
    truth = Truth(options.ygslam, world, folder / "truth", MOST_S)
    start, *goals = truth.goals(options.goals, seed)
    first = goals[0] - start
    robot, contacts = Robot(start, np.arctan2(first[1], first[0])), Contacts()
    camera = Camera(options.ygslam, world, folder / "frames", seed)
    pinhole = ygslam.CameraModel(**intrinsics(folder / "truth"))
    T_true_world = pose_of(*robot.at, robot.yaw)  # the map begins at the first camera
    slam = ygslam.Slam(pinhole, segmenter="builtin", deterministic=True)
    rays, room, path, track, lost, standing = DEPTH_ALONE.get(kind, RayGrid)(start), None, [], [], 0, 0
    shots, T_before = [], pose_of(*robot.at, robot.yaw)
    for k in range(MOST_S * FPS):
        T_now = pose_of(*robot.at, robot.yaw)
        rgb, depth = camera.look(k / FPS, T_now)
        wheels = np.linalg.inv(T_before) @ T_now
        result = slam.process(rgb, depth, 10**12 + k * 10**9 // FPS, T_last_camera=wheels)
        T_before = T_now
        contacts.check(k / FPS, robot, truth.people[k], truth.furniture,
                       [one[0][1] for one in forecasts(result.objects, T_true_world)])
        track.append(robot.at.tolist())
        lost += result.state == ygslam.State.LOST
        T_floor_camera = T_true_world @ result.pose  # in the axes of the building
        here = T_floor_camera[:2, 3]
        if np.linalg.norm(here - goals[0]) < REACHED_M:
            goals.pop(0)
            if not goals:
                break
        if ghosts:
            rays.add(depth, pinhole, T_floor_camera)
        if k % 2 == 0:
            people = [] if ghosts else forecasts(result.objects, T_true_world)
            if room is None or k % 6 == 0:
                room = rays.grid() if ghosts else grid_of(slam.plan(), T_true_world)
            grid = room.around([here, goals[0]])
            cost = cost_of(grid, here, RADIUS_M, SPEED_MPS, people)
            path = path_to(grid, cost, here, goals[0])
        target = next((p for p in path if np.linalg.norm(p - here) > 0.5), path[-1] if path else here)
        if result.state == ygslam.State.LOST:
            robot.move(np.zeros(2), robot.yaw)
        else:
            solid = grown(grid.cells == OCCUPIED, RADIUS_M / grid.cell_m)
            velocity = velocity_of(grid, solid, here, target, people, SPEED_MPS, RADIUS_M + PERSON_M)
            far = np.linalg.norm(target - here) > 0.2
            robot.move(velocity, np.arctan2(*(target - here)[::-1]) if far else robot.yaw)
        standing += np.linalg.norm(robot.velocity) < 0.05
        if options.film and k % round(FPS * SHOT_S) == 0:
            shots.append((rgb, grid, path, people, here, goals[0], truth.people[k]))
    camera.close()
    line = {"seed": seed, "plan": kind, "goals": options.goals - len(goals),
            "seconds": round(len(track) / FPS, 1), "standing_s": round(standing / FPS, 1), "lost_frames": lost,
            "metres": round(float(np.linalg.norm(np.diff(track, axis=0), axis=1).sum()), 1),
            "driven_into_people": contacts.driven, "walked_into": contacts.walked, "unseen": contacts.unseen,
            "furniture": contacts.furniture}
    return line, {"track": track, "contacts": contacts.places, "truth": truth, "shots": shots,
                  "goals": truth.goals(options.goals, seed)}


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
    """From above: furniture grey, people's ways blue, the drive green, goals numbered, contacts red."""
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
    for place, _, towards in seen["contacts"]:
        x, y = at(place)
        draw.ellipse([x - 12, y - 12, x + 12, y + 12], outline=(220, 0, 0) if towards else (230, 150, 0), width=4)
    draw.text((8, 6), title, fill="black")
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--seeds", default="1-1")
    parser.add_argument("--goals", type=int, default=10)
    parser.add_argument("--plans", nargs="+", choices=["ygslam", *DEPTH_ALONE], default=["ygslam", "ghosts"])
    parser.add_argument("--film", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "drives.jsonl"
    lines = [json.loads(line) for line in results.read_text("utf-8").splitlines()] if results.exists() else []
    first, last = (int(s) for s in (options.seeds.split("-") * 2)[:2])
    for seed in range(first, last + 1):
        films = {}
        for plan in options.plans:
            if any(line["seed"] == seed and line["plan"] == plan for line in lines):
                continue
            folder = Path(tempfile.mkdtemp())
            line, seen = drive(options, seed, plan, folder)
            shutil.rmtree(folder)
            lines.append(line)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            title = ", ".join(f"{key} {value}" for key, value in line.items())
            picture(seen, title).save(options.out / f"drive_{seed}_{plan}.png")
            films[f"{plan}: {line['driven_into_people']} driven into, {line['walked_into']} walked into"] = seen["shots"]
        if options.film and films:
            film(films, options.out / f"drive_{seed}.webp", SHOT_S)
    print("| plan | drives | goals | contacts: driven into people | walked into by people | by somebody not known then | furniture | metres | seconds "
          "| standing |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")
    for plan in ("ygslam", *DEPTH_ALONE):
        mine = [line for line in lines if line["plan"] == plan]
        if mine:
            total = {key: sum(line[key] for line in mine) for key in mine[0] if key not in ("plan", "seed")}
            print(f"| {plan} | {len(mine)} | {total['goals']} of {len(mine) * options.goals} | {total['driven_into_people']} "
                  f"| {total['walked_into']} | {total['unseen']} | {total['furniture']} | {total['metres']:.0f} | {total['seconds']:.0f} "
                  f"| {total['standing_s']:.0f} |")


if __name__ == "__main__":
    main()
