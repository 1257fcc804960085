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
from PIL import Image
from scipy.spatial.transform import Rotation

from plan_truth import CELL_M, FREE, HIGH_M, LOW_M, OCCUPIED, UNKNOWN, Truth
from rendered_seeds import micros, stamp_text

OCTOMAP_EVERY, OCTOMAP_STEP_PX, OCTOMAP_FAR_M = 3, 4, 4.5


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
