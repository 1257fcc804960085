"""A* on a grid, around people as they will be when the robot is there, and a velocity that keeps clear of them."""
import heapq

import numpy as np

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
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
    """Each cell the worst of `times` squared of them: occupied before unknown before free."""
    rows, columns = (n // times * times for n in grid.cells.shape)
    blocks = grid.cells[:rows, :columns].reshape(rows // times, times, columns // times, times)
    worst = np.where((blocks == OCCUPIED).any((1, 3)), OCCUPIED, np.where((blocks == FREE).any((1, 3)), FREE, UNKNOWN))
    return Grid(worst.astype(np.int8), grid.origin, grid.cell_m * times)


def grown(mask, radius_cells):
    """Every cell within the radius of one that is set."""
    reach = int(np.ceil(radius_cells))
    padded = np.pad(mask, reach)
    result = np.zeros_like(mask)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            if dy * dy + dx * dx <= radius_cells**2:
                result |= padded[reach + dy:reach + dy + mask.shape[0], reach + dx:reach + dx + mask.shape[1]]
    return result


def cost_of(grid, robot, radius_m, speed_mps, people):
    """Of each cell, infinite where the robot must not be.
    @param people of each a list of (seconds from now, place, sigma [m]): where he will be."""
    solid = grid.cells == OCCUPIED
    cost = np.where(grid.cells == UNKNOWN, 2.0, 1.0)
    cost += 3.0 * grown(solid, (radius_m + 0.2) / grid.cell_m)
    cost[grown(solid, radius_m / grid.cell_m)] = np.inf
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


def velocity_of(grid, solid, here, target, people, speed_mps, apart_m):
    """A dynamic window (Fox, Burgard, Thrun 1997) for a base that moves in any direction: of 49 velocities the one that
    comes nearest to the target without coming nearer to people than it must.
    @param solid where the robot must not be. @param people as for cost_of. @param apart_m of the middles that touch."""
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    choices = np.vstack([[0, 0], speed_mps * ways, 0.5 * speed_mps * ways])
    times = np.arange(0.25, 1.6, 0.25)
    places = here + choices[:, None] * times[:, None]
    score = -np.linalg.norm(places[:, 1] - target, axis=1)
    for i, way in enumerate(places):
        cells = [grid.cell_of(p) for p in way[:3]]
        hits = [not (0 <= y < solid.shape[0] and 0 <= x < solid.shape[1]) or solid[y, x] for y, x in cells]
        if any(hits) and not solid[grid.cell_of(here)]:
            score[i] -= 5 if i else 0
    for forecasts in people:
        after = [entry[0] for entry in forecasts]
        theirs = np.column_stack([np.interp(times, after, [entry[1][axis] for entry in forecasts]) for axis in (0, 1)])
        clear_m = np.linalg.norm(places - theirs, axis=2) - apart_m
        score -= ((0.5 - np.clip(clear_m, -0.5, 0.5)) * (2.0 - times)).max(axis=1) * 1.5
    return choices[np.argmax(score)]
