#!/usr/bin/env python3
"""Draws what bench/row_residuals.cpp prints of several maps, a panel for each recording.

  row_residuals.py --out PICTURE.png "recorded: as global=before.csv" "recorded: known=after.csv" ...
"""
import argparse

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="+", metavar="PANEL: LINE=FILE.csv")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    tables = [table.rsplit("=", 1) for table in arguments.tables]
    panels = list(dict.fromkeys(title.split(": ")[0] for title, _ in tables))
    figure, axes = plt.subplots(1, len(panels), figsize=(4.2 * len(panels), 3.6), sharey=True,
                                squeeze=False)
    for title, path in tables:
        panel, line = title.split(": ")
        rows = np.genfromtxt(path, delimiter=",", names=True)
        axes[0, panels.index(panel)].plot(rows["late_ms"], rows["row_px"], marker="o", markersize=3,
                                          label=line)
    for axis, panel in zip(axes[0], panels):
        axis.axvline(0, color="grey", linewidth=0.8)
        axis.set_title(panel)
        axis.set_xlabel("seen later than the map expects [ms]")
        axis.legend(frameon=False, loc="upper right")
    axes[0, 0].invert_yaxis()
    axes[0, 0].set_ylabel("image row [px]")
    figure.tight_layout()
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
