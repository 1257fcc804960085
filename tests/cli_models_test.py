"""Bad models given to `ygslam run`, none, and the built-in one."""
import json
import os
import pathlib
import re
import resource
import struct
import unittest

import numpy as np
from PIL import Image

from ygslam_cli import CliTest, png, sequence, ygslam


def onnx_field(number, payload):
    """One length-delimited field of a protocol buffer."""
    def varint(value):
        out = b""
        while value > 127:
            out, value = out + bytes([value & 127 | 128]), value >> 7
        return out + bytes([value])
    return varint(number << 3 | 2) + varint(len(payload)) + payload


def onnx_with_huge_tensor():
    """A syntactically right ONNX model with a constant of 2^62 numbers it does not hold."""
    huge = b"\x08" + b"\x80" * 8 + b"\x40"  # dims: 2^62
    tensor = huge + b"\x10\x01" + onnx_field(8, b"c") + onnx_field(9, struct.pack("<f", 1.0))
    node = onnx_field(1, b"c") + onnx_field(2, b"y") + onnx_field(4, b"Identity")
    graph = onnx_field(1, node) + onnx_field(2, b"g") + onnx_field(5, tensor)
    graph += onnx_field(12, onnx_field(1, b"y"))
    return b"\x08\x08" + onnx_field(7, graph) + onnx_field(8, b"\x10\x0d")


class Models(CliTest):
    """F24: models that are none, and no model at all."""

    def assert_refused(self, model, *parts):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = ygslam("run", sequence(), "--out", self.folder / "out", "--model", model, "--quiet")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assert_error(done, 5, *parts)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        self.assertLess(spent, 5.0, "seconds of processor time")

    def test_without_a_model_the_built_in_network_is_taken_and_said(self):
        for mode in ("full", "semantic"):
            done = self.run_slam(sequence(), "--dynamic", mode, "--to", 8, geometry=False, out=mode)
            self.assert_ran(done)
            self.assertEqual(done.stderr.count("people are found by the built-in one"), 1)
            self.assertEqual(json.loads((self.folder / mode / "metrics.json").read_text())["segmenter"], "builtin")
        done = self.run_slam(sequence(), "--dynamic", "geometry", "--to", 8, geometry=False, out="geometry")
        self.assertNotIn("built-in", done.stderr)

    def test_a_model_that_is_asked_for_and_not_given_is_an_error(self):
        done = self.run_slam(sequence(), "--segmenter", "model", "--quiet", geometry=False)
        self.assert_error(done, 5, "make model", "--model", "--segmenter none", "--dynamic geometry")

    def test_the_hint_names_options_that_the_command_has(self):
        for command, options in (("inspect", ()), ("inspect", ("--checks", "full")),
                                 ("localize", ("--map", self.folder / "none.map", "--out", self.folder / "out"))):
            done = ygslam(command, sequence(), *options, "--segmenter", "model", "--quiet")
            self.assert_error(done, 5, "make model")
            offered = re.findall(r"--[a-z]+", done.stderr)
            self.assertGreater(len(offered), 3)
            known = ygslam(command, "--help").stdout
            for option in offered:
                self.assertRegex(known, rf"(?m)^ +{option}\b", command)
        self.assert_ran(ygslam("inspect", sequence(), "--to", 8, "--checks", "classic,improved"))

    def test_files_that_are_no_model_are_named(self):
        contents = {"empty.onnx": b"", "garbage.onnx": bytes(range(256)) * 400,
                    "words.xml": b"<html>sign in</html>", "deep.xml": b"<a>" * 200000,
                    "zeros.onnx": bytes(100000), "picture.onnx": png(8, 8), "model.pt": b"x",
                    "huge_tensor.onnx": onnx_with_huge_tensor()}
        for name, data in contents.items():
            with self.subTest(name):
                (self.folder / name).write_bytes(data)
                self.assert_refused(self.folder / name, name)
        with open(self.folder / "huge.onnx", "wb") as file:
            file.truncate(5 << 30)
        self.assert_refused(self.folder / "huge.onnx", "huge.onnx")
        self.assert_refused(self.folder / "none.onnx", "none.onnx")
        self.assert_refused(self.folder, self.folder.name)

    def test_another_network_and_a_truncated_one_are_refused(self):
        import openvino as ov  # pylint: disable=import-outside-toplevel
        from openvino import opset8  # pylint: disable=import-outside-toplevel
        for shape, outputs in (([1, 10], 1), ([1, 3, 64, 64], 1), ([1, 3, 64, 64], 2)):
            data = opset8.parameter(shape, dtype=ov.Type.f32, name="images")
            results = [opset8.result(opset8.relu(data)) for _ in range(outputs)]
            path = self.folder / f"net{len(shape)}{outputs}.xml"
            ov.save_model(ov.Model(results, [data]), path)
            kinds = ("YOLO-seg", "RTMDet-Ins", "RF-DETR-Seg") if len(shape) == 4 else ()
            self.assert_refused(path, path.name, *kinds)
        whole = path.read_bytes()
        for share in (0.3, 0.9):
            path.write_bytes(whole[:int(share * len(whole))])
            self.assert_refused(path, path.name)

    def test_the_built_in_network_runs_in_step_or_is_said_to_be_missing(self):
        for schedule in ("--deterministic", "--realtime"):
            done = self.run_slam(sequence(), "--segmenter", "builtin", "--to", 12, schedule, "--quiet",
                                 "--set", "run.max_lost_share=1", out=schedule, geometry=False)
            if done.returncode == 5:
                self.assert_error(done, 5, "the built-in people network: not in this build", "--model FILE")
                return  # built without assets/people.onnx
            self.assert_ran(done)
            metrics = self.metrics(schedule)
            self.assertEqual(metrics["segmenter"], "builtin")
            self.assertEqual(metrics["masks_used"], metrics["readable"] - metrics["dropped"])
            self.assertIn(metrics["precision"], ("f32", "bf16"))
            self.assertEqual(metrics["mask_age_frames"]["p95"], 0)

    def test_the_built_in_network_in_int8_finds_the_same_people(self):
        found = {}
        for precision in ("f32", "int8"):
            masks = self.folder / f"masks_{precision}"
            done = self.run_slam(sequence(), "--segmenter", "builtin", "--set", f"segment.precision={precision}",
                                 "--to", 12, "--deterministic", "--save-masks", masks, "--quiet", out=precision,
                                 geometry=False)
            if done.returncode == 5:
                self.assert_error(done, 5, "the built-in people network: not in this build", "--model FILE")
                self.skipTest("built without the network")
            self.assert_ran(done)
            self.assertEqual(self.metrics(precision)["precision"], precision)
            found[precision] = np.stack([np.asarray(Image.open(file)) > 0 for file in sorted(masks.glob("*.png"))])
        both, either = (found["f32"] & found["int8"]).sum(), (found["f32"] | found["int8"]).sum()
        self.assertGreater(either, 0.01 * found["f32"].size)
        self.assertGreater(both / either, 0.9)

    def test_truncations_of_the_real_model_are_refused(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared"))
        model = shared / "models" / "yolov8n-seg_480x640.onnx"
        if not model.exists():
            self.skipTest(f"no model at {model}")
        data = model.read_bytes()
        for share in (0.01, 0.5, 0.99):
            path = self.folder / "cut.onnx"
            path.write_bytes(data[:int(share * len(data))])
            self.assert_refused(path, "cut.onnx")
        done = ygslam("run", sequence(), "--out", self.folder / "out", "--model", model, "--set",
                      "segment.precision=int8", "--quiet")
        self.assert_error(done, 3, "int8")


if __name__ == "__main__":
    unittest.main(verbosity=2)
