#!/usr/bin/env python3
"""How well the network finds the people of recorded or rendered sequences.

    training/evaluate.py MODEL SEQUENCE [...] [--polygons FILE | --nobody] [--first N] [--every N]
        [--pictures DIR]

MODEL: the network as ONNX file, or masks:DIR, what `ygslam run --save-masks DIR` has written for that sequence
(of whatever network; frames without a file are left out and counted). SEQUENCE: a folder in TUM layout. The truth
is its mask/ (not 0 = somebody, as far as instances.json says so), or hand-drawn polygons for the frames that have
some, or nobody with --nobody. Prints per sequence the overlap (IoU) of the pixels of all frames together and the
mean over frames with people, recall and precision of pixels, and the share of the image wrongly called a person.
With polygons and masks:DIR, also how many of the people drawn have an instance that overlaps them with IoU 0.5 or
more, of all and of those who cover more than 5 % of the image, and how many instances lie mostly on nobody.
"""
import argparse
import json
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import prepare

FOUND = 0.5  # IoU
LARGE = 0.05  # of the image
MASKS = "masks:"


def camera_of(folder):
    words = (folder / "calibration.txt").read_text(encoding="utf-8").split("\n")
    text = [w.split("#")[0].split() for w in words]
    text = [w for w in text if w]
    if text[0][0] in ("fx",):
        values = {w[0]: float(w[1]) for w in text}
        return [values[k] for k in ("fx", "fy", "cx", "cy")] + [values.get("depth_scale", 5000)]
    numbers = [float(x) for x in text[0]]
    return numbers[:4] + [numbers[-1]]


def rows_of(folder):
    """Stamp, colour and depth of each frame."""
    rows = (folder / "associations.txt").read_text(encoding="utf-8").splitlines()
    return [(row.split()[0], row.split()[1], row.split()[3]) for row in rows if row and row[0] != "#"]


def drawn_people(drawn, size):
    """True where each person is. drawn: of each a polygon, or a list of them for one who is seen in parts."""
    people = []
    for person in drawn:
        image = Image.new("1", size)
        for polygon in person if isinstance(person[0][0], list) else [person]:
            ImageDraw.Draw(image).polygon([tuple(p) for p in polygon], fill=1)
        people.append(np.asarray(image))
    return people


def is_person(names, number):
    return names.get(str(number), "person") in ("person", 0)


def truth_of(folder, colour, size, polygons, nobody):
    """True where there is somebody, None without truth; the same of each person drawn."""
    if nobody:
        return np.zeros(size[::-1], bool), []
    if polygons is not None:
        drawn = polygons.get(folder.name, {}).get(Path(colour).name)
        if drawn is None:
            return None, []
        people = drawn_people(drawn, size)
        return np.any([np.zeros(size[::-1], bool), *people], axis=0), people
    mask = folder / "mask" / (Path(colour).stem + ".png")
    if not mask.exists():
        return None, []
    ids = np.asarray(Image.open(mask))
    classes = folder / "instances.json"
    if classes.exists():
        names = json.loads(classes.read_text(encoding="utf-8"))
        return np.isin(ids, [int(k) for k, name in names.items() if name == "person"]), []
    return ids > 0, []


def finely(logits, size):
    """Logits of the cells as pixels."""
    return np.asarray(Image.fromarray(logits).resize(size, Image.BILINEAR))


def network_of(model):
    """A function of a frame's stamp and depth, the size wanted and the camera: True where the network sees somebody."""
    import openvino  # pylint: disable=import-outside-toplevel
    network = openvino.Core().compile_model(model, "CPU", {"INFERENCE_NUM_THREADS": 1})

    def found(_stamp, depth, size, camera):
        fx, fy, cx, cy, depth_scale = camera
        depth_m = np.asarray(Image.open(depth)).astype(np.float32) / np.float32(depth_scale)
        z, *grid = prepare.reduced(depth_m, fx, fy, cx, cy)
        return finely(network([prepare.channels(z, *grid)[None]])[0][0, 0], size) > 0
    return found


def masks_of(directory):
    """The same of masks in files, as instances: 0 = nobody. None where there is no file."""
    listed = [place / "instances.json" for place in (directory, directory.parent)]
    names = next((json.loads(file.read_text(encoding="utf-8")) for file in listed if file.exists()), {})

    def found(stamp, _depth, _size, _camera):
        file = directory / f"{float(stamp):.6f}.png"
        if not file.exists():
            return None
        ids = np.asarray(Image.open(file))
        return np.where(np.isin(ids, [i for i in np.unique(ids) if i and is_person(names, i)]), ids, 0)
    return found


def matched(ids, truth, people):
    """People, those who are large, those found of both, instances that are mostly nobody."""
    instances = [ids == i for i in np.unique(ids) if i]
    large = [person.mean() > LARGE for person in people]
    seen = [any((person & one).sum() >= FOUND * (person | one).sum() for one in instances) for person in people]
    false = sum(2 * (one & truth).sum() < one.sum() for one in instances)
    return len(people), sum(large), sum(seen), sum(np.logical_and(large, seen)), false


def save_picture(file, image, found, truth):
    shown = np.asarray(image).copy()
    shown[found & truth] = shown[found & truth] // 2 + np.array([0, 110, 0], np.uint8)
    shown[found & ~truth] = shown[found & ~truth] // 2 + np.array([120, 0, 0], np.uint8)
    shown[~found & truth] = shown[~found & truth] // 2 + np.array([0, 0, 120], np.uint8)
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(shown).save(file)


def print_overlap(name, rows, left_out):
    """rows: pixels of both, of either, found, true, of the image, a frame each."""
    both, either, found, true, pixels = np.array(rows, float).T
    false = (found - both) / pixels
    with_people = true > 0.005 * pixels
    mean = np.mean(both[with_people] / either[with_people]) if with_people.any() else float("nan")
    print(f"{name:32s} frames {len(rows):4d}  IoU {both.sum() / max(1, either.sum()):.3f}"
          f"  mean {mean:.3f}  recall {both.sum() / max(1, true.sum()):.3f}"
          f"  precision {both.sum() / max(1, found.sum()):.3f}"
          f"  false area {100 * false.mean():.2f} %, worst {100 * false.max():.1f} %"
          + (f"  without a mask {left_out}" if left_out else ""))


def evaluate(folder, found_in, polygons, a):
    camera = camera_of(folder)
    rows, counts, left_out = [], [], 0
    for stamp, colour, depth in rows_of(folder)[:a.first:a.every]:
        image = Image.open(folder / colour).convert("RGB")
        truth, people = truth_of(folder, colour, image.size, polygons, a.nobody)
        if truth is None:
            continue
        ids = found_in(stamp, folder / depth, image.size, camera)
        if ids is None:
            left_out += 1
            continue
        found = ids > 0
        rows.append(((found & truth).sum(), (found | truth).sum(), found.sum(), truth.sum(), truth.size))
        counts.append(matched(ids, truth, people))
        if a.pictures:
            save_picture(a.pictures / (Path(colour).stem + ".jpg"), image, found, truth)
    if not rows:
        raise SystemExit(f"{folder}: no frame with truth" + (" and a mask" if left_out else ""))
    print_overlap(folder.name, rows, left_out)
    people, large, seen, large_seen, false = np.sum(counts, axis=0)
    if people and a.model.startswith(MASKS):
        print(f"{'':32s} people found {seen} of {people}, over {100 * LARGE:.0f} % of the image"
              f" {large_seen} of {large}; instances mostly on nobody {false}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", help="ONNX file of the network, or masks:DIR")
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--polygons", type=Path)
    parser.add_argument("--nobody", action="store_true", help="there are no people in the sequences")
    parser.add_argument("--first", type=int, help="only so many frames")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--pictures", type=Path, help="folder for pictures of what was found")
    a = parser.parse_args()
    polygons = json.loads(a.polygons.read_text(encoding="utf-8"))["frames"] if a.polygons else None
    masks = a.model.startswith(MASKS)
    found_in = masks_of(Path(a.model.removeprefix(MASKS))) if masks else network_of(a.model)
    for folder in a.sequences:
        evaluate(folder, found_in, polygons, a)


if __name__ == "__main__":
    main()
