"""Tables and figures of a result folder of `ygslam bench`.

    python tools/report --results RESULTS [--out DIR]

Writes DIR/index.html (one file, opens without a network), DIR/tables (HTML, LaTeX, CSV, JSON) and
DIR/figures (SVG, PNG). DIR is RESULTS/report unless told. Exit codes: 0 ok, 2 usage, 4 RESULTS is
no result folder, 9 DIR cannot be written or a Python package is missing.
"""
import argparse
import io
import pathlib
import sys

# Run as a folder, Python finds the modules themselves; as a package they cannot hide others.
sys.path[0] = str(pathlib.Path(__file__).resolve().parent.parent)

try:
    from report import chapters, page, plot_style, results, table_files
    from report.published import Published
    from report.tables import Builder
    from report.writer import OutputError, Writer
except ModuleNotFoundError as missing:
    in_wheel = pathlib.Path(__file__).resolve().parent.parent.name == "ygslam"
    print(f"error: Python package '{missing.name}' is missing: "
          + ('pip install "ygslam[report]"' if in_wheel else "pip install -r tools/requirements-tools.txt, or `make setup`"),
          file=sys.stderr)
    sys.exit(9)


def png(picture):
    out = io.BytesIO()
    picture.save(out, "PNG", optimize=True)
    return out.getvalue()


def collect(writer, sweep):
    """Adds every file of the report."""
    published = Published()
    tables = Builder(sweep, published).all()
    for table in tables:
        for ending, make in (("csv", table_files.to_csv), ("json", table_files.to_json),
                             ("tex", table_files.to_latex)):
            writer.add(f"tables/{table.id}.{ending}", make(table, published.citations))
        writer.add(f"tables/{table.id}.html", page.table_html(table, published))
    size = chapters.size_for(len(sweep.sequences))
    made = []
    for sequence in sweep.sequences:
        chapter = chapters.make(sequence, sweep.modes, size)
        made.append(chapter)
        folder = f"figures/{sequence.id}"
        for name, _, svg in chapter.svgs:
            writer.add(f"{folder}/{name}.svg", plot_style.for_paper(svg))
        for name, _, picture in chapter.images:
            writer.add(f"{folder}/{name}.png", png(picture))
        for number, (_, shown) in enumerate(chapter.map_views, 1):
            for mode, picture, _ in shown:
                if picture:
                    writer.add(f"{folder}/map_{mode}_{number}.png", png(picture))
    writer.add("index.html", page.render(sweep, published, tables, made, size))


def main(arguments):
    parser = argparse.ArgumentParser(prog="report", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", help="folder that `ygslam bench` wrote")
    parser.add_argument("--check", action="store_true", help="only say whether all packages are there")
    parser.add_argument("--out", help="folder for the report (default: RESULTS/report)")
    parser.add_argument("--quiet", action="store_true", help="do not say where to look")
    given = parser.parse_args(arguments)
    if given.check:
        return 0
    if given.results is None:
        parser.error("--results is required")
    out = pathlib.Path(given.out) if given.out else pathlib.Path(given.results) / "report"
    writer = Writer(out)
    try:
        collect(writer, results.read_sweep(given.results))
        writer.commit()
    except results.InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 4
    except OutputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 9
    if not given.quiet:
        print(out / "index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
