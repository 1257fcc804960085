"""Reads the result folder of `ygslam bench`: sweep.json and what every run left.

A folder that is no result folder is an InputError; a single broken run is a run that failed.
"""
import dataclasses
import json
import math
import pathlib

FORMAT = 1
SWEEP = "sweep.json"
# What a run can have come to; only `ok` is unmarked in tables.
STATUSES = ("ok", "lost", "failed", "crashed", "bad_truth", "unfinished")


class InputError(Exception):
    """One line that names the file and its fault."""


def read_json(path):
    """The object in a JSON file. @raise InputError naming file and fault."""
    try:
        data = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON ({str(error).splitlines()[0]})") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: not a JSON object")
    return data


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


def read_run(folder, mode, number):
    """A run from its folder; faults of its files become its status."""
    run = Run(folder, mode, number, "unfinished")
    if not (folder / "run.json").exists():
        return run
    try:
        facts = read_json(folder / "run.json")
        run.status = facts.get("status") if facts.get("status") in STATUSES else "failed"
        run.error = facts.get("error")
        run.timings_valid = bool(facts.get("timings_valid", True))
        run.wall_s = facts.get("wall_s")
        run.command = str(facts.get("command", ""))
        if run.status in ("ok", "lost") or (folder / "metrics.json").exists():
            run.metrics = read_json(folder / "metrics.json")
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
    for mode in modes:
        folder = root / "runs" / name / mode
        sequence.runs[mode] = [] if sequence.error else [
            read_run(folder / f"{number:02d}", mode, number)
            for number in range(1, run_count + 1)]
    return sequence


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
    options = data.get("options")
    options = options if isinstance(options, dict) else {}
    modes = options.get("modes") or data.get("modes")
    if not isinstance(modes, list) or not modes or not all(isinstance(m, str) for m in modes):
        raise InputError(f"{root / SWEEP}: no list of modes")
    run_count = options.get("runs", 1)
    if not isinstance(run_count, int) or run_count < 1:
        raise InputError(f"{root / SWEEP}: options.runs is not a positive number")
    entries = data.get("sequences")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{root / SWEEP}: no sequences")
    return Sweep(root, data, modes, [read_sequence(root, e, modes, run_count) for e in entries])
