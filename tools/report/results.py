"""Reads the result folder of `ygslam bench`: sweep.json and what every run left.

A folder that is no result folder is an InputError; a single broken run is a run that failed.
"""
import dataclasses
import math
import pathlib

from . import series
from .files import InputError, read_json

FORMAT = 1
MOST_RUNS = 1000  # of a sequence in a mode; more is a damaged file
SWEEP = "sweep.json"
# What a run can have come to, in run.json, and how tables say it; only `ok` is unmarked.
# `unfinished` is the report's own word for a run that was asked for and is not there.
STATUSES = {"ok": "ok", "lost": "lost", "failed": "failed", "crashed": "crashed",
            "timed_out": "timed out", "bad_truth": "bad truth", "unfinished": "not finished"}
# Runs that came to an end of their own, or nearly: what they measured counts.
WITH_FIGURES = ("ok", "lost", "bad_truth")
# Files of a run that figures are drawn from, and what reads them.
DRAWN = {"trajectory.txt": series.read_trajectory, "errors.csv": series.read_errors}
# Parts of metrics.json in which every number is a length, an angle or a time.
FIGURE_TREES = ("ate", "rpe", "timing_ms", "cpu_ms")


@dataclasses.dataclass
class Run:
    """One run of one mode on one sequence."""
    folder: pathlib.Path
    mode: str
    number: int
    status: str
    error: str | None = None
    timings_valid: bool = True
    wall_s: float | None = None
    command: str = ""
    metrics: dict = dataclasses.field(default_factory=dict)

    def figure(self, *keys):
        """A finite number of metrics.json by its path of keys, else None."""
        value = self.metrics
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
        return finite(value)


@dataclasses.dataclass
class Sequence:
    id: str
    name: str
    kind: str  # tum, bonn, rendered, folder
    paper_row: str | None
    frames: float | None
    truth: dict | None
    error: str | None
    folder: pathlib.Path
    runs: dict = dataclasses.field(default_factory=dict)  # mode -> [Run]

    @property
    def rendered(self):
        return self.kind == "rendered"


@dataclasses.dataclass
class Sweep:
    root: pathlib.Path
    data: dict
    modes: list
    sequences: list

    @property
    def options(self):
        return self.data.get("options") or {}

    def runs(self):
        for sequence in self.sequences:
            for mode in self.modes:
                yield from ((sequence, run) for run in sequence.runs[mode])

    @property
    def timings_valid(self):
        return bool(self.data.get("timings_valid", True)) and all(
            run.timings_valid for _, run in self.runs())


def finite(value):
    """A finite number as float, anything else None."""
    usable = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if usable and math.isfinite(value) else None


def fault_of_metrics(metrics):
    """What cannot be in metrics.json, or None: the figures must be finite and not negative. Null
    stands for what was not measured, but for the ATE, which would not be there at all."""
    coverage = finite(metrics.get("coverage"))
    if coverage is None or not 0 <= coverage <= 1:
        return "coverage is no share"
    for name in FIGURE_TREES:
        if name in metrics and not isinstance(metrics[name], dict):
            return f"{name} is no sensible number"
        place = fault_in(metrics.get(name), name)
        if place:
            return f"{place} is no sensible number"
    if "ate" in metrics and finite(metrics["ate"].get("rmse")) is None:
        return "ate.rmse is no sensible number"
    return None


def fault_in(tree, place):
    """The place of the first value that is no number from 0 on, or None."""
    if tree is None:
        return None
    if not isinstance(tree, dict):
        value = finite(tree)
        return place if value is None or value < 0 else None
    return next((found for key, value in tree.items()
                 if (found := fault_in(value, f"{place}.{key}"))), None)


def check_drawn(folder, recorded):
    """@raise InputError if a file that figures are drawn from is damaged, or not there although
    run.json has it in its table `files`."""
    for name, read in DRAWN.items():
        if (folder / name).exists() or (isinstance(recorded, dict) and name in recorded):
            read(folder / name)


def read_run(folder, mode, number):
    """A run from its folder; faults of its files become its status."""
    run = Run(folder, mode, number, "unfinished")
    if not (folder / "run.json").exists():
        return run
    try:
        facts = read_json(folder / "run.json")
        status = facts.get("status")
        run.status = status if isinstance(status, str) and status in STATUSES else "failed"
        run.error = str(facts["error"]) if facts.get("error") is not None else None
        run.timings_valid = bool(facts.get("timings_valid", True))
        run.wall_s = finite(facts.get("wall_s"))
        run.command = str(facts.get("command", ""))
        if run.status in WITH_FIGURES:
            metrics = read_json(folder / "metrics.json")
            fault = fault_of_metrics(metrics)
            if fault:
                raise InputError(f"{folder / 'metrics.json'}: {fault}")
            check_drawn(folder, facts.get("files"))
            run.metrics = metrics
    except InputError as error:
        run.status = "failed"
        run.error = str(error).replace(str(folder), folder.name)
    return run


def read_sequence(root, entry, modes, run_count):
    """A sequence of sweep.json with all its runs, also those that were not made."""
    if not isinstance(entry, dict) or not isinstance(entry.get("id"), str):
        raise InputError(f"{root / SWEEP}: a sequence without an id")
    name = entry["id"]
    if name in ("", ".", "..") or "/" in name or "\\" in name:
        raise InputError(f"{root / SWEEP}: sequence id {name!r} is not a folder name")
    truth, error = entry.get("truth"), entry.get("error")
    sequence = Sequence(
        id=name, name=str(entry.get("name") or name), kind=str(entry.get("kind") or "folder"),
        paper_row=str(entry.get("paper_row")) if entry.get("paper_row") else None,
        frames=finite(entry.get("frames")),
        truth={key: finite(v) for key, v in truth.items()} if isinstance(truth, dict) else None,
        error=str(error) if error else None, folder=root / "sequences" / name)
    asked = entry.get("runs_asked")
    for mode in modes:
        folder = root / "runs" / name / mode
        count = run_count_of(asked, mode, run_count)
        if count is None:
            raise InputError(f"{root / SWEEP}: runs_asked of {name!r} is no table of numbers")
        sequence.runs[mode] = [] if sequence.error else [
            read_run(folder / f"{number:02d}", mode, number) for number in range(1, count + 1)]
    return sequence


def run_count_of(asked, mode, run_count):
    """How many runs of a mode were asked for; without such a table (older sweeps) run_count.
    None if the table is not one."""
    if asked is None:
        return run_count
    count = asked.get(mode, 0) if isinstance(asked, dict) else None
    return count if isinstance(count, int) and 0 <= count <= MOST_RUNS else None


def read_sweep(root):
    """The whole result folder. @raise InputError if it is none."""
    root = pathlib.Path(root)
    if not root.is_dir():
        raise InputError(f"{root}: no such folder")
    if not (root / SWEEP).exists():
        raise InputError(f"{root}: no result folder of `ygslam bench` ({SWEEP} is missing)")
    data = read_json(root / SWEEP)
    if data.get("format") != FORMAT:
        raise InputError(f"{root / SWEEP}: format {data.get('format')!r}, this report reads "
                         f"{FORMAT}")
    options = data.setdefault("options", {})
    if not isinstance(options, dict) or not isinstance(options.get("config") or {}, dict):
        raise InputError(f"{root / SWEEP}: options or options.config is no table")
    modes = options.get("modes") or data.get("modes")
    if not isinstance(modes, list) or not modes or not all(isinstance(m, str) for m in modes):
        raise InputError(f"{root / SWEEP}: no list of modes")
    run_count = options.get("runs", 1)
    if not isinstance(run_count, int) or not 1 <= run_count <= MOST_RUNS:
        raise InputError(f"{root / SWEEP}: options.runs is no number from 1 to {MOST_RUNS}")
    entries = data.get("sequences")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{root / SWEEP}: no sequences")
    return Sweep(root, data, modes, [read_sequence(root, e, modes, run_count) for e in entries])
