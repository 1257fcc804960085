"""For tests of the node with ROS 2: an environment, a camera that publishes a sequence, ears for what is published.

Run by the interpreter of an environment with rclpy (tools/setup.sh ros); each process has a domain of its own that
does not leave this machine.
"""
import array
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PATIENCE_S = 40  # for what takes a fraction of a second on an idle machine


LARGE_IMAGES = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com"><profiles>
  <transport_descriptors>
    <transport_descriptor><transport_id>shm</transport_id><type>SHM</type><segment_size>16777216</segment_size>
    </transport_descriptor>
    <transport_descriptor><transport_id>udp</transport_id><type>UDPv4</type>
      <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList></transport_descriptor>
  </transport_descriptors>
  <participant profile_name="large_images" is_default_profile="true"><rtps>
    <userTransports><transport_id>shm</transport_id><transport_id>udp</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
  </rtps></participant>
</profiles></dds>
"""


def use_large_images(distribution):
    """What FASTDDS_BUILTIN_TRANSPORTS='DEFAULT?sockets_size=16MB' sets, which is heeded in no domain of this machine
    alone: shared memory for more than one pair of images."""
    profile = pathlib.Path(os.environ["ROS_LOG_DIR"]) / "large_images.xml"
    profile.write_text(LARGE_IMAGES, "utf-8")
    os.environ["FASTDDS_DEFAULT_PROFILES_FILE" if distribution == "kilted" else
               "FASTRTPS_DEFAULT_PROFILES_FILE"] = str(profile)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"


def run_in_ros(distribution, large_images=False):
    """Goes on in the environment of a distribution; says that it is skipped where there is none."""
    if os.environ.get("YGSLAM_IN_ROS") == distribution:
        return
    python = pathlib.Path(os.environ.get("YGSLAM_ROS", ROOT / ".venv")) / f"ros-{distribution}" / "bin" / "python"
    if not python.exists():
        print(f"setUpClass (RosTest) ... skipped 'no ROS 2 in {python.parent.parent} (tools/setup.sh ros)'\n\n"
              "OK (skipped=1)")
        sys.exit(0)
    os.environ.update(YGSLAM_IN_ROS=distribution, ROS_DOMAIN_ID=str(random.randrange(1, 100)),
                      ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_LOG_DIR=tempfile.mkdtemp(prefix="ygslam_ros_"))
    if large_images:
        use_large_images(distribution)
    os.execv(python, [str(python), *sys.argv])


class Frames:
    """The frames of a sequence, forth and back for ever, as arrays."""

    def __init__(self, folder, most=10**9):
        import ygslam
        self._sequence = ygslam.open(folder)
        self.camera = self._sequence.camera
        self._count = min(len(self._sequence), most)
        self._kept = {}

    def __len__(self):
        return self._count

    def __getitem__(self, i):
        """@return rgb (H, W, 3) uint8, depth (H, W) uint16 [mm]."""
        import numpy as np
        i %= max(1, 2 * self._count - 2)
        i = i if i < self._count else 2 * self._count - 2 - i
        if i not in self._kept:
            frame = self._sequence[i]
            self._kept[i] = (np.array(frame.rgb), np.rint(frame.depth * 1000).astype(np.uint16))
        return self._kept[i]


def header_of(t_ns, frame):
    from builtin_interfaces.msg import Time
    from std_msgs.msg import Header
    return Header(stamp=Time(sec=t_ns // 10**9, nanosec=t_ns % 10**9), frame_id=frame)


def image_of(t_ns, encoding, pixels, frame="camera_optical"):
    from sensor_msgs.msg import Image
    height, width = pixels.shape[:2]
    return Image(header=header_of(t_ns, frame), height=height, width=width, encoding=encoding,
                 step=pixels.nbytes // height, data=array.array("B", pixels.tobytes()))


def info_of(t_ns, camera, frame="camera_optical", scale=1.0):
    from sensor_msgs.msg import CameraInfo
    fx, fy = camera.fx * scale, camera.fy * scale
    cx, cy = (camera.cx + 0.5) * scale - 0.5, (camera.cy + 0.5) * scale - 0.5
    return CameraInfo(header=header_of(t_ns, frame), width=int(camera.width * scale),
                      height=int(camera.height * scale), distortion_model="plumb_bob", d=[0.0] * 5,
                      k=[fx, 0, cx, 0, fy, cy, 0, 0, 1.0], r=[1.0, 0, 0, 0, 1, 0, 0, 0, 1],
                      p=[fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0])


def stamp_of(message):
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


class Ears:
    """A node of the test: publishes, and keeps what it hears with the time it came."""

    def __init__(self):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("ears", context=self.context)
        self.heard, self._lock = {}, threading.Condition()
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._ends = False
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self):
        while not self._ends:
            self._executor.spin_once(timeout_sec=0.05)

    def listen(self, kind, topic, qos=100):
        self.heard[topic] = []
        self.node.create_subscription(kind, topic, lambda message: self._keep(topic, message), qos)
        self._executor.wake()

    def _keep(self, topic, message):
        with self._lock:
            self.heard[topic].append((time.perf_counter(), message))
            self._lock.notify_all()

    def messages(self, topic):
        with self._lock:
            return [message for _, message in self.heard[topic]]

    def wait(self, topic, enough, patience_s=PATIENCE_S):
        """Until enough(messages). @return the messages, or raises."""
        with self._lock:
            if not self._lock.wait_for(lambda: enough([m for _, m in self.heard[topic]]), patience_s):
                raise AssertionError(f"{topic}: {len(self.heard[topic])} messages, and not what was waited for")
            return [message for _, message in self.heard[topic]]

    def call(self, kind, name, **request):
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(PATIENCE_S), name
        future = client.call_async(kind.Request(**request))
        end = time.monotonic() + PATIENCE_S
        while not future.done() and time.monotonic() < end:
            time.sleep(0.01)
        assert future.done(), f"{name}: no answer"
        return future.result()

    def wait_for_reader(self, *publishers):
        end = time.monotonic() + PATIENCE_S
        while not all(p.get_subscription_count() for p in publishers):
            assert time.monotonic() < end, "nobody subscribes"
            time.sleep(0.02)

    def close(self):
        self._ends = True
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


class Camera:
    """Publishes frames; colour and depth have stamps that differ by `lag_ns`."""

    def __init__(self, ears, frames, qos=10, lag_ns=3_000_000, frame="camera_optical"):
        from sensor_msgs.msg import CameraInfo, Image
        self.ears, self.frames, self.lag_ns, self.frame = ears, frames, lag_ns, frame
        self.publishers = [ears.node.create_publisher(Image, "rgb/image", qos),
                           ears.node.create_publisher(Image, "depth/image", qos),
                           ears.node.create_publisher(CameraInfo, "rgb/camera_info", qos)]
        self.sent = {}  # stamp of the colour image -> when the second image was published

    def ready(self):
        """Until the node listens, and has had time to choose how."""
        self.ears.wait_for_reader(*self.publishers)
        time.sleep(1.5)
        self.ears.wait_for_reader(*self.publishers)
        return self

    def send(self, i, t_ns):
        rgb, depth_mm = self.frames[i]
        colour, depth, info = self.publishers
        info.publish(info_of(t_ns, self.frames.camera, self.frame))
        depth.publish(image_of(t_ns + self.lag_ns, "16UC1", depth_mm, self.frame))
        message = image_of(t_ns, "rgb8", rgb, self.frame)
        self.sent[t_ns] = time.perf_counter()
        colour.publish(message)

    def stream(self, count, start_ns=10**15, first=0, rate=30.0):
        """@return the stamps."""
        began, stamps = time.perf_counter(), []
        for i in range(count):
            time.sleep(max(0.0, began + i / rate - time.perf_counter()))
            stamps.append(start_ns + round(i / rate * 1e9))
            self.send(first + i, stamps[-1])
        return stamps

    def close(self):
        for publisher in self.publishers:
            self.ears.node.destroy_publisher(publisher)


class NodeProcess:
    """python -m ygslam.ros, with parameters."""

    def __init__(self, remap=(), command=(sys.executable, "-m", "ygslam.ros"), **parameters):
        parameters = {"segmenter": "none", "camera_pose": "0.1 0 0.3 0 0 0", **parameters}
        words = []
        for name, value in parameters.items():
            text = f"'{value}'" if isinstance(value, str) else str(value).lower()
            words += ["-p", f"{name.replace('__', '.')}:={text}"]
        for pair in remap:
            words += ["-r", pair]
        self.process = subprocess.Popen([*command, "--ros-args", *words], stderr=subprocess.PIPE,
                                        stdout=subprocess.DEVNULL, text=True)

    def end(self, number=signal.SIGINT):
        """@return exit code, what it said, seconds it took."""
        began = time.monotonic()
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            _, said = self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.process.returncode, re.sub(r"\x1b\[\d*m", "", said), time.monotonic() - began
