#!/usr/bin/env python3
"""The model tools' behaviour that needs no PyTorch, NNCF or network: arguments, faults, files."""

import io
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from contextlib import redirect_stderr
from pathlib import Path

TOOLS = Path(__file__).resolve().parent.parent / "tools"
sys.path.insert(0, str(TOOLS))

import export_inside  # noqa: E402  pylint: disable=wrong-import-position
import export_model  # noqa: E402  pylint: disable=wrong-import-position
import export_networks  # noqa: E402  pylint: disable=wrong-import-position
import quantize_model  # noqa: E402  pylint: disable=wrong-import-position
import throwaway_env  # noqa: E402  pylint: disable=wrong-import-position


def run_tool(name, *arguments):
    """The finished process of one tool."""
    command = [sys.executable, str(TOOLS / name), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def refused(parse, *arguments):
    """The exit code with which a command line is refused, None if it is taken."""
    with redirect_stderr(io.StringIO()):
        try:
            parse(list(arguments))
        except SystemExit as stop:
            return stop.code
    return None


class InTemporaryFolder(unittest.TestCase):
    """Each test has an empty folder."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def assert_one_error_line(self, process, *parts):
        """Exit code 1, nothing on stdout, one line of error that holds the parts."""
        self.assertEqual(process.returncode, 1, process.stderr)
        self.assertEqual(process.stdout, "")
        last = process.stderr.strip().splitlines()[-1]
        self.assertIn("error: ", last)
        for part in parts:
            self.assertIn(str(part), last)
        self.assertNotIn("Traceback", process.stderr)


class ExportModel(InTemporaryFolder):
    """tools/export_model.py"""

    def test_sizes_must_be_multiples_of_32(self):
        self.assertEqual(export_model.parse_arguments(["--size", "384x512"]).size, (384, 512))
        for bad in ("480", "481x640", "48x650", "0x0", "axb", "480x640x3", "4096x640", "-32x64"):
            self.assertEqual(refused(export_model.parse_arguments, f"--size={bad}"), 2, bad)

    def test_name_says_network_and_size(self):
        def name(*arguments):
            return export_model.output_name(export_model.parse_arguments(list(arguments)))

        self.assertEqual(name(), "yolov8n-seg_480x640.onnx")
        self.assertEqual(name("--dynamic"), "yolov8n-seg_dynamic.onnx")
        self.assertEqual(
            name("--weights", "untrained", "--size", "384x512"),
            "yolov8n-seg-untrained_384x512.onnx",
        )
        self.assertEqual(name("--weights", "a/b/mine.pt"), "mine_480x640.onnx")
        self.assertEqual(name("--model", "rtmdet-ins-tiny"), "rtmdet-ins-tiny_480x640.onnx")
        self.assertEqual(name("--model", "rfdetr-seg-nano"), "rfdetr-seg-nano.onnx")
        self.assertEqual(
            name("--model", "rfdetr-seg-nano", "--weights", "untrained", "--size", "240x312"),
            "rfdetr-seg-nano-untrained_240x312.onnx",
        )

    def test_each_network_has_a_licence_weights_and_requirements_that_exist(self):
        for name, network in export_networks.NETWORKS.items():
            self.assertEqual(network.name, name)
            self.assertIn(export_networks.LICENCES[network.maker], network.notice)
            self.assertIn(network.maker, export_inside.EXPORTS)
            for requirements, *options in export_networks.REQUIREMENTS[network.maker]:
                self.assertTrue((TOOLS / requirements).is_file(), requirements)
                self.assertLessEqual(set(options), {"--no-deps"})
            if network.weights_url:
                self.assertRegex(network.weights_url, r"^https://[a-z./0-9]+/.*\.pth?$")
                self.assertIn(export_networks.HOSTS[network.maker], network.weights_url)
        licences = {name: n.notice for name, n in export_networks.NETWORKS.items()}
        for name in ("yolov8n-seg", "yolo11s-seg", "yolo26x-seg"):
            self.assertIn("AGPL-3.0", licences[name])
        for name in ("rtmdet-ins-tiny", "rfdetr-seg-nano"):
            self.assertNotIn("AGPL", licences[name])
            self.assertIn("under Apache-2.0, code and weights", licences[name])

    def test_help_lists_each_network_below_its_licence(self):
        text = run_tool("export_model.py", "--help").stdout
        for name in export_networks.NETWORKS:
            self.assertIn(name, text)
        for part in ("AGPL-3.0, code and weights", "Apache-2.0, code and weights",
                     "download.openmmlab.com", "Python 3.10 to 3.11"):
            self.assertIn(part, text)

    def test_unknown_networks_and_open_sizes_of_others_are_usage_errors(self):
        parse = export_model.parse_arguments
        self.assertEqual(refused(parse, "--model", "yolov5n-seg"), 2)
        self.assertEqual(refused(parse, "--model", "rfdetr-seg-nano", "--dynamic"), 2)
        self.assertEqual(refused(parse, "--model", "rtmdet-ins-s", "--size", "300x320"), 2)
        square = parse(["--model", "rfdetr-seg-nano", "--size", "312x312"])
        self.assertEqual(square.size, (312, 312))

    def test_command_inside_the_environment_says_all_and_is_understood_there(self):
        for line in (["--dynamic"], ["--model", "rfdetr-seg-small"],
                     ["--model", "rtmdet-ins-m", "--size", "256x320", "--weights", "untrained"]):
            given = export_model.parse_arguments(line)
            command = export_model.inner_command("python", given, given.weights, self.folder)
            self.assertEqual(command[0], "python")
            there = export_model.parse_arguments([str(part) for part in command[2:]])
            self.assertEqual(there.inside, self.folder)
            for key in ("model", "weights", "size", "dynamic"):
                self.assertEqual(getattr(there, key), getattr(given, key), key)

    def test_weights_keep_their_kind_and_rfdetr_downloads_its_own(self):
        mine = self.folder / "mine.pth"
        mine.write_bytes(b"PK")
        parse = export_model.parse_arguments
        copied = export_model.prepare_weights(
            parse(["--model", "rtmdet-ins-s", "--weights", str(mine)]), self.folder)
        self.assertEqual(copied.name, "rtmdet-ins-s.pth")
        self.assertEqual(copied.read_bytes(), b"PK")
        for weights in ("trained", "untrained"):
            given = parse(["--model", "rfdetr-seg-nano", "--weights", weights])
            self.assertEqual(export_model.prepare_weights(given, self.folder), weights)

    def test_python_that_an_exporter_does_not_know_is_named(self):
        given = export_model.parse_arguments(["--model", "rtmdet-ins-tiny"])
        export_model.check_python(given, (3, 11))
        for version in ((3, 9), (3, 12)):
            with self.assertRaises(throwaway_env.ToolError) as caught:
                export_model.check_python(given, version)
            self.assertIn("Python 3.10 to 3.11", str(caught.exception))

    def test_input_size_goes_into_the_pipeline_as_width_and_height(self):
        steps = [{"type": "LoadImageFromFile"}, {"type": "Resize", "scale": (640, 640)},
                 {"type": "Pad", "size": (640, 640)}, {"type": "PackDetInputs"}]
        export_inside.set_input_size(steps, 480, 640)
        self.assertEqual(steps[1]["scale"], (640, 480))
        self.assertEqual(steps[2]["size"], (640, 480))
        outputs = export_inside.rtmdet_deployment()["onnx_config"]["output_names"]
        self.assertEqual(outputs, ["dets", "labels", "masks"])

    def test_exporter_that_writes_nothing_is_an_error(self):
        network = export_networks.NETWORKS["rfdetr-seg-nano"]
        exports = {network.maker: lambda *_: str(self.folder / "none.onnx")}
        with unittest.mock.patch.object(export_inside, "EXPORTS", exports):
            with self.assertRaises(throwaway_env.ToolError) as caught:
                export_inside.export(network, "untrained", None, False, self.folder)
        self.assertIn("none.onnx", str(caught.exception))

    def test_missing_weights_are_named_before_anything_is_installed(self):
        process = run_tool("export_model.py", "--weights", self.folder / "none.pt")
        self.assert_one_error_line(process, "none.pt")
        self.assertIn("AGPL-3.0", process.stderr)

    def test_download_that_fails_says_what_to_do(self):
        with self.assertRaises(throwaway_env.ToolError) as caught:
            with redirect_stderr(io.StringIO()):
                export_model.fetch_weights(self.folder / "w.pt", "http://127.0.0.1:9/w.pt")
        self.assertIn("--weights FILE", str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
        self.assertFalse((self.folder / "w.pt").exists())

    def test_download_of_something_else_is_refused(self):
        page = self.folder / "page.html"
        page.write_text("<html>sign in</html>")
        with self.assertRaises(throwaway_env.ToolError):
            with redirect_stderr(io.StringIO()):
                export_model.fetch_weights(self.folder / "w.pt", page.as_uri())
        self.assertFalse((self.folder / "w.pt").exists())

    def test_unknown_option_is_a_usage_error(self):
        self.assertEqual(run_tool("export_model.py", "--wieghts", "x").returncode, 2)


class QuantizeModel(InTemporaryFolder):
    """tools/quantize_model.py"""

    def test_writes_beside_the_model_unless_told(self):
        parse = quantize_model.parse_arguments
        both = ["--model", "m/net.onnx", "--images", "i"]
        self.assertEqual(parse(both).out, Path("m/net_int8.xml"))
        self.assertEqual(parse([*both, "--out", "x.xml"]).out, Path("x.xml"))
        self.assertEqual(refused(parse, *both, "--out", "x.onnx"), 2)

    def test_best_score_is_found_in_either_layout_of_yolo(self):
        import numpy as np  # pylint: disable=import-outside-toplevel

        cells = np.zeros((1, 4 + 80 + 32, 21), np.float32)
        cells[0, :4], cells[0, 84:], cells[0, 20, 7] = 300, 9, 0.625
        self.assertEqual(quantize_model.best_score(cells), 0.625)
        rows = np.zeros((1, 300, 38), np.float32)
        rows[0, :, :4], rows[0, :, 5:], rows[0, 3, 4] = 300, 9, 0.75
        self.assertEqual(quantize_model.best_score(rows), 0.75)

    def test_model_images_and_a_count_above_zero_are_required(self):
        parse = quantize_model.parse_arguments
        self.assertEqual(refused(parse), 2)
        self.assertEqual(refused(parse, "--model", "m.onnx"), 2)
        for count in ("0", "-1", "many"):
            line = ["--model", "m", "--images", "i", f"--count={count}"]
            self.assertEqual(refused(parse, *line), 2, count)

    def test_missing_model_folder_or_images_are_named(self):
        model = self.folder / "net.onnx"
        images = self.folder / "images"
        line = ["--model", model, "--images", images]
        self.assert_one_error_line(run_tool("quantize_model.py", *line), "net.onnx")
        model.write_bytes(b"x")
        self.assert_one_error_line(run_tool("quantize_model.py", *line), images, "no such folder")
        images.mkdir()
        self.assert_one_error_line(run_tool("quantize_model.py", *line), images, "no images")
        self.assertEqual([p.name for p in self.folder.glob("*_int8*")], [])

    def test_images_are_spread_evenly_and_a_sequence_gives_its_colour_ones(self):
        for folder in ("rgb", "depth"):
            (self.folder / folder).mkdir()
            for i in range(100):
                (self.folder / folder / f"{i:03}.png").touch()
        chosen = quantize_model.calibration_images(self.folder, 10)
        self.assertEqual([p.stem for p in chosen], [f"{i:03}" for i in range(0, 100, 10)])
        self.assertEqual({p.parent.name for p in chosen}, {"rgb"})
        self.assertEqual(len(quantize_model.calibration_images(self.folder, 1000)), 100)


class ThrowawayEnvironment(InTemporaryFolder):
    """tools/throwaway_env.py"""

    def test_command_that_fails_is_an_error_with_its_last_words(self):
        with self.assertRaises(throwaway_env.ToolError) as caught:
            with redirect_stderr(io.StringIO()):
                code = "import sys; print('x'); print('error: broken pipe dream'); sys.exit(3)"
                throwaway_env.run([sys.executable, "-c", code], "the job")
        self.assertEqual(str(caught.exception), "the job failed: error: broken pipe dream")

    def test_file_is_put_in_place_whole_with_its_folder(self):
        source = self.folder / "a"
        source.write_text("new")
        target = self.folder / "deep" / "er" / "b"
        throwaway_env.move_into_place(source, target)
        self.assertEqual(target.read_text(), "new")
        self.assertEqual([p.name for p in target.parent.iterdir()], ["b"])
        with self.assertRaises(throwaway_env.ToolError):
            throwaway_env.move_into_place(source, source / "below" / "a_file")

    def test_kept_environment_is_reused(self):
        python = self.folder / "bin" / "python"
        python.parent.mkdir()
        python.touch()
        with throwaway_env.environment(self.folder) as found:
            self.assertEqual(found, python.resolve())
        self.assertTrue(python.exists())


if __name__ == "__main__":
    unittest.main()
