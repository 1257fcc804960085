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
import subprocess
import sys
import tempfile
import unittest

from report_fake import ATE_M, HOSTILE, TUM, metrics, write_results

ROOT = pathlib.Path(__file__).resolve().parent.parent
TOOL = ROOT / "tools" / "report"
sys.path.insert(0, str(ROOT / "tools"))

from report.published import Published  # noqa: E402


def report(*arguments):
    return subprocess.run([sys.executable, str(TOOL), *map(str, arguments)], capture_output=True,
                          text=True, check=False, timeout=300)


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
        notes = self.table("table2b")["notes"]
        self.assertIn("not a TUM recording", json.dumps(notes))
        self.assertEqual([notes[letter].split()[0] for letter in rendered["notes"]], ["Published", "Rendered"])

    def test_every_letter_of_a_footnote_stands_in_its_table(self):
        for file in (self.out / "tables").glob("*.json"):
            table = json.loads(file.read_text(encoding="utf-8"))
            marks = {mark for row in table["rows"] for mark in row.get("notes", [])}
            marks |= {mark for row in table["rows"] for cell in row["cells"] for mark in cell.get("notes", [])}
            self.assertEqual(marks, set(table["notes"]), file.name)

    def test_no_backticks_are_read(self):
        self.assertIn("<code>ygslam simulate</code>", self.page)
        self.assertNotIn("by `ygslam", self.page)

    def test_all_five_rows_of_the_paper_are_there(self):
        for name in ("table1", "table2b", "table3c", "table4c"):
            labels = [row["label"] for row in self.table(name)["rows"]]
            self.assertLessEqual({"fr3_w_x", "fr3_w_s", "fr3_w_r", "fr3_w_h", "fr3_s_s"}, set(labels))

    def test_what_was_not_run_stands_below_what_was(self):
        for name in ("table1", "table2b", "table3c", "table4c"):
            not_run = ["not run" in row["sublabel"] for row in self.table(name)["rows"]]
            self.assertIn(True, not_run)
            self.assertEqual(not_run, sorted(not_run), name)

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
        self.assertEqual(self.page.count("<style"), 1)
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
                           ('{"format": 1, "options": [], "modes": ["off"]}', "no table"),
                           ('{"format": 1, "options": {"config": 3}}', "no table"),
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

    def test_odd_values_of_no_importance_are_no_exception(self):
        root = self.small()
        sweep = json.loads((root / "sweep.json").read_text(encoding="utf-8"))
        sweep.update(wall_s=float("nan"), machine=3, started=["x"], version="\ud800")
        sweep["sequences"][0].update(name="\ud800", truth={"duration_s": "x"}, frames=-1)
        (root / "sweep.json").write_text(json.dumps(sweep), encoding="utf-8")
        done = report("--results", root)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_noise_in_place_of_poses_is_a_row_and_no_exception(self):
        root = self.small()
        (root / "runs" / "s" / "off" / "01" / "trajectory.txt").write_bytes(bytes(range(256)) * 9)
        done = report("--results", root)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        page = (root / "report" / "index.html").read_text(encoding="utf-8")
        self.assertIn("failed: 01/trajectory.txt: not text", page)
        row = json.loads((root / "report" / "tables" / "table2a.json").read_text("utf-8"))["rows"][-1]
        self.assertEqual((row["marked"], row["cells"][0]["shown"]), (True, "1 failed"))

    def test_what_was_never_asked_for_is_no_fault(self):
        root = self.small()
        sweep = json.loads((root / "sweep.json").read_text(encoding="utf-8"))
        sweep["options"].update(modes=["off", "full"], runs=3)
        sweep["sequences"][0]["runs_asked"] = {"off": 1}
        (root / "sweep.json").write_text(json.dumps(sweep), encoding="utf-8")
        self.assertEqual(report("--results", root).returncode, 0)
        page = (root / "report" / "index.html").read_text(encoding="utf-8")
        self.assertNotIn("went wrong", page)
        row = json.loads((root / "report" / "tables" / "table2a.json").read_text("utf-8"))["rows"][-1]
        self.assertFalse(row["marked"])
        self.assertIn("not run", [cell["shown"] for cell in row["cells"]])
        sweep["sequences"][0]["runs_asked"] = {"off": -1}
        (root / "sweep.json").write_text(json.dumps(sweep), encoding="utf-8")
        self.assert_refused(4, "runs_asked", "--results", root)

    def test_a_run_over_its_time_is_told_and_its_figures_do_not_count(self):
        page = self.row_of_status("timed_out", "not done after 600 s (--run-limit)")
        self.assertIn("timed out: not done after 600 s", page)

    def row_of_status(self, status, error):
        root = self.small()
        (root / "runs" / "s" / "off" / "01" / "run.json").write_text(
            json.dumps({"format": 1, "status": status, "error": error}), encoding="utf-8")
        self.assertEqual(report("--results", root).returncode, 0)
        row = json.loads((root / "report" / "tables" / "table2a.json").read_text("utf-8"))["rows"][-1]
        self.assertEqual(row["cells"][0]["shown"], "1 " + status.replace("_", " "))
        return (root / "report" / "index.html").read_text(encoding="utf-8")

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


if __name__ == "__main__":
    unittest.main()
