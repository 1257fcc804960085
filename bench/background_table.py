#!/usr/bin/env python3
"""How good the pictures of `ygslam run SEQ --background DIR` are, against the world without its movers.

  background_table.py DIR SEQ

SEQ is rendered with --truth: rgb_static and depth_static show the world without movers, without noise, and
mask/ has the movers' ids. Judged are the movers' pixels whose background was seen before: where some frame
of SEQ shows the static surface within --cell of it, itself not hidden and nearer than --far. SSIM is Wang's
(2004) of the picture but for what was never seen and stays black, averaged over those pixels; "ssim_black"
counts the black as well: a pixel beside it then differs, whatever it shows. Depth errors are told once more as if
an edge might lie a pixel off ("shifted": the least difference from the nine true pixels around). Beside it, what
DIR's pictures are worth where the frame's own pixels are shown ("own"), and how many movers' pixels were taken for
the room ("left").
"""
import argparse
import json
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from rendered_seeds import read_calibration

VIEW, MAP, NEVER = 64, 128, 255


def image(path):
    return np.asarray(Image.open(path))


def read_list(path):
    rows = [line.split() for line in path.read_text().splitlines() if line and line[0] != "#"]
    return {round(float(row[0]), 6): row[1] for row in rows}


def nearest(poses, stamp):
    row = poses[int(np.argmin(np.abs(poses[:, 0] - stamp)))]
    return Rotation.from_quat(row[4:8]).as_matrix(), row[1:4]


def ssim(a, b, shown):
    """Structural similarity of each pixel of two grey images (0 to 255), of what of its window is shown."""
    share = np.maximum(gaussian_filter(shown.astype(float), 1.5, truncate=3.5), 1e-9)
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2

    def blur(x):
        return gaussian_filter(np.where(shown, x, 0), 1.5, truncate=3.5) / share
    ma, mb = blur(a), blur(b)
    va, vb, vab = blur(a * a) - ma * ma, blur(b * b) - mb * mb, blur(a * b) - ma * mb
    return (2 * ma * mb + c1) * (2 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))


class Sequence:
    """A rendered sequence with its truth."""

    def __init__(self, folder):
        self.folder = folder
        camera = read_calibration(folder)
        self.fx, self.fy, self.cx, self.cy = (camera[k] for k in ("fx", "fy", "cx", "cy"))
        self.scale = camera["depth_scale"]
        self.depths = read_list(folder / "depth.txt")
        self.poses = np.loadtxt(folder / "groundtruth.txt")

    def truth(self, stamp):
        """Static colour and depth [m], and whether a mover hides them."""
        name = f"{stamp:.6f}.png"
        depth = image(self.folder / "depth_static" / name) / self.scale
        colour = next((self.folder / "rgb_static").glob(f"{stamp:.6f}.*"))
        return image(colour), depth, image(self.folder / "mask" / name) > 0

    def points(self, stamp, depth):
        """Of each pixel, in the world."""
        R, t = nearest(self.poses, stamp)
        v, u = np.mgrid[0:depth.shape[0], 0:depth.shape[1]]
        p = np.stack([(u - self.cx) / self.fx * depth, (v - self.cy) / self.fy * depth, depth], -1)
        return p @ R.T + t

    def cells(self, stamp, depth, cell):
        index = np.floor(self.points(stamp, depth) / cell).astype(np.int64) + (1 << 20)
        return (index[..., 2] << 42) | (index[..., 1] << 21) | index[..., 0]


def seen_cells(seq, stamps, cell, far):
    """Cells of the static surface that some frame shows."""
    found = []
    for stamp in stamps:
        _, depth, hidden = seq.truth(stamp)
        found.append(np.unique(seq.cells(stamp, depth, cell)[(depth > 0) & (depth < far) & ~hidden]))
    return np.unique(np.concatenate(found))


def beside(mine, true):
    """Least difference from the true depths of the pixel and its eight neighbours: small where an edge lies
    a pixel off."""
    height, width = true.shape
    padded = np.pad(true, 1, mode="edge")
    return np.min([np.abs(mine - padded[v:v + height, u:u + width])
                   for v in range(3) for u in range(3)], 0)


def db(squares):
    return round(float(10 * np.log10(255 ** 2 / np.mean(squares))), 2) if len(squares) else None


def measure(arguments):
    seq, folder = Sequence(arguments.seq), arguments.pictures
    stamps = sorted(read_list(folder / "rgb.txt"))
    seen = seen_cells(seq, sorted(seq.depths)[::arguments.step], arguments.cell, arguments.far)
    squares, similar, with_black, depth_errors, sources, own, left, shifted = ([] for _ in range(8))
    for stamp in stamps[::arguments.step]:
        name = f"{stamp:.6f}.png"
        colour, depth, hidden = seq.truth(stamp)
        mine, source = image(folder / "rgb" / name), image(folder / "source" / name)
        mine_depth = image(folder / "depth" / name) / seq.scale
        error = np.mean((mine.astype(float) - colour) ** 2, -1)
        wanted = hidden & (depth > 0) & (depth < arguments.far)
        wanted &= np.isin(seq.cells(stamp, depth, arguments.cell), seen)
        filled = wanted & ((source == VIEW) | (source == MAP))
        grey = [x.astype(float) @ (0.299, 0.587, 0.114) for x in (mine, colour)]
        squares.append(np.stack([error[filled], source[filled]], -1))
        similar.append(ssim(*grey, source != NEVER)[filled])
        with_black.append(ssim(*grey, np.full(source.shape, True))[filled])
        depth_errors.append((mine_depth - depth)[filled])
        shifted.append(beside(mine_depth, depth)[filled])
        sources.append(source[wanted])
        left.append(source[hidden] == 0)
        own.append(error[(source == 0) & ~hidden])
    squares, depth_errors = np.concatenate(squares), np.concatenate(depth_errors)
    sources, shifted = np.concatenate(sources), np.concatenate(shifted)
    if not len(sources):  # nothing moves, or nothing behind it was ever seen
        return {"pictures": folder.name, "frames": len(similar), "pixels": 0}
    near = np.abs(depth_errors) < 0.1
    return {"pictures": folder.name, "frames": len(similar), "pixels": len(sources),
            "psnr_db": db(squares[:, 0]), "psnr_views_db": db(squares[squares[:, 1] == VIEW, 0]),
            "psnr_map_db": db(squares[squares[:, 1] == MAP, 0]), "psnr_own_db": db(np.concatenate(own)),
            "ssim": round(float(np.concatenate(similar).mean()), 4),
            "ssim_black": round(float(np.concatenate(with_black).mean()), 4),
            "depth_rmse_m": round(float(np.sqrt(np.mean(depth_errors ** 2))), 4),
            "depth_median_m": round(float(np.median(np.abs(depth_errors))), 4),
            "depth_p90_m": round(float(np.percentile(np.abs(depth_errors), 90)), 4),
            "depth_p95_m": round(float(np.percentile(np.abs(depth_errors), 95)), 4),
            "depth_rmse_shifted_m": round(float(np.sqrt(np.mean(shifted ** 2))), 4),
            "beyond_10cm_shifted": round(float(np.mean(shifted >= 0.1)), 4),
            "depth_rmse_within_10cm_m": round(float(np.sqrt(np.mean(depth_errors[near] ** 2))), 4),
            "beyond_10cm": round(float(1 - near.mean()), 4),
            "covered": round(float(np.isin(sources, (VIEW, MAP)).mean()), 4),
            "from_views": round(float((sources == VIEW).mean()), 4),
            "left": round(float(np.concatenate(left).mean()), 4)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("pictures", type=Path)
    parser.add_argument("seq", type=Path)
    parser.add_argument("--step", type=int, default=4, help="every n-th frame")
    parser.add_argument("--cell", type=float, default=0.04, help="[m]")
    parser.add_argument("--far", type=float, default=4.4, help="[m], what the dense map holds")
    print(json.dumps(measure(parser.parse_args())))
