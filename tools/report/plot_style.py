"""How figures look: colours that read on white and on black, and SVG fit for a page."""
import io
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)
from matplotlib.colors import LinearSegmentedColormap  # noqa: E402

MODE_COLOURS = {"off": "#e4572e", "geometry": "#b98300", "semantic": "#3b8fd6", "full": "#1fa37a"}
OTHER_COLOURS = ("#9467bd", "#8c6d5a", "#d062a8", "#7f7f7f")
ESTIMATE, DIFFERENCE = "#3b8fd6", "#e0435c"
# Stand for the page's text and grid colours inside the SVG; nothing else has these values.
INK, GRID = "#010203", "#c1c2c4"
PAPER_INK, PAPER_GRID = "#000000", "#cccccc"
# Small to large errors; no end of it is lost on white or on black.
ERROR_COLOURS = LinearSegmentedColormap.from_list(
    "error", ["#3b8fd6", "#1fa37a", "#b98300", "#e0435c"])

plt.rcParams.update({
    "svg.fonttype": "none", "font.family": "DejaVu Sans", "font.size": 9, "axes.titlesize": 10,
    "text.color": INK, "axes.edgecolor": INK, "axes.labelcolor": INK, "xtick.color": INK,
    "ytick.color": INK, "grid.color": GRID, "grid.linewidth": 0.5, "axes.grid": True,
    "axes.axisbelow": True, "figure.facecolor": "none", "axes.facecolor": "none",
    "savefig.facecolor": "none", "legend.frameon": False, "lines.linewidth": 1.2,
    "axes.spines.top": False, "axes.spines.right": False, "path.simplify_threshold": 0.3,
    "axes.formatter.useoffset": False,
})


def colour(mode, modes):
    """The colour of a mode, the same in every figure."""
    others = [m for m in modes if m not in MODE_COLOURS]
    return MODE_COLOURS.get(mode) or OTHER_COLOURS[others.index(mode) % len(OTHER_COLOURS)]


def new_figure(rows, columns, width_in, height_in, **how):
    figure, axes = plt.subplots(rows, columns, figsize=(width_in, height_in), squeeze=False,
                                layout="constrained", **how)
    return figure, axes


def to_svg(figure, name):
    """The figure as compact SVG text with INK and GRID in it; closes the figure.
    @param name makes ids unlike those of other figures in one page."""
    out = io.StringIO()
    with plt.rc_context({"svg.hashsalt": name}):
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None}, dpi=140)
    plt.close(figure)
    svg = out.getvalue()
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = re.sub(r' d="[^"]*"', short_path, svg)
    svg = re.sub(r' transform="rotate\(-0 [^"]*"', "", svg)
    svg = re.sub(r' [xy]="[^"]*"', short_numbers, svg)
    return re.sub(r"\n\s*", "\n", svg)


def short_numbers(match):
    """Coordinates to a tenth of a point."""
    return re.sub(r"-?\d+\.\d{2,}", lambda m: f"{float(m.group()):.1f}", match.group())


def short_path(match):
    """A path attribute with lines on one line; the points after "M x y" need no "L"."""
    path = re.sub(r"\s+", " ", short_numbers(match)).replace(' "', '"')
    return path if re.search(r"[CQAHVZz]", path) else path.replace(" L ", " ")


class StyleClasses:
    """Styles that the figures of one page share, as CSS classes instead of a text at each mark."""

    def __init__(self):
        self.names = {}

    def replace(self, svg):
        return re.sub(r' style="([^"]*)"', lambda match: f' class="{self.name(match[1])}"', svg)

    def name(self, style):
        return self.names.setdefault(style, f"f{len(self.names)}")

    def css(self):
        return "".join(f".{name}{{{style}}}\n" for style, name in self.names.items())


def for_paper(svg):
    """A file of its own: black ink."""
    return svg.replace(INK, PAPER_INK).replace(GRID, PAPER_GRID)


def for_page(svg, label):
    """Inline SVG that takes the page's colours and scales with its box."""
    svg = svg.replace(INK, "currentColor").replace(GRID, "var(--grid)")
    # A style element would hold for the whole page; page.css says the same of figures only.
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", svg, count=1, flags=re.S)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    return svg.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)
