"""What several cameras on a base saw of people, put together."""
from dataclasses import dataclass

import numpy as np

from planner import Grid
from rendered import HEIGHT, WIDTH, lens

PERSON_M = 0.2  # radius
SAME_M = 0.6  # between two cameras' places of one person, at most


@dataclass
class Sight:
    """What a camera found in a frame."""
    rgb: np.ndarray
    depth: np.ndarray
    T_floor_camera: np.ndarray | None  # None: it is lost
    T_floor_base: np.ndarray | None
    people: list  # as of forecasts()
    near: np.ndarray  # what depth shows there, whatever it is
    grid: Grid | None  # the plan, where it was asked for


def merged(sights):
    """All forecasts but of those whom one camera has lost sight of, where another sees him, or sees that nobody is there."""
    seen = [entry[0][1] for sight in sights for is_seen, entry in sight.people if is_seen]

    def is_elsewhere(entry):
        _, at, sigma_m = entry[0]
        return any(np.linalg.norm(at - one) < SAME_M + min(sigma_m, SAME_M) for one in seen) or \
            any(is_empty(sight, at) for sight in sights)
    return [entry for sight in sights for is_seen, entry in sight.people if is_seen or not is_elsewhere(entry)]


def is_empty(sight, at):
    """Whether a camera sees through the place on the floor at the height of hips, as wide as somebody is."""
    if sight.T_floor_camera is None:
        return False
    x, y, z = np.linalg.inv(sight.T_floor_camera)[:3] @ [*at, 0.9, 1]
    c = lens()
    if z < 0.6:
        return False
    u, v, half = c["cx"] + c["fx"] * x / z, c["cy"] + c["fy"] * y / z, max(2, c["fx"] * PERSON_M / z)
    if not (half <= u < WIDTH - half and half <= v < HEIGHT - half):
        return False
    patch = sight.depth[int(v - half):int(v + half) + 1, int(u - half):int(u + half) + 1]
    return bool(np.mean(patch > z + SAME_M) > 0.9)
