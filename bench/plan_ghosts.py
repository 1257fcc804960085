"""Ground plans while people walk, second by second, against a rendered world: the library's and OctoMap's.

  ygslam simulate crowd --out SEQ --truth --fps 15 --seconds 20
  PYTHONPATH=build/release/python python bench/plan_ghosts.py SEQ ... --out DIR [--live] [--no-octomap]

SEQ was rendered with --truth. Both get the same depth and the poses that the library found. OctoMap casts the rays of
every fourth pixel of each third frame, with its own defaults. Cells are of 5 cm; obstacles stand from 0.10 to 1.50 m.

ghosts        occupied cells that somebody or something left: nothing stands within 10 cm, and a second's frames have
              seen through every part of the column that was filled, by what was measured (mean, most of a plan)
ghosts_unseen the same where fewer frames saw the place empty
on_people     occupied cells where somebody stands
false_free    free cells that lie, whole, within what stands: cell seconds of all judged plans; any must be looked at
missed        share of the columns of what stands, seen by three frames, without an occupied cell within a cell
free          share of the floor that three frames saw that is free; unknown, occupied: the rest
false_occupied occupied cells farther than 10 cm from all that stands, where nobody was
latency_ms    from a keyframe's result to the first plan that has it (--live; any recording will do)
"""
import argparse
import json
import time
from pathlib import Path

import numpy as np
import plyfile
from PIL import Image
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial.transform import Rotation

from rendered_seeds import micros, read_calibration, read_tum, stamp_text

CELL_M, FINE_M = 0.05, 0.025
LOW_M, HIGH_M, LAYER_M = 0.10, 1.50, 0.10
FAR_M, LEFT_S, LEAST_VIEWS = 4.0, 1.0, 3
BODY_M = 0.25  # radius of the disc that nobody's footprint leaves
OCTOMAP_EVERY, OCTOMAP_STEP_PX, OCTOMAP_FAR_M = 3, 4, 4.5
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


def cell_centres(points):
    """pyoctomap 1.2.2 gives cells of the smallest size half a cell off in all three directions, larger leaves as they
    are: both lie nearest to the same cell's three quarters."""
    return (np.rint(np.reshape(points, (-1, 3)) / CELL_M - 0.75) + 0.5) * CELL_M


class Plan:
    """Cells with their middles on the truth's ground."""

    def __init__(self, cells, places):
        self.cells, self.places = cells, places

    @staticmethod
    def of_grid(grid, turn, shift):
        """@param turn, shift from the library's world to the truth's."""
        y, x = np.mgrid[0:grid.cells.shape[0], 0:grid.cells.shape[1]] + 0.5
        floor = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3) * grid.resolution_m
        floor[:, :2] += grid.origin_m
        world = floor @ grid.T_world_floor[:3, :3].T + grid.T_world_floor[:3, 3]
        return Plan(grid.cells.reshape(-1), (turn.apply(world) + shift)[:, :2])

    @staticmethod
    def of_octree(tree, raster):
        occupied, empty = map(cell_centres, tree.extractPointCloud())
        heights = occupied[:, 2]
        cells = np.full(raster.shape, UNKNOWN)
        floor = np.concatenate([empty[(empty[:, 2] < 0.3) & (empty[:, 2] > -0.3)],
                                occupied[(heights < LOW_M) & (heights > -0.3)]])
        cells[raster.filled(floor)] = FREE
        cells[raster.filled(occupied[(heights >= LOW_M) & (heights <= HIGH_M)])] = OCCUPIED
        return Plan(cells.reshape(-1), raster.centres())

    def raster(self, raster, value):
        """A cell that stands askew covers what its four quarters lie in."""
        quarter = CELL_M / 4
        points = self.places[self.cells == value]
        return np.logical_or.reduce([raster.filled(points + [dx, dy]) for dx in (-quarter, quarter)
                                     for dy in (-quarter, quarter)])


def picture(truth, plan, verdict):
    """Grey: unknown; white: free; black: occupied; blue: people; red: ghosts; orange: ghosts_unseen; violet:
    false_occupied; green: false_free."""
    raster = truth.coarse
    image = np.full((*raster.shape, 3), 150, np.uint8)
    image[plan.raster(raster, FREE)] = 255
    image[plan.raster(raster, OCCUPIED)] = 0
    for name, colour in (("odd", (160, 80, 220)), ("unseen", (255, 150, 60)), ("ghost", (230, 0, 0)),
                         ("free", (0, 170, 0))):
        image[raster.filled(verdict["marks"][name])] = colour
    image[truth.under_people & (image.min(-1) > 100)] = (120, 170, 255)
    return np.asarray(Image.fromarray(image[::-1]).resize((3 * raster.shape[1], 3 * raster.shape[0]), Image.NEAREST))


class OctoMap:
    """As octomap_server has it, with the library's poses."""

    def __init__(self, camera):
        import pyoctomap
        self.tree, self.camera, self.seconds = pyoctomap.OcTree(CELL_M), camera, 0.0

    def add(self, depth_m, R, t):
        """@param R, t the camera in a frame with z up and the floor at 0."""
        c, step = self.camera, OCTOMAP_STEP_PX
        d = depth_m[step // 2::step, step // 2::step].astype(float)
        v, u = np.mgrid[step // 2:depth_m.shape[0]:step, step // 2:depth_m.shape[1]:step]
        rays = np.stack([(u - c["cx"]) / c["fx"], (v - c["cy"]) / c["fy"], np.ones(u.shape)], -1)
        points = (rays * d[..., None])[d > 0] @ R.T + t
        begin = time.thread_time()
        self.tree.insertPointCloud(np.ascontiguousarray(points), np.ascontiguousarray(t), OCTOMAP_FAR_M)
        self.seconds += time.thread_time() - begin


def run(seq, out, options):
    import ygslam
    truth = Truth(seq)
    frames = ygslam.open(str(seq))
    slam = ygslam.Slam(frames.camera, deterministic=True, segmenter=options.segmenter, options=options.set)
    octomap = None if options.no_octomap else OctoMap(truth.camera)
    turn, shift, next_s = None, None, None
    rows = {"ours": [], "octomap": []}
    for i in range(len(frames)):
        frame = frames[i]
        result = slam.process(frame.rgb, frame.depth, frame.t_ns)
        stamp = micros(frame.t_ns * 1e-9)
        truth.observe(stamp)
        if result.state.name not in ("TRACKING", "WEAK"):
            continue
        T, (R, t) = result.pose, truth._pose(stamp)
        if turn is None:  # the first camera is the world
            turn = Rotation.from_matrix(R) * Rotation.from_matrix(T[:3, :3]).inv()
            shift, next_s = t - turn.apply(T[:3, 3]), stamp * 1e-6 + 2
        if octomap and i % OCTOMAP_EVERY == 0:
            octomap.add(np.asarray(frame.depth), (turn * Rotation.from_matrix(T[:3, :3])).as_matrix(),
                        turn.apply(T[:3, 3]) + shift)
        if stamp * 1e-6 < next_s:
            continue
        next_s += options.every
        grid = slam.plan() if not options.room else slam.room().occupancy(LOW_M, HIGH_M)
        if grid is None:
            continue
        plans = {"ours": Plan.of_grid(grid, turn, shift)}
        if octomap:
            plans["octomap"] = Plan.of_octree(octomap.tree, truth.coarse)
        panels = []
        for name, plan in plans.items():
            verdict = truth.judge(plan)
            panels.append(np.pad(picture(truth, plan, verdict), ((0, 0), (0, 6), (0, 0)), constant_values=90))
            del verdict["marks"]
            rows[name].append({"t_s": round(stamp * 1e-6, 3), **verdict})
        Image.fromarray(np.concatenate(panels, 1)).save(out / f"{stamp_text(stamp)}.png")
    figures = {name: summary(table) for name, table in rows.items() if table}
    if octomap:
        figures["octomap"]["cpu_ms_per_view"] = 1e3 * octomap.seconds * OCTOMAP_EVERY / len(frames)
    (out / "plans.json").write_text(json.dumps({"figures": figures, "rows": rows}, indent=1))
    return figures


def run_live(seq, options):
    """As fast as the sequence's camera; between the frames it is looked which plan is there."""
    import ygslam
    frames = ygslam.open(str(seq))
    slam = ygslam.Slam(frames.camera, segmenter=options.segmenter, options=options.set)
    images = [frames[i] for i in range(len(frames))]
    told, arrived, begin = [], [], time.perf_counter()

    def watch_until(due):
        while True:
            plan = slam.plan()
            if plan is not None and (not arrived or plan.t_ns > arrived[-1][0]):
                arrived.append((plan.t_ns, time.perf_counter()))
            if time.perf_counter() > due:
                return
            time.sleep(0.002)

    for image in images:
        watch_until(begin + (image.t_ns - images[0].t_ns) * 1e-9)
        result = slam.process(image.rgb, image.depth, image.t_ns)
        if any(event.name == "KEYFRAME" for event in result.events):
            told.append((image.t_ns, time.perf_counter()))
    watch_until(time.perf_counter() + 2)
    first = arrived[0][0]  # before, no floor was known
    waits = [1e3 * (min((at for t_ns, at in arrived if t_ns >= since), default=np.inf) - when)
             for since, when in told if since >= first]
    seconds = (images[-1].t_ns - images[0].t_ns) * 1e-9
    return {"keyframes": len(waits), "plans": len(arrived), "plans_per_s": round(len(arrived) / seconds, 2),
            "first_s": (first - images[0].t_ns) * 1e-9,
            "latency_ms": {f"p{q}": round(float(np.percentile(waits, q)), 1) for q in (50, 90, 100)}}


def summary(table):
    ghosts = [row["ghosts"] for row in table]
    last = table[-1]
    return {"plans": len(table), "ghosts_mean": float(np.mean(ghosts)), "ghosts_most": int(max(ghosts)),
            "ghosts_unseen_mean": float(np.mean([r["ghosts_unseen"] for r in table])),
            "on_people_mean": float(np.mean([r["on_people"] for r in table])),
            "false_free": int(sum(r["false_free"] for r in table)),
            "false_occupied_mean": float(np.mean([r["false_occupied"] for r in table])),
            **{k: round(last[k], 4) for k in ("missed", "free", "occupied", "unknown")}}


def row_of(figures):
    return (f"{figures['ghosts_mean']:7.2f} {figures['ghosts_most']:5} {figures['ghosts_unseen_mean']:8.1f} "
            f"{figures['on_people_mean']:8.1f} {figures['false_free']:7} {figures['false_occupied_mean']:7.1f} "
            f"{100 * figures['missed']:7.1f} {100 * figures['free']:6.1f} {100 * figures['unknown']:7.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("seq", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True, help="pictures of both plans and plans.json, by sequence")
    parser.add_argument("--segmenter", default="")
    parser.add_argument("--set", nargs="*", default=[], help="KEY=VALUE of `ygslam config`")
    parser.add_argument("--live", action="store_true", help="measure the latency instead")
    parser.add_argument("--no-octomap", action="store_true")
    parser.add_argument("--every", type=float, default=1.0, metavar="S", help="between two plans that are judged")
    parser.add_argument("--room", action="store_true", help="judge room().occupancy() in place of the live plan")
    arguments = parser.parse_args()
    arguments.set = dict(entry.split("=", 1) for entry in arguments.set)
    if not arguments.live:
        print(f"{'':28}  ghosts  most   unseen onpeople  f.free f.occup. missed%  free% unknown%")
    for seq in arguments.seq:
        out = arguments.out / seq.name
        out.mkdir(parents=True, exist_ok=True)
        if arguments.live:
            print(seq.name, json.dumps(run_live(seq, arguments)))
            continue
        for name, figures in run(seq, out, arguments).items():
            print(f"{seq.name:20}{name:8}", row_of(figures), flush=True)


if __name__ == "__main__":
    main()
