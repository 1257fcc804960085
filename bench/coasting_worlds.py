"""Worlds in which a camera sees nothing that tells where it is, though its images are fine.

Each: YAML (docs/rendered-world.md), from when on [s], and for how long. The seed chooses what things look like and by
how much they differ in place; the hand's jerks are `simulate --seed`'s.
"""
import dataclasses
import random


@dataclasses.dataclass(frozen=True)
class BlindWorld:
    text: str
    from_s: float
    seconds: float


# Cabin walls beside an opening of 1.4 m; two panels close it, and move aside three seconds later.
LIFT_DOOR = """seconds: 20
layout: office
camera: {{path: xyz, at: [{x:.2f}, -1.9, 1.3], look_at: [0, 1.5, 1.1]}}
furniture:
  - {{kind: block, variant: {walls}, at: [-1.7, -1.05, 0], size: [2.0, 0.1, 2.88]}}
  - {{kind: block, variant: {walls}, at: [1.7, -1.05, 0], size: [2.0, 0.1, 2.88]}}
movers:
  - {{kind: block, variant: {panels}, size: [0.72, 0.04, 2.86], stations: [{{t: 10, at: [-1.1, -1.0, 0]}},
     {{t: {shut:.1f}, at: [-0.36, -1.0, 0]}}, {{t: 14.2, at: [-0.36, -1.0, 0]}}, {{t: 15, at: [-1.1, -1.0, 0]}}]}}
  - {{kind: block, variant: {panels}, size: [0.72, 0.04, 2.86], stations: [{{t: 10, at: [1.1, -1.0, 0]}},
     {{t: {shut:.1f}, at: [0.36, -1.0, 0]}}, {{t: 14.2, at: [0.36, -1.0, 0]}}, {{t: 15, at: [1.1, -1.0, 0]}}]}}
"""
# A carton is carried before the camera, which it fills or nearly fills for four seconds, and away.
COVER = """seconds: 20
layout: office
camera: {{path: xyz, at: [0, -1.9, 1.4], look_at: [0, 1.5, 0.9]}}
movers:
  - {{kind: carton, variant: {variant}, size: [{width:.2f}, 0.05, 1.0], stations: [{{t: 10, at: [{side}, -1.3, 0.75]}},
     {{t: 10.6, at: [{x:.2f}, -1.3, 0.75]}}, {{t: 14.5, at: [{x:.2f}, -1.3, 0.75]}}, {{t: 15, at: [{far}, -1.3, 0.75]}}]}}
"""
# Half of the room is furnished; the way leads towards the white wall of the other half, and back.
WHITE_WALL = """seconds: 22
rooms: [{{low: [-4, -5], high: [4, 4], wall: white, floor: carpet}}]
camera: {{path: walk, speed: 0.5, waypoints: [[1.2, -1.0, 1.4], [1.2, 0.2, 1.4], [0.6, 0.8, 1.4], [0, 0.2, 1.4],
         [{x:.2f}, {end}, 1.4], [-0.6, {turn}, 1.4], [-1.2, {end}, 1.4], [-1.2, -1, 1.4]]}}
furniture:
  - {{kind: workplace, variant: {variant}, at: [-0.78, 2.5, 0]}}
  - {{kind: workplace, variant: 4, at: [1.5, 2.5, 0]}}
  - {{kind: shelf, variant: 3, at: [-3.8, 1.6, 0], yaw: 90, size: [1.6, 0.35, 2.1]}}
  - {{kind: poster, variant: {poster}, at: [0, 3.95, 1.2], size: [1.4, 0.008, 1]}}
  - {{kind: shelf, variant: 2, at: [3.8, 0, 0], yaw: -90, size: [1.6, 0.35, 2.1]}}
"""
NAMES = ("lift_door", "cover", "white_wall", "long_white_wall")


def blind_world(name, seed):
    rng = random.Random(seed)
    if name == "lift_door":
        text = LIFT_DOOR.format(x=rng.uniform(-0.15, 0.15), walls=rng.randrange(4), panels=rng.randrange(4),
                                shut=rng.uniform(10.6, 11.4))
        return BlindWorld(text, 10, 4.2)
    if name == "cover":
        side = rng.choice([-2.5, 2.5])
        text = COVER.format(variant=rng.randrange(4), width=rng.uniform(1.0, 1.4), side=side, far=-side,
                            x=rng.uniform(-0.05, 0.05))
        return BlindWorld(text, 10, 4.5)
    end, turn, seconds = (-3.2, -3.4, 6) if name == "white_wall" else (-4, -4.2, 6.5)
    text = WHITE_WALL.format(x=rng.uniform(-0.2, 0.2), variant=rng.randrange(8), poster=rng.randrange(1, 9), end=end, turn=turn)
    return BlindWorld(text, 8.5, seconds)
