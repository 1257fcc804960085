#!/usr/bin/env python3
"""A furnished room that no rule was made for, as a world for `ygslam simulate`.

    python bench/furnished_room.py SEED > room.yaml

Room, furniture, what lies on it and the camera's way are drawn from the seed: tables .5 to 1 m high and
.6 to 2 m long, low ones and cabinets as high as tables among them, chairs at them, small things on them.
"""
import argparse
import random

SMALL = ("mug", "bottle", "books", "keyboard", "monitor", "plant", "paper", "duck", "lamp")


def item(kind, x, y, z=0.0, yaw=0.0, variant=0, size=None):
    text = f"  - {{kind: {kind}, variant: {variant}, at: [{x:.3f}, {y:.3f}, {z:.3f}], yaw: {yaw:.1f}"
    return text + (f", size: [{size[0]:.2f}, {size[1]:.2f}, {size[2]:.2f}]}}" if size else "}")


def on_top(rng, x, y, top, length, depth):
    lines = []
    for k in range(rng.randint(1, 5)):
        kind = rng.choice(SMALL)
        size = (0.3, 0.3, rng.uniform(0.3, 0.5)) if kind == "plant" else None
        across = (k + 0.5) / 5 - 0.5
        lines.append(item(kind, x + across * (length - 0.2), y + rng.uniform(-0.3, 0.3) * (depth - 0.15), top,
                          rng.uniform(-25, 25), rng.randint(0, 9), size))
    return lines


def room(seed):
    rng = random.Random(seed)
    half_x, half_y, high = rng.uniform(2.2, 3.2), rng.uniform(2.2, 3.0), rng.uniform(2.4, 3.0)
    lines = []
    nearest = half_y
    count = rng.randint(2, 3)
    for i in range(count):  # a row of things as high as tables before the far wall
        x = (2 * half_x - 0.6) * ((i + 0.5) / count - 0.5)
        y = half_y - rng.uniform(0.5, 1.3)
        length, depth = rng.uniform(0.7, min(1.7, 2 * half_x / count - 0.3)), rng.uniform(0.5, 0.9)
        top = rng.uniform(0.5, 1.0) if i else rng.uniform(0.64, 0.82)
        kind = "desk" if i == 0 or rng.random() < 0.7 else "cabinet"
        lines.append(item(kind, x, y, 0, 0, rng.randint(0, 9), (length, depth, top)))
        lines += on_top(rng, x, y, top, length, depth)
        nearest = min(nearest, y - depth / 2)
        if kind == "desk" and rng.random() < 0.7:
            lines.append(item(rng.choice(("chair", "office_chair")), x + rng.uniform(-0.3, 0.3), y - depth / 2 - 0.3,
                              0, rng.uniform(150, 210), rng.randint(0, 5)))
    lines.append(item("shelf", -half_x + 0.2, rng.uniform(-0.5, 0.5), 0, 90, rng.randint(0, 9), (1.2, 0.3, 1.6)))
    lines.append(rng.choice((item("sofa", half_x - 0.6, 0, 0, -90),
                             item("plant", half_x - 0.5, 0.2, 0, 0, 1, (0.6, 0.6, 1.3)),
                             item("carton", half_x - 0.6, 0.1, 0, 20, 2))))
    for x in (-0.5 * half_x, 0.4 * half_x):
        lines.append(item("poster", x, half_y - 0.02, 1.4, 0, rng.randint(0, 40), (0.6, 0.01, 0.8)))
    path = rng.choice(("xyz", "halfsphere"))
    at = (rng.uniform(-0.5, 0.5), max(nearest - rng.uniform(1.4, 2.2), 0.4 - half_y), rng.uniform(1.25, 1.6))
    look = (rng.uniform(-0.4, 0.4), half_y - 1.0, rng.uniform(0.6, 0.9))
    print(f"description: a furnished room of seed {seed}\nseconds: 20\nambient: 0.36\nrooms:\n"
          f"  - {{low: [{-half_x:.2f}, {-half_y:.2f}], high: [{half_x:.2f}, {half_y:.2f}], height: {high:.2f}, "
          "wall: plaster, floor: carpet, ceiling: ceiling, lamps: [2, 2]}\nfurniture:")
    print("\n".join(lines))
    print(f"camera: {{path: {path}, at: [{at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}], "
          f"look_at: [{look[0]:.2f}, {look[1]:.2f}, {look[2]:.2f}]}}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seed", type=int)
    room(parser.parse_args().seed)
