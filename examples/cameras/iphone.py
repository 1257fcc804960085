"""An iPhone or iPad by cable, with the app Record3D: `python iphone.py [MODEL.onnx]`, Ctrl-C ends.

Needs the package record3d. Tried against a stand-in of the same interface only
(tests/camera_examples_test.py), not with a phone.
"""
import sys
import threading
import time

import numpy as np
import ygslam
from record3d import Record3DStream


def main(model=""):
    session, arrived = Record3DStream(), threading.Event()
    session.on_new_frame = arrived.set
    session.on_stream_stopped = lambda: print("the phone stopped sending")
    devices = Record3DStream.get_connected_devices()
    if not devices:
        sys.exit("no phone is connected by cable, or Record3D does not stream by USB")
    session.connect(devices[0])
    slam = None
    try:
        while arrived.wait(5):
            arrived.clear()
            rgb, depth_m = session.get_rgb_frame(), session.get_depth_frame()
            if slam is None:
                k, (height, width) = session.get_intrinsic_mat(), rgb.shape[:2]
                slam = ygslam.Slam(ygslam.CameraModel(k.fx, k.fy, k.tx, k.ty, width, height),
                                   model=model)
            # Depth has fewer pixels: each colour pixel takes the nearest.
            rows = np.arange(rgb.shape[0]) * depth_m.shape[0] // rgb.shape[0]
            columns = np.arange(rgb.shape[1]) * depth_m.shape[1] // rgb.shape[1]
            depth = np.ascontiguousarray(depth_m[np.ix_(rows, columns)], dtype=np.float32)
            result = slam.process(np.ascontiguousarray(rgb[..., :3]), depth, time.monotonic_ns())
            print(result.state.name, result.pose[:3, 3].round(3), f"{len(result.objects)} objects")
    except KeyboardInterrupt:
        pass
    finally:
        if slam:
            ygslam.write_trajectory("trajectory.txt", slam.finish().trajectory)


if __name__ == "__main__":
    main(*sys.argv[1:])
