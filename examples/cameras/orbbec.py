"""An Orbbec camera, live: `python orbbec.py [MODEL.onnx]`, Ctrl-C ends. Needs pyorbbecsdk2.

Tried against a stand-in of the same interface only (tests/camera_examples_test.py), not with a camera.
"""
import sys

import numpy as np
import pyorbbecsdk as ob
import ygslam


def main(model=""):
    config, pipeline = ob.Config(), ob.Pipeline()
    profile = pipeline.get_stream_profile_list(ob.OBSensorType.COLOR_SENSOR).get_video_stream_profile(
        640, 480, ob.OBFormat.RGB, 30)
    config.enable_stream(profile)
    config.enable_stream(pipeline.get_stream_profile_list(ob.OBSensorType.DEPTH_SENSOR)
                         .get_default_video_stream_profile())
    config.set_frame_aggregate_output_mode(ob.OBFrameAggregateOutputMode.FULL_FRAME_REQUIRE)
    pipeline.enable_frame_sync()
    pipeline.start(config)
    k = profile.get_intrinsic()
    align = ob.AlignFilter(ob.OBStreamType.COLOR_STREAM)  # depth as the colour camera would see it
    slam = ygslam.Slam(ygslam.CameraModel(k.fx, k.fy, k.cx, k.cy, k.width, k.height), model=model)
    try:
        while True:
            frames = pipeline.wait_for_frames(1000)  # ms
            aligned = align.process(frames) if frames else None
            if not aligned:
                continue
            frames = aligned.as_frame_set()
            colour, depth = frames.get_color_frame(), frames.get_depth_frame()
            rgb = colour.get_data().reshape(colour.get_height(), colour.get_width(), 3)
            raw = depth.get_data().view(np.uint16).reshape(depth.get_height(), depth.get_width())
            result = slam.process(rgb, raw, 1000 * colour.get_timestamp_us(),
                                  depth_scale=1000 / depth.get_depth_scale())  # which is in mm
            print(result.state.name, result.pose[:3, 3].round(3), f"{len(result.objects)} objects")
    except KeyboardInterrupt:
        pass
    finally:
        ygslam.write_trajectory("trajectory.txt", slam.finish().trajectory)
        pipeline.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
