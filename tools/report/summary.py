"""Median and spread over runs. Runs without a number are counted, never forgotten."""
import dataclasses
import statistics

from .results import STATUSES, WITH_FIGURES

ATE = ("ate",)
RPE_30_M = ("rpe", "frames30", "trans_m")
RPE_30_DEG = ("rpe", "frames30", "rot_deg")
RPE_1S_M = ("rpe", "sec1", "trans_m")
RPE_1S_DEG = ("rpe", "sec1", "rot_deg")


@dataclasses.dataclass
class Spread:
    """@p median, low, high over the n of total runs that gave a number (None if n is 0).
    @p faults: {status: count} of runs that were not ok, also of lost ones that gave a number."""
    median: float | None
    low: float | None
    high: float | None
    n: int
    total: int
    faults: dict

    @property
    def sound(self):
        """Every run was made, was ok and gave a number."""
        return self.total > 0 and self.n == self.total and not self.faults

    @property
    def fault_text(self):
        """'1 crashed, 2 lost'; sound runs without a number count where others have one."""
        parts = [f"{count} {STATUSES[status]}" for status, count in sorted(self.faults.items())]
        if not parts and 0 < self.n < self.total:
            parts.append(f"{self.total - self.n} without a number")
        return ", ".join(parts)


def spread(runs, *keys):
    """Spread of a figure of metrics.json over runs of one mode."""
    values = [value for value in (run.figure(*keys) for run in runs) if value is not None]
    faults = {}
    for run in runs:
        if run.status != "ok":
            faults[run.status] = faults.get(run.status, 0) + 1
    if not values:
        return Spread(None, None, None, 0, len(runs), faults)
    return Spread(statistics.median(values), min(values), max(values), len(values), len(runs),
                  faults)


def typical_run(runs):
    """The run that figures show: that of the (lower) median ATE, else the first that has poses."""
    judged = [run for run in runs if run.figure("ate", "rmse") is not None]
    if judged:
        judged.sort(key=lambda run: run.figure("ate", "rmse"))
        return judged[(len(judged) - 1) // 2]
    return next((run for run in runs if run.status in WITH_FIGURES
                 and (run.folder / "trajectory.txt").exists()), None)


@dataclasses.dataclass
class Fault:
    """Something that went wrong, once for all runs of a sequence that it happened to."""
    sequence: object
    what: str
    runs: list  # empty: the sequence itself

    @property
    def where(self):
        """'off run 1, full runs 2, 3'."""
        modes = {}
        for run in self.runs:
            modes.setdefault(run.mode, []).append(str(run.number))
        return ", ".join(f"{mode} run{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}"
                         for mode, numbers in modes.items())


def faults(sweep):
    """Unreadable sequences first, then runs that went wrong, then those that were not made."""
    found = [Fault(sequence, sequence.error, []) for sequence in sweep.sequences if sequence.error]
    grouped = {}
    for sequence, run in sweep.runs():
        if run.status != "ok":
            key = (run.status == "unfinished", sequence.id, described(run))
            grouped.setdefault(key, Fault(sequence, described(run), [])).runs.append(run)
    return found + [fault for key, fault in grouped.items() if not key[0]] + [
        fault for key, fault in grouped.items() if key[0]]


def described(run):
    """'lost: for 61 % of the time (39.0 % of the frames tracked)'."""
    said = STATUSES[run.status] + (f": {run.error}" if run.error else "")
    coverage = run.figure("coverage")
    return said if coverage is None else f"{said} ({100 * coverage:.1f} % of the frames tracked)"
