"""The picture of `ygslam eval --plot`: paths seen along their flattest direction, errors over time.

    python tools/report/eval_plot.py --out FILE.svg|png|pdf < DATA.json

DATA: {"time": axis title, "alignment": name, "truth": {"t": [...], "xyz": [[x, y, z], ...]},
"estimates": [{"name", "t", "xyz", "truth_xyz", "ate_m", "rmse_m"}, ...]}; metres, estimates aligned.
"""
import argparse
import io
import json
import os
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import numpy as np  # noqa: E402
from matplotlib import pyplot  # noqa: E402

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito 2008
MOST_LINKS = 150  # lines between estimate and truth that can still be told apart
STYLE = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
         "axes.grid": True, "grid.alpha": 0.25, "svg.fonttype": "none", "legend.frameon": False}


def plane_of(points):
    """The two axes (of x, y, z) along which the path extends most, in their order."""
    flattest = int(np.argmin(np.ptp(points, axis=0)))
    return [axis for axis in range(3) if axis != flattest]


def short_names(names):
    """As many of each path's last parts as it takes to tell all apart."""
    parts = [pathlib.PurePath(name).parts for name in names]
    for count in range(1, max(map(len, parts)) + 1):
        short = ["/".join(p[-count:]) for p in parts]
        if len(set(short)) == len(set(names)):
            return short
    return names


def within_reach(truth, estimates):
    """The part of the truth at the time of the estimates."""
    times = np.asarray(truth["t"], float)
    points = np.asarray(truth["xyz"], float).reshape(-1, 3)
    first = min(e["t"][0] for e in estimates)
    last = max(e["t"][-1] for e in estimates)
    keep = (times >= first - 0.5) & (times <= last + 0.5)
    return points[keep] if keep.any() else points


def draw_paths(axes, truth, estimates):
    """Truth in grey, estimates in colour, thin red lines between the two for a single estimate."""
    first, second = plane_of(truth)
    axes.plot(truth[:, first], truth[:, second], color="0.35", linewidth=1.2, label="truth")
    for number, estimate in enumerate(estimates):
        points = np.asarray(estimate["xyz"], float)
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(points[:, first], points[:, second], color=colour, linewidth=1.0)
        if len(estimates) == 1:
            true_points = np.asarray(estimate["truth_xyz"], float)
            step = max(1, len(points) // MOST_LINKS)
            ends = np.stack([points[::step], true_points[::step]])
            axes.plot(ends[:, :, first], ends[:, :, second], color="#d62728", linewidth=0.6,
                      alpha=0.6)
    axes.set_xlabel(f"{'xyz'[first]} [m]")
    axes.set_ylabel(f"{'xyz'[second]} [m]")
    axes.set_aspect("equal", adjustable="datalim")


def draw_errors(axes, data, names):
    """Absolute error over time, the RMSE in the legend."""
    for number, (estimate, name) in enumerate(zip(data["estimates"], names)):
        axes.plot(estimate["t"], estimate["ate_m"], color=COLOURS[number % len(COLOURS)],
                  linewidth=1.0, label=f"{name}: RMSE {estimate['rmse_m']:.4f} m")
    axes.set_xlabel(data["time"])
    axes.set_ylabel("absolute trajectory error [m]")
    axes.set_ylim(bottom=0)
    axes.margins(x=0.01)


def draw(data):
    """The whole figure."""
    names = short_names([estimate["name"] for estimate in data["estimates"]])
    with matplotlib.rc_context(STYLE):
        figure, (paths, errors) = pyplot.subplots(1, 2, figsize=(10, 4.6), layout="constrained")
        truth = within_reach(data["truth"], data["estimates"])
        draw_paths(paths, truth, data["estimates"])
        draw_errors(errors, data, names)
        for axes, title in ((paths, f"alignment {data['alignment']}"), (errors, None)):
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), borderaxespad=0, fontsize=8,
                        title=title, title_fontsize=8, alignment="left")
        return figure


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    out = parser.parse_args().out
    temporary = out.with_name(f".{out.stem}.{os.getpid()}{out.suffix}")
    try:
        with matplotlib.rc_context(STYLE):
            figure = draw(json.load(sys.stdin))
            metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
            # Into memory first: on a full disk the PDF writer fails in ways of its own.
            picture = io.BytesIO()
            figure.savefig(picture, format=out.suffix[1:], dpi=160,
                           metadata=metadata.get(out.suffix))
        temporary.write_bytes(picture.getvalue())
        os.replace(temporary, out)
    except OSError as error:
        print(f"error: {error.strerror}", file=sys.stderr)
        return 9
    finally:
        temporary.unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
