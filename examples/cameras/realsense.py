"""An Intel RealSense, live: `python realsense.py [MODEL.onnx]`, Ctrl-C ends. Needs pyrealsense2, and ygslam
(`pip install .`). The IMU of a D435i or D455 is used: where nothing can be seen the pose goes on.

Tried against a stand-in of the same interface only (tests/camera_examples_test.py), not with a camera.
"""
import sys
import threading

import numpy as np
import pyrealsense2 as rs
import ygslam


class Imu:
    """Gyroscope and accelerometer, which tell apart from each other: forces are interpolated."""

    def __init__(self, profile, colour):
        gyro = profile.get_stream(rs.stream.gyro)
        place = gyro.get_extrinsics_to(colour)
        T_camera_imu = np.eye(4)
        T_camera_imu[:3, :3] = np.reshape(place.rotation, (3, 3)).T  # told by columns
        T_camera_imu[:3, 3] = place.translation
        self.calibration = ygslam.Imu(T_camera_imu, rate_hz=gyro.fps())
        self.turns, self.force, self.slam = [], None, None
        self.lock = threading.Lock()  # each of the two may tell in a thread of its own

    def take(self, frame):
        """In a thread of the camera's."""
        with self.lock:
            self.take_one(frame)

    def take_one(self, frame):
        v = frame.as_motion_frame().get_motion_data()
        now = frame.get_timestamp(), np.array([v.x, v.y, v.z])
        if frame.get_profile().stream_type() == rs.stream.gyro:
            self.turns = [*self.turns[-1000:], now]
            return
        before, self.force = self.force, now
        for t, turn in self.turns:
            if before and self.slam and before[0] <= t < now[0]:
                share = (t - before[0]) / (now[0] - before[0])
                self.slam.push_imu(round(1e6 * t), turn, (1 - share) * before[1] + share * now[1])
        self.turns = [turn for turn in self.turns if turn[0] >= now[0]]


def start_imu(pipeline, device, colour):
    """None: it has none."""
    if not any(sensor.is_motion_sensor() for sensor in device.sensors):
        return None
    config, waiting = rs.config(), []
    config.enable_device(device.get_info(rs.camera_info.serial_number))  # of several the same
    config.enable_stream(rs.stream.gyro)
    config.enable_stream(rs.stream.accel)
    profile = pipeline.start(config, lambda frame: waiting[0].take(frame) if waiting else None)
    waiting.append(Imu(profile, colour))
    return waiting[0]


def main(model=""):
    config, pipeline = rs.config(), rs.pipeline()
    config.enable_stream(rs.stream.color, 640, 480, rs.format.rgb8, 30)
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    k = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
    motion = rs.pipeline()
    imu = start_imu(motion, profile.get_device(), profile.get_stream(rs.stream.color))
    metres = profile.get_device().first_depth_sensor().get_depth_scale()
    camera = ygslam.CameraModel(k.fx, k.fy, k.ppx, k.ppy, k.width, k.height)
    align = rs.align(rs.stream.color)  # depth as the colour camera would see it
    slam, last_ns = ygslam.Slam(camera, model=model, imu=imu.calibration if imu else None), 0
    if imu:
        imu.slam = slam
    try:
        while True:
            frames = align.process(pipeline.wait_for_frames())
            colour, depth = frames.get_color_frame(), frames.get_depth_frame()
            if not colour or not depth:
                continue
            t_ns = round(1e6 * colour.get_timestamp())
            if t_ns <= last_ns:  # the same image again
                continue
            last_ns = t_ns
            result = slam.process(np.asarray(colour.get_data()), np.asarray(depth.get_data()), t_ns,
                                  depth_scale=1 / metres)
            print(result.state.name, result.pose[:3, 3].round(3), f"{len(result.objects)} objects")
    except KeyboardInterrupt:
        pass
    finally:
        if imu:
            motion.stop()
        ygslam.write_trajectory("trajectory.txt", slam.finish().trajectory)
        pipeline.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
