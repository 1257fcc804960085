"""A sensor beside the camera whose place a file tells, or /tf_static."""
from __future__ import annotations

import ygslam

FROM_TF = "tf"


class PlacedSensor:
    """@param wanted the parameter that is called as its topic is: empty (not used), a calibration file, or `tf`: usual
    noise, its place by /tf_static. @throws ygslam.Error for what the file holds."""
    topic: str
    kind: type  # of the library: made of its place, or read from a file

    def __init__(self, wanted: str):
        self._file = self.kind.read(wanted) if wanted and wanted != FROM_TF else None
        self.is_used, self._by_tf = bool(wanted), wanted == FROM_TF
        self.frame, self.received = "", 0

    def frames(self, camera_frame: str) -> tuple[str, str]:
        """Target and source of the transform that is its place."""
        raise NotImplementedError

    def what_is_missing(self, camera_frame: str, tree) -> str:
        """Empty if its place is known."""
        if not self._by_tf:
            return ""
        if not self.frame:
            return f"no message on {self.topic} yet"
        target, source = self.frames(camera_frame)
        if tree.transform(target, source) is None:
            return f"no static transform from {target} to {source}: publish it, or name a file in {self.topic}"
        return ""

    def placed(self, camera_frame: str, tree) -> ygslam.Imu | ygslam.Wheels | None:
        return self.kind(tree.transform(*self.frames(camera_frame))) if self._by_tf else self._file

    def note(self, frame: str) -> None:
        """That a message came."""
        self.frame = self.frame or frame
        self.received += 1
