"""Transforms that stay, as /tf_static tells them."""
from __future__ import annotations

import numpy as np

from .frames import inverse


class StaticTree:
    def __init__(self):
        self._parent: dict[str, tuple[str, np.ndarray]] = {}

    def add(self, parent: str, child: str, T_parent_child: np.ndarray) -> None:
        self._parent[child.lstrip("/")] = (parent.lstrip("/"), T_parent_child)

    def parent_of(self, frame: str) -> str | None:
        return self._parent.get(frame, (None,))[0]

    def transform(self, target: str, source: str) -> np.ndarray | None:
        """T_target_source; None where no chain of static transforms leads from one to the other."""
        up_source, up_target = self._to_root(source.lstrip("/")), self._to_root(target.lstrip("/"))
        for frame, T_frame_source in up_source.items():
            if frame in up_target:
                return inverse(up_target[frame]) @ T_frame_source
        return None

    def _to_root(self, frame: str) -> dict[str, np.ndarray]:
        """T_ancestor_frame of each ancestor, nearest first."""
        found, pose = {frame: np.eye(4)}, np.eye(4)
        while frame in self._parent:
            frame, step = self._parent[frame]
            if frame in found:  # a ring
                break
            pose = step @ pose
            found[frame] = pose
        return found
