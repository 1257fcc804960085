"""Figures 6 to 8 of the paper for one sequence: trajectories and errors, mode against mode."""
import numpy as np
from matplotlib.collections import LineCollection

from . import plot_style as style
from .series import gap_s, thin, with_gaps

AXES = "xyz"
SMALL_M = 0.02  # a path that is not longer is drawn in millimetres


def widest_plane(points_m):
    """The two axes in which a path extends most, in order."""
    finite = points_m[np.all(np.isfinite(points_m), axis=1)]
    extent = np.ptp(finite, axis=0) if len(finite) else np.ones(3)
    return sorted(np.argsort(extent)[-2:].tolist())


def path_scale(*paths_m):
    """(factor, unit) in which ticks of paths N x d are short."""
    extent = max((float(np.ptp(path[np.all(np.isfinite(path), axis=1)], axis=0).max())
                  for path in paths_m if np.isfinite(path).all(axis=1).any()), default=1.0)
    return (1000.0, "mm") if extent <= SMALL_M else (1.0, "m")


def few_ticks(axis):
    for direction in ("x", "y"):
        axis.locator_params(axis=direction, nbins=5)


def line(axis, t_s, values, points, **how):
    """A thinned line that is broken where frames are missing."""
    gap = gap_s(t_s)
    keep = thin(len(t_s), points)
    # A gap of the full series is longer than the steps that thinning makes.
    t, v = with_gaps(t_s[keep], values[keep], gap * max(1.0, len(t_s) / max(1, len(keep))))
    axis.plot(t - how.pop("start_s", 0.0), v, **how)


def mode_panels(series, width_in, height_in):
    """One panel a mode, at most two in a row."""
    columns = min(2, len(series))
    rows = -(-len(series) // columns)
    figure, axes = style.new_figure(rows, columns, width_in, height_in * rows)
    for axis in axes.flat[len(series):]:
        axis.set_axis_off()
    return figure, list(axes.flat)


def absolute_error_paths(series, points):
    """Estimate, truth and difference lines from above, in the manner of the TUM tools (Figs. 6, 7).
    @param series {mode: Errors}."""
    a, b = widest_plane(next(iter(series.values())).truth_m)
    scale, unit = path_scale(*(errors.estimate_m for errors in series.values()))
    figure, axes = mode_panels(series, 9, 3.6)
    for axis, (mode, errors) in zip(axes, series.items()):
        keep = thin(len(errors.t_s), points)
        truth, estimate = scale * errors.truth_m[keep], scale * errors.estimate_m[keep]
        pairs = np.full((3 * len(keep), 3), np.nan)
        pairs[0::3], pairs[1::3] = truth, estimate
        axis.plot(pairs[:, a], pairs[:, b], color=style.DIFFERENCE, linewidth=0.6,
                  label="difference")
        axis.plot(truth[:, a], truth[:, b], color=style.INK, linewidth=1.0, label="truth")
        axis.plot(estimate[:, a], estimate[:, b], color=style.ESTIMATE, label="estimate")
        rmse = np.sqrt(np.nanmean(errors.columns["ate_m"] ** 2))
        axis.set(title=f"{mode}: ATE RMSE {rmse:.4f} m", xlabel=f"{AXES[a]} [{unit}]",
                 ylabel=f"{AXES[b]} [{unit}]")
        axis.set_aspect("equal", adjustable="datalim")
        few_ticks(axis)
    axes[0].legend(loc="best", fontsize=8)
    return figure


def errors_over_time(series, modes, points):
    """Translational and rotational error after alignment."""
    figure, axes = style.new_figure(2, 1, 9, 4.2, sharex=True)
    draw_over_time(axes[:, 0], series, modes, points, ("ate_m", "ate_deg"))
    axes[0, 0].set_ylabel("ATE [m]")
    axes[1, 0].set(ylabel="orientation error [°]", xlabel="time [s]")
    legend_above(figure, axes[0, 0])
    return figure


def relative_errors_over_time(series, modes, points):
    """Drift over 30 frames (left) and over 1 s (right), each at the start of its interval."""
    figure, axes = style.new_figure(2, 2, 9, 4.4, sharex=True, sharey="row")
    for column, (name, title) in enumerate((("rpe30", "over 30 frames"), ("rpe1s", "over 1 s"))):
        draw_over_time(axes[:, column], series, modes, points, (f"{name}_m", f"{name}_deg"))
        axes[0, column].set_title(f"RPE {title}")
        axes[1, column].set_xlabel("time [s]")
    axes[0, 0].set_ylabel("translation [m]")
    axes[1, 0].set_ylabel("rotation [°]")
    legend_above(figure, axes[0, 0])
    return figure


def legend_above(figure, axis):
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center",
                  ncols=6, fontsize=8)


def draw_over_time(axes, series, modes, points, names):
    """Logarithmic where one mode is far worse than another, so that both can be read."""
    start_s = min(errors.t_s[0] for errors in series.values())
    for axis, name in zip(axes, names):
        tops = []
        for mode, errors in series.items():
            values = errors.columns[name]
            if not np.any(np.isfinite(values)):
                continue
            tops.append(np.nanmax(values))
            line(axis, errors.t_s, values, points, start_s=start_s, label=mode, linewidth=1.0,
                 color=style.colour(mode, modes))
        if tops and min(tops) > 0 and max(tops) > 8 * min(tops):
            axis.set_yscale("log")
        else:
            axis.set_ylim(bottom=0)


def coloured_paths(series, points):
    """The estimated path, coloured by its distance from the truth; one scale for all modes."""
    a, b = widest_plane(next(iter(series.values())).truth_m)
    figure, axes = mode_panels(series, 9, 3.6)
    scale, unit = path_scale(*(errors.estimate_m for errors in series.values()))
    top = scale * max(float(np.nanmax(errors.columns["ate_m"])) for errors in series.values())
    drawn = None
    for axis, (mode, errors) in zip(axes, series.items()):
        keep = thin(len(errors.t_s), points)
        path, truth = (scale * p[keep][:, [a, b]] for p in (errors.estimate_m, errors.truth_m))
        axis.plot(truth[:, 0], truth[:, 1], color=style.INK, linewidth=0.8, alpha=0.4)
        drawn = LineCollection(np.stack([path[:-1], path[1:]], axis=1), linewidth=2,
                               cmap=style.ERROR_COLOURS,
                               array=scale * errors.columns["ate_m"][keep][1:], capstyle="round")
        drawn.set_clim(0, top)
        axis.add_collection(drawn)
        axis.autoscale_view()
        axis.set(title=mode, xlabel=f"{AXES[a]} [{unit}]", ylabel=f"{AXES[b]} [{unit}]")
        axis.set_aspect("equal", adjustable="datalim")
        few_ticks(axis)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.8)
    bar.set_label(f"ATE [{unit}]")
    bar.solids.set_rasterized(True)
    return figure


def pose_over_time(series, angles, truth_angles, modes, points):
    """x, y, z and roll, pitch, yaw against the truth.
    @param angles {mode: (t_s, N x 3 deg)}; truth_angles (t_s, N x 3 deg) or None."""
    figure, axes = style.new_figure(3, 2, 9, 5.4, sharex=True)
    start_s = min(errors.t_s[0] for errors in series.values())
    longest = max(series.values(), key=lambda errors: len(errors.t_s))
    scale, unit = path_scale(*(errors.estimate_m for errors in series.values()))
    for i, axis in enumerate(axes[:, 0]):
        for mode, errors in series.items():
            line(axis, errors.t_s, scale * errors.estimate_m[:, i], points, start_s=start_s, label=mode,
                 color=style.colour(mode, modes), linewidth=1.0)
        line(axis, longest.t_s, scale * longest.truth_m[:, i], points, start_s=start_s, label="truth",
             color=style.INK, linewidth=1.0, linestyle=(0, (4, 2)))
        axis.set_ylabel(f"{AXES[i]} [{unit}]")
    for i, (axis, name) in enumerate(zip(axes[:, 1], ("roll", "pitch", "yaw"))):
        for mode, (t_s, degrees) in angles.items():
            line(axis, t_s, degrees[:, i], points, start_s=start_s, linewidth=1.0,
                 color=style.colour(mode, modes))
        if truth_angles:
            line(axis, truth_angles[0], truth_angles[1][:, i], points, start_s=start_s,
                 color=style.INK, linewidth=1.0, linestyle=(0, (4, 2)))
        axis.set_ylabel(f"{name} [°]")
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    legend_above(figure, axes[0, 0])
    return figure


def paths_in_space(paths, modes, points):
    """Fig. 8 for paper: trajectories in space from one side. @param paths {name: N x 3 [m]}."""
    figure = style.plt.figure(figsize=(6.5, 5), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    scale, unit = path_scale(*paths.values())
    for name, path in paths.items():
        path = scale * path[thin(len(path), points)]
        truth = name == "truth"
        axis.plot(*path.T, label=name, linewidth=1.2, linestyle="--" if truth else "-",
                  color=style.INK if truth else style.colour(name, modes))
    axis.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
    axis.set_aspect("equal", adjustable="datalim")
    for direction in "xyz":
        axis.locator_params(axis=direction, nbins=5)
    for pane in (axis.xaxis, axis.yaxis, axis.zaxis):
        pane.set_pane_color((0, 0, 0, 0))
    axis.legend(fontsize=8)
    return figure
