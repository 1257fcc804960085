"""report/index.html: one file that needs nothing else."""
import pathlib
import re

import jinja2
from markupsafe import Markup, escape

from . import pictures, plot_style, scene3d, summary
from .cells import Row, letter, rank
from .published import source_text
from .results import finite
from .tables import measured_cell
from .timing_tables import tracking_summary

HERE = pathlib.Path(__file__).parent
WAYS = {"as fast as possible": "as fast as possible: every frame is waited for, none dropped",
        "realtime": "realtime: frames fed at their stamps, late ones dropped",
        "deterministic": "deterministic: one schedule, masks two frames late; times are not "
                         "those of a live system"}


def render(sweep, published, tables, chapters, size):
    """The whole page as text."""
    styles = prepare(chapters)
    context = {
        "tables": tables, "chapters": chapters, "size": size, "modes": sweep.modes,
        "failures": summary.faults(sweep), "remarks": remarks(sweep),
        "headline": headline(sweep), "facts": facts(sweep), "citations": published.citations,
        "css": Markup((HERE / "page.css").read_text(encoding="utf-8") + styles),
        "javascript": (HERE / "page.js").read_text(encoding="utf-8"),
        "plotly": (scene3d.plotly_script() if any(c.scene for c in chapters) else ""),
    }
    return environment(published).get_template("page.html.j2").render(context)


def table_html(table, published):
    """One table as an HTML fragment for other pages."""
    macros = environment(published).get_template("table.html.j2").module
    sources = [(key, published.citations[key]) for key in table.sources()]
    return str(macros.table(table)) + str(macros.source_list(sources)) + "\n"


def environment(published):
    """Templates beside this file; everything put into them is escaped."""
    made = jinja2.Environment(loader=jinja2.FileSystemLoader(HERE), autoescape=True,
                              undefined=jinja2.StrictUndefined)
    numbers = {key: i for i, key in enumerate(published.citations, 1)}
    made.globals.update(letter=letter, cite_number=numbers, source_text=source_text)
    made.filters["words"] = with_commands
    return made


def with_commands(text):
    """Escaped; what stands between backticks is a command."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def prepare(chapters):
    """Figures and pictures as they stand in the page. @return CSS that the figures need."""
    styles = plot_style.StyleClasses()
    for chapter in chapters:
        name = str(escape(chapter.sequence.name))
        chapter.inline = [(key, caption,
                           styles.replace(plot_style.for_page(svg, f"{name}: {key}")))
                          for key, caption, svg in chapter.svgs]
        chapter.pictures = [(key, caption, pictures.data_uri(picture))
                            for key, caption, picture in chapter.images]
        chapter.maps = [(view, [(mode, picture and pictures.data_uri(picture), remark)
                                for mode, picture, remark in shown])
                        for view, shown in chapter.map_views]
    return styles.css()


def headline(sweep):
    """ATE of every mode at a glance."""
    rows = []
    for sequence in sweep.sequences:
        cells = [measured_cell(sequence, mode, "ate", "rmse") for mode in sweep.modes]
        rank(cells)
        kind = {"tum": "TUM", "bonn": "Bonn", "rendered": "rendered, not a recording"}
        rows.append(Row(sequence.name, kind.get(sequence.kind, "own folder"), cells,
                        sequence.kind, any(c.fault for c in cells)))
    return rows


def facts(sweep):
    """(name, value) of everything one must know to judge or repeat the numbers."""
    options = sweep.options
    runs = [run for _, run in sweep.runs()]
    way = str(options.get("way", "not told"))
    rows = [
        ("Version", sweep.data.get("version", "not told")),
        ("Machine", sweep.data.get("machine") or "not told"),
        ("Started", str(sweep.data.get("started", "not told"))),
        ("Wall time", wall_time(sweep.data.get("wall_s"), runs)),
        ("Sequences", f"{len(sweep.sequences)}, {sum(s.rendered for s in sweep.sequences)} of them "
                      "rendered"),
        ("Runs", f"{sum(r.status == 'ok' for r in runs)} of {len(runs)} sound; "
                 f"{options.get('runs', 1)} of each mode ({', '.join(sweep.modes)}), "
                 f"{options.get('jobs', 1)} at a time"),
        ("Way of running", WAYS.get(way, way)),
        ("Trajectory judged", "the final one (trajectory.txt: all tracked frames, with keyframe "
                              "poses as corrected up to the end), aligned by SE(3), no scale"),
        ("Statistics", "median and lowest–highest over runs; stamps matched within 0.02 s"),
        ("Segmentation", segmenter(options)),
        ("Seed", str(options.get("seed", "not told"))),
        ("Settings changed", ", ".join(f"{k}={v}" for k, v in (options.get("config") or {}).items())
         or "none"),
    ]
    for mode in sweep.modes:
        value, count = tracking_summary(sweep, mode)
        if value is not None:
            rows.append((f"Tracking, {mode}", f"{value:.2f} ms per frame (median of {count} runs)"
                         + ("" if sweep.timings_valid else ", not valid as a measurement")))
    return rows


def segmenter(options):
    if "segmenter" in options and options["segmenter"] is None:
        return "none: these modes use no masks"
    parts = [str(options.get("segmenter", "not told"))]
    parts += [str(options[key]) for key in ("model", "precision") if options.get(key)]
    return ", ".join(parts)


def wall_time(seconds, runs):
    """By the clock, and beside it the sum of the runs."""
    of_runs = sum(finite(run.wall_s) or 0 for run in runs)
    if not of_runs:
        return duration(seconds)
    if of_runs <= (finite(seconds) or 0):
        return f"{duration(seconds)}, of which runs {duration(of_runs)}"
    return f"{duration(seconds)}; runs, some of them at a time, {duration(of_runs)} together"


def duration(seconds):
    if finite(seconds) is None:
        return "not told"
    minutes, rest = divmod(int(round(seconds)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min {rest} s" if hours else f"{minutes} min {rest} s"


def remarks(sweep):
    """What a reader must know before the first number."""
    found = []
    if sweep.data.get("complete") is False:
        found.append("The sweep was not complete when this report was made.")
    if any(s.rendered for s in sweep.sequences):
        found.append("Sequences marked as rendered are synthetic: their figures cannot be compared "
                     "with figures published for the TUM recordings of similar names.")
    if not sweep.timings_valid:
        found.append("Times are not valid as a measurement: several runs shared the machine.")
    if sweep.options.get("way") == "deterministic":
        found.append("Deterministic runs: repeats of one seed are equal by construction, so their "
                     "spread says nothing.")
    return found
