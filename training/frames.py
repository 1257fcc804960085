"""Rendered frames as training samples: cropped, mirrored, and made worse in the ways of real cameras."""
import csv
from pathlib import Path

import numpy as np
from PIL import Image

import prepare


CELLS = np.dtype([("rgb", "u1", (prepare.HEIGHT, prepare.WIDTH, 3)),
                  ("depth", "<u2", (prepare.HEIGHT, prepare.WIDTH)),
                  ("people", "u1", (prepare.HEIGHT, prepare.WIDTH)),
                  ("camera", "<f4", 4)])
UNITS_PER_M = 5000


def read_list(folder):
    """Rows of all whole frames of a folder that `simulate --random` wrote, or is writing."""
    with open(Path(folder) / "frames.csv", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["depth_scale"]]


def reduce_frame(folder, row):
    """One frame on the network's grid."""
    path = str(Path(folder) / row["name"])
    rgb = np.asarray(Image.open(path + ".jpg").convert("RGB"))
    depth_m = np.asarray(Image.open(path + "_depth.png")).astype(np.float32)
    depth_m /= np.float32(row["depth_scale"])
    people = np.asarray(Image.open(path + "_people.png")) > 0
    step = rgb.shape[1] // prepare.WIDTH
    if rgb.shape[:2] != (step * prepare.HEIGHT, step * prepare.WIDTH):
        raise ValueError(f"{path}: not a multiple of {prepare.WIDTH}x{prepare.HEIGHT}")
    cell = np.zeros((), CELLS)
    colour, z = prepare.blocks(rgb, depth_m, step)
    cell["rgb"] = np.round(colour)
    cell["depth"] = np.minimum(65535, np.round(z * UNITS_PER_M))
    cell["people"] = np.round(255 * people.reshape(prepare.HEIGHT, step, prepare.WIDTH, step).mean(axis=(1, 3)))
    fx, fy, cx, cy = (float(row[k]) for k in ("fx", "fy", "cx", "cy"))
    cell["camera"] = fx / step, fy / step, (cx + 0.5) / step - 0.5, (cy + 0.5) / step - 0.5
    return cell


def reduced_frames(folder):
    """All frames of a folder on the network's grid, kept in its cells.bin from call to call."""
    rows, kept = read_list(folder), Path(folder) / "cells.bin"
    done = kept.stat().st_size // CELLS.itemsize if kept.exists() else 0
    with open(kept, "r+b" if done else "wb") as file:
        file.truncate(done * CELLS.itemsize)
        file.seek(0, 2)
        for row in rows[done:]:
            file.write(reduce_frame(folder, row).tobytes())
    return np.memmap(kept, CELLS, "r", shape=(len(rows),))


def smooth_field(rng, cells, height, width):
    """Smooth noise, about -1..1."""
    coarse = rng.standard_normal((cells, cells)).astype(np.float32)
    return np.asarray(Image.fromarray(coarse).resize((width, height), Image.BILINEAR))


def blurred(x, rng):
    """A box of 3 along one side or both, once or twice."""
    for axis in (0, 1):
        for _ in range(int(rng.integers(0, 3))):
            x = (np.roll(x, 1, axis) + x + np.roll(x, -1, axis)) / np.float32(3)
    return x


def jittered(rgb, rng):
    """Colours as other cameras, other light and other compression would have them."""
    x = rgb / np.float32(255)
    if rng.random() < 0.3:
        x = blurred(x, rng)
    gain = np.exp(rng.normal(0, 0.25) + rng.normal(0, 0.12, 3)).astype(np.float32)
    x = np.clip(x * gain, 1e-6, None) ** np.float32(np.exp(rng.normal(0, 0.25)))
    grey = ((x[..., 0] + x[..., 1] + x[..., 2]) / 3)[..., None]
    saturation = 0.0 if rng.random() < 0.1 else rng.uniform(0.4, 1.5)
    x = grey + np.float32(saturation) * (x - grey)
    x = (x - 0.5) * np.float32(rng.uniform(0.6, 1.4)) + np.float32(0.5 + rng.normal(0, 0.08))
    if rng.random() < 0.5:
        x = x + np.float32(rng.uniform(0.01, 0.06)) * rng.standard_normal(x.shape, np.float32)
    return 255 * np.clip(x, 0, 1)


def worn(depth_m, rgb, rng):
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
        dark = np.float32(rng.uniform(0, 2)) * np.clip(0.35 - rgb[..., 1] / 255, 0, 1)
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
    frame: of reduced_frames(). coarse: half as many cells along each side, of up to twice the size.
    plain: the frame as it is, for validation."""
    h, w = prepare.HEIGHT, prepare.WIDTH
    fx, fy, cx, cy = (float(value) for value in frame["camera"])
    cells = 2 if coarse else 1  # of the frame along a side of ours, where all of it is taken
    scale = 1.0 * cells
    rows, columns = np.arange(h // cells), np.arange(w // cells)
    shift = (0, 0)
    if not plain and (coarse or rng.random() < 0.6):  # a part of it
        scale = cells * rng.uniform(0.45, 1)
        u0 = rng.uniform(0, w - scale * len(columns))
        v0 = rng.uniform(0, h - scale * len(rows))
        rows = np.minimum((v0 + (rows + 0.5) * scale).astype(int), h - 1)
        columns = np.minimum((u0 + (columns + 0.5) * scale).astype(int), w - 1)
        cx, cy = (cx + 0.5 - u0) / scale - 0.5, (cy + 0.5 - v0) / scale - 0.5
    if not plain and rng.random() < 0.4:  # depth beside colour
        shift = rng.normal(0, 0.8, 2)
    mirrored = not plain and rng.random() < 0.5
    if mirrored:
        columns, cx = columns[::-1], len(columns) - 1 - cx
    z_rows = np.clip(np.round(rows + shift[1]).astype(int), 0, h - 1)
    z_columns = np.clip(np.round(columns + shift[0]).astype(int), 0, w - 1)
    z = frame["depth"][z_rows[:, None], z_columns].astype(np.float32) / np.float32(UNITS_PER_M)
    rgb = frame["rgb"][rows[:, None], columns].astype(np.float32)
    who = frame["people"][rows[:, None], columns].astype(np.float32)
    target = who / np.float32(255)
    if not plain:
        what = rng.random()
        if what < 0.3:
            rgb = np.full_like(rgb, 127.5)
        else:
            rgb = jittered(rgb, rng)
        z = np.zeros_like(z) if 0.3 < what < 0.4 else worn(z, rgb, rng)
    return prepare.channels(rgb, z, fx / scale, fy / scale, cx, cy), target[None]
