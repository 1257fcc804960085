#!/usr/bin/env python3
"""How clean and how complete map.ply is, against the depth of the static world.

  map_table.py RUN SEQ [STATIC_DEPTH]     RUN: folder of `ygslam run SEQ`

STATIC_DEPTH (default SEQ/depth_static, which `simulate --truth` writes) has the depth without movers under
the names of SEQ/depth. A point of the map is a ghost where static surface was seen behind it by more than
--ghost in more frames than it was seen at it (movers leave those), else off where no static surface is
within --off. Complete is the share of the static surface that no mover of SEQ/mask hid, nearer than --far,
on a 2 cm grid and seen in at least two of the frames looked at, with a point of the map within 3 cm. All in
the poses of the run's own trajectory, so that its error does not count.
"""
import argparse
import json
from pathlib import Path

import numpy as np
import plyfile
from PIL import Image
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from rendered_seeds import read_calibration


def depths_by_time(seq):
    rows = [line.split() for line in (seq / "depth.txt").read_text().splitlines() if line[0] != "#"]
    return np.array([float(t) for t, _ in rows]), [Path(name).name for _, name in rows]


def frames(run, seq, static, step):
    """Every step-th frame: pose (R, t), static depth [m], whether a mover hides the pixel."""
    times, names = depths_by_time(seq)
    scale = read_calibration(seq)["depth_scale"]
    masks = sorted((seq / "mask").glob("*.png"))
    mask_times = np.array([float(m.stem) for m in masks])
    for row in np.loadtxt(run / "trajectory.txt", ndmin=2)[::step]:
        name = names[int(np.argmin(np.abs(times - row[0])))]
        depth = np.asarray(Image.open(static / name)) / scale
        hidden = np.asarray(Image.open(masks[int(np.argmin(np.abs(mask_times - row[0])))])) > 0
        yield Rotation.from_quat(row[4:8]).as_matrix(), row[1:4], depth, hidden


def measure(arguments):
    camera = read_calibration(arguments.seq)
    cloud = plyfile.PlyData.read(arguments.run / "map.ply")["vertex"].data
    cloud = np.stack([cloud[axis] for axis in "xyz"], -1).astype(float)
    static = arguments.static or arguments.seq / "depth_static"
    fx, fy, cx, cy = (camera[k] for k in ("fx", "fy", "cx", "cy"))
    through, at = np.zeros(len(cloud), int), np.zeros(len(cloud), int)
    surface, visible = [], []
    for R, t, depth, hidden in frames(arguments.run, arguments.seq, static, arguments.step):
        p = (cloud - t) @ R  # in the camera
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = np.rint(fx * p[:, 0] / p[:, 2] + cx), np.rint(fy * p[:, 1] / p[:, 2] + cy)
        h, w = depth.shape
        seen = np.flatnonzero((p[:, 2] > 0.2) & (u >= 2) & (v >= 2) & (u < w - 2) & (v < h - 2))
        ui, vi = u[seen].astype(int), v[seen].astype(int)
        none = depth <= 0
        nearest = -maximum_filter(np.where(none, -99.0, -depth), 5)  # an edge is not seen through
        z, near = p[seen, 2], nearest[vi, ui]
        through[seen] += (near < 90) & (near > z + arguments.ghost * np.maximum(1, z / 2))
        at[seen] += np.abs(depth[vi, ui] - z) <= arguments.ghost * np.maximum(1, z / 2)
        vv, uu = np.mgrid[0:h:2, 0:w:2]
        d, free = depth[::2, ::2], ~maximum_filter(hidden, 9)[::2, ::2]
        q = np.stack([(uu - cx) / fx * d, (vv - cy) / fy * d, d], -1) @ R.T + t
        surface.append(q[(d > 0) & (d < arguments.far + 1)])
        cells = np.unique(np.floor(q[(d > 0) & (d < arguments.far) & free] / 0.02).astype(int), axis=0)
        visible.append(cells)
    truth = np.unique(np.floor(np.concatenate(surface) / 0.01).astype(int), axis=0) * 0.01 + 0.005
    cells, views = np.unique(np.concatenate(visible), axis=0, return_counts=True)
    wanted = cells[views >= 2] * 0.02 + 0.01
    ghost = through > at
    off = ~ghost & (cKDTree(truth).query(cloud, distance_upper_bound=arguments.off)[0] > arguments.off)
    found = cKDTree(cloud[~ghost]).query(wanted, distance_upper_bound=0.03)[0] <= 0.03
    return {"run": arguments.run.name, "points": len(cloud), "ghosts": int(ghost.sum()),
            "off": int(off.sum()), "complete": round(float(found.mean()), 4)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("seq", type=Path)
    parser.add_argument("static", type=Path, nargs="?")
    parser.add_argument("--step", type=int, default=8)
    parser.add_argument("--ghost", type=float, default=0.1, help="[m], at 2 m")
    parser.add_argument("--off", type=float, default=0.05, help="[m]")
    parser.add_argument("--far", type=float, default=4.0, help="[m]")
    print(json.dumps(measure(parser.parse_args())))
