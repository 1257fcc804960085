"""tools/report: tables with the right numbers, faults that stay visible, a page that stands alone.

    python tests/report_test.py

The result folder is made up here; what the tables must show is computed from the same figures by
other means. No SLAM runs.
"""
import csv
import html.parser
import json
import pathlib
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parent.parent
TOOL = ROOT / "tools" / "report"
sys.path.insert(0, str(ROOT / "tools"))

from report import map_view, series  # noqa: E402
from report.published import Published  # noqa: E402

TUM = "rgbd_dataset_freiburg3_walking_xyz"
HOSTILE = "own<script>alert(1)</script>_50%&$#{"
# ATE RMSE [m] of each run; the S.D. is made half of it, RPE twice and thrice, rotation in degrees.
ATE_M = {
    (TUM, "off"): [0.70, 0.60, 0.80], (TUM, "full"): [0.0140, 0.0110, 0.0120],
    ("walking_static", "off"): [0.020, 0.040, 0.030],
    ("walking_static", "full"): [0.004, None, 0.006],  # run 2 crashed
    ("rgbd_bonn_balloon", "off"): [0.30, 0.31, 0.32],
    ("rgbd_bonn_balloon", "full"): [0.025, 0.021, 0.023],  # run 1 was lost, with a figure
    ("own", "off"): [None, None, None], ("own", "full"): [None, None, None],  # nothing ran
}
STATUS = {("walking_static", "full", 2): "crashed", ("rgbd_bonn_balloon", "full", 1): "lost",
          **{("own", mode, n): "failed" for mode in ("off", "full") for n in (1, 2, 3)}}


def statistics_of(rmse):
    return {"rmse": rmse, "std": rmse / 2, "mean": rmse, "median": rmse, "min": 0, "max": rmse}


def metrics(rmse, coverage):
    def rpe(scale):
        return {"trans_m": statistics_of(scale * rmse),
                "rot_deg": statistics_of(10 * scale * rmse)}
    return {"coverage": coverage, "ate": statistics_of(rmse),
            "rpe": {"frames30": rpe(2), "sec1": rpe(3)}, "precision": "f32", "peak_rss_mb": 100,
            "timing_ms": {"track": {"mean": 7.5, "median": 7, "p95": 9, "max": 12},
                          "segment": None}, "cpu_ms": {"track": {"mean": 6}}, "startup_s": 0.5}


def write_poses(run, truth_file):
    """40 poses on a straight way, estimated 10 mm beside it but for the last pose."""
    tum, rows, truth = [], ["t_s,x_m,y_m,z_m,truth_x_m,truth_y_m,truth_z_m,ate_m,ate_deg,"
                            "rpe30_m,rpe30_deg,rpe1s_m,rpe1s_deg"], []
    for i in range(40):
        t, x, y = 100 + i / 30, 0.02 * i, 0.3 * (i / 40) ** 2
        side = 0.01 if i < 39 else 0
        tum.append(f"{t:.6f} {x} {y + side} 0 0 0 0 1")
        truth.append(f"{t:.6f} {x} {y} 0 0 0 0 1")
        rpe = f"{side},0.1,," if i < 10 else ",,,"
        rows.append(f"{t:.6f},{x},{y + side},0,{x},{y},0,{side},0.2,{rpe}")
    (run / "trajectory.txt").write_text("\n".join(tum) + "\n", encoding="utf-8")
    (run / "errors.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    truth_file.parent.mkdir(parents=True, exist_ok=True)
    truth_file.write_text("\n".join(truth) + "\n", encoding="utf-8")


def write_map(path):
    points = [(0.1 * i, 0.1 * j, 2.0, 200, 100, 10 * i) for i in range(9) for j in range(9)]
    names = [("float", c) for c in "xyz"] + [("uchar", c) for c in ("red", "green", "blue")]
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(points)}\n" + "".join(
        f"property {kind} {name}\n" for kind, name in names) + "end_header\n"
    path.write_bytes(header.encode() + b"".join(struct.pack("<fffBBB", *p) for p in points))


def write_results(root):
    modes, kinds = ["off", "full"], {TUM: "tum", "walking_static": "rendered",
                                     "rgbd_bonn_balloon": "bonn", "own": "folder"}
    rows = {TUM: "fr3_walking_xyz", "walking_static": "fr3_walking_static"}
    sequences = [{"id": name, "name": HOSTILE if name == "own" else name, "kind": kind,
                  "paper_row": rows.get(name), "frames": 827, "error": None,
                  "truth": {"duration_s": 28.5, "length_m": 5.8, "speed_mps": 0.2035,
                            "angular_speed_degps": 5.5}} for name, kind in kinds.items()]
    sequences.append({"id": "broken", "name": "broken", "kind": "folder", "paper_row": None,
                      "frames": None, "truth": None, "error": "associations.txt:3: no stamp"})
    for (name, mode), values in ATE_M.items():
        for number, value in enumerate(values, 1):
            run = root / "runs" / name / mode / f"{number:02d}"
            run.mkdir(parents=True)
            status = STATUS.get((name, mode, number), "ok")
            (run / "run.json").write_text(json.dumps({
                "format": 1, "status": status, "timings_valid": True,
                "error": None if status == "ok" else f"because of {status}"}), encoding="utf-8")
            if value is not None:
                (run / "metrics.json").write_text(json.dumps(
                    metrics(value, 0.4 if status == "lost" else 1.0)), encoding="utf-8")
            if name == TUM:
                write_poses(run, root / "sequences" / TUM / "groundtruth.txt")
                write_map(run / "map.ply")
    inspect = root / "sequences" / TUM / "inspect"
    inspect.mkdir()
    Image.new("RGB", (64, 48), (10, 200, 30)).save(inspect / "checks.png")
    (root / "sweep.json").write_text(json.dumps({
        "format": 1, "version": "1.2.3", "machine": "a machine", "started": "2026-01-01T00:00:00Z",
        "wall_s": 3723, "timings_valid": True, "modes": modes, "sequences": sequences,
        "options": {"modes": modes, "runs": 3, "jobs": 1, "way": "realtime", "seed": 7,
                    "segmenter": "model", "model": "net.onnx", "precision": "f32",
                    "config": {"orb.features": 900}}}), encoding="utf-8")


def report(*arguments):
    return subprocess.run([sys.executable, str(TOOL), *map(str, arguments)], capture_output=True,
                          text=True, check=False, timeout=300)


class PublishedFigures(unittest.TestCase):
    def test_recomputed_reductions_differ_from_print_exactly_at_the_known_errata(self):
        data = json.loads((TOOL / "published.json").read_text(encoding="utf-8"))
        differ = set()
        for table in ("table2", "table3", "table4"):
            for row, entry in data[table].items():
                for column in (0, 1):
                    alpha, beta = entry["ORB-SLAM2"][column], entry["YG-SLAM"][column]
                    eta = (alpha - beta) / alpha * 100
                    if abs(eta - entry["reduction"][column]) > 0.05:
                        differ.add((table, row, column))
                    else:  # rounding of the last printed digits explains what is left
                        self.assertLess(abs(eta - entry["reduction"][column]), 0.02)
        known = {("table2", "fr3_walking_rpy", 1), ("table2", "fr3_sitting_static", 0),
                 ("table2", "fr3_sitting_static", 1), ("table3", "fr3_sitting_static", 0),
                 ("table3", "fr3_sitting_static", 1)}
        self.assertEqual(differ, known)
        self.assertEqual(set(Published().known_errata_of_reductions()), known)

    def test_the_one_reduction_that_no_rounding_explains_is_told_from_the_others(self):
        published = Published()
        notes = {key: published.reduction_note(*key)
                 for key in published.reductions_that_differ()}
        self.assertEqual([key for key, note in notes.items() if "no rounding" in note],
                         [("table2", "fr3_walking_rpy", 1)])
        self.assertIn("95.31", notes["table2", "fr3_walking_rpy", 1])

    def test_the_average_in_the_text_is_an_erratum_in_table_2_only(self):
        for table, wrong in (("table2", True), ("table3", False), ("table4", False)):
            self.assertEqual("erratum" in Published().average_note(table), wrong)
        self.assertIn("96.46", Published().average_note("table2"))

    def test_every_system_is_cited_and_every_row_complete(self):
        published = Published()
        for system in [*published.systems, *published.peers]:
            self.assertIn(system, published.citations)
        for table in ("table2", "table3", "table4"):
            self.assertEqual(list(published.data[table]), published.rows)
        self.assertEqual([published.best_ate_m(row) for row in published.rows],
                         [0.0127, 0.005, 0.0252, 0.016, 0.0053])


class Parser(html.parser.HTMLParser):
    """Collects what a page would load, and checks that elements close."""
    VOID = {"meta", "img", "br", "link", "input", "hr", "col"}

    def __init__(self):
        super().__init__()
        self.loads, self.links, self.open, self.ids = [], [], [], []

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "srcset", "data", "action", "poster") or (
                    name in ("href", "xlink:href") and tag != "a"):
                self.loads.append((tag, value))
            if name == "href" and tag == "a":
                self.links.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise AssertionError(f"</{tag}> closes nothing at {self.getpos()}")


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="yg report ü ")
        cls.addClassCleanup(folder.cleanup)
        cls.results = pathlib.Path(folder.name, "results")
        write_results(cls.results)
        done = report("--results", cls.results)
        assert done.returncode == 0, done.stderr
        cls.out = cls.results / "report"
        cls.page = (cls.out / "index.html").read_text(encoding="utf-8")

    def table(self, name):
        return json.loads((self.out / "tables" / f"{name}.json").read_text(encoding="utf-8"))

    def row(self, table, sublabel, label=None):
        found = [row for row in self.table(table)["rows"]
                 if sublabel in row["sublabel"] and (label is None or row["label"] == label)]
        self.assertEqual(len(found), 1, f"{table}: {sublabel}")
        return found[0]

    def cell(self, table, row, group, label="RMSE"):
        columns = self.table(table)["columns"]
        return row["cells"][[(c["group"], c["label"]) for c in columns].index((group, label))]

    def test_medians_and_spreads_of_all_tables(self):
        values = ATE_M[TUM, "full"]
        for table, scale in (("table2a", 1), ("table3a", 2), ("table3b", 3), ("table4a", 20),
                             ("table4b", 30)):
            row = self.row(table, TUM)
            for label, share in (("RMSE", 1), ("S.D.", 0.5)):
                cell = self.cell(table, row, "full", label)
                wanted = [scale * share * value for value in values]
                self.assertAlmostEqual(cell["value"], statistics.median(wanted))
                self.assertAlmostEqual(cell["low"], min(wanted))
                self.assertAlmostEqual(cell["high"], max(wanted))
                self.assertEqual((cell["n"], cell["total"]), (3, 3))
            self.assertFalse(row["marked"])

    def test_error_reductions(self):
        row = self.row("table2a", TUM)
        cell = self.cell("table2a", row, "reduction, full against off")
        self.assertAlmostEqual(cell["value"], (0.70 - 0.012) / 0.70 * 100)
        cell = self.cell("table2b", self.row("table2b", TUM),
                         "our full against published ORB-SLAM2")
        self.assertAlmostEqual(cell["value"], (0.7842 - 0.012) / 0.7842 * 100)

    def test_a_crashed_run_is_counted_and_marked(self):
        row = self.row("table2a", "rendered, not TUM")
        cell = self.cell("table2a", row, "full")
        self.assertEqual((cell["value"], cell["n"], cell["total"]), (0.005, 2, 3))
        self.assertEqual(cell["fault"], "1 crashed")
        self.assertTrue(row["marked"])
        self.assertIn("because of crashed", self.page)

    def test_a_lost_run_stays_in_the_median_and_is_marked(self):
        row = self.row("table2a", "Bonn")
        cell = self.cell("table2a", row, "full")
        self.assertEqual((cell["value"], cell["n"]), (0.023, 3))
        self.assertEqual((cell["fault"], cell["coverage"]), ("1 lost", 0.4))
        self.assertTrue(row["marked"])
        best = self.cell("table2b", self.row("table2b", "Bonn"), "best published")
        self.assertEqual(best["value"], 0.018)

    def test_a_sequence_where_all_failed_and_an_unreadable_one_keep_their_rows(self):
        for name in ("table2a", "table3a", "table3b", "table4a", "table4b"):
            failed = self.row(name, "own folder", HOSTILE)
            unread = self.row(name, "own folder", "broken")
            self.assertEqual(failed["cells"][0]["shown"], "3 failed")
            self.assertEqual(unread["cells"][0]["shown"], "unreadable")
            self.assertTrue(failed["marked"] and unread["marked"])
        stages = [row["label"] for row in self.table("table5b")["rows"] if row["marked"]]
        self.assertIn("broken, full", stages)
        self.assertIn("associations.txt:3: no stamp", self.page)

    def test_published_figures_beside_a_rendered_row_are_no_comparison(self):
        rendered = self.row("table2b", "rendered, not TUM")
        real = self.row("table2b", TUM)
        theirs = self.cell("table2b", rendered, "YG-SLAM")
        self.assertTrue(theirs["foreign"])
        self.assertEqual(theirs["value"], 0.0079)
        self.assertNotIn("foreign", self.cell("table2b", real, "YG-SLAM"))
        self.assertIsNone(self.cell("table2b", rendered,
                                    "our full against published ORB-SLAM2")["value"])
        self.assertIn("not a TUM recording", json.dumps(self.table("table2b")["notes"]))

    def test_all_five_rows_of_the_paper_are_there(self):
        for name in ("table1", "table2b", "table3c", "table4c"):
            labels = [row["label"] for row in self.table(name)["rows"]]
            self.assertEqual(list(dict.fromkeys(labels))[:5],
                             ["fr3_w_x", "fr3_w_s", "fr3_w_r", "fr3_w_h", "fr3_s_s"])
            self.assertIn("TUM recording, not run", json.dumps(self.table(name)))

    def test_times(self):
        row = self.table("table5a")["rows"][1]
        self.assertEqual(row["label"], "ours, full")
        self.assertEqual((row["cells"][1]["value"], row["cells"][1]["n"]), (7.5, 8))
        self.assertIn("DynaSLAM", [r["label"] for r in self.table("table5a")["rows"]])

    def test_csv_has_one_width_and_the_same_numbers(self):
        for path in (self.out / "tables").glob("*.csv"):
            rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
            data = [row for row in rows if not row[0].startswith("note ")]
            self.assertEqual({len(row) for row in data}, {len(rows[0])}, path.name)
        rows = list(csv.DictReader((self.out / "tables" / "table2a.csv").read_text(
            encoding="utf-8").splitlines()))
        row = next(r for r in rows if TUM in r["remark"])
        self.assertEqual(float(row["full: RMSE"]), 0.012)
        self.assertEqual(row["full: RMSE (runs)"], "3/3")

    def test_latex_is_balanced(self):
        for path in (self.out / "tables").glob("*.tex"):
            text = path.read_text(encoding="utf-8")
            bare = re.sub(r"\\[\\{}&%$#_]", "", text)
            self.assertEqual(bare.count("{"), bare.count("}"), path.name)
            stack = []
            for verb, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", text):
                if verb == "begin":
                    stack.append(name)
                else:
                    self.assertEqual(stack.pop(), name, path.name)
            self.assertEqual(stack, [])
            for tabular in re.findall(r"\\begin\{tabular\}\{(l[lr]*)\}(.*?)\\end\{tabular\}", text,
                                      re.S):
                for line in tabular[1].splitlines():
                    if line.endswith(r"\\"):
                        spanned = sum(int(n) - 1 for n in re.findall(r"multicolumn\{(\d+)", line))
                        cells = len(re.findall(r"(?<!\\)&", line)) + 1 + spanned
                        self.assertEqual(cells, len(tabular[0]), f"{path.name}: {line}")
            self.assertTrue(text.isascii(), path.name)

    def test_the_page_loads_nothing_from_elsewhere(self):
        parser = Parser()
        parser.feed(self.page)
        self.assertEqual(parser.open, [])
        for tag, value in parser.loads:
            self.assertRegex(value, r"^(data:image/|#)", tag)
        for link in parser.links:
            if link.startswith("#"):
                self.assertIn(link[1:], parser.ids)
            else:
                self.assertIn(link, [c.get("url") for c in Published().citations.values()])
        css = re.search(r"<style>(.*?)</style>", self.page, re.S).group(1)
        self.assertNotRegex(css, r"@import|url\(")
        self.assertIn("prefers-color-scheme: dark", css)
        self.assertEqual(len(parser.ids), len(set(parser.ids)) + self.doubled_in_figures(parser))

    def doubled_in_figures(self, parser):
        """Ids that occur twice; within figures equal marks have equal ids, which does no harm."""
        outside = [i for i in parser.ids if not re.fullmatch(r"[A-Za-z]\w{8,}", i)]
        self.assertEqual(len(outside), len(set(outside)))
        return len(parser.ids) - len(set(parser.ids))

    def test_names_cannot_become_markup(self):
        self.assertNotIn("<script>alert", self.page)
        self.assertIn("own&lt;script&gt;alert(1)", self.page)
        tex = (self.out / "tables" / "table2a.tex").read_text(encoding="utf-8")
        self.assertIn(r"50\%\&\$\#\{", tex)

    def test_the_summary_tells_how_the_numbers_were_made(self):
        for part in ("1.2.3", "a machine", "2026-01-01T00:00:00Z", "1 h 2 min 3 s", "realtime",
                     "net.onnx", "orb.features=900", "trajectory.txt"):
            self.assertIn(part, self.page)

    def test_figures_for_papers_and_for_the_page(self):
        folder = self.out / "figures" / TUM
        names = {path.name for path in folder.iterdir()}
        self.assertLessEqual({"ate.svg", "ate_over_time.svg", "rpe_over_time.svg",
                              "path_by_error.svg", "pose_over_time.svg", "paths_3d.svg",
                              "checks.png", "map_off_1.png", "map_full_2.png"}, names)
        for path in folder.glob("*.svg"):
            text = path.read_text(encoding="utf-8")
            self.assertTrue(text.startswith("<svg") and text.rstrip().endswith("</svg>"))
            self.assertNotIn("#010203", text)
        inline = self.page[self.page.index('id="figures"'):self.page.index('id="sources"')]
        self.assertEqual(inline.count("<svg"), len(list(folder.glob("*.svg"))))
        self.assertEqual(self.page.count('"scatter3d"'), 3 + self.plotly_mentions())

    @staticmethod
    def plotly_mentions():
        from plotly.offline import get_plotlyjs
        return get_plotlyjs().count('"scatter3d"')

    def test_small_beside_plotly(self):
        from plotly.offline import get_plotlyjs
        self.assertLess(len(self.page) - len(get_plotlyjs()), 1_500_000)


class Folders(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_refused(self, code, part, *arguments):
        done = report(*arguments)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("error: "), done.stderr)
        self.assertIn(part, done.stderr)

    def small(self):
        """A result folder without anything to draw."""
        root = self.folder / "small"
        run = root / "runs" / "s" / "off" / "01"
        run.mkdir(parents=True)
        (run / "run.json").write_text('{"format": 1, "status": "ok"}', encoding="utf-8")
        (run / "metrics.json").write_text(json.dumps(metrics(0.01, 1)), encoding="utf-8")
        (root / "sweep.json").write_text(json.dumps({
            "format": 1, "options": {"modes": ["off"], "runs": 1},
            "sequences": [{"id": "s", "kind": "folder"}]}), encoding="utf-8")
        return root

    def test_what_is_no_result_folder_is_refused_in_one_line(self):
        self.assert_refused(4, "no such folder", "--results", self.folder / "none")
        self.assert_refused(4, "sweep.json", "--results", self.folder)
        sweep = self.folder / "sweep.json"
        for text, part in (("{", "not JSON"), ("[]", "not a JSON object"),
                           ('{"format": 2}', "format 2"), ('{"format": 1}', "modes"),
                           ('{"format": 1, "options": {"modes": ["off"]}}', "no sequences"),
                           ('{"format": 1, "options": {"modes": ["off"]}, "sequences": '
                            '[{"id": "../up"}]}', "not a folder name")):
            sweep.write_text(text, encoding="utf-8")
            self.assert_refused(4, part, "--results", self.folder)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["sweep.json"])

    def test_a_place_that_cannot_be_written_is_told(self):
        (self.folder / "file").write_text("", encoding="utf-8")
        self.assert_refused(9, "file", "--results", self.small(), "--out", self.folder / "file")

    def test_broken_files_of_one_run_are_a_failed_run(self):
        root = self.small()
        (root / "runs" / "s" / "off" / "01" / "metrics.json").write_text("{", encoding="utf-8")
        done = report("--results", root)
        self.assertEqual(done.returncode, 0, done.stderr)
        page = (root / "report" / "index.html").read_text(encoding="utf-8")
        self.assertIn("metrics.json: not JSON", page)
        self.assertIn("1 failed", page)

    def test_a_second_report_tidies_up_after_the_first_and_nothing_else(self):
        root = self.small()
        self.assertEqual(report("--results", root, "--quiet").returncode, 0)
        out = root / "report"
        (out / "notes.txt").write_text("mine", encoding="utf-8")
        (out / "figures").mkdir(exist_ok=True)
        (out / "figures" / "old.svg").write_text("old", encoding="utf-8")
        with open(out / "files.txt", "a", encoding="utf-8") as file:
            file.write("figures/old.svg\n../../sweep.json\n")
        before = (out / "index.html").read_bytes()
        done = report("--results", root)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("index.html", done.stdout)
        self.assertFalse((out / "figures" / "old.svg").exists())
        self.assertTrue((out / "notes.txt").exists() and (root / "sweep.json").exists())
        self.assertEqual((out / "index.html").read_bytes(), before, "the same input, the same page")


class Geometry(unittest.TestCase):
    def test_the_nearest_point_is_drawn(self):
        points = np.array([[0, 0, 2.0], [0, 0, 1.0], [0, 0, 3.0]], np.float32)
        colours = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]], np.uint8)
        picture = map_view.render(points, colours, np.zeros(3), np.array([0, 0, 1.0]), (64, 48))
        self.assertEqual(picture[24, 32].tolist(), [0, 255, 0, 255])
        self.assertEqual(picture[0, 0, 3], 0)

    def test_down_is_down_and_right_is_right(self):
        points = np.array([[0.5, 0, 2.0], [0, 0.5, 2.0]], np.float32)
        colours = np.array([[255, 0, 0], [0, 255, 0]], np.uint8)
        picture = map_view.render(points, colours, np.zeros(3), np.array([0, 0, 1.0]), (64, 48))
        red = np.argwhere(picture[..., 0] == 255).mean(0)
        green = np.argwhere(picture[..., 1] == 255).mean(0)
        self.assertGreater(red[1], 32)
        self.assertGreater(green[0], 24)

    def test_roll_pitch_yaw_turn_about_their_own_axes(self):
        angle = np.deg2rad(20)
        for axis, wanted in ((2, (20, 0, 0)), (0, (0, 20, 0)), (1, (0, 0, 20))):
            q = np.zeros(4)
            q[axis], q[3] = np.sin(angle / 2), np.cos(angle / 2)
            found = series.roll_pitch_yaw_deg(series.rotations(q[None]), np.eye(3))
            np.testing.assert_allclose(found[0], wanted, atol=1e-9)

    def test_angles_run_on_beyond_half_a_turn(self):
        angles = np.deg2rad(np.arange(0, 400, 10))
        q = np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], 1)
        found = series.roll_pitch_yaw_deg(series.rotations(q), np.eye(3))
        np.testing.assert_allclose(found[:, 0], np.arange(0, 400, 10), atol=1e-6)

    def test_rotation_between_finds_the_rotation(self):
        rng = np.random.default_rng(3)
        points = rng.normal(size=(20, 3))
        rotation = series.rotations(rng.normal(size=(1, 4)))[0]
        found = series.rotation_between(points, points @ rotation.T + [1, 2, 3])
        np.testing.assert_allclose(found, rotation, atol=1e-12)

    def test_broken_tables_and_maps_name_file_and_fault(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "errors.csv")
            path.write_text(",".join(series.COLUMNS) + "\n1,2,x\n", encoding="utf-8")
            with self.assertRaisesRegex(series.InputError, r"errors\.csv:2"):
                series.read_errors(path)
            write_map(pathlib.Path(folder, "map.ply"))
            whole = pathlib.Path(folder, "map.ply").read_bytes()
            pathlib.Path(folder, "cut.ply").write_bytes(whole[:-1])
            with self.assertRaisesRegex(series.InputError, r"cut\.ply: cut short"):
                map_view.read_ply(pathlib.Path(folder, "cut.ply"))


if __name__ == "__main__":
    unittest.main()
