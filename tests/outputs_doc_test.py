"""docs/outputs.md and what the commands write: neither has a file, column or key the other lacks."""
import json
import re
import shutil
import unittest

from ygslam_cli import FRAMES, ROOT, CliTest, sequence, ygslam

PAGE = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8")
# Objects whose keys are names: of files, settings, modes.
NAMED = {"files", "options.config", "sequences[].runs_asked"}
REPORT = """import pathlib, sys
if sys.argv[1] == "--check":
    sys.exit()
(pathlib.Path(sys.argv[1].split("=", 1)[1]) / "report").mkdir(exist_ok=True)
"""


def rows(heading):
    """Cells of the table below a heading of the page, one list for each row."""
    parts = re.split(r"(?m)^#+ (.+)\n", PAGE)
    text = dict(zip(parts[1::2], parts[2::2]))[heading]
    table = [line for line in text.splitlines() if line.startswith("|")]
    assert len(table) > 2, f"no table below '{heading}'"
    return [re.split(r"(?<!\\)\|", line)[1:-1] for line in table[2:]]


def names(heading):
    """What the first column of that table names, in its order."""
    return [name for row in rows(heading) for name in re.findall(r"`([^`]+)`", row[0])]


TIMES, ERRORS = set(names("Statistics")), set(names("Statistics of errors"))
FIGURES = {"median", "min", "max", "runs"}  # of `bench --json`, as the page says above its table


def keys(value, path=""):
    """Paths of the leaves of JSON: `a.b`, `list[].a`, and `a.*` of a set of statistics."""
    if isinstance(value, dict) and path not in NAMED:
        if set(value) in (TIMES, ERRORS, FIGURES):
            return {path + ".*"}
        return set().union(*(keys(v, f"{path}.{k}" if path else k) for k, v in value.items()))
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return set().union(*(keys(entry, path + "[]") for entry in value))
    return {path}


def listing(folder):
    """Names in a folder as the page writes them: folders with a slash, numbers as N."""
    return {re.sub(r"\d", "N", path.name) + "/" * path.is_dir() for path in folder.iterdir()}


class OutputsPage(CliTest):
    def assert_told(self, heading, written, told=None):
        """The page names exactly what was written."""
        told = names(heading) if told is None else told
        self.assertEqual(len(told), len(set(told)), f"'{heading}' names something twice")
        written = set(written)
        self.assertEqual((written - set(told), set(told) - written), (set(), set()),
                         f"'{heading}': (written but not told, told but not written)")

    def assert_header(self, heading, path):
        header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
        self.assertEqual(names(heading), header, f"{path.name}: columns in their order")

    def done(self, *arguments, **how):
        done = ygslam(*arguments, **how)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def load(self, *parts):
        return json.loads(self.folder.joinpath(*parts).read_text(encoding="utf-8"))

    def with_masks(self):
        return "--segmenter", f"masks:{sequence() / 'mask'}"

    def test_run(self):
        folder = self.copy_sequence()
        (folder / self.pairs(folder)[20][1]).write_bytes(b"damaged")
        option = {"--export": "scene", "--background": "background", "--debug-images": "drawn",
                  "--save-masks": "masks"}
        out = [word for name, target in option.items() for word in (name, self.folder / target)]
        self.done("run", folder, "--out", self.folder / "out", *self.with_masks(), "--deterministic",
                  "--save-map", self.folder / "room.map", "--mcap", self.folder / "run.mcap", "--trace",
                  self.folder / "trace.json", *out)
        run = self.folder / "out"
        self.assert_told("Files of `run`", listing(run))
        options = {row[0].split("`")[1].split()[0]: set(re.findall(r"`([^`]+)`", row[1]))
                   for row in rows("Files of other options")}
        for name, target in option.items():
            self.assert_told(name, listing(self.folder / target), sorted(options[name]))
        self.assertTrue((self.folder / "run.mcap").is_file() and (self.folder / "room.map").is_file())
        self.assert_told("Events of a trace", {event["cat"] for event in self.load("trace.json") if "cat" in event}
                         | {"wait", "dropped"})  # of threads
        self.assertEqual(options["--save-map"], {"FILE", "FILE.dense"})
        self.assertTrue((self.folder / "room.map.dense").is_file())
        for name in ("frames", "objects", "loops"):
            self.assert_header(f"Columns of `{name}.csv`", run / f"{name}.csv")
        metrics = self.metrics()
        self.assertEqual(metrics["skipped_images"][0]["file"].split("/")[0], "rgb")
        self.assert_told("Keys of `metrics.json`", keys(metrics))
        self.done("localize", sequence(), "--map", self.folder / "room.map", "--deterministic",
                  "--out", self.folder / "placed", *self.with_masks(), "--to", 20)
        self.assert_told("Files of `localize`", listing(self.folder / "placed"))
        text = self.done("eval", "--map", self.folder / "scene", "--truth", sequence(),
                         "--est", self.folder / "out" / "trajectory.txt", "--json")
        self.assert_told("Keys of `eval --map --json`", keys(json.loads(text)))

    def test_simulate(self):
        out = self.folder / "world"
        small = ("--out", out, "--size", "160x120", "--seconds", 0.5)
        sensors = ("--imu", "BMI085", "--wheels")
        self.done("simulate", "walking_xyz", *small, *sensors, "--truth")
        self.assert_told("Files of `simulate`", listing(out))
        self.assert_told("Keys of `odom.yaml`", {line.split(":")[0] for line in (out / "odom.yaml").read_text(
            encoding="utf-8").splitlines() if not line.startswith("#")})
        self.assert_told("Keys of `imu.yaml`", {line.split(":")[0] for line in (out / "imu.yaml").read_text(
            encoding="utf-8").splitlines() if not line.startswith("#")})
        for file in ("things/instances.json", "movers/1.txt"):
            self.assertTrue((out / file).is_file(), file)
        self.assert_told("Keys of `simulation.json`", keys(self.load(out, "simulation.json")))
        self.assert_told("Keys of `true_objects.json`", keys(self.load(out, "true_objects.json")))
        told = names("Files of `simulate`")
        self.done("simulate", "walking_xyz", *small, *sensors)
        self.assert_told("Files of `simulate`, no truth", listing(out), told[:told.index("mask/")])
        self.done("simulate", "walking_xyz", *small)
        self.assert_told("Files of `simulate`, no sensors", listing(out), told[:told.index("imu.csv")])
        out = self.folder / "random"
        self.done("simulate", "--random", 2, "--out", out, "--size", "160x120")
        self.assert_told("Files of `simulate --random`", listing(out))
        self.assert_header("Columns of `simulate --random`'s `frames.csv`", out / "frames.csv")

    def test_inspect(self):
        out = self.folder / "drawn"
        text = self.done("inspect", sequence(), *self.with_masks(), "--to", 40, "--out", out, "--json")
        self.assertEqual(json.loads(text), self.load(out, "inspect.json"))
        self.assert_told("Files of `inspect`", listing(out))
        told = keys(json.loads(text))
        self.assert_told("Keys of `inspect.json`", told)
        text = self.done("eval", "--tracks", "--gt", out / "tracks_truth.txt", "--est",
                         out / "tracks.txt", "--json")
        prefix = "checks[].objects."
        self.assertEqual(keys(json.loads(text)),
                         {key[len(prefix):] for key in told if key.startswith(prefix)})

    def test_inspect_loops(self):
        """Of a loop that was closed: written here, since so short a recording has none."""
        stamps = [pair[0] for pair in self.pairs(sequence())]
        cells = {"stamp": stamps[50], "place_stamp": stamps[1], "outcome": "closed",
                 "verdict": "agrees"}
        header = names("Columns of `loops.csv`")
        out = self.folder / "out"
        out.mkdir()
        (out / "loops.csv").write_text(
            ",".join(header) + "\n" + ",".join(cells.get(name, "1") for name in header) + "\n",
            encoding="utf-8")
        found = keys(json.loads(self.done("inspect", sequence(), "--loops", out, "--json")))
        self.assert_told("Keys of `inspect --loops --json`",
                         {re.sub(r"^stages\.[^.]+", "stages.STAGE", key) for key in found})

    def test_eval(self):
        truth = sequence() / "groundtruth.txt"
        text = self.done("eval", "--gt", truth, "--est", truth, "--align", "sim3", "--json", "--errors",
                         self.folder / "errors.csv", "--frames", sequence() / "associations.txt")
        self.assert_told("Keys of `eval --json`", keys(json.loads(text)))
        self.assert_header("Columns of `eval --errors`", self.folder / "errors.csv")

    def test_bench(self):
        data, report = self.folder / "data", self.folder / "report"
        data.mkdir()
        report.mkdir()
        self.copy_sequence("data/one", FRAMES)
        (report / "__main__.py").write_text(REPORT, encoding="utf-8")
        out = self.folder / "results"
        text = self.done("bench", data, "--out", out, "--modes", "full", "--runs", 1, "--segmenter",
                         "masks:mask", "--deterministic", "--json",
                         environment={"YGSLAM_REPORT": str(report)})
        told = keys(json.loads(text))
        self.assert_told("Keys of `bench --json`", told)
        compared = keys(json.loads(self.done("bench", "--compare", out, out, "--json")))
        figures = "|".join(re.escape(key[:-len(".*")]) for key in told if key.endswith(".*"))
        self.assert_told("Keys of `bench --compare --json`",
                         {re.sub(f"^({figures})", "rows[].FIGURE", key) for key in compared})
        self.assert_told("Keys of `sweep.json`", keys(self.load(out, "sweep.json")))
        run = out / "runs" / "one" / "full" / "01"
        record = self.load(run, "run.json")
        told = {key.split(".")[1] for key in names("Keys of `sweep.json`") if key.startswith("options.")}
        self.assertEqual(set(record["options"]), told - {"modes", "runs", "jobs"})
        record["options"] = None  # told once
        self.assert_told("Keys of `run.json`", keys(record))
        self.assertEqual(listing(run), set(names("Files of `run`")) | {"errors.csv", "run.json"})
        self.assertEqual(listing(out / "sequences" / "one" / "inspect"),
                         set(names("Files of `inspect`")) | {"drawn.json"})
        told = {name.split("/")[0] + "/" * ("/" in name) for name in names("Files of `bench`")}
        self.assert_told("Files of `bench`", listing(out), sorted(told))

    def test_calibrate(self):
        lively, camera = self.folder / "lively", self.folder / "camera.yaml"
        self.done("simulate", "walking_rpy", "--out", lively, "--without", "movers", "--size", "320x240",
                  "--seconds", 6, "--rolling", 0.8)
        text = self.done("calibrate", lively, "--write", camera)
        printed = re.findall(r"(?m)^(\S.*?) {2,}.* (?:agrees|differs|this motion does not tell)$", text)
        self.assert_told("Rows of `calibrate`", printed)
        written = re.findall(r"(?m)^(\w+): ", camera.read_text(encoding="utf-8"))
        self.assert_told("Keys of `calibrate --write`", written)


if __name__ == "__main__":
    unittest.main()
