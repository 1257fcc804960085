#!/usr/bin/env python3
"""How well the network finds the people of recorded or rendered sequences.

    training/evaluate.py MODEL.onnx SEQUENCE [...] [--polygons FILE | --nobody] [--every N] [--pictures DIR]

SEQUENCE: a folder in TUM layout. The truth is its mask/ (not 0 = somebody, as far as instances.json says
so), or hand-drawn polygons for the frames that have some, or nobody with --nobody. Prints per sequence
the overlap (IoU) of the pixels of all frames together and the mean over frames with people, recall and
precision of pixels, and the share of the image wrongly called a person.
"""
import argparse
import json
from pathlib import Path

import numpy as np
import openvino
from PIL import Image, ImageDraw

import prepare


def camera_of(folder):
    words = (folder / "calibration.txt").read_text(encoding="utf-8").split("\n")
    text = [w.split("#")[0].split() for w in words]
    text = [w for w in text if w]
    if text[0][0] in ("fx",):
        values = {w[0]: float(w[1]) for w in text}
        return [values[k] for k in ("fx", "fy", "cx", "cy")] + [values.get("depth_scale", 5000)]
    numbers = [float(x) for x in text[0]]
    return numbers[:4] + [numbers[-1]]


def pairs_of(folder):
    rows = (folder / "associations.txt").read_text(encoding="utf-8").splitlines()
    return [(row.split()[1], row.split()[3]) for row in rows if row and row[0] != "#"]


def truth_of(folder, colour, size, polygons, nobody):
    """True where there is somebody; None without truth."""
    if nobody:
        return np.zeros(size[::-1], bool)
    if polygons is not None:
        drawn = polygons.get(folder.name, {}).get(Path(colour).name)
        if drawn is None:
            return None
        image = Image.new("1", size)
        for polygon in drawn:
            ImageDraw.Draw(image).polygon([tuple(p) for p in polygon], fill=1)
        return np.asarray(image)
    mask = folder / "mask" / (Path(colour).stem + ".png")
    if not mask.exists():
        return None
    ids = np.asarray(Image.open(mask))
    classes = folder / "instances.json"
    if classes.exists():
        names = json.loads(classes.read_text(encoding="utf-8"))
        return np.isin(ids, [int(k) for k, name in names.items() if name == "person"])
    return ids > 0


def finely(logits, size):
    """Logits of the cells as pixels."""
    return np.asarray(Image.fromarray(logits).resize(size, Image.BILINEAR))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--polygons", type=Path)
    parser.add_argument("--nobody", action="store_true", help="there are no people in the sequences")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--pictures", type=Path, help="folder for pictures of what was found")
    a = parser.parse_args()
    polygons = json.loads(a.polygons.read_text(encoding="utf-8"))["frames"] if a.polygons else None
    core = openvino.Core()
    network = core.compile_model(str(a.model), "CPU", {"INFERENCE_NUM_THREADS": 1})
    for folder in a.sequences:
        fx, fy, cx, cy, depth_scale = camera_of(folder)
        rows = []
        for colour, depth in pairs_of(folder)[::a.every]:
            image = Image.open(folder / colour).convert("RGB")
            truth = truth_of(folder, colour, image.size, polygons, a.nobody)
            if truth is None:
                continue
            depth_m = np.asarray(Image.open(folder / depth)).astype(np.float32) / np.float32(depth_scale)
            z, *grid = prepare.reduced(depth_m, fx, fy, cx, cy)
            found = finely(network([prepare.channels(z, *grid)[None]])[0][0, 0], image.size) > 0
            both, either = (found & truth).sum(), (found | truth).sum()
            rows.append((both, either, found.sum(), truth.sum(), truth.size))
            if a.pictures:
                a.pictures.mkdir(parents=True, exist_ok=True)
                shown = np.asarray(image).copy()
                shown[found & truth] = shown[found & truth] // 2 + np.array([0, 110, 0], np.uint8)
                shown[found & ~truth] = shown[found & ~truth] // 2 + np.array([120, 0, 0], np.uint8)
                shown[~found & truth] = shown[~found & truth] // 2 + np.array([0, 0, 120], np.uint8)
                Image.fromarray(shown).save(a.pictures / (Path(colour).stem + ".jpg"))
        if not rows:
            raise SystemExit(f"{folder}: no frame with truth")
        both, either, found, true, pixels = np.array(rows, float).T
        false = (found - both) / pixels
        with_people = true > 0.005 * pixels
        mean = np.mean(both[with_people] / either[with_people]) if with_people.any() else float("nan")
        print(f"{folder.name:32s} frames {len(rows):4d}  IoU {both.sum() / max(1, either.sum()):.3f}"
              f"  mean {mean:.3f}  recall {both.sum() / max(1, true.sum()):.3f}"
              f"  precision {both.sum() / max(1, found.sum()):.3f}"
              f"  false area {100 * false.mean():.2f} %, worst {100 * false.max():.1f} %")


if __name__ == "__main__":
    main()
