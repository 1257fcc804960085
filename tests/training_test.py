#!/usr/bin/env python3
"""What the network of our own is trained with: random frames, their preparation, a small training; how it is judged.

The training needs PyTorch: $YGSLAM_TRAINING_PYTHON, or the environment that `make train` leaves in
build/training-env; without either that part is skipped.
"""
import csv
import json
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np
from PIL import Image

from ygslam_cli import BINARY, CliTest, HANG_S, ROOT, ygslam

TRAINING = ROOT / "training"
DATA = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")) / "data"
PYTHON = pathlib.Path(os.environ.get("YGSLAM_TRAINING_PYTHON", ROOT / "build/training-env/bin/python"))
sys.path.insert(0, str(TRAINING))
# Exports a network, takes its weights over into another one, exports that; prints by how much the logits of
# the two files differ, by how much those of the file are above the network's, whether exporting left the
# network as it was, and what is said of a file without that metadata.
ROUND_TRIP = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy, openvino, torch
from export import onnx_model, raised_by
from network import PeopleNet
from start import take_over
torch.manual_seed(1)
net = PeopleNet((8, 8, 16, 16))
for module in net.modules():
    if isinstance(module, torch.nn.BatchNorm2d):
        torch.nn.init.uniform_(module.weight, .5, 1.5)
        torch.nn.init.normal_(module.bias, std=.1)
        torch.nn.init.normal_(module.running_mean, std=.1)
        torch.nn.init.uniform_(module.running_var, .5, 1.5)
net.eval()
x = torch.randn(4, 5, 120, 160)

def logits(model):
    core = openvino.Core()
    network = core.compile_model(core.read_model(model.SerializeToString()), "CPU",
                                 {"INFERENCE_PRECISION_HINT": "f32"})
    return numpy.stack([network([one[None]])[0][0] for one in x.numpy()])

before = {name: value.clone() for name, value in net.state_dict().items()}
first = onnx_model(net)
with open(sys.argv[2], "wb") as file:
    file.write(first.SerializeToString())
again = PeopleNet((8, 8, 16, 16))
take_over(again, sys.argv[2], x)
with torch.no_grad():
    plain = net(x).numpy()
silent = onnx_model(net)
del silent.metadata_props[:]
try:
    refused = f"taken as {raised_by(silent)}"
except ValueError as error:
    refused = str(error)
print(json.dumps({"apart": float(abs(logits(first) - logits(onnx_model(again))).max()),
                  "spread": float(plain.std()), "raised": float((logits(first) - plain).mean()),
                  "refused": refused,
                  "same": all(torch.equal(value, before[name]) for name, value in net.state_dict().items())}))
"""


def bytes_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


class RandomFrames(CliTest):
    """`ygslam simulate --random`"""

    def render(self, name, *options, count=8):
        out = self.folder / name
        self.assert_ran(ygslam("simulate", "--random", count, "--out", out, "--size", "160x120",
                               "--quiet", *options))
        return out

    def test_frames_are_listed_and_whole(self):
        out = self.render("frames")
        with open(out / "frames.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 8)
        for row in rows:
            self.assertEqual((row["width"], row["height"]), ("160", "120"))
            self.assertTrue(100 < float(row["fx"]) < 190, row)
            for ending in (".jpg", "_depth.png", "_people.png"):
                self.assertTrue((out / (row["name"] + ending)).stat().st_size > 0)
        self.assertEqual(len(bytes_of(out)), 3 * 8 + 1)

    def test_same_seed_same_bytes(self):
        first = bytes_of(self.render("a", "--seed", 5, "--threads", 1))
        self.assertEqual(first, bytes_of(self.render("b", "--seed", 5, "--threads", 2)))
        self.assertNotEqual(first, bytes_of(self.render("c", "--seed", 6)))

    def test_what_does_not_go_with_it_is_refused(self):
        out = self.folder / "out"
        for options in (("walking_xyz",), ("--truth",), ("--blur", "0.5"), ("--list",)):
            done = ygslam("simulate", "--random", 3, "--out", out, *options)
            self.assertEqual(done.returncode, 2, (options, done.stderr))
        self.assertEqual(ygslam("simulate", "--random", 0, "--out", out).returncode, 2)
        self.assertEqual(ygslam("simulate", "--random", 3).returncode, 2)
        self.assertFalse(out.exists())

    def test_a_folder_that_cannot_be_written_is_told(self):
        blocked = self.folder / "file"
        blocked.write_text("x", encoding="utf-8")
        done = ygslam("simulate", "--random", 1, "--out", blocked / "below")
        self.assertEqual(done.returncode, 9, done.stderr)


class Preparation(unittest.TestCase):
    """training/prepare.py"""

    def test_it_gives_what_it_gave(self):
        try:
            import golden  # pylint: disable=import-outside-toplevel
        except ImportError as error:
            self.skipTest(f"{error}")
        kept = json.loads(golden.FILE.read_text(encoding="utf-8"))
        for old, new in zip(kept["frames"], golden.answers()["frames"], strict=True):
            self.assertEqual(len(old["values"]), len(new["values"]))
            for a, b in zip(old["values"], new["values"]):
                self.assertAlmostEqual(a, b, delta=1e-4)


class Outlines(CliTest):
    """training/people_polygons.json, and training/evaluate.py, which scores with it"""
    frames = json.loads((TRAINING / "people_polygons.json").read_text(encoding="utf-8"))["frames"]
    model = ROOT / "assets/people.onnx"

    def evaluate(self, *arguments):
        return subprocess.run([sys.executable, TRAINING / "evaluate.py", *map(str, arguments)], capture_output=True,
                              text=True, check=False, timeout=HANG_S)

    @staticmethod
    def parts(person):
        return person if isinstance(person[0][0], list) else [person]

    def test_the_outlines_are_whole(self):
        frames = {name: (len(drawn), sum(map(len, drawn.values()))) for name, drawn in self.frames.items()}
        self.assertEqual(frames, {"kitchen_person_static_camera": (18, 18), "tum_fr1_rpy_part": (26, 26),
                                  "redkitchen_walk": (16, 29), "bonn_crowd_part": (30, 35)})
        for name, drawn in self.frames.items():
            for file, people in drawn.items():
                for polygon in (part for person in people for part in self.parts(person)):
                    x, y = np.array(polygon).T
                    self.assertTrue(0 <= x.min() < x.max() < 640 and 0 <= y.min() < y.max() < 480, (name, file))
                    area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
                    self.assertGreater(area, 50, (name, file, polygon))

    def drawn_sequence(self):
        """Two frames of 100x80: one with two people, the second of them in two parts, one with nobody."""
        folder = self.folder / "drawn"
        for part in ("rgb", "masks"):
            (folder / part).mkdir(parents=True)
        (folder / "calibration.txt").write_text("50 50 49.5 39.5 5000\n", encoding="utf-8")
        rows = [f"{i}.5 rgb/{i}.png {i}.5 depth/{i}.png\n" for i in (1, 2)]
        (folder / "associations.txt").write_text("".join(rows), encoding="utf-8")
        for i in (1, 2):
            Image.new("RGB", (100, 80)).save(folder / f"rgb/{i}.png")
        (folder / "masks/instances.json").write_text('{"1": "person", "2": "chair", "3": 0}', encoding="utf-8")

        def box(x, y, width, height):
            return [[x, y], [x + width - 1, y], [x + width - 1, y + height - 1], [x, y + height - 1]]
        people = [box(0, 0, 40, 20), [box(60, 0, 10, 10), box(60, 40, 10, 10)]]
        polygons = {"frames": {"drawn": {"1.png": people, "2.png": []}}}
        (folder / "polygons.json").write_text(json.dumps(polygons), encoding="utf-8")
        return folder

    def test_masks_are_scored_against_outlines(self):
        folder = self.drawn_sequence()
        ids = np.zeros((2, 80, 100), np.uint8)
        ids[0, :20, :30] = 1  # three quarters of the first
        ids[0, :10, 60:70] = 3  # half of the other
        ids[0, 60:, :] = 2  # no person
        ids[1, :10, :10] = 4  # nobody; not listed, so called a person
        for i in (1, 2):
            Image.fromarray(ids[i - 1]).save(folder / f"masks/{i}.500000.png")
        command = [f"masks:{folder / 'masks'}", folder, "--polygons", folder / "polygons.json"]
        done = self.evaluate(*command, "--pictures", folder / "pictures")
        self.assertEqual(done.returncode, 0, done.stderr)
        first, second = done.stdout.splitlines()
        self.assertEqual(first.split()[1:], "frames 2 IoU 0.636 mean 0.700 recall 0.700 precision 0.875"
                         " false area 0.62 %, worst 1.2 %".split())
        self.assertEqual(second.strip(), "people found 2 of 2, over 5 % of the image 1 of 1; "
                                         "instances mostly on nobody 1")
        self.assertEqual(len(list((folder / "pictures").iterdir())), 2)

        (folder / "masks/2.500000.png").unlink()
        done = self.evaluate(*command)
        self.assertIn("frames    1  IoU 0.700", done.stdout)
        self.assertIn("without a mask 1", done.stdout)
        done = self.evaluate(*command[:2], "--nobody", "--first", 1)
        self.assertIn("frames    1  IoU 0.000", done.stdout)
        self.assertIn("false area 8.75 %", done.stdout)
        (folder / "masks/1.500000.png").unlink()
        self.assertNotEqual(self.evaluate(*command).returncode, 0)

    def test_the_network_finds_who_is_drawn_in_a_recording(self):
        for name, least in (("bonn_crowd_part", 0.82), ("redkitchen_walk", 0.70)):
            folder = DATA / name
            if not (folder / "associations.txt").exists():
                self.skipTest(f"no recorded data at {folder}")
            done = self.evaluate(self.model, folder, "--polygons", TRAINING / "people_polygons.json")
            self.assertEqual(done.returncode, 0, done.stderr)
            words = done.stdout.split()
            self.assertEqual(int(words[words.index("frames") + 1]), len(self.frames[name]))
            self.assertGreater(float(words[words.index("IoU") + 1]), least, done.stdout)


@unittest.skipUnless(PYTHON.exists(), f"no PyTorch: {PYTHON} does not exist")
class Training(CliTest):
    """training/run.py, on a few frames"""

    def test_a_small_one_learns_goes_on_and_its_network_loads(self):
        work = self.folder / "people"
        command = [sys.executable, TRAINING / "run.py", "--ygslam", BINARY, "--work", work, "--frames", "60",
                   "--validation-frames", "12", "--coarse", "1280", "--threads", "1",
                   "--environment", PYTHON.parent.parent]

        def train(samples):
            return subprocess.run([*map(str, command), "--samples", str(samples)], capture_output=True, text=True,
                                  check=False, timeout=3 * HANG_S)
        first = train(1280)
        self.assertEqual(first.returncode, 0, first.stderr)
        frames = bytes_of(work / "frames-00")
        done = train(1312)  # goes on where it was
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(bytes_of(work / "frames-00"), frames)
        log = [json.loads(line) for line in (work / "log.jsonl").read_text(encoding="utf-8").splitlines()]
        self.assertEqual([line["samples"] for line in log], [640, 1280, 1312])
        self.assertLess(log[1]["loss"], log[0]["loss"])
        card = json.loads((work / "people.json").read_text(encoding="utf-8"))
        self.assertEqual(card["last"], log[-1])
        self.assertEqual(card["openvino"]["calibration_frames"], 60)
        self.assertGreater(card["openvino"]["f32"], 0.1)
        self.assertAlmostEqual(card["openvino"]["int8"], card["openvino"]["f32"], delta=0.1)
        size = (work / "people.onnx").stat().st_size
        self.assertTrue(1e5 < size < 3e6, size)
        for name in ("people.onnx", "people_int8.xml"):
            loaded = subprocess.run(
                [PYTHON, "-c", "import openvino, numpy, sys; net = openvino.Core().compile_model(sys.argv[1], 'CPU');"
                 "print(net([numpy.zeros((1, 5, 120, 160), numpy.float32)])[0].shape)", work / name],
                capture_output=True, text=True, check=False, timeout=HANG_S)
            self.assertEqual(loaded.stdout.strip(), "(1, 1, 120, 160)", loaded.stderr)

    def test_exported_taken_over_and_exported_again_it_is_the_same_network(self):
        done = subprocess.run([PYTHON, "-c", ROUND_TRIP, TRAINING, self.folder / "first.onnx"],
                              capture_output=True, text=True, check=False, timeout=HANG_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout.splitlines()[-1])
        self.assertTrue(found["same"], found)
        self.assertGreater(found["spread"], 0.05, found)
        self.assertAlmostEqual(found["raised"], 0.5, delta=0.01, msg=found)
        self.assertLess(found["apart"], 0.01, found)  # 16-bit weights
        self.assertIn("logits_raised_by", found["refused"])


if __name__ == "__main__":
    unittest.main()
