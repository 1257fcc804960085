"""How many poses the node of ROS 2 loses, and how much later they come than from the library alone.

    PYTHONPATH=build/release/python YGSLAM_BINARY=build/release/ygslam \
        python bench/ros_node.py SEQUENCE --ros kilted --seconds 600

A process beside the node publishes the sequence, forth and back, and hears the poses. Then the same frames go to the
library in this process, at the same rate. Added latency: from the call that publishes the second image to the
arrival of the pose, less the library's process(); medians.
"""
import argparse
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "tests"))
import ros_harness  # noqa: E402


def of_node(frames, count, rate, qos, queue_size):
    """@return poses lost, milliseconds from image to pose, what the node counted."""
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseWithCovarianceStamped
    ears = ros_harness.Ears()
    node = ros_harness.NodeProcess(queue_size=queue_size)
    try:
        ears.listen(PoseWithCovarianceStamped, "/ygslam/pose")
        ears.listen(DiagnosticArray, "/ygslam/status")
        camera = ros_harness.Camera(ears, frames, qos).ready()
        stamps = camera.stream(count, rate=rate)
        end = time.monotonic() + 10
        while len(ears.messages("/ygslam/pose")) < count and time.monotonic() < end:
            time.sleep(0.1)
        time.sleep(1)  # for the last status
        said = {value.key: value.value for value in ears.messages("/ygslam/status")[-1].status[0].values}
        heard = {ros_harness.stamp_of(message): at for at, message in ears.heard["/ygslam/pose"]}
        return (len(set(stamps) - set(heard)),
                [(at - camera.sent[stamp]) * 1e3 for stamp, at in heard.items() if stamp in camera.sent],
                {key: int(said[key]) for key in ("frames", "dropped", "refused", "unpaired")})
    finally:
        code, told, _ = node.end()
        ears.close()
        print(f"node: exit code {code} {told}".strip(), file=sys.stderr)


def of_library(frames, count, rate):
    import ygslam
    began, taken = time.perf_counter(), []
    with ygslam.Slam(frames.camera, segmenter="none", keep_trajectory=False) as slam:
        for i in range(count):
            rgb, depth_mm = frames[i]
            time.sleep(max(0.0, began + i / rate - time.perf_counter()))
            start = time.perf_counter()
            slam.process(rgb, depth_mm, 10**15 + round(i / rate * 1e9), depth_scale=1000.0)
            taken.append((time.perf_counter() - start) * 1e3)
    return taken


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence")
    parser.add_argument("--ros", default="kilted", choices=("kilted", "jazzy"))
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--rate", type=float, default=30)
    parser.add_argument("--queue-size", type=int, default=10)
    parser.add_argument("--best-effort", action="store_true")
    options = parser.parse_args()
    ros_harness.run_in_ros(options.ros)
    import numpy as np
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT if options.best_effort
                     else ReliabilityPolicy.RELIABLE)
    frames = ros_harness.Frames(options.sequence)
    for i in range(len(frames)):
        frames[i]  # decoded beforehand
    count = round(options.seconds * options.rate)
    lost, latencies, counts = of_node(frames, count, options.rate, qos, options.queue_size)
    library = of_library(frames, min(count, 600), options.rate)
    print(json.dumps({"frames": count, "lost": lost, "node": counts, "image_to_pose_ms": round(float(np.median(latencies)), 2),
                      "library_ms": round(float(np.median(library)), 2),
                      "added_ms": round(float(np.median(latencies) - np.median(library)), 2),
                      "p10_ms": [round(float(np.percentile(x, 10)), 2) for x in (latencies, library)]}))


if __name__ == "__main__":
    main()
