"""The plan that depth gives without knowing people: hits and misses of rays, as in OctoMap (Hornung et al. 2013), on the
floor instead of in space."""
import numpy as np

from planner import FREE, OCCUPIED, UNKNOWN, Grid

HIT, MISS, LEAST, MOST = 0.85, -0.4, -2.0, 3.5  # log odds
CELL_M, SIZE_M, REACH_M = 0.1, 16.0, 4.0


class RayGrid:
    def __init__(self, middle):
        self.origin = np.asarray(middle) - SIZE_M / 2
        n = round(SIZE_M / CELL_M)
        self.odds, self.seen = np.zeros((n, n)), np.zeros((n, n), bool)

    def add(self, depth_m, camera, T_floor_camera):
        v, u = np.mgrid[0:depth_m.shape[0]:2, 0:depth_m.shape[1]:2]
        z = depth_m[v, u]
        rays = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)
        points = rays @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]
        stands = (z > 0) & (points[..., 2] > 0.1) & (points[..., 2] < 1.5)
        eye = T_floor_camera[:2, 3]
        away = np.where(z > 0, np.linalg.norm(points[..., :2] - eye, axis=-1), 0)
        # In each column the nearest thing ends the ray; where nothing stands, what was seen farthest.
        nearest = np.where(stands, away, np.inf).min(axis=0)
        reach = np.minimum(np.where(np.isfinite(nearest), nearest, away.max(axis=0)), REACH_M)
        column = rays[np.argmax(away, axis=0), np.arange(away.shape[1])] @ T_floor_camera[:3, :3].T
        ways = column[:, :2] / np.maximum(np.linalg.norm(column[:, :2], axis=1), 1e-6)[:, None]
        steps = np.arange(0.3, REACH_M, CELL_M / 2)
        passed = (eye + ways[:, None] * steps[:, None])[steps[None] < reach[:, None] - CELL_M]
        stops = nearest < REACH_M
        hit = eye + ways[stops] * nearest[stops, None]
        hits, misses = self._cells(hit), self._cells(passed)
        misses &= ~hits
        self.odds = np.clip(self.odds + HIT * hits + MISS * misses, LEAST, MOST)
        self.seen |= hits | misses

    def _cells(self, points):
        mask = np.zeros_like(self.seen)
        x, y = np.floor((points - self.origin) / CELL_M).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < mask.shape[1]) & (y < mask.shape[0])
        mask[y[inside], x[inside]] = True
        return mask

    def grid(self):
        cells = np.where(self.seen, np.where(self.odds > 0, OCCUPIED, FREE), UNKNOWN)
        return Grid(cells.astype(np.int8), self.origin, CELL_M)


class OctoMapGrid:
    """The plan of OctoMap itself, with its defaults (package pyoctomap)."""

    FLOOR_M, STANDS_M = np.array([-0.25, -0.15, -0.05, 0.05, 0.15, 0.25]), np.arange(0.15, 1.5, CELL_M)  # middles of cells

    def __init__(self, start):
        import pyoctomap
        self.tree = pyoctomap.OcTree(CELL_M)
        self.low, self.high = np.array(start, float), np.array(start, float)

    def add(self, depth_m, camera, T_floor_camera):
        v, u = np.mgrid[1:depth_m.shape[0]:3, 1:depth_m.shape[1]:3]
        z = depth_m[v, u].astype(float)
        rays = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)[z > 0]
        points = rays @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]
        self.tree.insertPointCloud(points, np.ascontiguousarray(T_floor_camera[:3, 3]), REACH_M)
        self.low = np.minimum(self.low, T_floor_camera[:2, 3] - REACH_M)
        self.high = np.maximum(self.high, T_floor_camera[:2, 3] + REACH_M)

    def grid(self):
        """Occupied where a cell between 0.1 and 1.5 m is, else free where one at the floor is known."""
        first = np.floor(self.low / CELL_M)
        columns, rows = (np.ceil(self.high / CELL_M) - first).astype(int)
        heights = np.concatenate([self.FLOOR_M, self.STANDS_M])
        y, x, z = np.meshgrid((first[1] + np.arange(rows) + 0.5) * CELL_M, (first[0] + np.arange(columns) + 0.5) * CELL_M,
                              heights, indexing="ij")
        labels = self.tree.getLabels(np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(x.shape)  # 0 free, 1 occupied
        floor, stands = labels[..., :len(self.FLOOR_M)], labels[..., len(self.FLOOR_M):]
        free = (floor == 0).any(axis=2) | (floor[..., np.abs(self.FLOOR_M) <= 0.1] == 1).any(axis=2)
        cells = np.where((stands == 1).any(axis=2), OCCUPIED, np.where(free, FREE, UNKNOWN))
        return Grid(cells.astype(np.int8), first * CELL_M, CELL_M)
