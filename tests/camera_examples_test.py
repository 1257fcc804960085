"""The camera examples against stand-ins of their makers' modules, which play a rendered sequence.

    PYTHONPATH=build/release/python python tests/camera_examples_test.py
"""
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


def realsense(frames):
    """pyrealsense2 as far as the example uses it."""
    module, units = types.ModuleType("pyrealsense2"), 0.0002
    module.stream = types.SimpleNamespace(color="color", depth="depth")
    module.format = types.SimpleNamespace(rgb8="rgb8", z16="z16")
    module.config = lambda: mock.Mock(spec=["enable_stream"])
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

    class Pipeline:
        def start(self, config):
            return profile

        def stop(self):
            pass

        def wait_for_frames(self):
            frame = next(left, None)
            if frame is None:
                raise KeyboardInterrupt
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

    def test_record3d(self):
        self.play("record3d", record3d(ygslam.open(sequence())))


if __name__ == "__main__":
    unittest.main()
