"""A* on a grid, around people as they will be when the robot is there, and a velocity that keeps clear of them."""
import heapq

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
LANE_M, LANE_S, LANE_COST = 0.5, 60, 2
STEP_S, WISH_M = 0.1, 0.6  # between two decisions; kept from people where there is room
ROOM_M = 0.6  # kept from what stands where there is a choice: nearer than 0.5 m cameras have no depth
FAR_M = 9.0
NEIGHBOURS = [(dy, dx, float(np.hypot(dy, dx))) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


class Grid:
    """Of the floor: `cells` by row (y) and column (x), `origin` the lower left corner [m]."""

    def __init__(self, cells, origin, cell_m):
        self.cells, self.origin, self.cell_m = cells, np.asarray(origin, float), cell_m

    def cell_of(self, at):
        x, y = np.floor((np.asarray(at) - self.origin) / self.cell_m).astype(int)
        return int(y), int(x)

    def middle_of(self, cell):
        return self.origin + (np.array([cell[1], cell[0]]) + 0.5) * self.cell_m

    def middles(self):
        rows, columns = self.cells.shape
        return np.dstack(np.meshgrid(self.origin[0] + (np.arange(columns) + 0.5) * self.cell_m,
                                     self.origin[1] + (np.arange(rows) + 0.5) * self.cell_m))

    def clearance_m(self):
        """Of each cell the way to the nearest that is occupied."""
        solid = self.cells == OCCUPIED
        return distance_transform_edt(~solid) * self.cell_m if solid.any() else np.full(solid.shape, FAR_M)

    def look_up(self, values, places, outside=FAR_M):
        """Of each place the value of its cell."""
        x, y = np.moveaxis(np.floor((places - self.origin) / self.cell_m).astype(int), -1, 0)
        rows, columns = values.shape
        inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
        return np.where(inside, values[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)], outside)

    def around(self, points, margin_m=0.5):
        """The same, large enough to hold the points; what was added is unknown."""
        low = np.minimum(self.origin, np.min(points, axis=0) - margin_m)
        high = np.maximum(self.origin + self.cell_m * np.array(self.cells.shape[::-1]), np.max(points, axis=0) + margin_m)
        before = np.ceil((self.origin - low) / self.cell_m - 1e-9).astype(int)
        origin = self.origin - before * self.cell_m
        shape = np.ceil((high - origin) / self.cell_m - 1e-9).astype(int)[::-1]
        cells = np.full(np.maximum(shape, before[::-1] + self.cells.shape), UNKNOWN, np.int8)
        cells[before[1]:before[1] + self.cells.shape[0], before[0]:before[0] + self.cells.shape[1]] = self.cells
        return Grid(cells, origin, self.cell_m)


def coarser(grid, times):
    """Each cell from `times` squared of them: occupied if any is, else free if any is, else unknown."""
    rows, columns = (n // times * times for n in grid.cells.shape)
    blocks = grid.cells[:rows, :columns].reshape(rows // times, times, columns // times, times)
    cells = np.where((blocks == OCCUPIED).any((1, 3)), OCCUPIED, np.where((blocks == FREE).any((1, 3)), FREE, UNKNOWN))
    return Grid(cells.astype(np.int8), grid.origin, grid.cell_m * times)


class Lanes:
    """Where people were within the last minute they will walk again: better not to linger there."""

    def __init__(self):
        self.last_s = {}  # by half metre

    def add(self, t_s, places):
        self.last_s.update({tuple(np.floor(p / LANE_M).astype(int)): t_s for p in places})

    def cost(self, t_s, grid):
        walked = [(np.array(cell) + 0.5) * LANE_M for cell, last_s in self.last_s.items() if t_s - last_s < LANE_S]
        if not walked:
            return np.zeros(grid.cells.shape)
        return np.where(cKDTree(walked).query(grid.middles())[0] < LANE_M, LANE_COST, 0.0)


def cost_of(grid, clear_m, robot, radius_m, speed_mps, people):
    """Of each cell, infinite where the robot must not be. @param clear_m the grid's clearance.
    @param people of each a list of (seconds from now, place, sigma [m]): where he will be."""
    cost = np.where(grid.cells == UNKNOWN, 2.0, 1.0) + (clear_m <= ROOM_M) + 3 * (clear_m <= radius_m + 0.2)
    cost[clear_m <= radius_m] = np.inf
    middles = grid.middles()
    arrival_s = np.linalg.norm(middles - robot, axis=2) / speed_mps
    for forecasts in people:
        for after_s, at, sigma_m in forecasts:
            away_m = np.linalg.norm(middles - at, axis=2)
            meets = np.abs(arrival_s - after_s) < 0.5
            cost[meets & (away_m < radius_m + 0.3 + min(sigma_m, 0.3))] = np.inf
            cost[meets & (away_m < radius_m + 0.6 + min(2 * sigma_m, 0.6))] += 4
    return cost


def path_to(grid, cost, start, goal):
    """Places from start to goal, or to the nearest cell to it that can be reached; empty where there is no way."""
    begin, end = grid.cell_of(start), grid.cell_of(goal)
    rows, columns = cost.shape
    came_from, best, queue, nearest = {begin: None}, {begin: 0.0}, [(0.0, begin)], begin

    def ahead(cell):
        return float(np.hypot(cell[0] - end[0], cell[1] - end[1]))
    while queue:
        _, cell = heapq.heappop(queue)
        if ahead(cell) < ahead(nearest):
            nearest = cell
        if cell == end:
            break
        for dy, dx, length in NEIGHBOURS:
            there = (cell[0] + dy, cell[1] + dx)
            if not (0 <= there[0] < rows and 0 <= there[1] < columns):
                continue
            # Who stands too near to something may leave.
            step = cost[there] if np.isfinite(cost[there]) else (50 if not np.isfinite(cost[cell]) else np.inf)
            total = best[cell] + length * step
            if total < best.get(there, np.inf):
                best[there], came_from[there] = total, cell
                heapq.heappush(queue, (total + ahead(there), there))
    path, cell = [], nearest
    while cell is not None:
        path.append(grid.middle_of(cell))
        cell = came_from[cell]
    return path[::-1]


def along(velocity, choices, times, most_mps2):
    """Ways of a base that goes from one velocity to each of the choices as fast as it can: by choice and time."""
    change = choices - velocity
    takes_s = np.linalg.norm(change, axis=1)[:, None, None] / most_mps2
    t = times[None, :, None]
    part = np.minimum(t, takes_s)  # of the time that changing takes
    return velocity * t + change[:, None] * (part**2 / (2 * np.maximum(takes_s, 1e-9)) + t - part)


def velocity_of(clear_at, near, here, velocity, target, people, speed_mps, most_mps2, radius_m, apart_m):
    """A dynamic window (Fox, Burgard, Thrun 1997) for a base that moves in any direction: of 73 velocities the one that
    comes nearest to the target while it keeps clear of people for two seconds. Safe first: none is chosen with which the
    base, braking a step later, would not be at rest before somebody can be where it is, or would come nearer to him than
    it is (passive safety: Bouraine, Fraichard, Salhi 2012; the same as speed and separation monitoring, ISO/TS 15066).
    @param clear_at tells of places how far what stands is. @param near places where depth has just seen
    something, whatever it is. @param people as for cost_of. @param apart_m of the middles that touch."""
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    choices = np.vstack([[0, 0], *(share * speed_mps * ways for share in (1, 0.6, 0.3))])
    times = np.arange(0.1, 2.05, 0.1)
    moves = along(velocity, choices, times, most_mps2)
    places = here + moves
    score = -np.linalg.norm(places[:, 7] - target, axis=1)
    away_m = clear_at(places[:, 1:10:2])
    hits, room_m = (away_m <= radius_m).sum(axis=1), away_m[:, -1]
    score -= 5.0 * (hits > 0) * (1 + hits)
    if len(near):
        nearest = cKDTree(near)
        away_m = nearest.query(places[:, 1:10:2])[0]
        room_m = np.minimum(room_m, away_m[:, -1])
        lacks_m = np.minimum(radius_m + 0.1 - away_m, nearest.query(here)[0] - away_m)
        score -= 20 * np.clip(lacks_m, 0, None).max(axis=1)
    score -= 0.8 * np.clip(ROOM_M - room_m, 0, None)
    # If it brakes after a step; until it stands, each person may leave his forecast with 3 m/s2, and be a sigma off it.
    step = np.minimum(most_mps2 * STEP_S / np.maximum(np.linalg.norm(choices - velocity, axis=1), 1e-9), 1)[:, None]
    then = velocity + step * (choices - velocity)
    stop_s = np.linalg.norm(then, axis=1) / most_mps2
    t = np.minimum(np.maximum(times - STEP_S, 0), stop_s[:, None])[..., None]
    direction = then / np.maximum(np.linalg.norm(then, axis=1), 1e-9)[:, None]
    braking = here + then[:, None] * (np.minimum(times, STEP_S)[:, None] + t) - 0.5 * most_mps2 * direction[:, None] * t**2
    for forecasts in people:
        after = [entry[0] for entry in forecasts]
        theirs = np.column_stack([np.interp(times, after, [entry[1][axis] for entry in forecasts]) for axis in (0, 1)])
        sigma_m = np.minimum(np.interp(times, after, [entry[2] for entry in forecasts]), 0.3)
        clear_m = np.linalg.norm(places - theirs, axis=2) - apart_m
        score -= ((WISH_M - np.clip(clear_m, -0.5, WISH_M)) * (2.3 - times)).max(axis=1) * 1.5
        clear_m = np.linalg.norm(braking - theirs, axis=2) - apart_m
        standing_m = np.linalg.norm(here - theirs, axis=1) - apart_m
        lacks_m = np.minimum(0.05 + sigma_m + 1.5 * times**2 - clear_m, standing_m - clear_m)
        lacks_m[times > stop_s[:, None] + STEP_S] = 0
        score -= 20 * np.clip(lacks_m, 0, None).max(axis=1)
    return choices[np.argmax(score)]
