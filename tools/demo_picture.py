#!/usr/bin/env python3
"""One picture of a run: the room as mesh with the camera's path, frames with masks and points, the plan.

    .venv/bin/python tools/demo_picture.py --room room.png --frames images/ --plan plan.png --out demo.png
"""
import argparse
import pathlib

from PIL import Image

WIDTH_PX = 1600
GAP_PX = 8
FRAMES = 6
BACKGROUND = (24, 26, 30)


def fitted(path: pathlib.Path, width_px: int, height_px: int) -> Image.Image:
    """The image whole, as large as the cell allows, in its middle."""
    cell = Image.new("RGB", (width_px, height_px), BACKGROUND)
    with Image.open(path) as opened:
        image = opened.convert("RGB")
    scale = min(width_px / image.width, height_px / image.height)
    size = (max(1, round(image.width * scale)), max(1, round(image.height * scale)))
    cell.paste(image.resize(size, Image.Resampling.LANCZOS if scale < 1 else Image.Resampling.NEAREST),
               ((width_px - size[0]) // 2, (height_px - size[1]) // 2))
    return cell


def evenly(paths: list, count: int) -> list:
    """count of them, from the first to the last."""
    if len(paths) <= count:
        return paths
    return [paths[round(i * (len(paths) - 1) / (count - 1))] for i in range(count)]


def compose(room: pathlib.Path, plan: pathlib.Path | None, frames: list) -> Image.Image:
    """Above: the room and, if there is one, its plan. Below: the frames, three in a row."""
    plan_px = 520 if plan else 0
    room_px = WIDTH_PX - 2 * GAP_PX - (plan_px + GAP_PX if plan else 0)
    top_px = room_px * 3 // 4
    cell_px = (WIDTH_PX - 4 * GAP_PX) // 3
    row_px = cell_px * 3 // 4
    rows = (len(frames) + 2) // 3
    sheet = Image.new("RGB", (WIDTH_PX, top_px + 2 * GAP_PX + rows * (row_px + GAP_PX)), BACKGROUND)
    sheet.paste(fitted(room, room_px, top_px), (GAP_PX, GAP_PX))
    if plan:
        sheet.paste(fitted(plan, plan_px, top_px), (2 * GAP_PX + room_px, GAP_PX))
    for i, frame in enumerate(frames):
        sheet.paste(fitted(frame, cell_px, row_px),
                    (GAP_PX + i % 3 * (cell_px + GAP_PX), top_px + 2 * GAP_PX + i // 3 * (row_px + GAP_PX)))
    return sheet


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", type=pathlib.Path, required=True, help="picture of the mesh (ygslam render)")
    parser.add_argument("--frames", type=pathlib.Path, required=True, help="folder of `run --debug-images`")
    parser.add_argument("--plan", type=pathlib.Path, help="ground plan of `run --export`; left out where absent")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    frames = sorted(p for p in options.frames.iterdir() if p.suffix in (".png", ".jpg"))
    plan = options.plan if options.plan and options.plan.is_file() else None
    compose(options.room, plan, evenly(frames, FRAMES)).save(options.out)


if __name__ == "__main__":
    main()
