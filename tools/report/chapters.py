"""One chapter a sequence: chooses the runs, makes the figures and says what cannot be shown."""
import dataclasses

import numpy as np

from . import figures, pictures, plot_style, scene3d
from .files import InputError
from .results import finite
from .series import (nearest, read_errors, read_trajectory, roll_pitch_yaw_deg, rotation_between,
                     rotations)
from .summary import typical_run


@dataclasses.dataclass
class Chapter:
    """@p svgs [(name, caption, svg)]; @p images [(name, caption, PIL picture)] and @p map_views
    as pictures.py gives them; @p scene JSON or None; @p remarks what could not be shown."""
    sequence: object
    svgs: list = dataclasses.field(default_factory=list)
    images: list = dataclasses.field(default_factory=list)
    scores: list = dataclasses.field(default_factory=list)
    map_views: list = dataclasses.field(default_factory=list)
    scene: str | None = None
    remarks: list = dataclasses.field(default_factory=list)
    shown: dict = dataclasses.field(default_factory=dict)  # mode -> run that figures show


@dataclasses.dataclass
class Size:
    """How much a chapter may hold, so that the page stays small however many there are."""
    points: int
    picture_px: int
    map_px: tuple


def size_for(chapter_count):
    """A page of many sequences has fewer points a line and smaller pictures."""
    scale = min(1.0, 4 / max(1, chapter_count))
    width = int(640 * max(0.5, scale ** 0.5))
    return Size(max(150, int(600 * scale)), int(1600 * max(0.5, scale ** 0.5)),
                (width, width * 3 // 4))


def make(sequence, modes, size):
    """The chapter of one sequence; a file that cannot be read becomes a remark."""
    chapter = Chapter(sequence)
    if sequence.error:
        chapter.remarks.append(f"The sequence could not be read: {sequence.error}")
        return chapter
    chapter.images = pictures.tracking_pictures(sequence, size.picture_px)
    chapter.remarks += [caption for _, caption, picture in chapter.images if picture is None]
    chapter.images = [image for image in chapter.images if image[2] is not None]
    chapter.scores = pictures.check_scores(sequence)
    errors, trajectories = read_runs(chapter, modes)
    if errors:
        judged_figures(chapter, errors, trajectories, modes, size)
    elif trajectories:
        chapter.remarks.append("No errors to draw: there is no truth that fits, or no table of "
                               "errors that can be read. "
                               "The paths are shown as estimated, each in its own frame.")
    paths = {mode: e.estimate_m for mode, e in errors.items()}
    if errors:
        paths["truth"] = longest(errors).truth_m
    else:
        paths = {mode: t.position_m for mode, t in trajectories.items()}
    if paths:
        chapter.scene = scene3d.scene(paths, modes, size.points)
        add(chapter, "paths_3d", "Trajectories in space (Fig. 8).",
            figures.paths_in_space(paths, modes, size.points))
    chapter.map_views = pictures.maps(sequence, size.map_px)
    return chapter


def read_runs(chapter, modes):
    """({mode: Errors}, {mode: Trajectory}) of the typical run of each mode."""
    errors, trajectories = {}, {}
    for mode in modes:
        if not chapter.sequence.runs[mode]:
            continue  # never asked for
        run = typical_run(chapter.sequence.runs[mode])
        if run is None:
            chapter.remarks.append(f"{mode}: no run that could be shown.")
            continue
        try:
            trajectories[mode] = read_trajectory(run.folder / "trajectory.txt")
            chapter.shown[mode] = run
            if (run.folder / "errors.csv").exists():
                errors[mode] = read_errors(run.folder / "errors.csv")
        except (InputError, OSError) as error:
            chapter.remarks.append(f"{mode}, run {run.number}: "
                                   + str(error).replace(f"{run.folder}/", ""))
    return errors, trajectories


def longest(errors):
    return max(errors.values(), key=lambda e: len(e.t_s))


def add(chapter, name, caption, figure):
    chapter.svgs.append((name, caption, plot_style.to_svg(figure, f"{chapter.sequence.id}_{name}")))


def judged_figures(chapter, errors, trajectories, modes, size):
    """Everything that needs a truth."""
    points = size.points
    add(chapter, "ate", "ATE in the manner of the TUM tools (Figs. 6, 7): truth, estimate after "
        "SE(3) alignment, and the differences.",
        figures.absolute_error_paths(errors, points))
    add(chapter, "ate_over_time", "Absolute error over time.",
        figures.errors_over_time(errors, modes, points))
    add(chapter, "rpe_over_time", "Relative error over time, at the start of each interval.",
        figures.relative_errors_over_time(errors, modes, points))
    add(chapter, "path_by_error", "The estimated path coloured by its error; truth in grey.",
        figures.coloured_paths(errors, points // 3))
    turn = turn_of_truth(chapter.shown.values())
    angles, truth_angles = orientations(chapter.sequence, errors, trajectories, turn)
    add(chapter, "pose_over_time", "Position, and orientation relative to the first true pose "
        "(roll about the viewing direction, pitch about x, yaw about y). Dashed: truth.",
        figures.pose_over_time(errors, angles, truth_angles, modes, points))


def turn_of_truth(runs):
    """The rotation of the camera on the truth's body that `ygslam` found, else identity."""
    for run in runs:
        body = run.metrics.get("body")
        pose = body.get("T_body_camera") if isinstance(body, dict) else None
        pose = [finite(value) for value in pose] if isinstance(pose, list) else []
        if len(pose) == 7 and None not in pose and any(pose[3:]):
            return rotations(np.array([pose[3:]]))[0]
    return np.eye(3)


def orientations(sequence, errors, trajectories, turn_of_camera):
    """({mode: (t_s, angles)}, truth's or None). Estimates are turned as their positions were."""
    path = sequence.folder / "groundtruth.txt"
    try:
        truth = read_trajectory(path) if path.exists() else None
    except InputError:
        truth = None
    if truth is None or len(truth.t_s) < 2:
        return {}, None
    truth.rotation = truth.rotation @ turn_of_camera
    judged = longest(errors)
    at, near = nearest(truth.t_s, judged.t_s)
    if not near.any():
        return {}, None
    reference = truth.rotation[at[near][0]]
    angles = {}
    for mode, found in errors.items():
        trajectory = trajectories[mode]
        index, same = nearest(trajectory.t_s, found.t_s, 1e-3)
        if same.sum() < 3:
            continue
        moves = np.ptp(found.truth_m, axis=0).max() > 1e-6
        turn = (rotation_between(trajectory.position_m[index[same]], found.estimate_m[same])
                if moves else np.eye(3))
        angles[mode] = (found.t_s[same],
                        roll_pitch_yaw_deg(turn @ trajectory.rotation[index[same]], reference))
    return angles, (judged.t_s[near], roll_pitch_yaw_deg(truth.rotation[at[near]], reference))
