"""A dense map's cells and ground plan, and a network's single masks, against a rendered world.

  voxel_truth.py SCENE SEQ TRAJECTORY [MASKS]

SCENE is what `ygslam run SEQ --export` wrote, SEQ was rendered with --truth, TRAJECTORY is the run's,
MASKS what `run --save-masks` kept (or SEQ/things). True cells are cubes of 5 cm of the truth's frame,
of every fifth frame, within 4 m: static ones that three of these frames measured (the sensor gave a depth
within 5 cm of the true one), with the name that most of their pixels have; movers' ones that such a frame
saw, 10 cm and more from all that is static and from where a thing stands in the end. A cell is in the map
where the centre of an occupied cell of space.ot lies within 5 cm of the mean of its points.

kept, gone      static cells that are in the map; movers' cells that are not
miou            over the names that occur in the truth: of static cells of 2 cm within 5 cm of mesh.ply, the
                name of its nearest vertex against the true one; those without a name count where one was given
miou_things     of those without floor, wall and ceiling, which no network names
miou_single     the same of single masks, at all static cells that a frame shows
unknown_free    of the pixels that read as free (nav2's rules): where no frame saw the floor or less
                than 30 cm above it, a pixel's width allowed for
obstacles_found of the columns with a measured static surface 0.13 to 1.47 m up: occupied within a pixel
free_obstacle   of the pixels that read as free: more than a pixel's width inside of such columns
false_occupied  of the occupied pixels: farther than 10 cm from any true surface of these heights
"""
import argparse
import json
from pathlib import Path

import numpy as np
import plyfile
import pyoctomap
import yaml
from PIL import Image
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from rendered_seeds import micros, read_calibration, read_tum, stamp_text

CELL_M, LABEL_CELL_M, WITHIN_M, CLEAR_M, FAR_M = 0.05, 0.02, 0.05, 0.1, 4.0
LEAST_VIEWS, STEP, PIXEL_STEP = 3, 5, 2
LEAST_CELLS = 50  # of a name that counts: 200 cm2
STRUCTURE = ("floor", "wall", "ceiling")
OBSTACLE_M, FLOOR_SEEN_M = (0.10, 1.50), 0.30
PLAN_ERROR_M = 0.03  # of heights: half a cell


def image(path):
    return np.asarray(Image.open(path))


def names_of(folder):
    """By the value of a pixel; "" has no name."""
    names = np.full(256, "", dtype="<U16")
    for number, name in json.loads((folder / "instances.json").read_text()).items():
        names[int(number)] = name if isinstance(name, str) else name["class"]
    return names


class Frames:
    """Every fifth frame of a rendered sequence, looked at by every second pixel of every second row."""

    def __init__(self, seq, step=STEP):
        self.seq, self.camera = seq, read_calibration(seq)
        pairs = [line.split() for line in (seq / "associations.txt").read_text().splitlines() if line[0] != "#"]
        self.all_stamps = [micros(p[0]) for p in pairs]
        self.stamps = self.all_stamps[::step]
        self.poses = read_tum(seq / "groundtruth.txt")

    def pose(self, stamp):
        pose = self.poses[stamp]
        return Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]

    def pixels(self, folder, stamp):
        return image(self.seq / folder / f"{stamp_text(stamp)}.png")[::PIXEL_STEP, ::PIXEL_STEP]

    def points(self, stamp, depth):
        """Of each pixel, in the truth's frame."""
        v, u = np.mgrid[0:depth.shape[0], 0:depth.shape[1]] * PIXEL_STEP
        c = self.camera
        ray = np.stack([(u - c["cx"]) / c["fx"], (v - c["cy"]) / c["fy"], np.ones(u.shape)], -1)
        R, t = self.pose(stamp)
        return (ray * depth[..., None]) @ R.T + t

    def seen(self, stamp):
        """Points, whether static, whether measured, of the pixels that show something near."""
        true, static = self.pixels("depth_true", stamp) / 5000, self.pixels("depth_static", stamp) / 5000
        measured = self.pixels("depth", stamp) / self.camera["depth_scale"]
        shown = (true > 0) & (true < FAR_M)
        stays = (static > 0) & (static - true <= 0.01)
        return shown, self.points(stamp, true), stays, (measured > 0) & (abs(measured - true) < 0.05)


    def static_points(self, stamp):
        static = self.pixels("depth_static", stamp) / 5000
        return self.points(stamp, static)[static > 0]


def keys_of(points, cell_m):
    cells = np.floor(points / cell_m).astype(np.int64) + (1 << 20)
    return cells[:, 0] << 42 | cells[:, 1] << 21 | cells[:, 2]


class Cells:
    """Means, views and commonest names of the cells that points lie in."""

    def __init__(self, points, names, views, cell_m=CELL_M):
        keys, index = np.unique(keys_of(points, cell_m), return_inverse=True)
        count = np.bincount(index, minlength=len(keys))
        self.keys = keys
        self.mean = np.stack([np.bincount(index, points[:, i], len(keys)) for i in range(3)], -1)
        self.mean /= count[:, None]
        known, number = np.unique(names, return_inverse=True)
        votes = np.zeros((len(keys), len(known)), int)
        np.add.at(votes, (index, number), 1)
        self.names = known[votes.argmax(1)]
        pairs = np.unique(np.stack([index, views], -1), axis=0)
        self.views = np.bincount(pairs[:, 0], minlength=len(keys))


def means(points):
    return Cells(points, np.full(len(points), ""), np.zeros(len(points), int)).mean


def true_cells(frames):
    """Static cells, those of labels, movers' points, and means of all that is static, measured or not."""
    names = names_of(frames.seq / "things")
    points, called, views, movers, fixed = [], [], [], [], []
    for i, stamp in enumerate(frames.stamps):
        shown, where, stays, measured = frames.seen(stamp)
        pick = shown & stays & measured
        points.append(where[pick])
        called.append(names[frames.pixels("things", stamp)[pick]])
        views.append(np.full(pick.sum(), i))
        movers.append(where[shown & ~stays])
        fixed.append(frames.static_points(stamp))
    seen = [np.concatenate(x) for x in (points, called, views)]
    return (Cells(*seen), Cells(*seen, LABEL_CELL_M), np.concatenate(movers),
            means(np.concatenate(fixed)))


def standing_boxes(seq):
    """Of things that came to where they stand at the end."""
    truth = json.loads((seq / "true_objects.json").read_text())
    objects = truth["objects"] + truth.get("nameless", [])
    begin = min((p["from_ns"] for o in objects for p in o["places"]), default=0)
    end = max((p["until_ns"] for o in objects for p in o["places"]), default=0)
    lasts = [o["places"][-1] for o in objects if o["places"]]
    return [p for p in lasts if p["until_ns"] == end and p["from_ns"] > begin]


def inside(points, box, margin_m):
    local = (points - box["centre_m"]) @ Rotation.from_euler("z", box["yaw_rad"]).as_matrix()
    return (np.abs(local) < np.array(box["size_m"]) / 2 + margin_m).all(1)


def true_movers(frames, movers, surface):
    if not len(movers):
        return movers
    cells = means(movers)
    cells = cells[surface.query(cells, distance_upper_bound=CLEAR_M)[0] > CLEAR_M]
    for box in standing_boxes(frames.seq):
        cells = cells[~inside(cells, box, CLEAR_M)]
    return cells


def map_to_truth(trajectory, truth):
    """Rotation and shift that lay a map over the truth: the mean of its poses."""
    poses = read_tum(trajectory)
    stamps = [s for s in poses if s in truth]
    est, true = (np.array([p[s] for s in stamps]) for p in (poses, truth))
    turn = (Rotation.from_quat(true[:, 3:]) * Rotation.from_quat(est[:, 3:]).inv()).mean()
    return turn, true[:, :3].mean(0) - turn.apply(est[:, :3].mean(0))


def confusion_iou(true, given, wanted):
    """Intersection over union of each wanted name."""
    hit = {n: np.sum((true == n) & (given == n)) for n in wanted}
    return {str(n): float(hit[n] / max(1, np.sum((true == n) | (given == n)))) for n in wanted}


def mean_of(iou, leave_out=()):
    values = [v for name, v in iou.items() if name not in leave_out]
    return float(np.mean(values)) if values else None


def single_masks(frames, masks, cells, wanted):
    """Each frame's own names of the cells that it shows, against the true ones."""
    names, true, given = names_of(masks), [], []
    for stamp in frames.stamps:
        file = masks / f"{stamp_text(stamp)}.png"
        if not file.exists():
            continue
        shown, where, stays, measured = frames.seen(stamp)
        pick = shown & stays & measured
        called = names[image(file)[::PIXEL_STEP, ::PIXEL_STEP][pick]]
        one = Cells(where[pick], called, np.zeros(pick.sum(), int), LABEL_CELL_M)
        at = np.minimum(np.searchsorted(cells.keys, one.keys), len(cells.keys) - 1)
        same = (cells.keys[at] == one.keys) & (cells.views[at] >= LEAST_VIEWS)
        true.append(cells.names[at[same]])
        given.append(one.names[same])
    return confusion_iou(np.concatenate(true), np.concatenate(given), wanted) if true else {}


class Plan:
    """A ground plan, read as nav2's map_server does in trinary mode."""

    def __init__(self, file):
        about = yaml.safe_load(file.read_text())
        shade = image(file.parent / about["image"]).astype(float)[::-1]  # row 0: least y
        occupied = (255 - shade) / 255
        self.occupied = occupied > about["occupied_thresh"]
        self.free = ~self.occupied & (occupied < about["free_thresh"])
        self.metres, self.origin = about["resolution"], np.array(about["origin"][:2])
        pose = about["world_from_map"]
        self.turn = Rotation.from_quat(pose["rotation_xyzw"])
        self.shift = np.array(pose["translation_m"])

    def centres(self):
        y, x = np.mgrid[0:self.free.shape[0], 0:self.free.shape[1]] + 0.5
        return np.stack([x, y], -1) * self.metres + self.origin

    def raster(self, points):
        """Pixels that hold a point; points outside are cut off."""
        filled = np.zeros(self.free.shape, bool)
        x, y = np.floor((points[:, :2] - self.origin) / self.metres).astype(int).T
        ok = (x >= 0) & (y >= 0) & (x < filled.shape[1]) & (y < filled.shape[0])
        filled[y[ok], x[ok]] = True
        return filled


def floor_seen(frames, plan, to_truth):
    """Pixels over which a frame saw the floor or the air just above it."""
    centres = plan.centres().reshape(-1, 2)
    heights = np.arange(0, FLOOR_SEEN_M + 0.01, CELL_M)
    points = to_truth(np.column_stack([np.repeat(centres, len(heights), 0),
                                       np.tile(heights, len(centres))]))
    found = np.zeros(len(points), bool)
    c = frames.camera
    for stamp in frames.all_stamps:
        R, t = frames.pose(stamp)
        p = (points - t) @ R
        depth = image(frames.seq / "depth_true" / f"{stamp_text(stamp)}.png") / 5000
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.rint(c["fx"] * p[:, 0] / p[:, 2] + c["cx"])
            v = np.rint(c["fy"] * p[:, 1] / p[:, 2] + c["cy"])
        at = np.flatnonzero((p[:, 2] > 0.3) & (u >= 0) & (v >= 0) & (u < depth.shape[1])
                            & (v < depth.shape[0]))
        there = depth[v[at].astype(int), u[at].astype(int)]
        found[at[there > p[at, 2] - CELL_M]] = True
    return found.reshape(*plan.free.shape, len(heights)).any(-1)


def judge_plan(frames, plan, cells, fixed, turn, shift):
    def to_truth(points):
        return turn.apply(plan.turn.apply(points) + plan.shift) + shift

    def to_plan(points):
        return plan.turn.inv().apply(turn.inv().apply(points - shift) - plan.shift)

    def between(points, margin_m):
        low, high = OBSTACLE_M
        return points[(points[:, 2] > low - margin_m) & (points[:, 2] < high + margin_m)]

    cross = np.ones((3, 3))
    seen = binary_dilation(floor_seen(frames, plan, to_truth), cross)
    often = (cells.views >= LEAST_VIEWS) & (cells.names != "ceiling")
    obstacles = plan.raster(between(to_plan(cells.mean[often]), -PLAN_ERROR_M))
    around = binary_dilation(plan.occupied, cross)
    inside = binary_erosion(obstacles, cross)
    stays = between(to_plan(fixed), CLEAR_M)
    taken = plan.centres()[plan.occupied]
    far = cKDTree(stays[:, :2]).query(taken)[0] > CLEAR_M if len(taken) else np.zeros(1)
    free, count = max(1, plan.free.sum()), max(1, obstacles.sum())
    return {"free_pixels": int(plan.free.sum()), "obstacles": int(obstacles.sum()),
            "unknown_free": float((plan.free & ~seen).sum() / free),
            "obstacles_found": float((obstacles & around).sum() / count),
            "free_obstacle": float((plan.free & inside).sum() / free),
            "false_occupied": float(np.mean(far))}


def judge_labels(frames, scene, masks, cells, turn, shift):
    """Of cells as small as the map's voxels: in larger ones a bottle and its table are one."""
    mesh = plyfile.PlyData.read(scene / "mesh.ply")["vertex"].data
    known = json.loads((scene / "labels.json").read_text())["labels"]
    names = {entry["label"]: entry["name"] for entry in known} | {255: ""}
    points = turn.apply(np.stack([mesh[axis] for axis in "xyz"], -1)) + shift
    often = cells.views >= LEAST_VIEWS
    away, nearest = cKDTree(points).query(cells.mean[often])
    kept, true = away <= WITHIN_M, cells.names[often]
    given = np.array([names[i] for i in mesh["label"].tolist()])[nearest]
    called, count = np.unique(true, return_counts=True)
    wanted = [n for n, k in zip(called, count) if n and k >= LEAST_CELLS]
    iou = confusion_iou(true[kept], given[kept], wanted)
    figures = {"miou": mean_of(iou), "miou_things": mean_of(iou, STRUCTURE), "iou": iou}
    if masks:
        single = single_masks(frames, masks, cells, wanted)
        figures |= {"miou_single": mean_of(single, STRUCTURE), "iou_single": single}
    return figures


def measure(scene, seq, trajectory, masks=None):
    frames = Frames(seq)
    cells, small, movers, fixed = true_cells(frames)
    turn, shift = map_to_truth(trajectory, frames.poses)
    space = pyoctomap.ColorOcTree(CELL_M).read(str(scene / "space.ot"))
    occupied = [leaf.getCoordinate() for leaf in space.begin_leafs() if space.isNodeOccupied(leaf)]
    tree = cKDTree(turn.apply(occupied) + shift)
    often = cells.views >= LEAST_VIEWS
    kept = tree.query(cells.mean[often])[0] <= WITHIN_M
    gone = true_movers(frames, movers, cKDTree(fixed))
    return {"static_cells": int(often.sum()), "kept": float(kept.mean()), "mover_cells": len(gone),
            "gone": float((tree.query(gone)[0] > WITHIN_M).mean()) if len(gone) else None,
            **judge_labels(frames, scene, masks, small, turn, shift),
            "plan": judge_plan(frames, Plan(scene / "grid.yaml"), cells, fixed, turn, shift)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    for name in ("scene", "seq", "trajectory"):
        parser.add_argument(name, type=Path)
    parser.add_argument("masks", type=Path, nargs="?")
    a = parser.parse_args()
    print(json.dumps(measure(a.scene, a.seq, a.trajectory, a.masks), indent=1))
