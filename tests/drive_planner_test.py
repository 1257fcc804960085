"""The planner of examples/drive_among_people, in a room of numbers: who is seen is not driven into; its cameras
together: who is counted once, what is remembered; and what its wheels tell.

    python tests/drive_planner_test.py
"""
import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "examples" / "drive_among_people"))
from planner import OCCUPIED, UNKNOWN, Grid, Lanes, along, coarser, cost_of, path_to, velocity_of  # noqa: E402

from rendered import HEIGHT, WIDTH, base_pose, camera_on_base  # noqa: E402
from robot import Wheels  # noqa: E402
from sights import Nearby, Sight, merged  # noqa: E402

STEP_S, SPEED_MPS, MOST_MPS2, RADIUS_M, APART_M = 0.1, 0.8, 1.5, 0.25, 0.45


def forecast(at, velocity, sigma_m=0.05):
    return [(s, np.array(at) + s * np.array(velocity), sigma_m) for s in (0, 0.5, 1, 1.5, 2)]


class Base:
    def __init__(self, at=(0, 0), walls=()):
        self.at, self.velocity, self.walls = np.array(at, float), np.zeros(2), walls

    def step(self, target, people=(), near=()):
        def clear_at(places):
            return np.min([np.linalg.norm(places - wall, axis=-1) for wall in self.walls], axis=0) if len(self.walls) else \
                np.full(places.shape[:-1], 9.0)
        chosen = velocity_of(clear_at, np.array(near), self.at, self.velocity, np.array(target), people, SPEED_MPS, MOST_MPS2,
                             RADIUS_M, APART_M)
        change = chosen - self.velocity
        self.velocity = self.velocity + change * min(1, MOST_MPS2 * STEP_S / max(np.linalg.norm(change), 1e-9))
        self.at = self.at + STEP_S * self.velocity


class TheBase(unittest.TestCase):
    def test_drives_to_its_target_and_stays(self):
        base = Base()
        for _ in range(40):
            base.step((1, 0.5))
        self.assertLess(np.linalg.norm(base.at - (1, 0.5)), 0.2)
        self.assertLess(np.linalg.norm(base.velocity), 0.05)

    def test_makes_way_for_whoever_walks_through_its_place(self):
        for way_rad in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            way = 1.2 * np.array([np.cos(way_rad), np.sin(way_rad)])
            base, nearest_m = Base(), 9.0
            for k in range(50):
                person = -2.4 * way + way * k * STEP_S
                nearest_m = min(nearest_m, np.linalg.norm(person - base.at))
                base.step((0, 0), [forecast(person, way)])
            self.assertGreater(nearest_m, APART_M, way_rad)

    def test_is_at_rest_or_on_its_way_off_when_somebody_turns_into_it(self):
        """Who stood still walks towards it all at once, which no forecast tells."""
        for since in range(0, 24, 3):
            base, person, way = Base((-1.5, 0)), np.array([0.3, 0.9]), np.zeros(2)
            for k in range(40):
                apart = person - base.at
                away_m = np.linalg.norm(apart)
                if away_m < APART_M:
                    self.assertLess(base.velocity @ apart / away_m, 0.05, f"driven into, {since}")
                    break
                if k >= since:
                    way = -apart / away_m * min(1.2, 3 * (k - since) * STEP_S)
                    person = person + STEP_S * way
                base.step((1.5, 0), [forecast(person, way)])

    def test_stops_before_what_only_depth_has_seen(self):
        base, wall = Base(), np.array([[0.9, y] for y in np.arange(-3, 3, 0.1)])
        for _ in range(40):
            base.step((2, 0), near=wall)
            self.assertLess(base.at[0], 0.9 - RADIUS_M)
        self.assertGreater(base.at[0], 0.2)

    def test_makes_way_to_where_there_is_room(self):
        """Who comes along a wall is passed on the side without it, whichever that is."""
        for side in (1, -1):
            walls = [np.array([x, -0.9 * side]) for x in np.arange(-4, 4, 0.1)]
            base = Base(walls=walls)
            for k in range(40):
                person = np.array([2.5 - 0.1 * k, 0])
                base.step(base.at, [forecast(person, (-1, 0))])
            self.assertGreater(side * base.at[1], 0.3)

    def test_the_way_to_a_velocity_is_that_of_bounded_acceleration(self):
        velocity, choice = np.array([0.5, 0.0]), np.array([[-0.4, 0.3]])
        times = np.arange(0.05, 2, 0.05)
        at, v, walked = np.zeros(2), velocity.copy(), []
        for t in np.arange(0, 2, 0.001):
            if np.any(np.abs(times - t) < 5e-4):
                walked.append(at.copy())
            change = choice[0] - v
            v = v + change * min(1, MOST_MPS2 * 0.001 / max(np.linalg.norm(change), 1e-12))
            at = at + 0.001 * v
        np.testing.assert_allclose(along(velocity, choice, times, MOST_MPS2)[0], walked, atol=2e-3)


class ThePath(unittest.TestCase):
    def grid(self):
        cells = np.zeros((40, 40), np.int8)
        cells[20, 5:35] = OCCUPIED
        return Grid(cells, (0, 0), 0.1)

    def test_goes_round_what_stands_with_room_for_the_base(self):
        grid = self.grid()
        path = np.array(path_to(grid, cost_of(grid, grid.clearance_m(), (2, 1), RADIUS_M, SPEED_MPS, []), (2, 1), (2, 3)))
        self.assertGreater(grid.look_up(grid.clearance_m(), path).min(), RADIUS_M)
        self.assertLess(np.linalg.norm(path[-1] - (2, 3)), 0.1)

    def test_keeps_off_lanes_where_there_is_another_way(self):
        grid = Grid(np.zeros((40, 60), np.int8), (0, 0), 0.1)
        lanes = Lanes()
        for x in np.arange(1, 5, 0.2):
            lanes.add(0, [np.array([x, 2.25])])
        plain = cost_of(grid, grid.clearance_m(), (0.5, 2.25), RADIUS_M, SPEED_MPS, [])

        def within(cost):
            path = np.array(path_to(grid, cost, (0.5, 2.25), (5.5, 2.25)))
            return np.sum(np.abs(path[:, 1] - 2.25) < 0.4)
        self.assertGreater(within(plain), 40)
        self.assertLess(within(plain + lanes.cost(10, grid)), 25)
        self.assertEqual(np.ptp(lanes.cost(100, grid)), 0, "a minute later nobody walks there")

    def test_what_is_coarser_hides_nothing_that_stands(self):
        fine = Grid(np.array([[0, 0, UNKNOWN, UNKNOWN], [0, OCCUPIED, UNKNOWN, 0]], np.int8), (0, 0), 0.05)
        np.testing.assert_array_equal(coarser(fine, 2).cells, [[OCCUPIED, 0]])


class SeveralCameras(unittest.TestCase):
    """One looks along x, one along y, from the origin."""

    def sights(self, hidden_at, seen_at=None, wall_m=5):
        depth = np.full((HEIGHT, WIDTH), wall_m, np.float32)
        looks = [base_pose(0, 0, 0) @ camera_on_base(way) for way in (0, np.pi / 2)]
        people = [[(False, forecast(hidden_at, (0, 0), 0.2))],
                  [] if seen_at is None else [(True, forecast(seen_at, (0, 0)))]]
        return [Sight(None, depth, look, np.empty((0, 3)), who) for look, who in zip(looks, people)]

    def test_whom_another_sees_is_counted_once(self):
        self.assertEqual(len(merged(self.sights((-1, 1), (-0.8, 1.4)))), 1)
        self.assertEqual(len(merged(self.sights((-1, 1), (1, 2)))), 2)

    def test_where_a_camera_sees_through_nobody_is(self):
        self.assertEqual(merged(self.sights((2, 0))), [])
        self.assertEqual(len(merged(self.sights((2, 0), wall_m=1.2))), 1, "behind something")
        self.assertEqual(len(merged(self.sights((-2, 0)))), 1, "where no camera looks")


class WhatIsNearby(unittest.TestCase):
    """A table's end half a metre ahead was seen from farther away; now depth shows nothing there."""

    def remembered(self, way_m=0.1, after_s=5, depth_m=0, people=(), height_m=0.75,
                   knows_people=True):
        look, nearby = base_pose(0, 0, 0), Nearby(knows_people)
        for t_s, stands, at_m, depth in ((0, [[0.5, 0, height_m]], 0, 0.55), (after_s, np.empty((0, 3)), way_m, depth_m)):
            image = np.full((HEIGHT, WIDTH), depth, np.float32)
            nearby.add(t_s, at_m, look, [Sight(None, image, look @ camera_on_base(0), np.array(stands))], people)
        return len(nearby.points)

    def test_is_remembered_while_the_robot_hardly_moves(self):
        self.assertEqual(self.remembered(), 1)
        self.assertEqual(self.remembered(way_m=1.2), 0)

    def test_is_forgotten_where_a_camera_sees_through(self):
        self.assertEqual(self.remembered(depth_m=3), 0)

    def test_legs_are_remembered_for_a_moment_only(self):
        person = [np.array([0.6, 0])]
        self.assertEqual(self.remembered(after_s=0.3, people=person), 1)
        self.assertEqual(self.remembered(people=person), 0)

    def test_where_nobody_knows_people_nothing_stays(self):
        self.assertEqual(self.remembered(knows_people=False), 0)
        self.assertEqual(self.remembered(knows_people=False, after_s=0.3), 1)

    def test_who_stands_too_near_for_depth_is_remembered_until_he_has_left(self):
        person = [np.array([0.6, 0])]
        self.assertEqual(self.remembered(people=person, height_m=1.2), 1)
        self.assertEqual(self.remembered(people=person, height_m=1.2, depth_m=3), 0)


class TheWheels(unittest.TestCase):
    def ways(self, step, steps=400):
        """True and told, of a drive in steps of 0.1 s."""
        wheels, T = Wheels(1), np.eye(4)
        for k in range(steps):
            wheels.roll(k * STEP_S, step)
            T = T @ step
        return T, wheels.T_odom_base

    def test_err_by_a_few_percent(self):
        told_of = self.ways(base_pose(0.05, 0.03, 0.02))
        way_m = 400 * np.hypot(0.05, 0.03)
        off_m = np.linalg.norm((told_of[0] - told_of[1])[:2, 3])
        self.assertGreater(off_m, 0.001)
        self.assertLess(off_m, 0.05 * way_m)

    def test_say_nothing_at_rest(self):
        np.testing.assert_array_equal(self.ways(np.eye(4))[1], np.eye(4))


if __name__ == "__main__":
    unittest.main()
