"""RGB-D SLAM for rooms with people in them.

    import ygslam
    sequence = ygslam.open("rgbd_dataset_freiburg3_walking_xyz")
    with ygslam.Slam(sequence.camera, segmenter="builtin") as slam:
        for frame in sequence:
            result = slam.process(frame.rgb, frame.depth, frame.t_ns)
            print(result.state, result.pose[:3, 3])
        outcome = slam.finish()
"""
import typing as _typing

import numpy as _numpy
from numpy.typing import ArrayLike as _ArrayLike
from numpy.typing import NDArray as _NDArray

from . import _calls, _core
from ._command import Path as _Path
from ._command import path_of as _path_of
from ._command import evaluate, localize, run, simulate
from ._core import (CameraModel, ConfigError, Error, Event, Frame, Imu, InputError, MapError, MapSnapshot, ModelError,
                    Object, OccupancyGrid, Outcome, OutputError, RayHit, Result, Room, Sequence, Slam, Space,
                    StageTimes, State, StaticObject, UsageError, Wheels)
from ._core import __version__
from ._core import write_file as _write_file

__all__ = ["CameraModel", "ConfigError", "Error", "Event", "Frame", "Imu", "InputError", "MapError", "MapSnapshot",
           "ModelError", "Object", "OccupancyGrid", "Outcome", "OutputError", "RayHit", "Result", "Room", "Sequence",
           "Slam", "Space", "StageTimes", "State", "StaticObject", "UsageError", "Wheels", "__version__", "evaluate",
           "localize", "run", "simulate", "write_trajectory"]  # open hides a builtin


if not _typing.TYPE_CHECKING:
    class Slam(_core.Slam):
        __doc__ = _core.Slam.__doc__
        __init__ = _calls.clear("Slam", _core.Slam.__init__)

    for _kind in (_core.Slam, MapSnapshot, Object, OccupancyGrid, Room, Sequence):
        _calls.clear_methods(_kind)


def open(path: _Path) -> Sequence:  # noqa: A001 - as the module's other openers
    """A recorded sequence, whatever `ygslam run` takes. path: str, bytes or os.PathLike."""
    return Sequence(_path_of(path))


def write_trajectory(path: _Path, rows: _ArrayLike) -> None:
    """Writes rows as Outcome.trajectory has them (seconds, x, y, z, qx, qy, qz, qw) as a TUM trajectory: all of
    them, or none and an error."""
    _write_file(_path_of(path), "".join(f"{row[0]:.6f} " + " ".join(f"{v:.9f}" for v in row[1:]) + "\n"
                                        for row in _checked(rows)))


def _checked(rows: _ArrayLike) -> _NDArray[_numpy.float64]:
    table = _numpy.asarray(rows, dtype=_numpy.float64)
    if table.shape == (0,):
        return table  # an empty list
    if table.ndim != 2 or table.shape[1] != 8:
        raise ValueError("rows: shape (N, 8) is expected (seconds, x, y, z, qx, qy, qz, qw), not "
                         f"{table.shape}")
    for bad, what in ((~_numpy.isfinite(table).all(axis=1), "a value that is not finite"),
                      (abs(_numpy.linalg.norm(table[:, 4:], axis=1) - 1) > 1e-3,
                       "a quaternion (qx, qy, qz, qw) that is not of length 1"),
                      (abs(table[:, 0]) > 9e9, "a stamp that is not in seconds")):
        if bad.any():
            raise ValueError(f"rows: row {int(_numpy.argmax(bad))} has {what}")
    return table
