"""What a ground plan should show of a rendered sequence, second by second: the truth of plan_ghosts.py."""
import json

import numpy as np
import plyfile
from PIL import Image
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial.transform import Rotation

from rendered_seeds import read_calibration, read_tum, stamp_text

CELL_M, FINE_M = 0.05, 0.025
LOW_M, HIGH_M, LAYER_M = 0.10, 1.50, 0.10
FAR_M, LEFT_S, LEAST_VIEWS = 4.0, 1.0, 3
BODY_M = 0.25  # radius of the disc that nobody's footprint leaves
FREE, OCCUPIED, UNKNOWN = 0, 100, -1


def disc(radius):
    y, x = np.mgrid[-radius:radius + 1, -radius:radius + 1]
    return x * x + y * y <= radius * radius


def surface_points(file):
    """Of a mesh's triangles, a centimetre apart."""
    ply = plyfile.PlyData.read(file)
    vertices = np.stack([ply["vertex"][a] for a in "xyz"], -1).astype(float)
    corners = vertices[np.stack(ply["face"]["vertex_indices"])]
    heights = corners[..., 2]
    corners = corners[(heights.max(1) > LOW_M) & (heights.min(1) < HIGH_M)]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(1)
    points = []
    for count in np.unique(np.maximum(1, np.ceil(sides / 0.01)).astype(int)):
        pick = corners[np.maximum(1, np.ceil(sides / 0.01)).astype(int) == count]
        i, j = np.mgrid[0:count + 1, 0:count + 1]
        i, j = i[i + j <= count] / count, j[i + j <= count] / count
        for part in np.array_split(pick, max(1, len(pick) * len(i) // 2_000_000)):
            found = (part[:, None, 0] * (1 - i - j)[:, None] + part[:, None, 1] * i[:, None]
                     + part[:, None, 2] * j[:, None]).reshape(-1, 3)
            points.append(found[(found[:, 2] >= LOW_M) & (found[:, 2] <= HIGH_M)])
    return np.concatenate(points)


class Raster:
    """Of the truth's ground."""

    def __init__(self, low, high, cell_m):
        self.low, self.cell_m = np.asarray(low, float), cell_m
        self.shape = tuple(np.ceil((np.asarray(high) - low) / cell_m).astype(int)[::-1])

    def index(self, points):
        x, y = np.floor((points[:, :2] - self.low) / self.cell_m).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < self.shape[1]) & (y < self.shape[0])
        return np.where(inside, y * self.shape[1] + x, -1)

    def filled(self, points):
        mask = np.zeros(self.shape[0] * self.shape[1], bool)
        at = self.index(points)
        mask[at[at >= 0]] = True
        return mask.reshape(self.shape)

    def look_up(self, values, points, outside):
        at = self.index(points)
        return np.where(at >= 0, values.reshape(-1)[at], outside)

    def centres(self):
        y, x = np.mgrid[0:self.shape[0], 0:self.shape[1]] + 0.5
        return np.stack([x, y], -1).reshape(-1, 2) * self.cell_m + self.low


class Truth:
    """What stands, who was where, and what the frames so far could see of it."""

    def __init__(self, seq):
        self.seq, self.camera = seq, read_calibration(seq)
        self.poses = read_tum(seq / "groundtruth.txt")
        fixed = surface_points(seq / "static.ply")
        low, high = fixed[:, :2].min(0) - 0.3, fixed[:, :2].max(0) + 0.3
        self.fine, self.coarse = Raster(low, high, FINE_M), Raster(low, high, CELL_M)
        self.fixed_fine, self.fixed = self.fine.filled(fixed), self.coarse.filled(fixed)
        names = json.loads((seq / "instances.json").read_text()) if (seq / "instances.json").exists() else {}
        self.people = {int(i) for i, name in names.items() if name == "person"}
        self.paths = {int(f.stem): read_tum(f) for f in (seq / "movers").glob("*.txt")}
        self.boxes = self._boxes()
        layers = round((HIGH_M - LOW_M) / LAYER_M)
        self.layers_m = LOW_M + LAYER_M * (np.arange(layers) + 0.5)
        shape = (layers, *self.coarse.shape)
        self.covered = np.full(shape, -np.inf)  # when somebody or something that moves was last seen there
        self.through = np.zeros(shape, int)  # frames that saw through it since
        self.enough = LEFT_S / np.median(np.diff(sorted(self.poses))) * 1e6  # such frames
        self.views = np.zeros(self.coarse.shape, int)
        self.floor_views = np.zeros(self.coarse.shape, int)
        self.under_people = np.zeros(self.coarse.shape, bool)
        self.now = -np.inf

    def _boxes(self):
        """Of things that move, where they stand for a while: static.ply has them not."""
        truth = json.loads((self.seq / "true_objects.json").read_text())
        things = truth["objects"] + truth.get("nameless", [])
        return [place for thing in things if len(thing["places"]) > 1 for place in thing["places"]]

    def _image(self, folder, stamp):
        return np.asarray(Image.open(self.seq / folder / f"{stamp_text(stamp)}.png"))

    def _pose(self, stamp):
        pose = self.poses[stamp]
        return Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]

    def observe(self, stamp):
        """A frame; in their order."""
        now = self.now = stamp * 1e-6
        depth, mask = self._image("depth_true", stamp) / 5000, self._image("mask", stamp)
        c, (R, t) = self.camera, self._pose(stamp)
        v, u = np.mgrid[0:depth.shape[0]:2, 0:depth.shape[1]:2]
        d, m = depth[::2, ::2], mask[::2, ::2]
        near = (d > 0) & (d < FAR_M)
        rays = np.stack([(u - c["cx"]) / c["fx"], (v - c["cy"]) / c["fy"], np.ones(u.shape)], -1)
        points = (rays * d[..., None])[near] @ R.T + t
        moves = m[near] > 0
        still = points[~moves]
        self.views += self.coarse.filled(still[(still[:, 2] > LOW_M + 0.03) & (still[:, 2] < HIGH_M - 0.03)])
        self.floor_views += self.coarse.filled(still[np.abs(still[:, 2]) < 0.03])
        self._cover(points[moves], now)
        measured = self._image("depth", stamp) / c["depth_scale"]
        self._see_through(depth, measured, R, t, now)
        self._stand(now)

    def _cover(self, points, now):
        for i, middle_m in enumerate(self.layers_m):
            filled = self.coarse.filled(points[np.abs(points[:, 2] - middle_m) <= LAYER_M / 2])
            filled = binary_dilation(filled, np.ones((3, 3)))
            self.covered[i][filled] = now
            self.through[i][filled] = 0

    def _see_through(self, depth, measured, R, t, now):
        """In truth, around the middle of the cell, and by what was measured there."""
        waiting = np.argwhere((self.covered > -np.inf) & (self.covered < now) & (self.through < self.enough))
        if not len(waiting):
            return
        ground = self.coarse.low + (waiting[:, 2:0:-1] + 0.5) * CELL_M
        p = (np.column_stack([ground, self.layers_m[waiting[:, 0]]]) - t) @ R
        c = self.camera
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.rint(c["fx"] * p[:, 0] / p[:, 2] + c["cx"])
            v = np.rint(c["fy"] * p[:, 1] / p[:, 2] + c["cy"])
        in_view = (p[:, 2] > 0.3) & (p[:, 2] < FAR_M) & (u >= 8) & (v >= 8)
        in_view &= (u < depth.shape[1] - 8) & (v < depth.shape[0] - 8)
        at = np.flatnonzero(in_view)
        through = measured[v[at].astype(int), u[at].astype(int)] > p[at, 2] + 0.15
        for du in (-8, 0, 8):
            for dv in (-8, 0, 8):
                seen = depth[v[at].astype(int) + dv, u[at].astype(int) + du]
                through &= seen > p[at, 2] + 0.15
        gone = waiting[at[through]]
        self.through[tuple(gone.T)] += 1

    def _stand(self, now):
        """Where people stand, as far as a disc is a footprint."""
        stamp = min(self.poses, key=lambda s: abs(s * 1e-6 - now))
        centres = self.coarse.centres()
        self.under_people = np.zeros(len(centres), bool)
        for number in self.people:
            place = self.paths.get(number, {}).get(stamp)
            if place is None:
                continue
            self.under_people |= np.linalg.norm(centres - place[:2], axis=1) < BODY_M
        self.under_people = self.under_people.reshape(self.coarse.shape)

    def standing(self):
        """What stands now but people: all that never moves, and things between two moves."""
        stands = self.fixed.copy()
        centres = self.coarse.centres()
        for place in self.boxes:
            if not place["from_ns"] * 1e-9 - 1e-3 <= self.now <= place["until_ns"] * 1e-9 + 1e-3:
                continue
            local = (centres - place["centre_m"][:2]) @ Rotation.from_euler(
                "z", place["yaw_rad"]).as_matrix()[:2, :2]
            inside = (np.abs(local) < np.array(place["size_m"][:2]) / 2).all(1)
            stands |= inside.reshape(self.coarse.shape)
        return stands

    def judge(self, plan):
        """@param plan a Plan of now."""
        at, cells = plan.places, plan.cells

        def look_up(values, outside=False):
            return self.coarse.look_up(values, at, outside)

        stands = self.standing()
        near = look_up(binary_dilation(stands, disc(2)))
        present = look_up(binary_dilation((self.covered >= self.now).any(0) | self.under_people, disc(2)))
        was = np.isfinite(self.covered)
        seen_empty = (~was | (self.through >= self.enough)).all(0) & was.any(0)
        occupied, free = cells == OCCUPIED, cells == FREE
        odd = occupied & ~near & ~present
        around = look_up(binary_dilation(was.any(0), np.ones((3, 3))))
        ghosts = odd & look_up(seen_empty)
        inner = self.fine.look_up(binary_erosion(self.fixed_fine, np.ones((5, 5))), at, False)
        false_free = free & inner
        floor = (self.floor_views >= LEAST_VIEWS) & ~binary_dilation(stands, disc(1)) & (self.views == 0)
        shown = plan.raster(self.coarse, OCCUPIED)
        known = (self.views >= LEAST_VIEWS) & self.fixed
        floor_count = max(1, floor.sum())
        free_raster = plan.raster(self.coarse, FREE)
        return {"ghosts": int(ghosts.sum()), "ghosts_unseen": int((odd & around & ~ghosts).sum()),
                "on_people": int((occupied & look_up(self.under_people) & ~near).sum()),
                "false_free": int(false_free.sum()),
                "missed": float((known & ~binary_dilation(shown, np.ones((3, 3)))).sum() / max(1, known.sum())),
                "free": float((floor & free_raster).sum() / floor_count),
                "occupied": float((floor & shown & ~free_raster).sum() / floor_count),
                "unknown": float((floor & ~free_raster & ~shown).sum() / floor_count),
                "false_occupied": int((odd & ~around).sum()),
                "marks": {"ghost": at[ghosts], "unseen": at[odd & around & ~ghosts], "free": at[false_free],
                          "odd": at[odd & ~around]}}
