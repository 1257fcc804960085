"""The thread that owns the Slam: pairs and commands in, results out. Nothing of ROS is needed here."""
from __future__ import annotations

import collections
import dataclasses
import threading
import time
from typing import Any, Callable

import ygslam

from .sync import Image

Pair = tuple[Image, Image]
INTERNAL = 1  # ygslam.Error.code


@dataclasses.dataclass
class Counts:
    frames: int = 0  # processed
    dropped: int = 0  # pairs that had to make room for newer ones
    refused: int = 0  # frames that could not be used: image, stamp
    last_fault: str = ""
    milliseconds: float = 0  # from the arrival of the newest frame's second image to its result


class Engine:
    """A bounded queue of pairs (the oldest makes room) and a thread that processes them.

    @param open_slam (images, load_map, localize_only) -> a new Slam for the camera of `images`.
    @param on_result (pair, result, slam), in the thread, which may ask the Slam there and then.
    @param on_fault (line), in the thread: a frame or a command failed, the next one may not.
    @param on_end (error), in the thread: the Slam cannot be opened with these settings.
    """

    def __init__(self, open_slam, on_result: Callable, on_fault: Callable[[str], None],
                 on_end: Callable[[Exception], None], queue_size: int = 30):
        self.counts = Counts()
        self.images: ygslam._core.RosImages | None = None
        self.paused = False
        self._open_slam, self._on_result, self._on_fault, self._on_end = open_slam, on_result, on_fault, on_end
        self._slam: ygslam.Slam | None = None
        self._how = {"load_map": "", "localize_only": False}
        self._queue: collections.deque[tuple[Pair, float]] = collections.deque()
        self._most = queue_size
        self._commands: collections.deque[tuple[Callable[[], Any], Callable[[Exception | None], None]]] = (
            collections.deque())
        self._wake = threading.Condition()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="slam", daemon=True)

    def start(self, load_map: str = "", localize_only: bool = False) -> None:
        self._how = {"load_map": load_map, "localize_only": localize_only}
        self._thread.start()

    def put(self, colour: Image, depth: Image) -> None:
        with self._wake:
            if self.paused or self._ends:
                return
            if len(self._queue) >= self._most:
                self._queue.popleft()
                self.counts.dropped += 1
            self._queue.append(((colour, depth), time.perf_counter()))
            self._wake.notify()

    def push_imu(self, t_ns: int, rates: list[float], accelerations: list[float]) -> None:
        """At once, from any thread; before there is a Slam nobody needs it."""
        slam = self._slam
        if slam is not None and not self.paused:
            slam.push_imu(t_ns, rates, accelerations)

    def push_odometry(self, t_ns: int, T_odom_base) -> None:
        """The same."""
        slam = self._slam
        if slam is not None and not self.paused:
            slam.push_odometry(t_ns, T_odom_base)

    def do(self, command: Callable[[], Any], done: Callable[[Exception | None], None] = lambda fault: None) -> None:
        """`command` runs between two frames, `done` after it; both in the thread."""
        with self._wake:
            self._commands.append((command, done))
            self._wake.notify()

    # Commands.
    def use(self, images) -> None:
        """Another camera: a new Slam, at the next frame."""
        self._close()
        self.images = images

    def reopen(self, load_map: str = "", localize_only: bool = False) -> None:
        """Forgets the map and goes on with that of a file; where that fails, with none."""
        self._close()
        self._how = {"load_map": load_map, "localize_only": localize_only}
        try:
            self._slam = self._open()
        except Exception:
            self._how = {"load_map": "", "localize_only": False}
            raise

    def save(self, path: str) -> None:
        if self._slam is None:
            raise ygslam.UsageError("no image was processed yet: there is no map")
        self._slam.save_map(path)

    def reset(self) -> None:
        if self._slam is not None:
            self._slam.reset()

    def end(self) -> None:
        """What waits is left; the Slam is ended in its thread."""
        with self._wake:
            self._ends = True
            self._wake.notify()
        if self._thread.ident is not None:
            self._thread.join()

    def _open(self):
        if self.images is None:
            raise ygslam.UsageError("no camera info came yet")
        return self._open_slam(self.images, **self._how)

    def _open_or_end(self) -> bool:
        try:
            self._slam = self._open()
        except Exception as error:  # noqa: BLE001 - whatever it is, the next frame would meet it again
            self._ends = True
            self._on_end(error)
        return not self._ends

    def _close(self) -> None:
        """At once: nobody asks for the final map, whose adjustment takes half a minute of a busy machine."""
        self._slam = None

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._ends or self._commands or self._queue)
                if self._ends:
                    break
                command = self._commands.popleft() if self._commands else None
                pair = None if command else self._queue.popleft()
            if command:
                self._obey(*command)
            else:
                self._process(*pair)
        self._guarded(self._close)

    def _obey(self, command, done) -> None:
        done(self._guarded(command))

    def _guarded(self, work) -> Exception | None:
        try:
            work()
        except Exception as fault:  # noqa: BLE001 - told; the node goes on
            self._on_fault(str(fault))
            return fault
        return None

    def _process(self, pair: Pair, since: float) -> None:
        fault = self._guarded(lambda: self._step(pair, since))
        if fault:
            self.counts.refused += 1
            self.counts.last_fault = str(fault)

    def _step(self, pair: Pair, since: float) -> None:
        colour, depth = pair
        if self._slam is None and not self._open_or_end():
            return
        rgb = self.images.colour(colour.type, colour.data)
        depth_m = self.images.depth(depth.type, depth.data)
        try:
            result = self._slam.process(rgb, depth_m, colour.t_ns, depth_t_ns=depth.t_ns)
        except ygslam.Error as error:
            if error.code == INTERNAL:  # of no further use; the next frame starts anew
                self._slam = None
            raise
        self.counts.frames += 1
        self.counts.milliseconds = (time.perf_counter() - since) * 1e3
        self._on_result(pair, result, self._slam)
