"""Rendered sequences, runs over them and the exact truth: what the benchmarks over seeds share."""
import shutil
import subprocess
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

WORLDS = Path(__file__).resolve().parent.parent / "configs" / "worlds"
OFF = ["--deterministic", "--dynamic", "off", "--segmenter", "none"]
WRONG_M = 2          # a pose so far from the truth is of another place; drift is less
FALSE_LOOP_M = 3     # apart, as for `ygslam inspect --loops`
OFF_M = 0.3          # of one view as seen from the other, in the end


def seed_range(text):
    """Of FIRST-LAST, or of one."""
    first, last = (int(s) for s in (text.split("-") * 2)[:2])
    return range(first, last + 1)


class Sequence:
    """Frames with their truth: of a rendered folder, or put together from frames of one."""

    def __init__(self, folder, frames=None):
        self.folder = Path(folder)
        if frames is None:
            pairs = [line.split() for line in (self.folder / "associations.txt").open()
                     if not line.startswith("#")]
            truth = read_tum(self.folder / "groundtruth.txt")
            frames = [(micros(p[0]), p[1], p[3], truth[micros(p[0])]) for p in pairs]
        self.frames = frames

    def truth(self):
        return {stamp: pose for stamp, _, _, pose in self.frames}

    def cut(self, begin, end):
        return Sequence(self.folder, self.frames[begin:end])

    def then(self, other, after_s):
        """Both; so long after the last frame of this one comes the first of the other."""
        shift = self.frames[-1][0] + micros(after_s) - other.frames[0][0]
        return Sequence(self.folder,
                        self.frames + [(f[0] + shift, *f[1:]) for f in other.frames])

    def write(self, folder):
        folder.mkdir(parents=True)
        for part in ("rgb", "depth"):
            (folder / part).symlink_to((self.folder / part).resolve())
        shutil.copy(self.folder / "calibration.txt", folder)
        stamps = [stamp_text(f[0]) for f in self.frames]
        (folder / "associations.txt").write_text("".join(
            f"{s} {f[1]} {s} {f[2]}\n" for s, f in zip(stamps, self.frames)))
        (folder / "groundtruth.txt").write_text("".join(
            f"{s} {' '.join(f'{x:.9f}' for x in f[3])}\n" for s, f in zip(stamps, self.frames)))
        return folder

    def room(self, i):
        """Of twin_rooms: A, B or - (the corridor)."""
        x, y, _ = self.frames[i][3][:3]
        return "-" if y < -2.95 else "A" if x < 0 else "B"


def to_and_fro(recording, folder, count):
    """The frames forwards and backwards, as often as it takes, and their masks; written by links."""
    there_and_back = recording.frames + recording.frames[-2:0:-1]
    step = round((recording.frames[-1][0] - recording.frames[0][0]) / (len(recording.frames) - 1))
    played = Sequence(recording.folder, [(10**9 + i * step, *there_and_back[i % len(there_and_back)][1:])
                                         for i in range(count)])
    played.write(folder)
    if (recording.folder / "mask").is_dir():
        (folder / "mask").mkdir()
        for stamp, colour, *_ in played.frames:
            mask = recording.folder / "mask" / f"{Path(colour).stem}.png"
            (folder / "mask" / f"{stamp_text(stamp)}.png").symlink_to(mask.resolve())
    return played


def micros(stamp):
    return round(float(stamp) * 1e6)


def stamp_text(stamp_us):
    return f"{stamp_us // 10**6}.{stamp_us % 10**6:06d}"


def read_tum(path):
    poses = {}
    for line in Path(path).open():
        if not line.startswith("#"):
            numbers = [float(x) for x in line.split()]
            poses[micros(line.split()[0])] = np.array(numbers[1:])
    return poses


def read_calibration(folder):
    lines = (folder / "calibration.txt").read_text().splitlines()
    return {k: float(v) for k, v in (line.split()[:2] for line in lines if line[:1].islower())}


def read_table(path):
    lines = Path(path).read_text().splitlines()
    return [dict(zip(lines[0].split(","), line.split(","))) for line in lines[1:]]


def alignment(estimates, truth):
    """Rotation and shift that bring the estimates' frame to the truth's, by the first of them."""
    first = min(s for s in estimates if s in truth)
    turn = Rotation.from_quat(truth[first][3:]) * Rotation.from_quat(estimates[first][3:]).inv()
    return turn, truth[first][:3] - turn.apply(estimates[first][:3])


def errors_m(estimates, truth, aligned):
    turn, shift = aligned
    return {s: float(np.linalg.norm(turn.apply(p[:3]) + shift - truth[s][:3]))
            for s, p in estimates.items() if s in truth}


def best_fit_rmse_m(estimates, truth):
    stamps = [s for s in estimates if s in truth]
    est = np.array([estimates[s][:3] for s in stamps])
    true = np.array([truth[s][:3] for s in stamps])
    est, true = est - est.mean(0), true - true.mean(0)
    turn = Rotation.align_vectors(true, est)[0]
    return float(np.sqrt(np.mean(np.sum((turn.apply(est) - true) ** 2, axis=1))))


def count_frames(out, truth, aligned, stamps):
    """Of the final poses and of those delivered: how many there are, how many of another place."""
    provisional = {micros(row["stamp"]): row["provisional"] == "1"
                   for row in read_table(out / "frames.csv")}
    counts = {"frames": len(stamps)}
    for name, file in (("final", "trajectory.txt"), ("live", "trajectory_live.txt")):
        off = errors_m(read_tum(out / file), truth, aligned)
        mine = [(off[s], provisional[s]) for s in stamps if s in off]
        counts |= {f"{name}_tracked": len(mine),
                   f"{name}_wrong_marked": sum(e > WRONG_M and p for e, p in mine),
                   f"{name}_wrong": sum(e > WRONG_M and not p for e, p in mine)}
    return counts


def count_loops(out, truth):
    """What loops.csv says. False is a loop whose views stood apart, or do not lie to each other in
    the end as they should."""
    poses = read_tum(out / "trajectory.txt")

    def from_place(of, row):
        now, then = (of.get(micros(row[key])) for key in ("stamp", "place_stamp"))
        if now is None or then is None:
            return None
        return Rotation.from_quat(then[3:]).inv().apply(now[:3] - then[:3])
    counts = {"closed": 0, "false": 0, "refused": {}}
    for row in read_table(out / "loops.csv"):
        if row["outcome"] != "closed":
            why = row["verdict"] if row["outcome"] == "refused" else row["outcome"]
            counts["refused"][why] = counts["refused"].get(why, 0) + 1
            continue
        counts["closed"] += 1
        is_so, should_be = from_place(poses, row), from_place(truth, row)
        is_off = is_so is not None and np.linalg.norm(is_so - should_be) > OFF_M
        counts["false"] += int(is_off or np.linalg.norm(should_be) > FALSE_LOOP_M)
    return counts


class Bench:
    """A folder for what one measurement renders and runs, deleted when it is left."""

    def __init__(self, options):
        self.options = options
        self.made = []

    def __enter__(self):
        self.options.scratch.mkdir(parents=True, exist_ok=True)
        return self

    def __exit__(self, *_):
        for path in self.made:
            if path.is_dir():
                shutil.rmtree(path)
            elif path.exists():
                path.unlink()
            path.with_name(path.name + ".dense").unlink(missing_ok=True)  # beside a map

    def keep(self, name):
        self.made = [path for path in self.made if path.name != name]

    def folder(self, name):
        folder = self.options.scratch / name
        if not folder.exists():
            self.made.append(folder)
        return folder

    def call(self, *arguments):
        command = [self.options.ygslam, "--quiet", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def render(self, name, world, seed, *arguments):
        folder = self.folder(name)
        if folder in self.made:
            done = self.call("simulate", world, "--seed", seed, "--out", folder, *arguments)
            if done.returncode != 0:
                raise SystemExit(done.stderr)
        return Sequence(folder)

    def world(self, name, change):
        """A world of the project, changed."""
        config = yaml.safe_load((WORLDS / f"{name}.yaml").read_text())
        change(config)
        file = self.folder(f"{name}.yaml")
        file.write_text(yaml.safe_dump(config))
        return file

    def write(self, name, sequence):
        folder = self.folder(name)
        return sequence.write(folder)

    def run(self, name, sequence, *arguments, command="run", how=OFF):
        """Folder of the results; exit code 7 (lost for long) is a result."""
        out = self.folder(name)
        if out.exists():
            shutil.rmtree(out)
        done = self.call(command, sequence, "--out", out, *how, *arguments)
        if done.returncode not in (0, 7):
            raise SystemExit(f"{name}: {done.stderr}")
        return out
