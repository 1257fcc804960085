"""Rendered frames as training samples: cropped, mirrored, depth made worse in the ways of real cameras."""
import csv
from pathlib import Path

import numpy as np
from PIL import Image

import prepare


WIDTH, HEIGHT = 2 * prepare.WIDTH, 2 * prepare.HEIGHT  # of a frame [pixels]
FRAME = np.dtype([("grey", "u1", (HEIGHT, WIDTH)), ("depth", "<u2", (HEIGHT, WIDTH)),
                  ("people", "?", (HEIGHT, WIDTH)), ("camera", "<f4", 4)])
UNITS_PER_M = 5000


def read_list(folder):
    """Rows of all whole frames of a folder that `simulate --random` wrote, or is writing."""
    with open(Path(folder) / "frames.csv", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["depth_scale"]]


def read_frame(folder, row):
    path = str(Path(folder) / row["name"])
    frame = np.zeros((), FRAME)
    grey = np.asarray(Image.open(path + ".jpg").convert("L"))
    if grey.shape != (HEIGHT, WIDTH):
        raise ValueError(f"{path}: not {WIDTH}x{HEIGHT}")
    frame["grey"] = grey
    depth = np.asarray(Image.open(path + "_depth.png")).astype(np.float32)
    frame["depth"] = np.minimum(65535, np.round(depth * (UNITS_PER_M / float(row["depth_scale"]))))
    frame["people"] = np.asarray(Image.open(path + "_people.png")) > 0
    frame["camera"] = [float(row[k]) for k in ("fx", "fy", "cx", "cy")]
    return frame


def read_frames(folder):
    """All frames of a folder, kept in its frames.bin from call to call."""
    rows, kept = read_list(folder), Path(folder) / "frames.bin"
    done = kept.stat().st_size // FRAME.itemsize if kept.exists() else 0
    with open(kept, "r+b" if done else "wb") as file:
        file.truncate(done * FRAME.itemsize)
        file.seek(0, 2)
        for row in rows[done:]:
            file.write(read_frame(folder, row).tobytes())
    return np.memmap(kept, FRAME, "r", shape=(len(rows),))


def smooth_field(rng, cells, height, width):
    """Smooth noise, about -1..1."""
    coarse = rng.standard_normal((cells, cells)).astype(np.float32)
    return np.asarray(Image.fromarray(coarse).resize((width, height), Image.BILINEAR))


def worn(depth_m, grey, rng):
    """Depth with more of what goes wrong in depth: errors of scale, holes of all kinds."""
    h, w = depth_m.shape
    z = depth_m * np.float32(1 + rng.normal(0, 0.02))
    if rng.random() < 0.5:
        z = z * (1 + np.float32(rng.uniform(0, 0.012)) * smooth_field(rng, int(rng.integers(4, 25)), h, w))
    hole = np.zeros((h, w), bool)
    if rng.random() < 0.5:  # beside edges
        reach = int(rng.integers(0, 3))
        jump = np.zeros((h, w), bool)
        jump[:, 1:] |= np.abs(z[:, 1:] - z[:, :-1]) > 0.06 * z[:, 1:]
        jump[1:] |= np.abs(z[1:] - z[:-1]) > 0.06 * z[1:]
        for _ in range(reach):
            hole |= jump
            jump = jump.copy()
            jump[:, :-1] |= jump[:, 1:]
            if rng.random() < 0.5:
                jump[:, 1:] |= jump[:, :-1]
                jump[1:] |= jump[:-1]
        hole |= jump
    if rng.random() < 0.4:  # blobs, also where it is dark
        level = smooth_field(rng, int(rng.integers(4, 20)), h, w)
        dark = np.float32(rng.uniform(0, 2)) * np.clip(0.35 - grey / np.float32(255), 0, 1)
        hole |= level + 4 * dark > rng.uniform(0.9, 2.2)
    if rng.random() < 0.3:  # ellipses
        v, u = np.mgrid[:h, :w]
        for _ in range(int(rng.integers(1, 9))):
            a, b = rng.uniform(1, 14, 2)
            hole |= ((u - rng.uniform(0, w)) / a) ** 2 + ((v - rng.uniform(0, h)) / b) ** 2 < 1
    if rng.random() < 0.3:  # single pixels
        hole |= rng.random((h, w), np.float32) < rng.uniform(0, 0.25)
    if rng.random() < 0.4:  # the depth camera sees less than the other
        top, bottom = (rng.exponential(0.04, 2) * h).astype(int)
        left, right = (rng.exponential(0.04, 2) * w).astype(int)
        hole[:top] = hole[h - min(bottom, h):] = True
        hole[:, :left] = hole[:, w - min(right, w):] = True
    if rng.random() < 0.2:  # the range of the camera
        hole |= z > rng.uniform(2.5, 6)
    if rng.random() < 0.15:
        hole |= z < rng.uniform(0.5, 1)
    z[hole] = 0
    return z


def sample(frame, rng, coarse=False, plain=False):
    """(input, target): CHANNELS x H x W and the share of people in each cell, 1 x H x W.
    frame: of read_frames(). coarse: half as many cells along each side, of up to twice the size.
    plain: the frame as it is, for validation."""
    fx, fy, cx, cy = (float(value) for value in frame["camera"])
    cells = 2 if coarse else 1
    h, w = prepare.HEIGHT // cells, prepare.WIDTH // cells
    scale, u0, v0 = 2.0 * cells, 0.0, 0.0  # pixels along a cell; where the cells begin
    if not plain and (coarse or rng.random() < 0.6):  # a part of it
        scale *= rng.uniform(0.5, 1)
        u0, v0 = rng.uniform(0, WIDTH - scale * w), rng.uniform(0, HEIGHT - scale * h)
    # Two by two pixels of each cell.
    rows = (v0 + (np.arange(2 * h) + 0.5) * (scale / 2)).astype(int)
    columns = (u0 + (np.arange(2 * w) + 0.5) * (scale / 2)).astype(int)
    camera = [fx / scale, fy / scale, (cx + 0.5 - u0) / scale - 0.5, (cy + 0.5 - v0) / scale - 0.5]
    if not plain and rng.random() < 0.5:  # mirrored
        columns, camera[2] = columns[::-1], w - 1 - camera[2]
    people = frame["people"][rows[:, None], columns].view(np.uint8)
    both = people[::2] + people[1::2]
    target = (both[:, ::2] + both[:, 1::2]) * np.float32(0.25)
    if not plain and rng.random() < 0.4:  # depth beside colour
        aside = np.round(rng.normal(0, 1.6, 2)).astype(int)
        rows = np.clip(rows + aside[0], 0, HEIGHT - 1)
        columns = np.clip(columns + aside[1], 0, WIDTH - 1)
    depth_m = frame["depth"][rows[:, None], columns].astype(np.float32) / np.float32(UNITS_PER_M)
    z = prepare.blocks(depth_m, 2)
    if not plain:
        z = worn(z, frame["grey"][rows[::2, None], columns[::2]], rng)
    return prepare.channels(z, *camera), target[None]


def overlap(find, frames):
    """Overlap (IoU) of all people of these frames, as they are. find: N x CHANNELS x H x W to
    N x 1 x H x W, true where somebody is."""
    both = either = 0
    rng = np.random.default_rng(0)
    for k in range(0, len(frames), 20):
        pairs = [sample(f, rng, plain=True) for f in frames[k:k + 20]]
        x, target = (np.stack(part) for part in zip(*pairs))
        found, wanted = find(x), target > 0.5
        both += int((found & wanted).sum())
        either += int((found | wanted).sum())
    return both / max(1, either)
