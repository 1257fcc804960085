"""How many poses the node of ROS 2 loses, and how much later they come than from the library alone.

    PYTHONPATH=build/release/python YGSLAM_BINARY=build/release/ygslam \
        python bench/ros_node.py SEQUENCE --ros kilted --seconds 600

A process beside the node publishes the sequence, forth and back, as bytes made beforehand (a driver in C++ takes no
time for that), and hears the poses. The same images then go to a node that answers each pair at once: what ROS 2
itself takes on both ways. Then the same frames go to the library in this process, at the same rate. Milliseconds from
the call that publishes the second image to the arrival of the pose; medians. Where images are lost: before the node
(`colour_received`, `depth_received`), without a partner (`unpaired`), in its queue (`dropped`), unusable (`refused`).
Without --large-images Fast DDS has its defaults: half a megabyte of shared memory (docs/ros.md, Large images).
"""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "tests"))
import ros_harness  # noqa: E402


LAG_NS = 3_000_000  # of depth's stamps


def camera_of_bytes(ears, frames, qos):
    """A ros_harness.Camera whose images are serialised once; the stamp alone is written anew (bytes 4 to 11)."""
    from rclpy.serialization import serialize_message

    class Driver(ros_harness.Camera):
        def __init__(self):
            super().__init__(ears, frames, qos, lag_ns=LAG_NS)
            self._bytes = {}

        def _serialised(self, i, kind, make, t_ns):
            if (i, kind) not in self._bytes:
                self._bytes[i, kind] = bytearray(serialize_message(make()))
            data = self._bytes[i, kind]
            struct.pack_into("<iI", data, 4, t_ns // 10**9, t_ns % 10**9)
            return bytes(data)

        def send(self, i, t_ns):
            count = 2 * len(self.frames) - 2
            rgb, depth_mm = self.frames[i]
            colour, depth, info = self.publishers
            info.publish(ros_harness.info_of(t_ns, self.frames.camera, self.frame))
            depth.publish(self._serialised(i % count, "depth", lambda: ros_harness.image_of(
                0, "16UC1", depth_mm, self.frame), t_ns + self.lag_ns))
            data = self._serialised(i % count, "colour", lambda: ros_harness.image_of(0, "rgb8", rgb, self.frame), t_ns)
            self.sent[t_ns] = time.perf_counter()
            colour.publish(data)

    driver = Driver()
    for i in range(2 * len(frames) - 2):
        driver._serialised(i, "depth", lambda: ros_harness.image_of(0, "16UC1", frames[i][1], driver.frame), 0)
        driver._serialised(i, "colour", lambda: ros_harness.image_of(0, "rgb8", frames[i][0], driver.frame), 0)
    return driver


def echo():
    """A node that answers each pair of images with a pose of the colour image's stamp, and does nothing else."""
    import rclpy
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from rclpy.signals import SignalHandlerOptions
    from sensor_msgs.msg import CameraInfo, Image
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("echo")
    poses = node.create_publisher(PoseWithCovarianceStamped, "/ygslam/pose", 100)

    waiting = {"colour": {}, "depth": {}}

    def take_image(side, data):
        seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
        pair = seconds * 10**9 + nanoseconds - (LAG_NS if side == "depth" else 0)
        waiting[side][pair] = seconds, nanoseconds
        if any(pair not in stamps for stamps in waiting.values()):
            return
        message = PoseWithCovarianceStamped()
        message.header.stamp.sec, message.header.stamp.nanosec = waiting["colour"].pop(pair)
        waiting["depth"].pop(pair)
        poses.publish(message)

    qos = QoSProfile(depth=60, reliability=ReliabilityPolicy[os.environ["ECHO_RELIABILITY"]])
    for kind, topic, take in ((Image, "rgb/image", lambda data: take_image("colour", data)),
                              (Image, "depth/image", lambda data: take_image("depth", data)),
                              (CameraInfo, "rgb/camera_info", lambda data: None)):
        node.create_subscription(kind, topic, take, qos, raw=True)
    rclpy.spin(node)


def of_echo(frames, count, rate, qos):
    """@return milliseconds from image to answer."""
    from geometry_msgs.msg import PoseWithCovarianceStamped
    ears = ros_harness.Ears()
    node = subprocess.Popen([sys.executable, __file__, "--echo"],
                            env={**os.environ, "ECHO_RELIABILITY": qos.reliability.name})
    try:
        ears.listen(PoseWithCovarianceStamped, "/ygslam/pose")
        camera = camera_of_bytes(ears, frames, qos).ready()
        camera.stream(count, rate=rate)
        time.sleep(1)
        heard = {ros_harness.stamp_of(message): at for at, message in ears.heard["/ygslam/pose"]}
        return [(at - camera.sent[stamp]) * 1e3 for stamp, at in heard.items() if stamp in camera.sent]
    finally:
        node.kill()
        ears.close()


def of_node(frames, count, rate, qos, queue_size):
    """@return poses lost, milliseconds from image to pose, what the node counted."""
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseWithCovarianceStamped
    ears = ros_harness.Ears()
    node = ros_harness.NodeProcess(queue_size=queue_size)
    try:
        ears.listen(PoseWithCovarianceStamped, "/ygslam/pose")
        ears.listen(DiagnosticArray, "/ygslam/status")
        camera = camera_of_bytes(ears, frames, qos).ready()
        stamps = camera.stream(count, rate=rate)
        end = time.monotonic() + 10
        while len(ears.messages("/ygslam/pose")) < count and time.monotonic() < end:
            time.sleep(0.1)
        time.sleep(1)  # for the last status
        said = {value.key: value.value for value in ears.messages("/ygslam/status")[-1].status[0].values}
        heard = {ros_harness.stamp_of(message): at for at, message in ears.heard["/ygslam/pose"]}
        return (len(set(stamps) - set(heard)),
                [(at - camera.sent[stamp]) * 1e3 for stamp, at in heard.items() if stamp in camera.sent],
                {key: int(said[key]) for key in ("colour_received", "depth_received", "unpaired", "dropped", "refused",
                                              "frames")})
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
    parser.add_argument("--queue-size", type=int, default=30)
    parser.add_argument("--large-images", action="store_true", help="16 MB of shared memory for each process")
    parser.add_argument("--best-effort", action="store_true")
    if sys.argv[1:] == ["--echo"]:
        return echo()
    options = parser.parse_args()
    ros_harness.run_in_ros(options.ros, options.large_images)
    import numpy as np
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT if options.best_effort
                     else ReliabilityPolicy.RELIABLE)
    frames = ros_harness.Frames(options.sequence)
    for i in range(len(frames)):
        frames[i]  # decoded beforehand
    count = round(options.seconds * options.rate)
    lost, latencies, counts = of_node(frames, count, options.rate, qos, options.queue_size)
    transport = of_echo(frames, min(count, 600), options.rate, qos)
    library = of_library(frames, min(count, 600), options.rate)
    whole, ros, alone = (float(np.median(times)) for times in (latencies, transport, library))
    print(json.dumps({"frames": count, "load": os.getloadavg()[0], "lost": lost, "node": counts,
                      "image_to_pose_ms": round(whole, 2),
                      "image_to_pose_95_ms": round(float(np.percentile(latencies, 95)), 2), "ros_ms": round(ros, 2), "library_ms": round(alone, 2), "added_ms": round(whole - alone, 2),
                      "added_by_node_ms": round(whole - alone - ros, 2)}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
