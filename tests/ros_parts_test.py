"""What the node of ROS 2 computes, without ROS: frames, covariances, pairs, static transforms, settings, images.

    PYTHONPATH=build/release/python python tests/ros_parts_test.py
"""
import struct
import subprocess
import sys
import types
import unittest

import numpy as np
import ygslam
from rosbags.typesys import Stores, get_typestore
from ygslam.ros import frames, imu, moving_objects, settings, static_tree, sync, wheels, wire

from bags import Messages, png_bytes
from ygslam_cli import BINARY


def result(T_odom_camera=None, covariance=None, T_world_odom=None):
    T_odom_camera = np.eye(4) if T_odom_camera is None else T_odom_camera
    T_world_odom = np.eye(4) if T_world_odom is None else T_world_odom
    covariance = np.eye(6) if covariance is None else covariance
    return types.SimpleNamespace(T_odom_camera=T_odom_camera, T_world_odom=T_world_odom, pose=T_world_odom @ T_odom_camera,
                                 covariance=covariance, map_covariance=covariance, seen_covariance=covariance)


def image(t_ns):
    return sync.Image(t_ns, "camera", "sensor_msgs/msg/Image", b"")


class WheelMessages(unittest.TestCase):
    def test_stamp_frame_and_pose_are_read_wherever_they_lie(self):
        def text(word):
            return struct.pack("<I", len(word) + 1) + word.encode() + b"\0"

        for frame, child in (("odom", "base_link"), ("o", "b"), ("odometry", "base"), ("odo", "base_footprint")):
            data = b"\0\1\0\0" + struct.pack("<iI", 12, 34) + text(frame)
            data += b"\0" * (-(len(data) - 4) % 4) + text(child)
            data += b"\0" * (-(len(data) - 4) % 8)
            whole = data + struct.pack("<7d", 1, 2, 3, 0, 0, 0.6, 0.8)
            self.assertEqual(wheels.pose_of(whole), (12_000_000_034, child, (1, 2, 3, 0, 0, 0.6, 0.8)))
            for cut in (len(whole) - 1, len(data) - 9, 10):
                with self.assertRaises(ValueError):
                    wheels.pose_of(whole[:cut])


class FramesOfRos(unittest.TestCase):
    mount = frames.from_roll_pitch_yaw(0.2, 0, 1.0, 0, 0.3, 0) @ frames.T_BODY_OPTICAL

    def test_optical_axes(self):
        forward = frames.T_BODY_OPTICAL @ [0, 0, 1, 0]
        np.testing.assert_allclose(forward[:3], [1, 0, 0])
        np.testing.assert_allclose((frames.T_BODY_OPTICAL @ [0, 1, 0, 0])[:3], [0, 0, -1])  # down

    def test_base_starts_at_odom_and_moves_as_the_camera(self):
        at_first = frames.poses_of(result(), self.mount, self.mount)
        np.testing.assert_allclose(at_first.T_odom_base, np.eye(4), atol=1e-12)
        np.testing.assert_allclose(at_first.T_map_odom, np.eye(4), atol=1e-12)
        moved = np.array(frames.inverse(self.mount) @ frames.from_roll_pitch_yaw(0.5, 0.1, 0, 0, 0, 0.4) @ self.mount)
        poses = frames.poses_of(result(moved), self.mount, self.mount)
        np.testing.assert_allclose(poses.T_odom_base, frames.from_roll_pitch_yaw(0.5, 0.1, 0, 0, 0, 0.4), atol=1e-12)
        np.testing.assert_allclose(poses.T_map_base, poses.T_map_odom @ poses.T_odom_base, atol=1e-12)

    def test_quaternions_and_rotation_vectors_come_back(self):
        random = np.random.default_rng(1)
        for angles in [*random.uniform(-np.pi, np.pi, (50, 3)), (np.pi, 0, 0), (0, 0, np.pi), (0, 0, 0)]:
            pose = frames.from_roll_pitch_yaw(1, 2, 3, *angles)
            np.testing.assert_allclose(frames.matrix((1, 2, 3), frames.quaternion(pose)), pose, atol=1e-12)
        np.testing.assert_allclose(frames.rotation_vector(frames.from_roll_pitch_yaw(0, 0, 0, 0, 0, -2.5)),
                                   [0, 0, -2.5], atol=1e-12)

    def test_a_covariance_moves_with_its_point(self):
        """Against the scatter of many noisy poses."""
        random = np.random.default_rng(2)
        covariance = np.diag([1, 4, 9, 0.5, 0.2, 0.3]) * 1e-6
        T_odom_camera = frames.from_roll_pitch_yaw(1, 2, 3, 0.3, -0.2, 0.9)
        said = frames.poses_of(result(T_odom_camera, covariance), self.mount, self.mount)
        rows = []
        for noise in random.multivariate_normal(np.zeros(6), covariance, 4000):
            noisy = T_odom_camera.copy()
            noisy[:3, :3] = frames.from_roll_pitch_yaw(0, 0, 0, *noise[3:])[:3, :3] @ noisy[:3, :3]
            noisy[:3, 3] += noise[:3]
            at = frames.poses_of(result(noisy), self.mount, self.mount).T_odom_base
            rows.append([*(at[:3, 3] - said.T_odom_base[:3, 3]),
                         *frames.rotation_vector(at @ frames.inverse(said.T_odom_base))])
        np.testing.assert_allclose(np.cov(np.transpose(rows)), said.covariance, atol=8e-7)
        np.testing.assert_allclose(said.map_covariance, said.covariance, atol=1e-12)  # map is odom here

    def test_what_is_unknown_stays_large_and_nothing_is_0(self):
        lost = frames.poses_of(result(covariance=1e6 * np.eye(6)), self.mount, self.mount)
        np.testing.assert_array_equal(lost.covariance, 1e6 * np.eye(6))
        first = frames.poses_of(result(covariance=np.zeros((6, 6))), self.mount, self.mount)
        self.assertTrue((np.linalg.eigvalsh(first.covariance) > 0).all())


class Pairs(unittest.TestCase):
    def setUp(self):
        self.pairs = []
        self.pairing = sync.Pairing(20_000_000, lambda c, d: self.pairs.append((c.t_ns, d.t_ns)), most=5)

    def add(self, side, *milliseconds):
        for at in milliseconds:
            self.pairing.add(side, image(at * 10**6))

    def expect(self, *milliseconds):
        self.assertEqual(self.pairs, [(c * 10**6, d * 10**6) for c, d in milliseconds])

    def test_nearest_within_reach_each_once(self):
        self.add("depth", 1000, 1033, 1066)
        self.add("colour", 1030, 1070, 1120)
        self.expect((1030, 1033), (1070, 1066))
        self.assertEqual(self.pairing.left_alone, 1)  # 1000 came too late for another

    def test_a_late_side(self):
        self.add("colour", 1000, 1033)
        self.add("depth", 1003, 1036)
        self.expect((1000, 1003), (1033, 1036))

    def test_a_clock_that_was_set_back_begins_anew(self):
        self.add("colour", 5000)
        self.add("colour", 1000)
        self.add("depth", 1001, 5001)
        self.expect((1000, 1001))

    def test_one_side_alone_does_not_grow(self):
        self.add("colour", *range(1000, 9000, 33))
        self.assertEqual(len(self.pairing._waiting["colour"]), 5)
        self.assertGreater(self.pairing.left_alone, 200)


class Parts(unittest.TestCase):
    def test_static_transforms_over_a_common_ancestor(self):
        tree = static_tree.StaticTree()
        step = frames.from_roll_pitch_yaw(1, 0, 0, 0, 0, np.pi / 2)
        tree.add("base", "mast", step)
        tree.add("mast", "/camera", step)
        tree.add("base", "laser", step)
        np.testing.assert_allclose(tree.transform("base", "camera"), step @ step)
        np.testing.assert_allclose(tree.transform("laser", "camera"), step, atol=1e-12)
        np.testing.assert_allclose(tree.transform("/base", "/camera"), step @ step, err_msg="as older drivers write it")
        self.assertIsNone(tree.transform("base", "elsewhere"))
        tree.add("camera", "base", step)  # a ring ends
        self.assertIsNone(tree.transform("base", "elsewhere"))

    def test_headers(self):
        messages = Messages()
        info = messages.info(12 * 10**9 + 5, (1, 1, 1, 1), (4, 3))
        data = bytes(get_typestore(Stores.ROS2_HUMBLE).serialize_cdr(info, "sensor_msgs/msg/CameraInfo"))
        self.assertEqual(wire.header(data)[:2], (12 * 10**9 + 5, "camera"))
        for cut in range(0, 22):
            with self.assertRaises(ValueError):
                wire.header(data[:cut])

    def test_settings_have_defaults_and_ranges(self):
        said = {s.key: s for s in settings.parsed(subprocess.run([BINARY, "config"], capture_output=True, text=True,
                                                                 check=True).stdout)}
        self.assertGreater(len(said), 35)
        self.assertEqual(said["orb.features"][1:2] + said["orb.features"][3:], (1000, 50.0, 10000.0))
        self.assertEqual(said["dynamic.mode"].default, "full")
        self.assertIn("[px]", said["motion.tau_px"].meaning)

    def test_people_stand_on_the_floor(self):
        item = types.SimpleNamespace(id=3, class_name="person", missing_frames=0, centre_world_m=[0, 0.5, 2],
                                      velocity_world_mps=[0, 0, 1], min_world_m=[-0.2, 0, 1.8],
                                      max_world_m=[0.2, 1, 2.2], body_velocity_world_mps=[0, 0, 1],
                                      after=lambda s: ([0, 0.5, 2.1 + s], np.diag([0.01, 0.02, 0.03 + s])))
        T_map_world = frames.from_roll_pitch_yaw(0, 0, 1.4, 0, 0, 0) @ frames.T_BODY_OPTICAL
        [seen] = moving_objects.observed([item], T_map_world)
        np.testing.assert_allclose(seen.position_m, [2.1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(seen.soon_m, [3.1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(np.diag(seen.covariance_m2), [0.03, 0.01, 0.02], atol=1e-12)
        np.testing.assert_allclose(np.diag(seen.soon_covariance_m2), [1.03, 0.01, 0.02], atol=1e-12)
        np.testing.assert_allclose(seen.velocity_mps, [1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(seen.size_m, [0.4, 0.4, 1])
        item.missing_frames = 30
        self.assertFalse(moving_objects.observed([item], T_map_world)[0].is_visible)

    def test_nothing_of_it_is_imported_with_the_package(self):
        subprocess.run([sys.executable, "-c", "import sys, ygslam; assert 'ygslam.ros' not in sys.modules"], check=True)


class Readings(unittest.TestCase):
    def test_of_an_imu(self):
        types_of = get_typestore(Stores.ROS2_JAZZY).types
        make = lambda name, **how: types_of[name](**how)  # noqa: E731
        vector = lambda *v: make("geometry_msgs/msg/Vector3", x=v[0], y=v[1], z=v[2])  # noqa: E731
        for frame in ("i", "imu_link", "camera_imu_optical_frame"):  # of any length: what follows is aligned
            message = make(
                "sensor_msgs/msg/Imu", angular_velocity=vector(.1, .2, .3), linear_acceleration=vector(4, 5, 6),
                header=make("std_msgs/msg/Header", frame_id=frame,
                            stamp=make("builtin_interfaces/msg/Time", sec=7, nanosec=8)),
                orientation=make("geometry_msgs/msg/Quaternion", x=0, y=0, z=0, w=1),
                orientation_covariance=np.arange(9.0), angular_velocity_covariance=np.arange(9.0),
                linear_acceleration_covariance=np.arange(9.0))
            data = bytes(get_typestore(Stores.ROS2_JAZZY).serialize_cdr(message, "sensor_msgs/msg/Imu"))
            self.assertEqual(imu.reading_of(data), (7 * 10**9 + 8, frame, [.1, .2, .3], [4, 5, 6]))
            for end in (0, 3, 20, len(data) - 8):
                with self.assertRaises(ValueError):
                    imu.reading_of(data[:end])


class Images(unittest.TestCase):
    def setUp(self):
        self.messages = Messages()
        self.camera = (50.0, 50.0, 31.5, 23.5)
        self.images = ygslam._core.RosImages(self.cdr(self.messages.info(0, self.camera, (64, 48))))

    def cdr(self, message):
        return bytes(self.messages.store.serialize_cdr(message, message.__msgtype__))

    def test_colour_and_depth(self):
        rgb = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
        depth_mm = np.full((48, 64), 1500, np.uint16)
        said = self.images.colour("sensor_msgs/msg/Image", self.cdr(self.messages.image(0, "rgb8", rgb)))
        np.testing.assert_array_equal(said, rgb)
        said = self.images.colour("sensor_msgs/msg/CompressedImage",
                                  self.cdr(self.messages.compressed(0, "png", png_bytes(rgb))))
        np.testing.assert_array_equal(said, rgb)
        said = self.images.depth("sensor_msgs/msg/Image", self.cdr(self.messages.image(0, "16UC1", depth_mm)))
        np.testing.assert_allclose(said, 1.5)
        self.assertEqual((self.images.camera.width, self.images.camera.fx), (64, 50.0))

    def test_depth_of_another_camera_is_moved(self):
        info = self.cdr(self.messages.info(0, (25.0, 25.0, 15.5, 11.5), (32, 24)))
        images = ygslam._core.RosImages(self.cdr(self.messages.info(0, self.camera, (64, 48))), info,
                                        (0, 0, 0.5, 0, 0, 0, 1))
        far = self.cdr(self.messages.image(0, "16UC1", np.full((24, 32), 1500, np.uint16)))
        said = images.depth("sensor_msgs/msg/Image", far)
        self.assertEqual(said.shape, (48, 64))
        np.testing.assert_allclose(said[24, 32], 2.0)

    def test_what_cannot_be_used_is_an_error_in_one_line(self):
        for call in (lambda: self.images.colour("sensor_msgs/msg/Image", b""),
                     lambda: self.images.colour("sensor_msgs/msg/PointCloud2", b""),
                     lambda: self.images.depth("sensor_msgs/msg/Image", self.cdr(
                         self.messages.image(0, "16UC1", np.zeros((4, 4), np.uint16)))),
                     lambda: ygslam._core.RosImages(b"\0\1\0\0")):
            with self.assertRaisesRegex(ygslam.InputError, r"^[^\n]+$"):
                call()


if __name__ == "__main__":
    unittest.main()
