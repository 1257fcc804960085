#!/usr/bin/env python3
"""How well YOLOv8n-seg sees the people of rendered sequences: detection rate and mask IoU.

    tools/detection_table.py MODEL.onnx SEQUENCE...
Sequences as `ygslam simulate --truth` writes them. Needs numpy, pillow and openvino. A person counts
who is upright (hips above 0.7 m) and covers more than 5 % of the image; it is found if a detection of class person with score 0.35 or more overlaps it with IoU 0.5 or more.
"""
import json
import sys
from pathlib import Path

import numpy as np
import openvino
from PIL import Image

SCORE, OVERLAP, COVER = 0.35, 0.5, 0.05


def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def detect(network, image):
    """Masks (bool, image size) and scores of the persons in an RGB image of the network's size."""
    height, width = image.shape[:2]
    blob = image.astype(np.float32).transpose(2, 0, 1)[None] / 255
    boxes, prototypes = [network([blob])[i] for i in range(2)]
    boxes = boxes[0].T
    prototypes = prototypes[0]
    scores = boxes[:, 4]
    best = boxes[:, 4:84].argmax(axis=1)
    keep = np.flatnonzero((scores >= 0.25) & (best == 0))
    order = keep[np.argsort(-scores[keep])]
    xyxy = np.stack([boxes[:, 0] - boxes[:, 2] / 2, boxes[:, 1] - boxes[:, 3] / 2,
                     boxes[:, 0] + boxes[:, 2] / 2, boxes[:, 1] + boxes[:, 3] / 2], axis=1)
    chosen = []
    for i in order:
        if all(box_iou(xyxy[i], xyxy[j]) < 0.6 for j in chosen):
            chosen.append(i)
    masks = []
    for i in chosen:
        logits = np.tensordot(boxes[i, 84:116], prototypes, axes=1)
        large = np.asarray(Image.fromarray(logits.astype(np.float32)).resize((width, height), Image.BILINEAR))
        mask = large > 0
        x0, y0, x1, y1 = xyxy[i]
        inside = np.zeros_like(mask)
        inside[max(0, int(y0)):int(np.ceil(y1)), max(0, int(x0)):int(np.ceil(x1))] = True
        masks.append(mask & inside)
    return masks, scores[chosen]


def box_iou(a, b):
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    both = width * height
    return both / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - both)


def hip_heights(sequence, person):
    """Stamp -> height of the hips [m]."""
    lines = (sequence / "movers" / f"{person}.txt").read_text().splitlines()
    return {line.split()[0]: float(line.split()[3]) for line in lines if not line.startswith("#")}


def main():
    model = Path(sys.argv[1])
    core = openvino.Core()
    network = core.compile_model(str(model), "CPU", {"INFERENCE_NUM_THREADS": 2})
    print("| sequence | persons > 5 % | found | mean score | mean mask IoU |\n|---|---|---|---|---|")
    for name in [a for a in sys.argv[2:] if a != "-v"]:
        sequence = Path(name)
        classes = json.loads((sequence / "instances.json").read_text())
        people = [int(i) for i, c in classes.items() if c == "person"]
        hips = {person: hip_heights(sequence, person) for person in people}
        present, found, scores, overlaps = 0, 0, [], []
        for line in (sequence / "associations.txt").read_text().splitlines():
            stamp, colour = line.split()[:2]
            image = np.asarray(Image.open(sequence / colour).convert("RGB"))
            truth = np.asarray(Image.open(sequence / "mask" / (stamp + ".png")))
            masks, detected = detect(network, image)
            for person in people:
                body = truth == person
                if body.mean() <= COVER or hips[person][stamp] < 0.7:
                    continue
                present += 1
                iou = [np.logical_and(body, m).sum() / np.logical_or(body, m).sum() for m in masks]
                best = int(np.argmax(iou)) if iou else -1
                if best >= 0 and iou[best] >= OVERLAP and detected[best] >= SCORE:
                    found += 1
                    scores.append(detected[best])
                    overlaps.append(iou[best])
                    if "-v" in sys.argv:
                        print("found", stamp, person, f"{body.mean():.2f} score {detected[best]:.2f} IoU {iou[best]:.3f}")
                elif "-v" in sys.argv:
                    print("missed", name, stamp, person, f"{body.mean():.2f}", [f"{x:.2f}" for x in iou], detected)
        if present:
            print(f"| {sequence.name} | {present} | {found / present:.1%} | {np.mean(scores):.2f} | {np.mean(overlaps):.3f} |", flush=True)
        else:
            print(f"| {sequence.name} | 0 | - | - | - |")


if __name__ == "__main__":
    main()
