#!/usr/bin/env python3
"""Draws the error of a run's poses and what they claimed to err by (docs/images/coasting.png).

    .venv/bin/python bench/coasting_picture.py SEQUENCE OUT PICTURE.png     # OUT: of `ygslam run SEQUENCE --out OUT`
"""
import csv
import sys
from pathlib import Path

import matplotlib
import numpy as np

from coasting import poses_of

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402 - after the choice of what draws

COLOURS = {"coasting": "#f6c667", "lost": "#e57373", "weak": "#c9d6e8"}


def aligned_errors(truth, estimate, until_s):
    """Position errors [m] by stamp, after the rigid motion that fits the poses before until_s best."""
    at = [int(np.argmin(abs(truth[0] - t))) for t in estimate[0]]
    true, seen = truth[1][at], estimate[1]
    early = estimate[0] < estimate[0][0] + until_s
    a, b = true[early] - true[early].mean(0), seen[early] - seen[early].mean(0)
    U, _, V = np.linalg.svd(a.T @ b)
    R = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
    return np.linalg.norm((R @ (seen - seen[early].mean(0)).T).T + true[early].mean(0) - true, axis=1)


def main():
    sequence, out, picture = map(Path, sys.argv[1:4])
    truth = poses_of(sequence / "groundtruth.txt")
    rows = list(csv.DictReader((out / "frames.csv").open(encoding="utf-8")))
    began = float(rows[0]["stamp"])
    t_s = np.array([float(row["stamp"]) - began for row in rows])
    first = next((t for t, row in zip(t_s, rows) if row["state"] in ("coasting", "lost")), t_s[-1])
    figure, axes = plt.subplots(figsize=(9, 3.2), dpi=110)
    for state, colour in COLOURS.items():
        there = np.array([row["state"] == state for row in rows])
        if there.any():
            axes.fill_between(t_s, 0, 1, where=there, color=colour, alpha=0.45, transform=axes.get_xaxis_transform(),
                              label=state, linewidth=0)
    for name, colour, label in (("trajectory_live.txt", "#1f4e79", "error, as a robot is told"),
                                ("trajectory.txt", "#2e7d32", "error, as written at the end")):
        poses = poses_of(out / name)
        axes.plot(poses[0] - began, 1000 * aligned_errors(truth, poses, first), color=colour, label=label, linewidth=1.4)
    bound_mm = [3 * float(row["position_std_mm"]) if row["position_std_mm"] else np.nan for row in rows]
    axes.plot(t_s, bound_mm, "--", color="#c0392b", label="three standard deviations", linewidth=1)
    axes.set(xlabel="time [s]", ylabel="position [mm]", xlim=(t_s[0], t_s[-1]), ylim=(0, None))
    axes.legend(loc="upper left", fontsize=8)
    axes.grid(alpha=0.25)
    figure.tight_layout()
    figure.savefig(picture)


if __name__ == "__main__":
    main()
