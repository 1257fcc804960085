"""RGB-D SLAM for rooms with people in them.

    import ygslam
    sequence = ygslam.open("rgbd_dataset_freiburg3_walking_xyz")
    with ygslam.Slam(sequence.camera, model="yolov8n-seg_480x640.onnx") as slam:
        for frame in sequence:
            result = slam.process(frame.rgb, frame.depth, frame.t_ns)
            print(result.state, result.pose[:3, 3])
        outcome = slam.finish()
"""
import io

from ._command import evaluate, localize, run, simulate
from ._core import (CameraModel, ConfigError, Error, Frame, InputError, MapError, MapSnapshot, ModelError,
                    Object, Outcome, OutputError, Result, Sequence, Slam, State, UsageError)

__all__ = ["CameraModel", "ConfigError", "Error", "Frame", "InputError", "MapError", "MapSnapshot", "ModelError",
           "Object", "Outcome", "OutputError", "Result", "Sequence", "Slam", "State", "UsageError", "evaluate",
           "localize", "run", "simulate", "write_trajectory"]  # open hides a builtin


def open(path) -> Sequence:  # noqa: A001 - as the module's other openers
    """A recorded sequence, whatever `ygslam run` takes."""
    return Sequence(str(path))


def write_trajectory(path, rows) -> None:
    """Writes rows of Outcome.trajectory as a TUM trajectory."""
    with io.open(path, "w", encoding="utf-8") as file:  # not this module's
        for row in rows:
            file.write(f"{row[0]:.6f} " + " ".join(f"{v:.9f}" for v in row[1:]) + "\n")
