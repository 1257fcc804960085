"""Pairs of colour and depth images by their stamps."""
from __future__ import annotations

import bisect
import dataclasses
from typing import Callable

CLOCK_SET_BACK_NS = 10**9  # older by more is no late message


@dataclasses.dataclass
class Image:
    t_ns: int
    frame: str
    type: str  # "sensor_msgs/msg/Image"
    data: bytes  # CDR


class Pairing:
    """Each colour image with the nearest depth image, at most `slop_ns` away; each image once, in order.

    @param on_pair called with (colour, depth), in the call that completes a pair.
    """

    def __init__(self, slop_ns: int, on_pair: Callable[[Image, Image], None], most: int = 60):
        self._slop_ns, self._on_pair, self._most = slop_ns, on_pair, most
        self._waiting: dict[str, list[Image]] = {"colour": [], "depth": []}
        self._latest: dict[str, int] = {}
        self.left_alone = 0  # images that found no other

    def add(self, side: str, image: Image) -> None:
        """@param side "colour" or "depth"."""
        if image.t_ns < self._latest.get(side, image.t_ns) - CLOCK_SET_BACK_NS:
            self.clear()
        self._latest[side] = image.t_ns
        others = self._waiting["depth" if side == "colour" else "colour"]
        nearest = min(others, key=lambda other: abs(other.t_ns - image.t_ns), default=None)
        if nearest is None or abs(nearest.t_ns - image.t_ns) > self._slop_ns:
            self._keep(side, image)
            return
        for waiting in self._waiting.values():  # what is older than its like comes too late for another
            self._drop_until(waiting, min(image.t_ns, nearest.t_ns), nearest)
        self._on_pair(*((image, nearest) if side == "colour" else (nearest, image)))

    def clear(self) -> None:
        self.left_alone += sum(map(len, self._waiting.values()))
        self._waiting = {"colour": [], "depth": []}
        self._latest = {}

    def _keep(self, side: str, image: Image) -> None:
        waiting = self._waiting[side]
        bisect.insort(waiting, image, key=lambda other: other.t_ns)
        if len(waiting) > self._most:
            del waiting[0]
            self.left_alone += 1

    def _drop_until(self, waiting: list[Image], t_ns: int, taken: Image) -> None:
        kept = [image for image in waiting if image.t_ns > t_ns and image is not taken]
        self.left_alone += len(waiting) - len(kept) - sum(image is taken for image in waiting)
        waiting[:] = kept
