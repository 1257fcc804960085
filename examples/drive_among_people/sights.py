"""What several cameras on a base saw, put together."""
from dataclasses import dataclass, field

import numpy as np

from planner import Grid
from rendered import HEIGHT, WIDTH, lens

PERSON_M = 0.2  # radius
SAME_M = 0.6  # between two cameras' places of one person, at most
THROUGH_M = 0.15  # behind a point, and it is gone
CELL_M = 0.1
LATELY_S, REACH_M, KEPT_M = 0.6, 1.2, 1.0
LEGS_M, ABOUT_PERSON_M = 0.9, 0.6  # up to this height, so far about a person


@dataclass
class Sight:
    """What a camera found in a frame."""
    rgb: np.ndarray
    depth: np.ndarray
    T_floor_camera: np.ndarray  # as the robot believed before
    stands: np.ndarray  # what depth shows near by, whatever it is: points in the base's axes
    people: list = field(default_factory=list)  # as of forecasts()
    T_floor_base: np.ndarray | None = None  # as this camera found it; None: it is lost
    doubt: tuple = (False, 0)  # of that pose: smaller is better
    state: str = "tracking"  # its tracker's
    grid: Grid | None = None  # the plan, where it was asked for

    def pixels_of(self, points):
        """u, v, z of points (N, 3) of the floor's axes."""
        x, y, z = np.linalg.inv(self.T_floor_camera)[:3] @ np.column_stack([points, np.ones(len(points))]).T
        c, safe = lens(), np.where(z > 0.05, z, np.inf)
        return c["cx"] + c["fx"] * x / safe, c["cy"] + c["fy"] * y / safe, z


def merged(sights):
    """All forecasts but of those whom one camera has lost sight of, where another sees him, or sees that nobody is
    there."""
    seen = [entry[0][1] for sight in sights for is_seen, entry in sight.people if is_seen]

    def is_elsewhere(entry):
        _, at, sigma_m = entry[0]
        return any(np.linalg.norm(at - one) < SAME_M + min(sigma_m, SAME_M) for one in seen) or \
            any(is_empty(sight, at) for sight in sights)
    return [entry for sight in sights for is_seen, entry in sight.people if is_seen or not is_elsewhere(entry)]


def is_empty(sight, at):
    """Whether a camera sees through the place on the floor at the height of hips, as wide as somebody is."""
    (u,), (v,), (z,) = sight.pixels_of(np.array([[*at, 0.9]]))
    if z < 0.6:
        return False
    half = max(2, lens()["fx"] * PERSON_M / z)
    if not (half <= u < WIDTH - half and half <= v < HEIGHT - half):
        return False
    patch = sight.depth[int(v - half):int(v + half) + 1, int(u - half):int(u + half) + 1]
    return bool(np.mean(patch > z + SAME_M) > 0.9)


class Nearby:
    """What depth has shown about the robot in the last 0.6 s, and until a camera sees through its place, or for a metre of
    way: beside the robot it is too near for depth, or below the view. So are people's legs, which do not stay."""

    def __init__(self, knows_people):
        """@param knows_people else nothing stays: legs could not be told from things."""
        self.knows_people = knows_people
        self.points = np.empty((0, 3))
        self.rows = np.empty((0, 3))  # of each point: when it was seen [s], after which way [m], whether it may stay

    def add(self, t_s, way_m, T_floor_base, sights, people):
        """@param people where they are."""
        here = T_floor_base[:2, 3]
        new = np.concatenate([s.stands for s in sights]) @ T_floor_base[:3, :3].T + T_floor_base[:3, 3]
        may_stay = np.full(len(new), self.knows_people)
        for at in people:
            may_stay &= (new[:, 2] > LEGS_M) | (np.linalg.norm(new[:, :2] - at, axis=1) > ABOUT_PERSON_M)
        rows = np.column_stack([np.full(len(new), t_s), np.full(len(new), way_m), may_stay])
        seen_s, seen_m, stays = self.rows.T
        near = np.linalg.norm(self.points[:, :2] - here, axis=1) < REACH_M
        stays = (stays > 0) & near & (way_m - seen_m < KEPT_M)
        for sight in sights:
            stays[stays] = ~sees_through(sight, self.points[stays])
        kept = stays | (t_s - seen_s < LATELY_S)
        self.points, self.rows = np.concatenate([new, self.points[kept]]), np.concatenate([rows, self.rows[kept]])
        first = np.unique(np.floor(self.points[:, :2] / CELL_M), axis=0, return_index=True)[1]  # the newest of a cell
        self.points, self.rows = self.points[first], self.rows[first]


def sees_through(sight, points):
    """Of each point whether depth all about it is farther away."""
    u, v, z = sight.pixels_of(points)
    inside = (z > 0.05) & (u >= 2) & (u < WIDTH - 2) & (v >= 2) & (v < HEIGHT - 2)
    u, v = (np.where(inside, np.rint(x), 2).astype(int) for x in (u, v))
    least = np.min([sight.depth[v + dv, u + du] for dv in (-1, 0, 1) for du in (-1, 0, 1)], axis=0)
    return inside & (least > z + THROUGH_M)
