"""The trajectories that turn with the mouse (Fig. 8): data for plotly.js in the page."""
import json

import numpy as np

from . import plot_style as style
from .series import thin


def scene(paths, modes, points):
    """JSON of {data, layout} for plotly; colours of axes are the page's business.
    @param paths {name: N x 3 [m]}, the truth under the name "truth"."""
    data = []
    for name, path in paths.items():
        path = path[thin(len(path), points)].round(4)
        truth = name == "truth"
        data.append({"type": "scatter3d", "mode": "lines", "name": name,
                     "x": path[:, 0].tolist(), "y": path[:, 1].tolist(), "z": path[:, 2].tolist(),
                     "line": {"width": 3 if truth else 4, "dash": "dash" if truth else "solid",
                              "color": style.INK if truth else style.colour(name, modes)},
                     "hovertemplate": "%{x:.3f}, %{y:.3f}, %{z:.3f} m<extra>" + name + "</extra>"})
    low, high = box(paths)
    axes = {f"{axis}axis": {"title": {"text": f"{axis} [m]"},
                            "range": [round(low[i], 4), round(high[i], 4)]}
            for i, axis in enumerate("xyz")}
    ratio = 1.3 * (high - low) / (high - low).max()
    layout = {"scene": {"aspectmode": "manual", **axes,
                        "aspectratio": dict(zip("xyz", ratio.round(4).tolist())),
                        "camera": {"eye": {"x": 1.5, "y": 1.5, "z": 1.1}}},
              "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
              "legend": {"orientation": "h", "y": 0, "yanchor": "bottom"}, "uirevision": "keep"}
    # "</" would end the script element that holds this.
    return json.dumps({"data": data, "layout": layout}, separators=(",", ":")).replace("</", "<\\/")


def box(paths):
    """Lower and upper corner [m] around all paths, nowhere thinner than a seventh of its length, so
    that a scale true in all directions fits into view."""
    points = np.concatenate([path for path in paths.values()])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    half = 0.5 * 1.05 * (high - low)
    half = np.maximum(half, max(half.max() / 7, 1e-4))
    return (low + high) / 2 - half, (low + high) / 2 + half


def plotly_script():
    """plotly.js as it comes with the Python package."""
    from plotly.offline import get_plotlyjs
    return get_plotlyjs().replace("</script", "<\\/script")
