"""The trajectories that turn with the mouse (Fig. 8): data for plotly.js in the page."""
import json

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
    axes = {f"{axis}axis": {"title": {"text": f"{axis} [m]"}} for axis in "xyz"}
    layout = {"scene": {"aspectmode": "data", **axes,
                        "camera": {"eye": {"x": 1.5, "y": 1.5, "z": 1.1}}}, "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
              "legend": {"orientation": "h", "y": 0.98}, "uirevision": "keep"}
    # "</" would end the script element that holds this.
    return json.dumps({"data": data, "layout": layout}, separators=(",", ":")).replace("</", "<\\/")


def plotly_script():
    """plotly.js as it comes with the Python package."""
    from plotly.offline import get_plotlyjs
    return get_plotlyjs().replace("</script", "<\\/script")
