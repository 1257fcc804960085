#!/usr/bin/env python3
"""Puts frames of rendered sequences side by side: the pictures of docs/rendered-world.md.

    world_sheet.py SHEET.jpg SEQUENCE@SECONDS...          colour images, three in a row
    world_sheet.py --truth SHEET.jpg SEQUENCE@SECONDS     colour, depth, and the truth of one frame

The sequences come from `ygslam simulate` (with --truth for the second); the frame nearest to that
many seconds after the first is taken. `--fps 1` renders a long world quickly, but what moved since
the previous frame then is what moved within a second.
"""

import argparse
import pathlib
import sys

import numpy as np
from PIL import Image

TILE = (400, 300)  # [px]
COLUMNS = 3
FAR_M = 8.0  # black in pictures of depth; what has no depth is black, too
COLOURS = np.array([(0, 0, 0), (90, 200, 90), (180, 90, 220), (230, 200, 60), (70, 160, 230),
                    (230, 110, 70), (120, 220, 220), (240, 150, 200)], np.uint8)  # of instance ids


def frame_at(where):
    """(folder, stamp as in the file names) of SEQUENCE@SECONDS."""
    folder, _, seconds = where.rpartition("@")
    folder = pathlib.Path(folder)
    stamps = [line.split()[0] for line in (folder / "rgb.txt").read_text().splitlines()
              if not line.startswith("#")]
    wanted = float(stamps[0]) + float(seconds)
    return folder, min(stamps, key=lambda stamp: abs(float(stamp) - wanted))


def read(folder, part, stamp):
    """The image of a frame, whatever its format."""
    found = sorted((folder / part).glob(f"{stamp}.*"))
    if not found:
        raise FileNotFoundError(f"{folder / part}: no image of {stamp}")
    return Image.open(found[0])


def picture_of_depth(image):
    """Near is bright, nothing measured is black."""
    depth_m = np.asarray(image, np.float32) / 5000
    grey = np.where(depth_m > 0, 255 * np.clip(1 - depth_m / FAR_M, 0.03, 1), 0)
    return Image.fromarray(grey.astype(np.uint8))


def truth_tiles(where):
    """Colour, depth, true depth, ids, motion, the view without movers."""
    folder, stamp = frame_at(where)
    ids = np.asarray(read(folder, "mask", stamp))
    return [read(folder, "rgb", stamp), picture_of_depth(read(folder, "depth", stamp)),
            picture_of_depth(read(folder, "depth_true", stamp)),
            Image.fromarray(COLOURS[np.where(ids > 0, (ids - 1) % (len(COLOURS) - 1) + 1, 0)]),
            read(folder, "moving", stamp), read(folder, "rgb_static", stamp)]


def sheet_of(tiles):
    """All tiles at TILE size; photographs are averaged, the others must not be."""
    rows = -(-len(tiles) // COLUMNS)
    sheet = Image.new("RGB", (TILE[0] * COLUMNS, TILE[1] * rows))
    for i, tile in enumerate(tiles):
        way = Image.Resampling.LANCZOS if tile.format == "JPEG" else Image.Resampling.NEAREST
        sheet.paste(tile.convert("RGB").resize(TILE, way),
                    (TILE[0] * (i % COLUMNS), TILE[1] * (i // COLUMNS)))
    return sheet


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--truth", action="store_true", help="the truth of one frame")
    parser.add_argument("sheet", type=pathlib.Path)
    parser.add_argument("frames", nargs="+", metavar="SEQUENCE@SECONDS")
    arguments = parser.parse_args()
    if arguments.truth and len(arguments.frames) != 1:
        parser.error("--truth shows one frame")
    try:
        if arguments.truth:
            tiles = truth_tiles(arguments.frames[0])
        else:
            tiles = [read(folder, "rgb", stamp) for folder, stamp in
                     map(frame_at, arguments.frames)]
        sheet_of(tiles).save(arguments.sheet, quality=88)
    except (OSError, ValueError) as fault:
        sys.exit(f"world_sheet.py: {fault}")


if __name__ == "__main__":
    main()
