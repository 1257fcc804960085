"""The robot's cameras: each finds its own pose and people, in a process of its own."""
import multiprocessing

import numpy as np
import ygslam
from ygslam import State

from planner import OCCUPIED, UNKNOWN, Grid, coarser
from rendered import FPS, Camera, camera_on_base, lens
from sights import Sight

HORIZONS_S = (0, 0.5, 1, 1.5, 2)
REMEMBERED_S = 3
NEAR_M, NEAR_LOW_M, NEAR_HIGH_M, NEAR_CELL_M = 2, 0.15, 1.4, 0.1
SAME_DOUBT_M = 0.1  # of standard deviations: poses within the same step are as good


def forecasts(objects, T_floor_world, unseen_s=0):
    """Of each person whether he is seen, and (seconds, place on the floor, sigma). @param unseen_s since the frame."""
    people = []
    for item in objects:
        missing_s = item.missing_frames / FPS + unseen_s
        if item.class_name != "person" or missing_s > REMEMBERED_S:
            continue
        entry = []
        for after_s in HORIZONS_S:
            place, covariance = item.after(after_s + unseen_s)
            on_floor = T_floor_world[:3, :3] @ covariance @ T_floor_world[:3, :3].T
            at = (T_floor_world @ [*place, 1])[:2]
            entry.append((after_s, at, float(np.sqrt(np.linalg.eigvalsh(on_floor[:2, :2])[-1]))))
        people.append((missing_s == 0, entry))
    return people


class Eye:
    """A camera on the base, and what is found in its images with the wheels' help. The first makes the plan: a dense
    map for each would be too much."""

    def __init__(self, options, world, folder, seed, number, tracks):
        """@param tracks whether it finds its own pose and people, else it is told the pose."""
        self.T_base_camera = camera_on_base(2 * np.pi * number / options.cameras)
        self.camera = Camera(options.ygslam, world, folder, seed)
        self.pinhole = ygslam.CameraModel(**lens())
        self.slam = ygslam.Slam(self.pinhole, segmenter="builtin", deterministic=True,
                                wheels=ygslam.Wheels(self.T_base_camera),
                                options={} if number == 0 else {"run.without": "[dense_map]"}) if tracks else None
        self.T_odom_before = None  # the camera
        self.T_floor_first = None  # where the map began, as the robot believed then
        self.objects, self.seen_at, self.T_floor_map = [], 0, np.eye(4)

    def look(self, k, T_true_base, T_odom_base, T_floor_base, wants_grid):
        """@param T_true_base where the camera is moved to. @param T_odom_base as the wheels tell.
        @param T_floor_base as the robot believes: it places what each camera sees, so that all have the same axes."""
        rgb, depth = self.camera.look(k / FPS, T_true_base @ self.T_base_camera)
        seen = Sight(rgb, depth, T_floor_base @ self.T_base_camera, self.what_stands(depth))
        if self.slam:
            self.track(seen, k, T_odom_base)
            if wants_grid:
                seen.grid = grid_of(self.slam.plan(), self.T_floor_first)
        else:
            seen.T_floor_base = T_floor_base
        return seen

    def track(self, seen, k, T_odom_base):
        t_ns, T_odom_camera = 10**12 + k * 10**9 // FPS, T_odom_base @ self.T_base_camera
        self.slam.push_odometry(t_ns, T_odom_base)
        before = T_odom_camera if self.T_odom_before is None else self.T_odom_before
        result = self.slam.process(seen.rgb, seen.depth, t_ns, T_last_camera=np.linalg.inv(before) @ T_odom_camera)
        self.T_odom_before, seen.state = T_odom_camera, result.state.name.lower()
        if result.state in (State.TRACKING, State.WEAK, State.COASTING):
            self.objects, self.seen_at = result.objects, k
            self.T_floor_map = seen.T_floor_camera @ np.linalg.inv(result.pose)
            if self.T_floor_first is None:
                self.T_floor_first = self.T_floor_map
            seen.T_floor_base = self.T_floor_first @ result.pose @ np.linalg.inv(self.T_base_camera)
            std_m = float(np.sqrt(np.trace(result.map_covariance[:3, :3])))
            seen.doubt = (result.state != State.TRACKING, int(std_m / SAME_DOUBT_M))
        # While it is lost, who filled the view is still there.
        seen.people = forecasts(self.objects, self.T_floor_map, (k - self.seen_at) / FPS)

    def what_stands(self, depth):
        """At the robot's height, by this depth alone: points of the base's axes, one for each cell of 10 cm."""
        v, u = np.mgrid[2:depth.shape[0]:4, 2:depth.shape[1]:4]
        z, c = depth[v, u], self.pinhole
        rays = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], axis=-1)[(z > 0) & (z < NEAR_M)]
        points = rays @ self.T_base_camera[:3, :3].T + self.T_base_camera[:3, 3]
        points = points[(points[:, 2] > NEAR_LOW_M) & (points[:, 2] < NEAR_HIGH_M)]
        cells = np.floor(points[:, :2] / NEAR_CELL_M)
        return points[np.unique(cells, axis=0, return_index=True)[1]]


class EyeProcess:
    """An eye in a process of its own, so that all look at the same time."""

    def __init__(self, *arguments):
        self.pipe, theirs = multiprocessing.Pipe()
        self.process = multiprocessing.Process(target=self.live, args=(theirs, arguments), daemon=True)
        self.process.start()
        theirs.close()  # so that recv() ends where the process does

    @staticmethod
    def live(pipe, arguments):
        eye = Eye(*arguments)
        while question := pipe.recv():
            pipe.send(eye.look(*question))
        eye.camera.close()

    def close(self):
        self.pipe.send(None)
        self.process.join()


def grid_of(plan, T_floor_world):
    """The library's plan in the building's axes, 10 cm."""
    nothing = Grid(np.full((2, 2), -1, np.int8), (0, 0), 0.1)
    if plan is None or T_floor_world is None or not (plan.cells != -1).any():  # no floor was seen yet
        return nothing
    T = T_floor_world @ plan.T_world_floor
    fine = Grid(plan.cells, plan.origin_m, plan.resolution_m)
    places = np.concatenate([fine.middles(), np.zeros((*plan.cells.shape, 1))], axis=2) @ T[:3, :3].T + T[:3, 3]
    known = plan.cells != -1
    low = places[known][:, :2].min(axis=0)
    size = np.ceil((places[known][:, :2].max(axis=0) - low) / plan.resolution_m).astype(int)[::-1] + 1
    cells = np.full(size, UNKNOWN, np.int8)
    for what in (0, OCCUPIED):  # what stands there is written last
        x, y = ((places[plan.cells == what][:, :2] - low) / plan.resolution_m).astype(int).T
        cells[y, x] = what
    return coarser(Grid(cells, low, plan.resolution_m), max(1, round(0.1 / plan.resolution_m)))


