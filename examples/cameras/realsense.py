"""An Intel RealSense, live: `python realsense.py [MODEL.onnx]`, Ctrl-C ends. Needs pyrealsense2.

Tried against a stand-in of the same interface only (tests/camera_examples_test.py), not with a camera.
"""
import sys

import numpy as np
import pyrealsense2 as rs
import ygslam


def main(model=""):
    config, pipeline = rs.config(), rs.pipeline()
    config.enable_stream(rs.stream.color, 640, 480, rs.format.rgb8, 30)
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    k = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
    metres = profile.get_device().first_depth_sensor().get_depth_scale()
    camera = ygslam.CameraModel(k.fx, k.fy, k.ppx, k.ppy, k.width, k.height)
    align = rs.align(rs.stream.color)  # depth as the colour camera would see it
    slam, last_ns = ygslam.Slam(camera, model=model), 0
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
        ygslam.write_trajectory("trajectory.txt", slam.finish().trajectory)
        pipeline.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
