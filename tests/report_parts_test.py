"""Parts of tools/report by themselves: published figures, rotations, maps, files.

    python tests/report_parts_test.py
"""
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np
from PIL import Image

from report_fake import metrics, write_map

TOOL = pathlib.Path(__file__).resolve().parent.parent / "tools" / "report"
sys.path.insert(0, str(TOOL.parent))

from report import cells, figures, map_view, page, pictures, results, series, table_files  # noqa: E402
from report.published import Published  # noqa: E402


class WhatIsRead(unittest.TestCase):
    def test_figures_that_read_the_same_share_a_place(self):
        def ranks(*values):
            row = [cells.Cell("measured", value) for value in values]
            cells.rank(row)
            return [cell.rank for cell in row]
        self.assertEqual(ranks(0.00021, 0.00024, 0.00019), [0, 0, 0])  # 0.0002 all
        self.assertEqual(ranks(0.00121, 0.00124, 0.0019, 0.003), [1, 1, 2, 0])

    def test_a_camera_that_stands_is_drawn_in_millimetres(self):
        still = 3 + 1e-4 * np.eye(3)
        self.assertEqual(figures.path_scale(still), (1000, "mm"))
        self.assertEqual(figures.path_scale(still, np.eye(3)), (1, "m"))
        self.assertEqual(figures.path_scale(np.full((3, 3), np.nan)), (1, "m"))


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


    def test_what_could_not_be_confirmed_of_a_source_is_told(self):
        doubtful = {key for key, c in Published().citations.items() if "unconfirmed" in c}
        self.assertEqual(doubtful, {"YG-SLAM", "DFS-SLAM", "ADD-SLAM"})
        table = cells.Table("t", "1", "T", "", "Row", [cells.Column("A", citation="DFS-SLAM")])
        citations = Published().citations
        for text in (table_files.to_csv(table, citations), table_files.to_latex(table, citations),
                     page.table_html(table, Published())):
            self.assertIn("(not confirmed: authors)", text)


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


class EvalPlot(unittest.TestCase):
    DATA = {"time": "time [s]", "alignment": "se3",
            "truth": {"t": [0, 1], "xyz": [[0, 0, 0], [1, 1, 0]]},
            "estimates": [{"name": "a", "t": [0, 1], "xyz": [[0, 0, 0], [1, 1, 0]], "rmse_m": 0,
                           "truth_xyz": [[0, 0, 0], [1, 1, 0]], "ate_m": [0, 0]}]}

    def test_a_full_disk_is_one_line(self):
        def limit():  # no file may grow beyond this, as on a full disk
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
        with tempfile.TemporaryDirectory() as folder:
            for ending in ("pdf", "svg", "png"):
                done = subprocess.run(
                    [sys.executable, str(TOOL / "eval_plot.py"), f"--out={folder}/a.{ending}"],
                    input=json.dumps(self.DATA), capture_output=True, text=True, check=False,
                    preexec_fn=limit, restore_signals=False, timeout=120)
                self.assertEqual(done.returncode, 9, done.stderr)
                self.assertEqual(done.stderr.splitlines()[-1], "error: File too large")
                self.assertNotIn("Traceback", done.stderr)
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [])


class TrackingPictures(unittest.TestCase):
    def test_frames_are_shown_large_and_the_sheet_only_without_them(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "inspect"
            folder.mkdir()
            sequence = types.SimpleNamespace(folder=pathlib.Path(name))
            Image.new("RGB", (3840, 480)).save(folder / "checks.png")
            (sheet,) = pictures.tracking_pictures(sequence, 1600)
            self.assertIn("each column a frame", sheet[1])
            for frame in ("frame_00044.png", "frame_00068.png"):
                Image.new("RGB", (1920, 480)).save(folder / frame)
            shown = pictures.tracking_pictures(sequence, 1600)
            self.assertEqual([one[0] for one in shown], ["frame_00044", "frame_00068"])
            self.assertEqual([one[2].width for one in shown], [1600, 1600])


class WallTime(unittest.TestCase):
    def test_it_is_no_sum_of_runs(self):
        runs = [types.SimpleNamespace(wall_s=seconds) for seconds in (60, 30, None)]
        self.assertEqual(page.wall_time(200, runs), "3 min 20 s, of which runs 1 min 30 s")
        self.assertIn("together", page.wall_time(50, runs), "two at a time")
        self.assertEqual(page.wall_time(None, []), "not told")


class DamagedRuns(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name, "01")
        self.folder.mkdir()
        self.write("run.json", '{"format": 1, "status": "ok"}')
        self.write("metrics.json", json.dumps(metrics(0.01, 1)))

    def write(self, name, content):
        content = content if isinstance(content, bytes) else content.encode()
        (self.folder / name).write_bytes(content)

    def assert_failed(self, error):
        run = results.read_run(self.folder, "off", 1)
        self.assertEqual((run.status, run.metrics), ("failed", {}))
        self.assertIn(error, run.error)

    def test_figures_that_cannot_be(self):
        self.assertEqual(results.read_run(self.folder, "off", 1).status, "ok")
        for part, change in (("ate.rmse", {"ate": {"rmse": -0.01, "std": 0.1}}),
                             ("ate.std", {"ate": {"rmse": 0.01, "std": float("nan")}}),
                             ("ate.rmse", {"ate": {"rmse": "0.01"}}),
                             ("ate.rmse", {"ate": {"rmse": None}}), ("ate", {"ate": 3}),
                             ("rpe.sec1", {"rpe": {"sec1": True}}), ("rpe", {"rpe": []}),
                             ("timing_ms.track.mean", {"timing_ms": {"track": {"mean": -1}}}),
                             ("cpu_ms.track.mean", {"cpu_ms": {"track": {"mean": float("inf")}}}),
                             ("coverage", {"coverage": 1.5}), ("coverage", {"coverage": None})):
            self.write("metrics.json", json.dumps({**metrics(0.01, 1), **change}))
            self.assert_failed(f"metrics.json: {part} is no")

    def test_noise(self):
        for name in ("trajectory.txt", "errors.csv", "metrics.json", "run.json"):
            self.setUp()
            self.write(name, bytes(range(256)) * 9)
            self.assert_failed(f"{name}: not text")

    def test_poses_and_errors_that_are_none(self):
        self.write("trajectory.txt", "1 2 3\n")
        self.assert_failed("trajectory.txt:1: not a pose")
        (self.folder / "trajectory.txt").unlink()
        self.write("errors.csv", b"a\0b\n\0,1\n")
        self.assert_failed("errors.csv: not a table")
        (self.folder / "errors.csv").unlink()
        self.write("run.json", '{"format": 1, "status": "ok", "files": {"errors.csv": "00"}}')
        self.assert_failed("errors.csv: No such file")

    def test_pipes_and_folders_in_place_of_files(self):
        for make in (os.mkfifo, os.mkdir):
            for name in ("run.json", "metrics.json", "trajectory.txt"):
                self.setUp()
                (self.folder / name).unlink(missing_ok=True)
                make(self.folder / name)
                self.assert_failed(f"{name}: not a regular file")

    def test_words_and_columns_are_those_of_the_program(self):
        source = TOOL.parent.parent / "src"
        record = (source / "benchmark_runs" / "run_record.cpp").read_text(encoding="utf-8")
        self.assertEqual(set(re.findall(r'\{"(\w+)", RunStatus::', record)),
                         set(results.STATUSES) - {"unfinished"})
        figures = (source / "benchmark_runs" / "run_files.cpp").read_text(encoding="utf-8")
        trees = re.search(r"kFigureTrees = \{([^}]*)\}", figures).group(1)
        self.assertEqual(tuple(re.findall(r'"(\w+)"', trees)), results.FIGURE_TREES)
        errors = (source / "eval" / "error_series.hpp").read_text(encoding="utf-8")
        columns = re.search(r"kErrorColumns =([^;]*);", errors).group(1)
        self.assertEqual(tuple("".join(re.findall(r'"([^"]*)"', columns)).split(",")),
                         series.COLUMNS)
        options = (source / "benchmark_runs" / "sweep_options.hpp").read_text(encoding="utf-8")
        self.assertIn(f"kMostRuns = {results.MOST_RUNS};", options)

    def test_what_a_run_measured_before_it_was_ended_does_not_count(self):
        for status in ("crashed", "timed_out", "failed"):
            self.write("run.json", json.dumps({"format": 1, "status": status, "error": "so"}))
            run = results.read_run(self.folder, "off", 1)
            self.assertEqual((run.status, run.error, run.metrics), (status, "so", {}))
        self.write("run.json", '{"status": ["ok"], "wall_s": "long", "error": 3}')
        run = results.read_run(self.folder, "off", 1)
        self.assertEqual((run.status, run.wall_s, run.error), ("failed", None, "3"))


if __name__ == "__main__":
    unittest.main()
