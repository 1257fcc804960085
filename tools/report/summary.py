"""Median and spread over runs. Runs without a number are counted, never forgotten."""
import dataclasses
import statistics

ATE = ("ate",)
RPE_30_M = ("rpe", "frames30", "trans_m")
RPE_30_DEG = ("rpe", "frames30", "rot_deg")
RPE_1S_M = ("rpe", "sec1", "trans_m")
RPE_1S_DEG = ("rpe", "sec1", "rot_deg")

SAID = {"lost": "lost", "failed": "failed", "crashed": "crashed", "bad_truth": "bad truth",
        "unfinished": "not finished"}


NO_TRUTH = "no truth"


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
        """'1 crashed, 2 lost', or 'no number' for ok runs that have none."""
        parts = [f"{count} {SAID[status]}" for status, count in sorted(self.faults.items())]
        without = self.total - self.n - sum(c for s, c in self.faults.items() if s != "lost")
        if not parts and without > 0:
            parts.append(NO_TRUTH if self.n == 0 else f"{without} without a number")
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
    return next((run for run in runs if (run.folder / "trajectory.txt").exists()), None)


def faulty_runs(sweep):
    """[(sequence, run or None, what)] of everything that went wrong, unreadable sequences first."""
    found = [(sequence, None, sequence.error) for sequence in sweep.sequences if sequence.error]
    for sequence, run in sweep.runs():
        if run.status != "ok":
            coverage = run.figure("coverage")
            said = SAID[run.status]
            if run.error:
                said += f": {run.error}"
            if coverage is not None:
                said += f" ({100 * coverage:.1f} % of the frames tracked)"
            found.append((sequence, run, said))
    return found
