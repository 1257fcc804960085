"""The node with ROS 2's own rclpy on the other side.

    PYTHONPATH=build/release/python python tests/ros_node_test.py --ros kilted      # or jazzy

Skipped where that distribution is not installed (`tools/setup.sh ros`).
"""
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import ros_harness

if "--ros" in sys.argv:
    at = sys.argv.index("--ros")
    ros_harness.run_in_ros(sys.argv[at + 1], large_images="LargeImages" in sys.argv)
    del sys.argv[at:at + 2]

import numpy as np  # noqa: E402 - in the environment that has rclpy
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped  # noqa: E402
from nav_msgs.msg import OccupancyGrid, Odometry, Path  # noqa: E402
from people_msgs.msg import People  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import CompressedImage, PointCloud2  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from vision_msgs.msg import Detection3DArray  # noqa: E402
from visualization_msgs.msg import Marker  # noqa: E402

from foxglove_layout import topics_of  # noqa: E402
from ros_harness import Camera, Ears, Frames, NodeProcess, header_of, image_of, info_of, stamp_of  # noqa: E402

SEQUENCE = os.environ["YGSLAM_SEQUENCE"]
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TF_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"  # of recorded Jazzy bags
PACKAGE = """
import os, ament_index_python.packages as index
share = index.get_package_share_directory("ygslam_ros_py")
print(index.get_package_prefix("ygslam_ros_py"), *os.listdir(share + "/launch"), os.path.exists(share + "/package.xml"))
"""
COUNT = 40  # frames of a short test
RATE = 10.0  # [Hz]: other tests run beside these; the long one keeps 30


class RosTest(unittest.TestCase):
    frames = Frames(SEQUENCE)

    def setUp(self):
        self.ears = Ears()
        self.addCleanup(self.ears.close)

    def node(self, remap=(), **how):
        node = NodeProcess(remap, **how)
        self.addCleanup(lambda: node.process.poll() is None and node.end())
        return node

    def camera(self, qos=10, **how):
        return Camera(self.ears, self.frames, qos, **how).ready()

    def listen(self, **topics):
        for topic, kind in topics.items():
            self.ears.listen(kind, f"/ygslam/{topic}")

    def stream(self, camera, count=COUNT, **how):
        return camera.stream(count, rate=RATE, **how)

    def wait_for_poses(self, stamps, topic="/ygslam/pose"):
        """A message of each stamp. The first frame may be without."""
        heard = self.ears.wait(topic, lambda said: set(stamps) <= set(map(stamp_of, said)))
        return [message for message in heard if stamp_of(message) in set(stamps)]


def wait_for_status(ears, text):
    return ears.wait("/ygslam/status", lambda said: said and text in said[-1].status[0].message)[-1]


class Images(RosTest):
    def check_all(self, qos):
        self.listen(pose=PoseWithCovarianceStamped, odometry=Odometry)
        self.node()
        stamps = self.stream(self.camera(qos))
        poses = self.wait_for_poses(stamps)
        self.wait_for_poses(stamps, "/ygslam/odometry")
        self.assertEqual([stamp_of(m) for m in poses], stamps)

    def test_a_reliable_camera_loses_no_pose(self):
        self.check_all(10)

    def test_a_best_effort_camera_loses_no_pose(self):
        self.check_all(BEST_EFFORT)

    def test_compressed_images(self):
        import bags
        self.listen(pose=PoseWithCovarianceStamped)
        self.node(colour_transport="compressed", depth_transport="compressedDepth")
        camera = self.camera_of_infos("rgb/camera_info")
        colour = self.ears.node.create_publisher(CompressedImage, "rgb/image/compressed", 10)
        depth = self.ears.node.create_publisher(CompressedImage, "depth/image/compressedDepth", 10)
        self.ears.wait_for_reader(colour, depth, camera)
        time.sleep(1.5)
        stamps = []
        for i in range(COUNT):
            rgb, depth_mm = self.frames[i]
            stamps.append(10**15 + i * 10**8)
            camera.publish(info_of(stamps[-1], self.frames.camera))
            depth.publish(CompressedImage(header=header_of(stamps[-1], "camera_optical"),
                                          format="16UC1; compressedDepth png",
                                          data=bytes(12) + bags.png_bytes(depth_mm)))
            colour.publish(CompressedImage(header=header_of(stamps[-1], "camera_optical"),
                                           format="rgb8; png compressed", data=bags.png_bytes(rgb)))
            time.sleep(1 / RATE)
        self.wait_for_poses(stamps)

    def camera_of_infos(self, topic):
        from sensor_msgs.msg import CameraInfo
        return self.ears.node.create_publisher(CameraInfo, topic, 10)

    def test_depth_of_a_camera_of_its_own(self):
        """Half the size, its place told by /tf_static, as that of the colour camera."""
        self.listen(odometry=Odometry, pose=PoseWithCovarianceStamped)
        tf = self.ears.node.create_publisher(TFMessage, "/tf_static", KEPT)
        tf.publish(TFMessage(transforms=[static("base_link", "camera_optical", optical=True),
                                         static("camera_optical", "depth_optical")]))
        self.node(camera_pose="", depth_registered=False)
        info = self.camera_of_infos("depth/camera_info")
        camera = self.camera()
        stamps, before = [], self.frames
        for i in range(COUNT):
            rgb, depth_mm = before[i]
            stamps.append(10**15 + i * 10**8)
            info.publish(info_of(stamps[-1], before.camera, "depth_optical", 0.5))
            camera.publishers[2].publish(info_of(stamps[-1], before.camera))
            camera.publishers[1].publish(image_of(stamps[-1], "16UC1", np.ascontiguousarray(depth_mm[::2, ::2]),
                                                  "depth_optical"))
            camera.publishers[0].publish(image_of(stamps[-1], "rgb8", rgb))
            time.sleep(1 / RATE)
        self.wait_for_poses(stamps)
        said = self.wait_for_poses(stamps, "/ygslam/odometry")
        truth = np.loadtxt(pathlib.Path(SEQUENCE) / "groundtruth.txt")
        at = said[-1].pose.pose.position
        self.assertAlmostEqual(np.linalg.norm([at.x, at.y, at.z]),
                               np.linalg.norm(truth[COUNT - 1, 1:4] - truth[0, 1:4]), delta=0.1)


class LargeImages(RosTest):
    """640 x 480, with the shared memory that docs/ros.md asks for: run alone."""

    def setUp(self):
        super().setUp()
        if os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST":
            self.skipTest("to be run by its name: large images need settings of the whole process")

    def large(self):
        frames = Frames(SEQUENCE)
        camera = frames.camera
        camera = type("Twice", (), {"fx": 2 * camera.fx, "fy": 2 * camera.fy, "cx": 2 * camera.cx + 0.5,
                                    "cy": 2 * camera.cy + 0.5, "width": 2 * camera.width,
                                    "height": 2 * camera.height})
        twice = type("Twice", (), {"camera": camera, "__getitem__": lambda _, i: [
            np.ascontiguousarray(image.repeat(2, 0).repeat(2, 1)) for image in frames[i]]})()
        self.assertEqual((twice.camera.width, twice.camera.height), (640, 480))
        return twice

    def check_all(self, qos):
        self.listen(odometry=Odometry)
        self.node()
        stamps = Camera(self.ears, self.large(), qos).ready().stream(COUNT, rate=RATE)
        self.wait_for_poses(stamps, "/ygslam/odometry")

    def test_best_effort_loses_no_pose(self):
        self.check_all(BEST_EFFORT)

    def test_reliable_loses_no_pose(self):
        self.check_all(10)


def static(parent, child, xyz=(0.0, 0.0, 0.0), optical=False):
    message = TransformStamped(header=header_of(0, parent), child_frame_id=child)
    message.transform.translation.x, message.transform.translation.y, message.transform.translation.z = xyz
    if optical:
        q = message.transform.rotation
        q.x, q.y, q.z, q.w = -0.5, 0.5, -0.5, 0.5
    return message


class Frames105(RosTest):
    def test_one_chain_from_map_to_base_with_the_images_stamps(self):
        self.ears.listen(TFMessage, "/tf")
        self.listen(odometry=Odometry)
        tf = self.ears.node.create_publisher(TFMessage, "/tf_static", KEPT)
        tf.publish(TFMessage(transforms=[static("base_link", "mast", (0.2, 0.0, 1.0)),
                                         static("mast", "camera_optical", optical=True)]))
        self.node(camera_pose="")
        stamps = self.stream(self.camera())
        self.wait_for_poses(stamps, "/ygslam/odometry")
        said = self.ears.wait("/tf", lambda all_of: len(all_of) >= len(stamps))
        for message in said:
            self.assertEqual([(t.header.frame_id, t.child_frame_id) for t in message.transforms],
                             [("map", "odom"), ("odom", "base_link")])
        self.assertEqual({t.header.stamp.sec * 10**9 + t.header.stamp.nanosec for m in said for t in m.transforms},
                         set(stamps))
        first = said[0].transforms[1].transform.translation
        self.assertLess(np.linalg.norm([first.x, first.y, first.z]), 1e-6)  # odom is where base was
        [info] = self.ears.node.get_publishers_info_by_topic("/tf")
        self.assertEqual(str(info.topic_type_hash), TF_HASH)

    def test_base_moves_as_the_camera_does(self):
        self.listen(odometry=Odometry)
        self.node()
        self.wait_for_poses(self.stream(self.camera()), "/ygslam/odometry")
        said = self.ears.messages("/ygslam/odometry")
        truth = np.loadtxt(pathlib.Path(SEQUENCE) / "groundtruth.txt")
        travelled = np.linalg.norm(truth[COUNT - 1, 1:4] - truth[0, 1:4])
        at = said[-1].pose.pose.position
        self.assertAlmostEqual(np.linalg.norm([at.x, at.y, at.z]), travelled, delta=0.1)
        covariance = np.array(said[-1].pose.covariance).reshape(6, 6)
        self.assertTrue((np.linalg.eigvalsh(covariance) > 0).all())
        self.assertLess(covariance[0, 0], 0.01)

    def test_a_second_parent_of_base_ends_ours(self):
        self.listen(status=DiagnosticArray)
        self.ears.listen(TFMessage, "/tf")
        node = self.node()
        camera = self.camera()
        self.stream(camera, 10)
        other = self.ears.node.create_publisher(TFMessage, "/tf", 10)
        self.ears.wait_for_reader(other)
        other.publish(TFMessage(transforms=[static("wheels", "base_link")]))
        wait_for_status(self.ears, "two parents")
        before = len(self.ears.messages("/tf"))
        self.stream(camera, 5, start_ns=10**15 + 10**10, first=10)
        time.sleep(0.5)
        self.assertEqual(len(self.ears.messages("/tf")), before)
        self.assertIn("has the parent wheels", node.end()[1])

    def test_a_camera_without_a_place_is_told(self):
        self.listen(status=DiagnosticArray)
        self.node(camera_pose="")
        self.stream(self.camera(), 10)
        wait_for_status(self.ears, "no static transform from base_link to camera_optical")


class Outputs(RosTest):
    def test_map_cloud_mesh_and_path(self):
        """To one who comes late, too."""
        self.listen(status=DiagnosticArray)
        self.ears.listen(OccupancyGrid, "/ygslam/map", KEPT)
        self.ears.listen(PointCloud2, "/ygslam/cloud", KEPT)
        self.ears.listen(Marker, "/ygslam/mesh", KEPT)
        self.ears.listen(Path, "/ygslam/path", KEPT)
        self.node(map_period_s=0.5)
        camera = self.camera()
        self.stream(camera, 60)
        grid = self.ears.wait("/ygslam/map", lambda said: said and 0 in said[-1].data)[-1]
        self.assertEqual(len(grid.data), grid.info.width * grid.info.height)
        self.assertLessEqual(set(grid.data), {-1, 0, 100})
        self.assertEqual(grid.header.frame_id, "map")
        self.assertAlmostEqual(grid.info.resolution, 0.05)
        late = Ears()
        self.addCleanup(late.close)
        late.listen(OccupancyGrid, "/ygslam/map", KEPT)
        late.wait("/ygslam/map", len)
        cloud = self.ears.wait("/ygslam/cloud", lambda said: said and said[-1].width > 1000)[-1]
        z = np.frombuffer(bytes(cloud.data), np.float32).reshape(-1, 4)[:, 2]
        self.assertGreater(np.mean(np.abs(z) < 0.05), 0.02)  # the floor is at 0
        mesh = self.ears.wait("/ygslam/mesh", lambda said: said and said[-1].points)[-1]
        self.assertEqual((len(mesh.points) % 3, len(mesh.colors)), (0, len(mesh.points)))
        self.assertEqual((mesh.ns, mesh.type, mesh.color.a), ("mesh", Marker.TRIANGLE_LIST, 1.0))
        self.assertGreater(len(self.ears.wait("/ygslam/path", len)[-1].poses), 2)
        there = {topic for topic, _ in self.ears.node.get_topic_names_and_types()}
        self.assertLessEqual(topics_of("ros"), there, "the layout for Foxglove")

    def test_who_comes_first_when_the_camera_has_stopped_hears_the_map(self):
        self.listen(pose=PoseWithCovarianceStamped)
        self.node(map_period_s=0.5)
        self.wait_for_poses(self.stream(self.camera(), 60))
        time.sleep(1.5)  # what is made of the last frame is made
        for topic, kind in (("map", OccupancyGrid), ("cloud", PointCloud2)):
            self.ears.listen(kind, f"/ygslam/{topic}", KEPT)
            self.ears.wait(f"/ygslam/{topic}", len)

    def test_the_plan_follows_the_keyframes_above_a_floor_that_is_given(self):
        """Long before the rest of the map is due, and in the frame of /tf."""
        self.listen(status=DiagnosticArray)
        self.ears.listen(OccupancyGrid, "/ygslam/map", KEPT)
        self.ears.listen(TFMessage, "/tf", 100)
        self.node(floor_at_base=True, map_high_m=0.6, map_period_s=3600.0)
        self.stream(self.camera(), 60)
        grids = self.ears.wait("/ygslam/map", lambda said: len({stamp_of(m) for m in said}) > 1)
        self.assertIn(100, grids[-1].data)
        last = [t for m in self.ears.wait("/tf", len) for t in m.transforms if t.header.frame_id == "map"][-1]
        self.assertAlmostEqual(last.transform.translation.z, 0, delta=0.2)  # drift between map and odom

    def test_people_and_objects(self):
        self.listen(people=People, objects=Detection3DArray)
        self.node(segmenter="builtin")
        self.stream(self.camera(), 60)
        person = self.ears.wait("/ygslam/people", lambda said: any(m.people for m in said))
        person = next(m for m in person if m.people).people[0]
        self.assertEqual(person.position.z, 0.0)
        found = self.ears.wait("/ygslam/objects", lambda said: any(m.detections for m in said))
        found = next(m for m in found if m.detections).detections[0]
        self.assertEqual(found.results[0].hypothesis.class_id, "person")
        self.assertGreater(found.results[0].pose.covariance[0], 0)
        self.assertEqual(found.results[0].pose.covariance[35], 1e6)


class Losses(RosTest):
    def test_images_without_a_like_are_told(self):
        """Stamps farther apart than slop_ms, as those of a camera that is not set up to trigger both together."""
        self.listen(status=DiagnosticArray)
        self.node()
        self.camera(lag_ns=25_000_000).stream(100, rate=20)
        wait_for_status(self.ears, "without the other one")
        values = {v.key: v.value for v in self.ears.messages("/ygslam/status")[-1].status[0].values}
        self.assertEqual(values["frames"], "0")
        self.assertGreater(int(values["depth_received"]), 60)


class Services(RosTest):
    def test_save_load_localise_reset_pause(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "room.map"
            self.listen(pose=PoseWithCovarianceStamped, status=DiagnosticArray)
            self.node(map_file=str(path))
            camera = self.camera()
            self.wait_for_poses(self.stream(camera))
            self.assertTrue(self.ears.call(Trigger, "/ygslam/save_map").success)
            self.assertGreater(path.stat().st_size, 1000)
            for i, (kind, name, request) in enumerate([(Trigger, "load_map", {}), (SetBool, "localise", {"data": True}),
                                                       (Trigger, "reset", {})], 1):
                answer = self.ears.call(kind, f"/ygslam/{name}", **request)
                self.assertTrue(answer.success, answer.message)
                stamps = self.stream(camera, start_ns=10**15 + i * 10**11)
                self.wait_for_poses(stamps[-5:])  # found again in the map
            self.assertTrue(self.ears.call(SetBool, "/ygslam/pause", data=True).success)
            wait_for_status(self.ears, "paused")
            before = len(self.ears.messages("/ygslam/pose"))
            self.stream(camera, 5, start_ns=10**15 + 5 * 10**11)
            time.sleep(0.5)
            self.assertEqual(len(self.ears.messages("/ygslam/pose")), before)

    def test_a_map_that_is_not_there(self):
        self.node(map_file="/nowhere/room.map")
        self.stream(self.camera(), 5)
        answer = self.ears.call(Trigger, "/ygslam/load_map")
        self.assertFalse(answer.success)
        self.assertIn("/nowhere/room.map", answer.message)


class Clocks(RosTest):
    def test_a_camera_that_starts_again(self):
        self.listen(pose=PoseWithCovarianceStamped)
        self.node()
        camera = self.camera()
        self.wait_for_poses(self.stream(camera))
        camera.close()
        again = self.camera(BEST_EFFORT)  # even of the other kind
        self.wait_for_poses(self.stream(again, start_ns=10**15 + 10**10, first=COUNT - 1))

    def test_a_clock_that_is_set_back(self):
        self.listen(pose=PoseWithCovarianceStamped)
        self.node()
        camera = self.camera()
        self.wait_for_poses(self.stream(camera))
        stamps = self.stream(camera, start_ns=10**14, first=COUNT - 1)
        self.wait_for_poses(stamps[5:])  # the fifth frame that agrees is believed

    def test_simulated_time(self):
        """Status has the time of /clock, and comes while that stands still."""
        self.listen(status=DiagnosticArray, pose=PoseWithCovarianceStamped)
        self.node(use_sim_time=True)
        clock = self.ears.node.create_publisher(Clock, "/clock", 10)
        self.ears.wait_for_reader(clock)
        for _ in range(10):  # what is sent before a reader is found is lost
            clock.publish(Clock(clock=header_of(5 * 10**9, "").stamp))
            time.sleep(0.1)
        self.ears.wait("/ygslam/status", lambda said: sum(stamp_of(m) == 5 * 10**9 for m in said) >= 2)
        self.wait_for_poses(self.stream(self.camera(), 10, start_ns=5 * 10**9))


class Bags(RosTest):
    def test_a_bag_of_rosbag2_that_is_played(self):
        import bags
        from rosbags.highlevel import AnyReader
        from sensor_msgs.msg import CameraInfo, Image
        camera = self.frames.camera
        with tempfile.TemporaryDirectory() as folder:
            said = bags.recording(bags.Messages(), [
                bags.Frame(10**15 + i * 10**8, *self.frames[i]) for i in range(COUNT)],
                (camera.fx, camera.fy, camera.cx, camera.cy))
            from rosbags.rosbag2 import StoragePlugin
            path = bags.write_ros2(pathlib.Path(folder) / "bag", said, StoragePlugin.SQLITE3)
            self.listen(pose=PoseWithCovarianceStamped)
            self.node([f"rgb/image:={bags.RGB}", f"depth/image:={bags.DEPTH}", f"rgb/camera_info:={bags.INFO}"])
            publishers = {bags.RGB: Image, bags.DEPTH: Image, bags.INFO: CameraInfo}
            publishers = {topic: self.ears.node.create_publisher(kind, topic, 10) for topic, kind in publishers.items()}
            self.ears.wait_for_reader(*publishers.values())
            time.sleep(1.5)
            with AnyReader([path]) as reader:
                for connection, _, data in reader.messages():
                    publishers[connection.topic].publish(bytes(data))
                    time.sleep(0.03)
            self.wait_for_poses([10**15 + i * 10**8 for i in range(COUNT)])


class Inertial(RosTest):
    """The lens is covered from 3 s to 4 s."""

    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.recording = pathlib.Path(folder.name) / "covered"
        subprocess.run([os.environ["YGSLAM_BINARY"], "--quiet", "simulate", "walking_xyz", "--without", "people",
                        "--out", self.recording, "--seconds", "5", "--fps", "20", "--size", "320x240", "--imu", "BMI085",
                        "--fault", "both:black@3s+1s", "--fault", "depth:empty@3s+1s"], check=True)

    def drive(self, **how):
        """Publishes the recording with its readings. @return states of the poses in the dark."""
        from geometry_msgs.msg import Vector3
        from sensor_msgs.msg import Imu
        self.frames = Frames(self.recording)
        self.listen(odometry=Odometry, pose=PoseWithCovarianceStamped)
        self.node(**how)
        readings = np.loadtxt(self.recording / "imu.csv", delimiter=",", skiprows=1)
        start_ns = round(1e9 * float((self.recording / "associations.txt").read_text().split()[0]))
        sensor = self.ears.node.create_publisher(Imu, "imu", 200)
        camera = self.camera()
        if how:
            self.ears.wait_for_reader(sensor)
        stamps, at = [], 0
        for i in range(len(self.frames)):
            stamps.append(start_ns + i * 50_000_000)
            while at < len(readings) and readings[at, 0] < stamps[-1] + 10_000_000:
                t_ns, *values = readings[at]
                rate, force = (Vector3(x=v[0], y=v[1], z=v[2]) for v in (values[:3], values[3:]))
                sensor.publish(Imu(header=header_of(int(t_ns), "imu_link"), angular_velocity=rate,
                                   linear_acceleration=force))
                at += 1
            camera.send(i, stamps[-1])
            time.sleep(1 / RATE)
        heard = self.ears.wait("/ygslam/odometry", lambda said: stamps[-1] in map(stamp_of, said))
        return [m.pose.covariance[0] for m in heard if stamp_of(m) in set(stamps[62:79])]

    def check_goes_on(self, **how):
        variances = self.drive(**how)
        self.assertGreater(len(variances), 10)
        self.assertLess(max(variances), 0.01, "m2: known on, not 1e6 as of a lost camera")
        self.assertEqual(variances, sorted(variances))

    def test_the_pose_goes_on_in_the_dark(self):
        self.check_goes_on(imu=str(self.recording / "imu.yaml"))

    def test_tf_tells_where_it_is(self):
        line = next(text for text in (self.recording / "imu.yaml").read_text().splitlines() if "T_camera_imu" in text)
        x, y, z, qx, qy, qz, qw = (float(word) for word in line.split("[")[1].split("]")[0].split(","))
        place = TransformStamped(header=header_of(0, "camera_optical"), child_frame_id="imu_link")
        for part, values in ((place.transform.translation, (x, y, z)), (place.transform.rotation, (qx, qy, qz, qw))):
            for name, value in zip("xyzw", values):
                setattr(part, name, value)
        static = self.ears.node.create_publisher(TFMessage, "/tf_static", KEPT)
        static.publish(TFMessage(transforms=[place]))
        self.check_goes_on(imu="tf")

    def test_without_it_nothing_is_known(self):
        self.assertGreater(min(self.drive()), 1e5)


class Ends(RosTest):
    def test_signals_end_it_with_0(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            node = self.node()
            camera = self.camera()
            self.stream(camera, 10)
            code, said, seconds = node.end(number)
            self.assertEqual(code, 0, said)
            self.assertNotRegex(said, r"(?i)error|traceback")
            self.assertLess(seconds, 20)
            camera.close()

    def test_wrong_parameters_are_told_in_one_line(self):
        for parameters, code, part in (({"camera_pose": "1 2"}, 3, "camera_pose"),
                                       ({"queue_size": 0}, 3, "queue_size"), ({"queue_size": "many"}, 3, "queue_size"),
                                       ({"reliability": "some"}, 3, "reliability")):
            node = self.node(**parameters)
            node.process.wait(ros_harness.PATIENCE_S)
            ended, said, _ = node.end()
            self.assertEqual(ended, code, said)
            self.assertRegex(said, rf"^error: .*{part}.*\n$")

    def test_a_setting_that_the_library_refuses(self):
        node = self.node(load_map="/nowhere/room.map")
        self.stream(self.camera(), 5)
        node.process.wait(ros_harness.PATIENCE_S)
        ended, said, _ = node.end()
        self.assertEqual(ended, 6, said)
        self.assertRegex(said, r"(?m)^error: .*/nowhere/room.map")


class Workspace(RosTest):
    def test_colcon_builds_the_package_whose_node_runs(self):
        """As docs/ros.md has it: linked into a workspace. `ros2 run` starts the same file; the launch file is not run."""
        if not importlib.util.find_spec("colcon_core"):
            self.skipTest("no colcon in this environment (tools/setup.sh ros)")
        scratch = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (scratch / "src").mkdir()
        (scratch / "src" / "ygslam_ros_py").symlink_to(ros_harness.ROOT / "ros2" / "python")
        built = subprocess.run([sys.executable, "-m", "colcon", "--log-base", "log", "build"], cwd=scratch, text=True,
                               capture_output=True)
        self.assertEqual(built.returncode, 0, built.stdout + built.stderr)
        sourced = f'. "{scratch}/install/setup.bash"; exec "$@"'
        there = subprocess.run(["bash", "-c", sourced, "-", sys.executable, "-c", PACKAGE], check=True, text=True,
                               capture_output=True).stdout.split()
        self.assertEqual(there, [str(scratch / "install" / "ygslam_ros_py"), "ygslam.launch.py", "True"])
        self.listen(pose=PoseWithCovarianceStamped)
        program = scratch / "install" / "ygslam_ros_py" / "lib" / "ygslam_ros_py" / "ygslam"
        self.node(command=["bash", "-c", sourced, "-", program])
        self.wait_for_poses(self.stream(self.camera(), 10))


class Long(RosTest):
    def test_a_minute_at_30_hz_loses_no_pose(self):
        """However late on a loaded machine: nothing makes room here."""
        self.listen(odometry=Odometry)
        self.node(queue_size=1000)
        stamps = self.camera(100).stream(1800)
        self.wait_for_poses(stamps, "/ygslam/odometry")


if __name__ == "__main__":
    unittest.main()
