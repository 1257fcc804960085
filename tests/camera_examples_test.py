"""The camera examples against stand-ins of their makers' modules, which play a rendered sequence.

    PYTHONPATH=build/release/python python tests/camera_examples_test.py
"""
import ast
import datetime
import os
import runpy
import sys
import types
import unittest
from unittest import mock

import numpy as np
import ygslam

from ygslam_cli import ROOT, CliTest, sequence, trajectory

FRAMES = 10
SERIAL = "841512070383"


# Of a rendered sequence's imu.yaml: x of the sensor looks ahead.
T_CAMERA_IMU = np.array([[0, -1, 0, 0.02], [0, 0, -1, -0.006], [1, 0, 0, -0.012], [0, 0, 0, 1]])


def force_at(t_ns):
    """Of a camera that gains speed ever faster: halfway between two readings it is their mean."""
    t_s = t_ns * 1e-9 - 1000  # from about where a rendered sequence begins
    return 0.2 * t_s, -0.1 * t_s, 9.8 + 0.05 * t_s


def motion_frames(t_from_ns, t_to_ns):
    """A gyroscope at 200 Hz, an accelerometer at 100 Hz 1.25 ms later, as halves."""
    step_ns = 5_000_000
    for step in range(-(-t_from_ns // step_ns), -(-t_to_ns // step_ns)):
        for stream, every, late_ns in (("gyro", 1, 0), ("accel", 2, 1_250_000)):
            t_ns = step * step_ns + late_ns
            v = (0, 0, 0) if stream == "gyro" else force_at(t_ns)
            if step % every == 0:
                data = types.SimpleNamespace(x=v[0], y=v[1], z=v[2])
                yield mock.Mock(
                    get_timestamp=lambda t_ns=t_ns: t_ns * 1e-6,
                    as_motion_frame=lambda data=data: mock.Mock(get_motion_data=lambda: data),
                    get_profile=lambda stream=stream: mock.Mock(stream_type=lambda: stream))


def realsense(frames, has_imu=False):
    """pyrealsense2 as far as the example uses it."""
    module, units = types.ModuleType("pyrealsense2"), 0.0002
    module.stream = types.SimpleNamespace(color="color", depth="depth", gyro="gyro", accel="accel")
    module.format = types.SimpleNamespace(rgb8="rgb8", z16="z16")
    module.camera_info = types.SimpleNamespace(serial_number="serial number")
    module.config = lambda: mock.Mock(spec=["enable_stream", "enable_device"])
    module.align = lambda to: types.SimpleNamespace(process=lambda pair: pair)
    some = list(frames)[:FRAMES]
    camera, left = frames.camera, iter(some[:3] + some[2:])  # one comes twice, as they do
    intrinsics = types.SimpleNamespace(fx=camera.fx, fy=camera.fy, ppx=camera.cx, ppy=camera.cy,
                                       width=camera.width, height=camera.height)
    profile = mock.Mock()
    profile.get_stream.return_value.as_video_stream_profile.return_value.get_intrinsics \
        .return_value = intrinsics
    profile.get_device.return_value.first_depth_sensor.return_value.get_depth_scale \
        .return_value = units
    profile.get_device.return_value.sensors = [types.SimpleNamespace(is_motion_sensor=lambda: kind)
                                               for kind in (False, has_imu)]
    profile.get_device.return_value.get_info = {"serial number": SERIAL}.get
    gyro = profile.get_stream.return_value
    gyro.fps.return_value = 200
    gyro.get_extrinsics_to.return_value = types.SimpleNamespace(
        rotation=list(T_CAMERA_IMU[:3, :3].T.ravel()), translation=list(T_CAMERA_IMU[:3, 3]))
    hears = []  # who hears of the IMU

    class Pipeline:
        last_ns = some[0].t_ns - 100_000_000

        def start(self, config, hear=None):
            if hear:
                config.enable_device.assert_called_once_with(SERIAL)  # not that of another camera
                hears.append(hear)
            return profile

        def stop(self):
            pass

        def wait_for_frames(self):
            frame = next(left, None)
            if frame is None:
                raise KeyboardInterrupt
            for reading in motion_frames(self.last_ns, frame.t_ns):
                for hear in hears:
                    hear(reading)
            self.last_ns = frame.t_ns
            raw = np.round(frame.depth / units).astype(np.uint16)
            colour = mock.Mock(get_data=lambda: frame.rgb, get_timestamp=lambda: frame.t_ns * 1e-6)
            return mock.Mock(get_color_frame=lambda: colour,
                             get_depth_frame=lambda: mock.Mock(get_data=lambda: raw))
    module.pipeline = Pipeline
    return module


def record3d(frames):
    """record3d as far as the example uses it; depth in a quarter of the size."""
    module, camera, left = types.ModuleType("record3d"), frames.camera, list(frames)[:FRAMES]

    class Stream:
        @staticmethod
        def get_connected_devices():
            return ["phone"]

        def connect(self, device):
            self.at = -1
            self.on_new_frame()

        def get_rgb_frame(self):
            self.at += 1
            if self.at == len(left):
                raise KeyboardInterrupt
            self.on_new_frame()  # the next one
            return left[self.at].rgb

        def get_depth_frame(self):
            return left[self.at].depth[::4, ::4]

        def get_intrinsic_mat(self):
            return types.SimpleNamespace(fx=camera.fx, fy=camera.fy, tx=camera.cx, ty=camera.cy)
    module.Record3DStream = Stream
    return module


def orbbec(frames):
    """pyorbbecsdk as far as the example uses it (2.1): images come as rows of bytes."""
    module, camera, left = types.ModuleType("pyorbbecsdk"), frames.camera, iter(list(frames)[:FRAMES])
    mm = 0.25  # a unit of depth
    module.OBSensorType = types.SimpleNamespace(COLOR_SENSOR=1, DEPTH_SENSOR=2)
    module.OBFormat = types.SimpleNamespace(RGB=22)
    module.OBStreamType = types.SimpleNamespace(COLOR_STREAM=2)
    module.OBFrameAggregateOutputMode = types.SimpleNamespace(FULL_FRAME_REQUIRE=0)
    module.Config = lambda: mock.Mock(spec=["enable_stream", "set_frame_aggregate_output_mode"])
    profile = mock.Mock(spec=["get_intrinsic"])
    profile.get_intrinsic.return_value = types.SimpleNamespace(
        fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy, width=camera.width, height=camera.height)

    def image(data, t_ns, **more):
        return types.SimpleNamespace(get_data=lambda: np.frombuffer(data.tobytes(), np.uint8),
                                     get_height=lambda: data.shape[0], get_width=lambda: data.shape[1],
                                     get_timestamp_us=lambda: t_ns // 1000, **more)

    class Pipeline:
        waits = 0

        def get_stream_profile_list(self, sensor):
            return types.SimpleNamespace(get_video_stream_profile=lambda *wanted: profile,
                                         get_default_video_stream_profile=lambda: None)

        def enable_frame_sync(self):
            pass

        def start(self, config):
            pass

        def stop(self):
            pass

        def wait_for_frames(self, timeout_ms):
            self.waits += 1
            if self.waits == 2:
                return None  # in vain, as happens
            frame = next(left, None)
            if frame is None:
                raise KeyboardInterrupt
            raw = np.round(1000 / mm * frame.depth).astype(np.uint16)
            return types.SimpleNamespace(
                get_color_frame=lambda: image(frame.rgb, frame.t_ns),
                get_depth_frame=lambda: image(raw, frame.t_ns, get_depth_scale=lambda: mm))
    module.Pipeline = Pipeline
    module.AlignFilter = lambda stream: types.SimpleNamespace(
        process=lambda pair: types.SimpleNamespace(as_frame_set=lambda: pair))
    return module


def oak(frames):
    """depthai as far as the example uses it (3.12)."""
    module, camera, left = types.ModuleType("depthai"), frames.camera, iter(list(frames)[:FRAMES])
    module.CameraBoardSocket = types.SimpleNamespace(CAM_A=0, CAM_B=1, CAM_C=2)
    module.ImgFrame = types.SimpleNamespace(Type=types.SimpleNamespace(RGB888i=1))
    module.Platform = types.SimpleNamespace(RVC2=1, RVC4=2)
    module.node = types.SimpleNamespace(Camera="Camera", StereoDepth="StereoDepth", Sync="Sync")
    matrix = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]

    def image(frame, data):
        return types.SimpleNamespace(
            getFrame=lambda: data, getWidth=lambda: data.shape[1], getHeight=lambda: data.shape[0],
            getTimestampDevice=lambda: datetime.timedelta(microseconds=frame.t_ns // 1000),
            getTransformation=lambda: types.SimpleNamespace(getIntrinsicMatrix=lambda: matrix))

    def next_pair():
        frame = next(left, None)
        if frame is None:
            raise KeyboardInterrupt
        return {"rgb": image(frame, frame.rgb),
                "depth": image(frame, np.round(1000 * frame.depth).astype(np.uint16))}

    class Pipeline:
        def __enter__(self):
            return self

        def __exit__(self, *error):
            pass

        def create(self, node):
            made = mock.MagicMock(name=node)
            made.build.return_value = made
            made.out.createOutputQueue.return_value.get = next_pair
            return made

        def getDefaultDevice(self):  # noqa: N802 - its own names
            return types.SimpleNamespace(getPlatform=lambda: module.Platform.RVC2)

        def start(self):
            pass

        def isRunning(self):  # noqa: N802
            return True
    module.Pipeline = Pipeline
    return module


class Cameras(CliTest):
    def play(self, name, module):
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)
        example = ROOT / "examples" / "cameras" / f"{name}.py"
        with mock.patch.dict(sys.modules, {module.__name__: module}):
            runpy.run_path(str(example))["main"]()
        self.assertEqual(len(trajectory(self.folder / "trajectory.txt")), FRAMES)

    def test_realsense(self):
        self.play("realsense", realsense(ygslam.open(sequence())))

    def test_a_realsense_with_an_imu(self):
        slams = []

        class Slam(ygslam.Slam):
            def __init__(self, *arguments, imu=None, **more):
                super().__init__(*arguments, imu=imu, **more)
                slams.append(self)
                self.imu, self.pushed = imu, []

            def push_imu(self, t_ns, gyro, accel):
                self.pushed.append((t_ns, *gyro, *accel))
                super().push_imu(t_ns, gyro, accel)
        with mock.patch.object(ygslam, "Slam", Slam):
            self.play("realsense", realsense(ygslam.open(sequence()), has_imu=True))
        (slam,) = slams
        np.testing.assert_allclose(slam.imu.T_camera_imu, T_CAMERA_IMU, atol=1e-6)
        stamps = [reading[0] for reading in slam.pushed]
        self.assertGreater(len(stamps), 20)
        self.assertEqual(set(np.diff(stamps)), {5_000_000}, "each of the gyroscope's, in their order")
        said = np.array([reading[1:] for reading in slam.pushed])
        np.testing.assert_array_equal(said[:, :3], 0)
        np.testing.assert_allclose(said[:, 3:], [force_at(t_ns) for t_ns in stamps], atol=1e-6)

    def test_orbbec(self):
        self.play("orbbec", orbbec(ygslam.open(sequence())))

    def test_oak(self):
        self.play("oak", oak(ygslam.open(sequence())))

    def test_record3d(self):
        self.play("iphone", record3d(ygslam.open(sequence())))

    def test_no_example_has_the_name_of_a_module_that_it_imports(self):
        """Python would find the example itself first, which the stand-ins above do not show."""
        for example in (ROOT / "examples" / "cameras").glob("*.py"):
            nodes = list(ast.walk(ast.parse(example.read_text(encoding="utf-8"))))
            modules = {alias.name.split(".")[0] for node in nodes if isinstance(node, ast.Import) for alias in node.names}
            modules |= {node.module.split(".")[0] for node in nodes if isinstance(node, ast.ImportFrom)}
            with self.subTest(example.name):
                self.assertIn("ygslam", modules)
                self.assertNotIn(example.stem, modules)


if __name__ == "__main__":
    unittest.main()
