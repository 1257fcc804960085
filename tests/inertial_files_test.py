"""What `simulate --imu --wheels` writes belongs to the images: integrated here, it leads along their truth.

    YGSLAM_BINARY=build/release/ygslam YGSLAM_SEQUENCE=FOLDER python tests/inertial_files_test.py
"""
import json
import unittest

import numpy as np
from rosbags.highlevel import AnyReader

from ygslam_cli import CliTest, ygslam

GRAVITY = np.array([0, 0, -9.80665])
SMALL = ("--size", "64x48", "--noise", "none", "--quiet")


def rotation(q):
    """Of a quaternion x y z w."""
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def turned(omega):
    """Rodrigues."""
    angle = np.linalg.norm(omega)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = omega / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pose_of(numbers):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(np.asarray(numbers[3:7])), numbers[:3]
    return T


def place_of_imu(folder):
    line = next(line for line in (folder / "imu.yaml").read_text(encoding="utf-8").splitlines()
                if line.startswith("T_camera_imu"))
    return pose_of([float(word) for word in line.split("[")[1].split("]")[0].split(",")])


class InertialFiles(CliTest):
    def simulate(self, world, *options, out="world"):
        done = ygslam("simulate", world, "--out", self.folder / out, *SMALL, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / out

    def test_readings_lead_along_the_true_path(self):
        out = self.simulate("walking_halfsphere", "--seconds", 1.2, "--imu", "ideal", "--imu-rate", 400, "--truth")
        readings = np.loadtxt(out / "imu.csv", delimiter=",", skiprows=1)
        true = np.loadtxt(out / "imu_true.csv", delimiter=",", skiprows=1)
        camera = np.loadtxt(out / "groundtruth.txt")
        self.assertTrue(np.array_equal(readings[:, 0], true[:, 0]))
        self.assertLess(readings[0, 0] * 1e-9, camera[0, 0])
        self.assertGreater(readings[-1, 0] * 1e-9, camera[-1, 0])
        T_camera_imu = place_of_imu(out)
        first = int(np.argmin(abs(readings[:, 0] * 1e-9 - camera[0, 0])))
        start = pose_of(camera[0, 1:]) @ T_camera_imu
        R, p, v = start[:3, :3], start[:3, 3], true[first, 8:11]
        rows, worst_m, worst_rad = {round(row[0], 4): row for row in camera}, 0, 0
        for a, b in zip(readings[first:], readings[first + 1:]):
            dt = (b[0] - a[0]) * 1e-9
            R_next = R @ turned(dt * (a[1:4] + b[1:4]) / 2)
            acceleration = (R @ a[4:7] + R_next @ b[4:7]) / 2 + GRAVITY
            p, v, R = p + dt * v + dt * dt / 2 * acceleration, v + dt * acceleration, R_next
            row = rows.get(round(b[0] * 1e-9, 4))
            if row is not None:
                seen = pose_of(row[1:]) @ T_camera_imu
                worst_m = max(worst_m, np.linalg.norm(seen[:3, 3] - p))
                worst_rad = max(worst_rad, np.linalg.norm(seen[:3, :3].T @ R - np.eye(3)) / np.sqrt(2))
        self.assertLess(worst_m, 5e-4)
        self.assertLess(worst_rad, 1e-4)

    def test_options_reach_the_readings_and_one_seed_repeats(self):
        options = ("--seconds", 0.2, "--imu", "BMI055")
        plain = np.loadtxt(self.simulate("walking_rpy", *options) / "imu.csv", delimiter=",", skiprows=1)
        again = np.loadtxt(self.simulate("walking_rpy", *options, out="again") / "imu.csv", delimiter=",", skiprows=1)
        late = np.loadtxt(self.simulate("walking_rpy", *options, "--imu-offset-ms", 12.5) / "imu.csv",
                          delimiter=",", skiprows=1)
        raw = np.loadtxt(self.simulate("walking_rpy", *options, "--imu-uncalibrated") / "imu.csv",
                         delimiter=",", skiprows=1)
        self.assertTrue(np.array_equal(plain, again))
        self.assertTrue(np.array_equal(late[:, 1:], plain[:, 1:]))
        self.assertTrue(np.all(late[:, 0] - plain[:, 0] == 12_500_000))
        self.assertGreater(np.linalg.norm(np.mean(raw - plain, axis=0)[4:]), 0.1)  # 70 mg in place of 7
        self.assertEqual(json.loads((self.folder / "world" / "simulation.json").read_text(encoding="utf-8"))["imu"],
                         "BMI055")

    def test_wheels_tell_the_way_of_a_robot(self):
        out = self.simulate("robot_rounds", "--seconds", 12, "--fps", 5, "--wheels")
        odom, camera = np.loadtxt(out / "odom.csv"), np.loadtxt(out / "groundtruth.txt")
        words = (out / "odom.csv").read_text(encoding="utf-8").splitlines()[1].split()
        self.assertEqual(words[1], "T_base_camera:")
        T_base_camera = pose_of([float(word) for word in words[2:]])
        self.assertAlmostEqual(T_base_camera[2, 3], 0.9, 5)
        T_world_odom = pose_of(camera[0, 1:]) @ np.linalg.inv(T_base_camera)
        worst = 0
        for row in camera:
            told = odom[np.argmin(abs(odom[:, 0] - row[0]))]
            worst = max(worst, np.linalg.norm((T_world_odom @ pose_of(told[1:]) @ T_base_camera)[:3, 3] - row[1:4]))
        self.assertLess(worst, 0.25)
        self.assertGreater(worst, 0.001)
        done = ygslam("eval", "--gt", out / "groundtruth.txt", "--est", out / "odom.csv", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_hand_on_wheels_gives_a_warning(self):
        done = ygslam("simulate", "walking_xyz", "--out", self.folder / "hand", *SMALL[:-1], "--seconds", 2,
                      "--wheels")
        self.assertEqual(done.returncode, 0)
        self.assertIn("moves sideways", done.stderr)

    def test_readings_of_an_earlier_rendering_do_not_stay(self):
        out = self.simulate("static_xyz", "--seconds", 0.1, "--imu", "BMI085", "--wheels", "--truth")
        self.assertTrue((out / "imu.csv").exists())
        self.simulate("static_xyz", "--seconds", 0.1)
        for name in ("imu.csv", "imu.yaml", "imu_true.csv", "odom.csv", "odom.yaml"):
            self.assertFalse((out / name).exists(), name)

    def test_a_recording_holds_what_the_files_hold(self):
        file = self.folder / "robot.mcap"
        out = self.simulate("robot_rounds", "--seconds", 3, "--fps", 5, "--imu", "BMI085", "--wheels", "--mcap", file)
        readings = np.loadtxt(out / "imu.csv", delimiter=",", skiprows=1)
        odom, camera = np.loadtxt(out / "odom.csv"), np.loadtxt(out / "groundtruth.txt")
        with AnyReader([file]) as bag:
            told = {connection.topic: connection.msgtype for connection in bag.connections}
            self.assertEqual((told["/imu"], told["/wheel_odometry"]),
                             ("sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"))
            said = {topic: [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages()
                            if c.topic == topic] for topic in ("/imu", "/wheel_odometry", "/tf_static")}
        self.assertEqual({t.child_frame_id for t in said["/tf_static"][0].transforms}, {"imu", "base_link"})
        rows = [[m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, m.angular_velocity.x, m.angular_velocity.y,
                 m.angular_velocity.z, m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z]
                for m in said["/imu"]]
        self.assertTrue(np.array_equal(np.array(rows), readings))
        self.assertEqual(len(said["/wheel_odometry"]), len(odom))
        self.assertAlmostEqual(said["/wheel_odometry"][-1].pose.pose.position.x, odom[-1, 1], 6)
        self.assertEqual(len(camera), 15)
        done = ygslam("run", file, "--out", self.folder / "run", "--segmenter", "none", "--deterministic", "--quiet")
        self.assertIn(done.returncode, (0, 7), done.stderr)  # images are tiny: it may be lost

    def test_what_makes_no_sense_is_refused(self):
        out = ("--out", self.folder / "none")
        for options, word in ((("--imu", "BMI999", *out), "BMI055"), (("--imu-rate", 100, *out), "--imu"),
                              (("--imu", "ideal", "--imu-rate", 1, *out), "--imu-rate"),
                              (("--wheel-slips", 3, *out), "--wheels"), (("--imu", "ideal", "--poses", "-", *out), "--poses"),
                              (("--imu", "ideal", "--random", 3, *out), "--random")):
            done = ygslam("simulate", *(() if "--random" in options else ("static_xyz",)), *options)
            self.assertEqual(done.returncode, 2, options)
            self.assertIn(word, done.stderr)
        self.assertFalse((self.folder / "none").exists())


if __name__ == "__main__":
    unittest.main()
