"""The node: subscribes, hands pairs to the engine, publishes what comes out. docs/ros.md lists topics."""
from __future__ import annotations

import collections
import math
import signal
import sys
import threading
import time

import numpy as np
import rclpy
import ygslam
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterValueException, ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from sensor_msgs.msg import CameraInfo, CompressedImage, Imu
from sensor_msgs.msg import Image as RawImage
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from . import frames, messages, moving_objects, parameters, wire
from .engine import Engine
from .imu import ImuInput
from .inputs import Receiver
from .outputs import Outputs
from .static_tree import StaticTree
from .sync import Image, Pairing
from .wheels import WheelInput

KEPT_TF = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STATUS_S = 0.5
KEPT_READINGS = 1000  # of an IMU or of wheels, by the middleware: two seconds and more
PARENT_WAIT_S = 2.0  # before the camera gets a parent of ours: others may have told one
TELL_AGAIN_S = 5.0
OK, WARNING, ERROR, STALE = range(4)


class SlamNode(Node):
    def __init__(self, **how):
        super().__init__("ygslam", **how)
        self.own, self._options = parameters.declare(self)
        self.fatal: Exception | None = None
        self._said = "no images yet"
        self._tree, self._T_base_camera, self._camera_frame = StaticTree(), None, ""
        self._fixed_pose = self._parameter_pose()
        self._imu, self._wheels = ImuInput(self.own["imu"]), WheelInput(self.own["odom"])
        self._infos: dict[str, bytes] = {}
        self._depth_frame, self._used_infos = "", None
        self._in_lock = threading.RLock()  # images come in one thread, transforms in another
        self._early: collections.deque[tuple[Image, Image]] = collections.deque(maxlen=self.own["queue_size"])
        self._foreign_parent, self._told_camera_tf = "", False
        self._T_map_world, self._plan, self._result = None, None, None
        self._map_due_ns: int | None = None
        self._room_lock, self._room = threading.Lock(), None
        self._counts_before, self._began = (0, time.monotonic()), time.monotonic()
        self._alone_before, self._received = 0, {"colour": 0, "depth": 0}
        self.out = Outputs(self, (self.own["map_frame"], self.own["odom_frame"], self.own["base_frame"]),
                           self.own["path_step_m"], self.own["path_length"])
        self.engine = Engine(self._open_slam, self._take_result, self._tell, self._give_up, self.own["queue_size"])
        self._pairs = Pairing(round(self.own["slop_ms"] * 1e6), self._take_pair)
        self._receiver = Receiver(self, self._give_up)
        self._subscribe()
        self._serve()
        # Of its own clock: with use_sim_time nothing comes while /clock stands still.
        self.create_timer(STATUS_S, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.engine.start(self.own["load_map"], self.own["localize_only"])
        self._receiver.start()

    def end(self) -> None:
        self._receiver.end()
        self.engine.end()

    # Set-up
    def _parameter_pose(self) -> np.ndarray | None:
        words = self.own["camera_pose"].split()
        if not words:
            return None
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
            raise ValueError(f"parameter camera_pose: '{self.own['camera_pose']}': six numbers are expected: "
                             "x y z roll pitch yaw")
        return frames.from_roll_pitch_yaw(*numbers) @ frames.T_BODY_OPTICAL

    def _subscribe(self) -> None:
        depth_info = [] if self.own["depth_registered"] else [("depth", "depth/camera_info", self._take_info)]
        for side, topic in (("colour", "rgb/image"), ("depth", "depth/image")):
            transport = self.own[f"{side}_transport"]
            if transport not in ("raw", "compressed", "compressedDepth"):
                raise ValueError(f"parameter {side}_transport: '{transport}': must be raw, compressed or "
                                 "compressedDepth")
            kind, name = (RawImage, "Image") if transport == "raw" else (CompressedImage, "CompressedImage")
            self._receiver.subscribe(kind, topic if transport == "raw" else f"{topic}/{transport}",
                                     lambda data, side=side, name=name: self._take_image(side, name, data))
        for side, topic, take in [("colour", "rgb/camera_info", self._take_info), *depth_info]:
            self._receiver.subscribe(CameraInfo, topic, lambda data, side=side, take=take: take(side, data))
        if self._imu.is_used:
            self._receiver.subscribe(Imu, "imu", self._take_imu, kept=KEPT_READINGS)
        if self._wheels.is_used:
            self._receiver.subscribe(Odometry, "odom", self._take_wheels, kept=KEPT_READINGS)
        self.create_subscription(TFMessage, "/tf_static", self._take_static, KEPT_TF)
        if self.own["publish_tf"]:
            self.create_subscription(TFMessage, "/tf", self._watch_tf, 100)
        self._static = self.create_publisher(TFMessage, "/tf_static", QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)) if self._fixed_pose is not None else None

    def _serve(self) -> None:
        def offer(name, kind, work):
            async def answer(request, response):
                fault = await self._done(lambda: work(request))
                response.success, response.message = fault is None, str(fault or "")
                return response
            self.create_service(kind, f"~/{name}", answer)

        offer("save_map", Trigger, lambda _: self.engine.save(self._map_file()))
        offer("load_map", Trigger, lambda _: self._anew(lambda: self.engine.reopen(self._map_file())))
        offer("localise", SetBool, lambda r: self._anew(lambda: self.engine.reopen(self._map_file(), r.data)))
        offer("reset", Trigger, lambda _: self._anew(self.engine.reset))
        offer("pause", SetBool, lambda r: setattr(self.engine, "paused", r.data))

    def _map_file(self) -> str:
        return self.get_parameter("map_file").value

    def _anew(self, work) -> None:
        self._T_map_world, self._map_due_ns, self._plan = None, None, None
        with self._room_lock:
            self._room = None
        self.out.forget()
        work()

    def _done(self, work) -> Future:
        """A command of the engine; its fault, or None."""
        future = Future()

        def tell(fault):
            future.set_result(fault)
            self.executor.wake()
        self.engine.do(work, tell)
        return future

    def _open_slam(self, images, load_map: str, localize_only: bool):
        return ygslam.Slam(images.camera, model=self.own["model"], segmenter=self.own["segmenter"], load_map=load_map,
                           localize_only=localize_only, keep_trajectory=False, view=self.own["view"],
                           room_every_s=self.own["map_period_s"], floor=self._floor(load_map),
                           imu=self._imu.placed(self._camera_frame, self._tree),
                           wheels=self._wheels.placed(self._camera_frame, self._tree),
                           options={"dense.plan_low_m": repr(self.own["map_low_m"]),
                                    "dense.plan_high_m": repr(self.own["map_high_m"]), **self._options})

    def _floor(self, load_map: str):
        """In the world, which is the first camera; that of a loaded map is another."""
        if not self.own["floor_at_base"] or load_map:
            return None
        T_camera_base = frames.inverse(self._T_base_camera)
        up = T_camera_base[:3, 2]
        return up.tolist(), float(up @ T_camera_base[:3, 3])

    # In
    def _take_image(self, side: str, name: str, data: bytes) -> None:
        try:
            head = wire.header(data)
        except ValueError as error:
            return self._tell(f"{side}: {error}")
        self._received[side] += 1
        with self._in_lock:
            if side == "depth":
                self._depth_frame = head.frame
            self._pairs.add(side, Image(head.t_ns, head.frame, f"sensor_msgs/msg/{name}", data))

    def _take_info(self, side: str, data: bytes) -> None:
        try:
            if self._infos.get(side) and wire.body(data) == wire.body(self._infos[side]):
                return
        except ValueError as error:
            return self._tell(f"{side} camera_info: {error}")
        with self._in_lock:
            self._infos[side] = data
            self._pass_on()

    def _take_imu(self, data: bytes) -> None:
        try:
            self._imu.take(data, self.engine)
        except (ValueError, ygslam.Error) as error:
            self._tell(f"imu: {error}")

    def _take_wheels(self, data: bytes) -> None:
        try:
            self._wheels.take(data, self.engine)
        except (ValueError, ygslam.Error) as error:
            self._tell(f"odom: {error}")

    def _take_static(self, message: TFMessage) -> None:
        with self._in_lock:
            for entry in message.transforms:
                self._tree.add(entry.header.frame_id, entry.child_frame_id, messages.matrix_of(entry))
            self._pass_on()

    def _watch_tf(self, message: TFMessage) -> None:
        """A frame has one parent: where somebody else gives base_frame one, this node keeps off /tf."""
        for entry in message.transforms:
            if entry.child_frame_id.lstrip("/") != self.own["base_frame"] or self._foreign_parent:
                continue
            stamp = entry.header.stamp.sec * 10**9 + entry.header.stamp.nanosec
            if entry.header.frame_id == self.own["odom_frame"] and stamp in self.out.own_stamps:
                continue
            self._foreign_parent = entry.header.frame_id
            self.get_logger().error(f"{self.own['base_frame']} has the parent {self._foreign_parent} from another "
                                    "node: nothing more is published on /tf; set publish_tf to false, or stop it")

    def _take_pair(self, colour: Image, depth: Image) -> None:
        """What comes before the cameras are known waits for them."""
        self._early.append((colour, depth))
        self._pass_on()

    def _pass_on(self) -> None:
        if not self._early or not self._is_ready(self._early[-1][0]):
            return
        while self._early:
            self.engine.put(*self._early.popleft())

    def _is_ready(self, colour: Image) -> bool:
        """Whether the cameras and their places are known; says what is missing."""
        if "colour" not in self._infos:
            return self._wait("no rgb/camera_info yet")
        base = self.own["base_frame"]
        T_base_camera = self._fixed_pose
        if T_base_camera is None:
            T_base_camera = self._tree.transform(base, colour.frame)
        if T_base_camera is None:
            return self._wait(f"no static transform from {base} to {colour.frame}: publish it, or set camera_pose")
        for sensor in (self._imu, self._wheels):
            if missing := sensor.what_is_missing(colour.frame, self._tree):
                return self._wait(missing)
        if not self._know_cameras(colour.frame):
            return False
        self._T_base_camera, self._camera_frame = T_base_camera, colour.frame
        return True

    def _know_cameras(self, colour_frame: str) -> bool:
        place, infos = (0, 0, 0, 0, 0, 0, 1), (self._infos["colour"], b"")
        if not self.own["depth_registered"]:
            T_colour_depth = self._tree.transform(colour_frame, self._depth_frame)
            if "depth" not in self._infos or T_colour_depth is None:
                return self._wait(f"no depth/camera_info, or no static transform from {colour_frame} to "
                                  f"{self._depth_frame}")
            place = (*T_colour_depth[:3, 3], *frames.quaternion(T_colour_depth))
            infos = (self._infos["colour"], self._infos["depth"])
        if self._used_infos == infos:
            return True
        try:
            images = ygslam._core.RosImages(*infos, place)
        except ygslam.Error as error:
            return self._wait(str(error))
        is_other = self._used_infos is not None
        self._used_infos = infos
        if is_other:
            self.get_logger().warning("another camera: a new map begins")
        self.engine.do(lambda: self._anew(lambda: self.engine.use(images)))
        return True

    def _wait(self, what: str) -> bool:
        self._tell(what)
        return False

    def _tell(self, line: str) -> None:
        self._said = line
        self.get_logger().warning(line, throttle_duration_sec=TELL_AGAIN_S)

    def _give_up(self, error: Exception) -> None:
        self.fatal = error
        if self.executor:
            self.executor.wake()

    # Out, in the engine's thread
    def _take_result(self, pair, result, slam) -> None:
        t_ns = pair[0].t_ns
        if self._T_map_world is None:  # until the floor is known: base stood level at first
            self._T_map_world = self._T_base_camera
        self._result = result
        if result.state == ygslam.State.WAITING:
            return
        is_tracked = result.state != ygslam.State.LOST
        poses = frames.poses_of(result, self._T_base_camera, self._T_map_world)
        self.out.frame(t_ns, poses, is_tracked, self.own["publish_tf"] and not self._foreign_parent)
        if is_tracked:
            self.out.objects(t_ns, moving_objects.observed(result.objects, self._T_map_world))
        self._take_plan(slam)
        if self._map_due_ns is None or not 0 <= self._map_due_ns - t_ns <= self.own["map_period_s"] * 1e9:
            self._map_due_ns = t_ns + round(self.own["map_period_s"] * 1e9)
            self._take_room(slam)

    def _take_plan(self, slam) -> None:
        plan = slam.plan()
        if plan is None or plan is self._plan:
            return
        self._plan = plan
        self._T_map_world = frames.inverse(plan.T_world_floor)
        self.out.plan(plan)

    def _take_room(self, slam) -> None:
        room = slam.room()
        if room.t_ns == 0:
            return
        with self._room_lock:
            self._room = room, self._T_map_world

    # From time to time, in the executor's thread
    def _tick(self) -> None:
        self._publish_camera_tf()
        self._tell_of_losses()
        t_ns = self.get_clock().now().nanoseconds
        self.out.status(messages.status(t_ns, "ygslam: slam", *self._judged(), self._values()))
        with self._room_lock:
            room = self._room
        self.out.path(t_ns)
        if room is not None:
            self.out.room(*room, self.own["mesh_triangles"])

    def _publish_camera_tf(self) -> None:
        if self._static is None or self._told_camera_tf or not self._camera_frame:
            return
        if time.monotonic() - self._began < PARENT_WAIT_S:
            return
        self._told_camera_tf = True
        with self._in_lock:
            parent = self._tree.parent_of(self._camera_frame)
        if parent:
            self._tell(f"{self._camera_frame} has the parent {parent} on /tf_static: camera_pose is used, but not "
                       "published")
            return
        self._static.publish(TFMessage(transforms=[messages.transform(
            self.get_clock().now().nanoseconds, self.own["base_frame"], self._camera_frame, self._fixed_pose)]))

    def _tell_of_losses(self) -> None:
        alone, paired = self._pairs.left_alone, self.engine.counts.frames
        if alone - self._alone_before > max(1, paired - self._counts_before[0]):
            self._tell(f"{alone - self._alone_before} images came without the other one: its like is lost on the way, "
                       f"or their stamps differ by more than slop_ms (docs/ros.md, Large images)")
        self._alone_before = alone

    def _judged(self) -> tuple[int, str]:
        state = self._result.state if self._result else ygslam.State.WAITING
        if self._foreign_parent:
            return ERROR, f"{self.own['base_frame']} has two parents"
        if self.engine.paused:
            return STALE, "paused"
        if self._result is None:
            return WARNING, self._said
        if state == ygslam.State.LOST:
            return ERROR, "lost"
        if self._rate() == 0:
            return STALE, "no images"
        if state == ygslam.State.COASTING:
            return WARNING, "coasting: IMU or wheels carry on"
        if state != ygslam.State.TRACKING or self._result.provisional:
            return WARNING, "provisional" if self._result.provisional else state.name.lower()
        return OK, "tracking"

    def _rate(self) -> float:
        frames_before, since = self._counts_before
        return (self.engine.counts.frames - frames_before) / max(time.monotonic() - since, 1e-3)

    def _values(self) -> dict:
        counts, result = self.engine.counts, self._result
        values = {"state": result.state.name.lower() if result else "waiting",
                  "provisional": result.provisional if result else False,
                  "frames_per_second": f"{self._rate():.1f}", "frames": counts.frames, "dropped": counts.dropped,
                  "refused": counts.refused, "unpaired": self._pairs.left_alone,
                  "colour_received": self._received["colour"], "depth_received": self._received["depth"],
                  "imu_received": self._imu.received, "odom_received": self._wheels.received,
                  "latency_ms": f"{counts.milliseconds:.1f}",
                  "mask_age_frames": result.mask_age_frames if result else -1,
                  "last_fault": counts.last_fault}
        self._counts_before = (counts.frames, time.monotonic())
        return values


def main(args: list[str] | None = None) -> int:
    """@return 0 after SIGINT or SIGTERM; else the code of ygslam.Error."""
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        return _spin(stop)
    finally:
        rclpy.try_shutdown()


def _spin(stop: threading.Event) -> int:
    try:
        node = SlamNode()
    except (ValueError, InvalidParameterValueException, ParameterException, ygslam.Error) as error:
        print(f"error: {error}", file=sys.stderr)
        return getattr(error, "code", 3)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stop.is_set() and node.fatal is None:
            executor.spin_once(timeout_sec=0.1)  # a signal does not end a wait
    finally:
        node.end()
        executor.shutdown()
        node.destroy_node()
    if node.fatal is None:
        return 0
    print(f"error: {node.fatal}", file=sys.stderr)
    return getattr(node.fatal, "code", 1)
