"""A Luxonis OAK-D, live: `python oak.py [MODEL.onnx]`, Ctrl-C ends. Needs depthai 3.

Tried against a stand-in of the same interface only (tests/camera_examples_test.py), not with a camera.
"""
import sys
from datetime import timedelta

import depthai as dai
import ygslam


def main(model=""):
    slam, socket = None, dai.CameraBoardSocket
    with dai.Pipeline() as pipeline:
        def output(of, size, kind=None, **how):
            return pipeline.create(dai.node.Camera).build(of).requestOutput(size, kind, fps=30, **how)
        rgb = output(socket.CAM_A, (640, 480), dai.ImgFrame.Type.RGB888i, enableUndistortion=True)
        stereo = pipeline.create(dai.node.StereoDepth).build(output(socket.CAM_B, (640, 400)),
                                                             output(socket.CAM_C, (640, 400)))
        depth = stereo.depth
        if pipeline.getDefaultDevice().getPlatform() == dai.Platform.RVC4:  # aligns in a node of its own
            align = pipeline.create(dai.node.ImageAlign)
            depth.link(align.input)
            rgb.link(align.inputAlignTo)
            depth = align.outputAligned
        else:
            rgb.link(stereo.inputAlignTo)
        sync = pipeline.create(dai.node.Sync)
        sync.setSyncThreshold(timedelta(milliseconds=16))
        rgb.link(sync.inputs["rgb"])
        depth.link(sync.inputs["depth"])
        pairs = sync.out.createOutputQueue()
        pipeline.start()
        try:
            while pipeline.isRunning():
                pair = pairs.get()
                colour, mm = pair["rgb"], pair["depth"].getFrame()
                if slam is None:
                    (fx, _, cx), (_, fy, cy), _ = colour.getTransformation().getIntrinsicMatrix()
                    size = colour.getWidth(), colour.getHeight()
                    slam = ygslam.Slam(ygslam.CameraModel(fx, fy, cx, cy, *size), model=model)
                t_ns = 1000 * (colour.getTimestampDevice() // timedelta(microseconds=1))
                result = slam.process(colour.getFrame(), mm, t_ns, depth_scale=1000)
                print(result.state.name, result.pose[:3, 3].round(3), f"{len(result.objects)} objects")
        except KeyboardInterrupt:
            pass
        finally:
            if slam:
                ygslam.write_trajectory("trajectory.txt", slam.finish().trajectory)


if __name__ == "__main__":
    main(*sys.argv[1:])
