"""What figures draw of a run: positions, orientations and errors over time."""
import csv
import dataclasses
import pathlib

import numpy as np

from .files import InputError, read_text

COLUMNS = ("t_s", "x_m", "y_m", "z_m", "truth_x_m", "truth_y_m", "truth_z_m", "ate_m", "ate_deg",
           "rpe30_m", "rpe30_deg", "rpe1s_m", "rpe1s_deg")


@dataclasses.dataclass
class Errors:
    """errors.csv: N poses with the estimate aligned to the truth; NaN where a figure is missing."""
    t_s: np.ndarray
    columns: dict

    @property
    def estimate_m(self):
        return np.stack([self.columns[f"{axis}_m"] for axis in "xyz"], axis=1)

    @property
    def truth_m(self):
        return np.stack([self.columns[f"truth_{axis}_m"] for axis in "xyz"], axis=1)


@dataclasses.dataclass
class Trajectory:
    """Poses T_world_camera: stamps [s], positions N x 3 [m], rotations N x 3 x 3."""
    t_s: np.ndarray
    position_m: np.ndarray
    rotation: np.ndarray


def read_errors(path):
    """errors.csv of a run. @raise InputError naming file and line."""
    rows = []
    reader = csv.reader(read_text(path).splitlines(keepends=True))
    try:
        header = next(reader, None)
        if header is None or not set(COLUMNS) <= set(header):
            raise InputError(f"{path}: not a table of errors (columns {', '.join(COLUMNS)})")
        where = [header.index(name) for name in COLUMNS]
        for number, row in enumerate(reader, 2):
            try:
                rows.append([float(row[i]) if row[i] else np.nan for i in where])
            except (ValueError, IndexError):
                raise InputError(f"{path}:{number}: not a line of {len(header)} numbers") from None
    except csv.Error as error:
        raise InputError(f"{path}: not a table of errors ({error})") from None
    if not rows:
        raise InputError(f"{path}: no pose")
    table = np.array(rows)
    table[~np.isfinite(table)] = np.nan
    if np.isnan(table[:, :8]).any():
        raise InputError(f"{path}: a pose without position or error")
    return Errors(table[:, 0], dict(zip(COLUMNS, table.T)))


def read_trajectory(path):
    """A TUM trajectory. @raise InputError naming file and line."""
    rows = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            row = [float(word) for word in line.split()]
        except ValueError:
            row = []
        if len(row) != 8 or not np.all(np.isfinite(row)) or not any(row[4:]):
            raise InputError(f"{path}:{number}: not a pose of 8 numbers")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: no pose")
    table = np.array(rows)
    return Trajectory(table[:, 0], table[:, 1:4], rotations(table[:, 4:8]))


def rotations(q_xyzw):
    """Rotation matrices N x 3 x 3 of quaternions N x 4 (x y z w), normalised first."""
    x, y, z, w = (q_xyzw / np.linalg.norm(q_xyzw, axis=1, keepdims=True)).T
    return np.stack([
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
        np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
        np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def rotation_between(source, target):
    """The rotation that turns centred points N x 3 of source best onto target (Kabsch 1976)."""
    covariance = (target - target.mean(0)).T @ (source - source.mean(0))
    u, _, vt = np.linalg.svd(covariance)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    return u @ sign @ vt


def nearest(t_s, wanted_s, max_diff_s=0.02):
    """Indices into the increasing t_s nearest to wanted_s, and which of them are near enough."""
    right = np.clip(np.searchsorted(t_s, wanted_s), 1, max(1, len(t_s) - 1))
    left = right - 1
    right = np.minimum(right, len(t_s) - 1)
    index = np.where(np.abs(t_s[left] - wanted_s) <= np.abs(t_s[right] - wanted_s), left, right)
    return index, np.abs(t_s[index] - wanted_s) <= max_diff_s


def roll_pitch_yaw_deg(rotation, reference):
    """N x 3 angles [deg] of cameras relative to a reference camera, made continuous in time.

    Axes of the optical frame (x right, y down, z forward): relative = Ry(yaw) Rx(pitch) Rz(roll),
    so roll turns about the viewing direction.
    """
    relative = np.einsum("ji,njk->nik", reference, rotation)
    pitch = np.arcsin(np.clip(-relative[:, 1, 2], -1, 1))
    yaw = np.arctan2(relative[:, 0, 2], relative[:, 2, 2])
    roll = np.arctan2(relative[:, 1, 0], relative[:, 1, 1])
    return np.rad2deg(np.unwrap(np.stack([roll, pitch, yaw], 1), axis=0))


def thin(count, wanted):
    """Indices of at most `wanted` of count samples, first and last among them."""
    if count <= wanted:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(int))


def gap_s(t_s):
    """A step in time beyond which a line must not be drawn through [s]."""
    return 5 * float(np.median(np.diff(t_s))) if len(t_s) > 2 else np.inf


def with_gaps(t_s, values, gap):
    """Inserts NaN where more than gap seconds lie between samples (N or N x d values)."""
    breaks = np.flatnonzero(np.diff(t_s) > gap) + 1
    filler = np.full((len(breaks),) + values.shape[1:], np.nan)
    return np.insert(t_s, breaks, t_s[breaks]), np.insert(values, breaks, filler, axis=0)
