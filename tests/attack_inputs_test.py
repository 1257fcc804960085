"""Many small inputs that are bad or odd, made of one rendered sequence: each is read right, told, or
refused in one line with the code of its kind. Nothing crashes, hangs, or is taken for something else
in silence.

    python tests/attack_inputs_test.py [Class]
"""
import itertools
import json
import math
import pathlib
import random
import shutil
import unittest

import numpy as np
from PIL import Image

from bags import Messages, frames_of, recording, write_mcap
from ygslam_cli import CliTest, lines_of, trajectory, ygslam

FRAMES = 8
CODES = {0, 2, 3, 4, 7}  # of what is read here: fine, usage, settings and cameras, input, lost
SLOWEST_S = 120
C = {"fx": 267.7, "fy": 269.6, "cx": 159.8, "cy": 123.55}
RIGHT = None  # in place of a word of the error: the input is read, and the result is right


class Attack(CliTest):
    def setUp(self):
        super().setUp()
        self.seq = self.copy_sequence(frames=FRAMES)
        self.count = itertools.count()

    def fresh(self):
        """A copy of the sequence that a case may spoil."""
        return pathlib.Path(shutil.copytree(self.seq, self.folder / f"case{next(self.count)}"))

    def attack(self, *arguments, names=""):
        """Runs the program. Fine and silent, or one line of error that names the file.
        @return the code, and all it said."""
        done = ygslam(*arguments, timeout=SLOWEST_S)
        said = done.stdout + done.stderr
        self.assertIn(done.returncode, CODES, said)
        self.assertNotIn("Traceback", said)
        self.assertNotIn("terminate called", said)
        errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
        if done.returncode in (2, 3, 4):
            self.assertEqual(len(errors), 1, said)
            self.assertIn(str(names), errors[0])
        return done.returncode, said

    def run_case(self, folder, *options, names=""):
        out = self.folder / f"out{next(self.count)}"
        code, said = self.attack("run", folder, "--out", out, "--dynamic", "off", "--deterministic", *options,
                                 names=names)
        if code == 0:
            for stamp, pose in trajectory(out / "trajectory.txt"):
                self.assertTrue(all(map(math.isfinite, [float(stamp), *pose])))
        return code, said, out

    def assert_right(self, out):
        done = ygslam("eval", "--gt", self.seq / "groundtruth.txt", "--est", out / "trajectory.txt", "--json")
        report = json.loads(done.stdout)
        self.assertEqual(report["pairs"], FRAMES)
        self.assertLess(report["ate"]["rmse"], 0.01)

    def judge(self, folder, word, *options, code=4, names=""):
        """The case is refused with this word, or right."""
        found, said, out = self.run_case(folder, *options, names=names)
        if word is RIGHT:
            self.assertEqual(found, 0, said)
            self.assert_right(out)
        else:
            self.assertEqual(found, code, said)
            self.assertIn(word, said)


def ours(**changes):
    return "".join(f"{key} {value}\n" for key, value in {**C, "depth_scale": 5000, **changes}.items())


def orb(extra="DepthMapFactor: 5000.0\n", **changes):
    return "%YAML:1.0\n" + "".join(f"Camera.{k}: {v}\n" for k, v in {**C, **changes}.items()) + extra


def matrix(*changes, rows=3):
    m = np.eye(rows)
    m[0, 0], m[1, 1], m[0, 2], m[1, 2] = C["fx"], C["fy"], C["cx"], C["cy"]
    for row, column, value in changes:
        m[row, column] = value
    return m


def text_of(m):
    return "".join(" ".join(map(str, row)) + "\n" for row in m)


def line(order):
    return " ".join(str(C[key]) for key in order.split()) + "\n"


CAMERAS = (  # title, text, word
    ("ours", ours(), RIGHT), ("with equals", ours().replace(" ", " = "), RIGHT),
    ("CR LF", ours().replace("\n", "\r\n"), RIGHT), ("byte order mark", "\ufeff" + ours(), RIGHT),
    ("in order", line("fx fy cx cy"), RIGHT), ("by axes", line("fx cx fy cy"), "may be fx cx fy cy"),
    ("centre first", line("cx cy fx fy"), "may be cx cy fx fy"),
    ("six numbers", line("fx fy cx cy fx fy"), "6 numbers without keys"),
    ("3x3", text_of(matrix()), RIGHT), ("4x4", text_of(matrix(rows=4)), RIGHT),
    ("4x4 with a translation", text_of(matrix((0, 3, 0.1), rows=4)), "a fourth column"),
    ("skewed", text_of(matrix((0, 1, 1.5))), "a skew of 1.5"),
    ("by columns", text_of(matrix().T), "row by row"), ("identity", text_of(np.eye(3)), "fx"),
    ("orb", orb(), RIGHT), ("orb, another fx", orb("Camera.fx: 300\n"), "given twice"),
    ("COLMAP, fisheye", "1 OPENCV_FISHEYE 320 240 267 269 159 123 0 0 0 0\n", "is not read"),
    ("Kalibr, omnidirectional", "cam0:\n  camera_model: omni\n  intrinsics: [1, 2, 3, 4, 5]\n", "is not read"),
    ("XML", "<opencv_storage>\n", "is XML"), ("InfiniTAM", "320 240\n267 269\naffine 0.001 0\n", ""),
    ("orb, factor 0", orb("DepthMapFactor: 0\n"), "must be above 0"),
    ("orb, factor < 0", orb("DepthMapFactor: -5000\n"), "must be above 0"),
    ("orb, fisheye", orb('Camera.type: "KannalaBrandt8"\n'), "is not read"),
    ("orb, comma", orb(fx="267,7"), "not a finite number"),
    ("Open3D by rows", json.dumps({"intrinsic_matrix": matrix().ravel().tolist()}), "row by row"),
    ("JSON cut off", json.dumps({"intrinsic_matrix": [1, 2]})[:-3], "begins as JSON and is none"),
    ("JSON of something", json.dumps({"a": 1}), "JSON without a camera"), ("empty", "", "missing"),
    ("no camera", "hello world\n", "unknown key"), ("twice", ours() + "fx 5\n", "given twice"),
    ("NumPy", "\x93NUMPY\x01", ""), ("UTF-16", ours().encode("utf-16"), "UTF-16"),
    ("binary", bytes(range(256)), ""),
    *((f"{key} {value}", ours(**{key: value}), key) for key in ("fx", "cy", "depth_scale")
      for value in ("nan", "inf", "-1e9", "1e999", "", "5 5", "0x10", "five")),
)


class OddCameras(Attack):
    def test_each_is_read_right_or_refused(self):
        for title, text, word in CAMERAS:
            data = text if isinstance(text, bytes) else text.encode()
            folder = self.fresh()
            (folder / "calibration.txt").write_bytes(data)
            given = self.folder / "given.yaml"
            given.write_bytes(data)
            with self.subTest(title=title):
                self.judge(folder, word, code=3, names="calibration.txt")
            if title not in ("with equals", "empty", "no camera", "twice", "CR LF"):  # YAML says otherwise
                with self.subTest(title=title, option="--camera"):
                    code, said, out = self.run_case(self.seq, "--camera", given, names=given)
                    self.assertEqual(code, 0 if word is RIGHT else 3, said)
                    if word is RIGHT:
                        self.assert_right(out)

    def test_those_in_the_folder_are_found_and_must_agree(self):
        lens = {"intrinsic_matrix": matrix().T.ravel().tolist(), "width": 320, "height": 240}
        nerf = {"fl_x": C["fx"], "fl_y": C["fy"], "cx": C["cx"], "cy": C["cy"], "frames": []}
        for files, word in (({"camera_intrinsic.json": lens}, RIGHT), ({"transforms.json": nerf}, RIGHT),
                            ({"camera_intrinsic.json": lens, "transforms.json": nerf}, RIGHT),
                            ({"camera_intrinsic.json": lens, "transforms.json": {**nerf, "fl_x": 300}},
                             "tell of two cameras"),
                            ({"transforms.json": {"frames": []}}, "no calibration.txt")):
            folder = self.fresh()
            (folder / "calibration.txt").unlink()
            for path in (folder / "depth").iterdir():  # which these files have in millimetres
                Image.fromarray((np.asarray(Image.open(path)) / 5).round().astype(np.uint16)).save(path)
            for name, content in files.items():
                (folder / name).write_text(json.dumps(content), encoding="utf-8")
            with self.subTest(files=list(files), word=word):
                self.judge(folder, word, code=3)


def raw_pgm(depth, order):
    return b"P5\n%d %d\n65535\n" % depth.shape[::-1] + depth.astype(order + "u2").tobytes()


DEPTHS = (  # title, ending, bytes or image of a depth image in units, word
    ("PGM", "pgm", lambda d: raw_pgm(d, ">"), RIGHT),
    ("PGM, low byte first", "pgm", lambda d: raw_pgm(d, "<"), "bytes swapped"),
    ("PNG, low byte first", "png", lambda d: Image.fromarray(d.byteswap()), "bytes swapped"),
    ("8 bits", "png", lambda d: Image.fromarray((d >> 8).astype(np.uint8)), "8 bit"),
    ("colours", "png", lambda d: Image.fromarray(np.stack([(d >> 8).astype(np.uint8)] * 3, 2)), "3 channel"),
    ("a JPEG", "jpg", lambda d: Image.fromarray((d >> 8).astype(np.uint8)), ""),
    ("a BMP", "png", lambda d: b"BM" + bytes(100), "BMP"), ("nothing", "png", lambda d: b"", "empty file"),
    ("text", "png", lambda d: b"depth\n" * 99, "neither JPEG nor PNG"),
    ("TIFF", "tif", Image.fromarray, RIGHT), ("cut off", "pgm", lambda d: raw_pgm(d, ">")[:999], "truncated"),
)
COLOURS = (
    ("PNG", "png", lambda c: c, RIGHT), ("palette", "png", lambda c: c.quantize(256), RIGHT),
    ("1 bit", "png", lambda c: c.convert("1"), "1 bit"), ("with alpha", "png", lambda c: c.convert("RGBA"), RIGHT),
    ("16 bits", "png", lambda c: Image.fromarray(np.asarray(c.convert("L")).astype(np.uint16) * 257), "16 bit"),
    ("GIF", "gif", lambda c: c.quantize(64), "GIF"), ("CMYK", "jpg", lambda c: c.convert("CMYK"), ""),
    ("another size", "png", lambda c: c.resize((32, 24)), ""),
)


class OddImages(Attack):
    def replaced(self, part, ending, change):
        folder = self.fresh()
        rows = self.pairs(folder)
        for row in rows:
            column = 1 if part == "rgb" else 3
            old = folder / row[column]
            image = Image.open(old)
            image.load()
            made = change(image if part == "rgb" else np.asarray(image).astype(np.uint16))
            old.unlink()
            row[column] = str(pathlib.Path(row[column]).with_suffix("." + ending))
            if isinstance(made, bytes):
                (folder / row[column]).write_bytes(made)
            else:
                made.save(folder / row[column])
        (folder / "associations.txt").write_text("".join(" ".join(row) + "\n" for row in rows), encoding="utf-8")
        return folder

    def test_depth(self):
        for title, ending, change, word in DEPTHS:
            with self.subTest(title=title):
                self.judge_images(self.replaced("depth", ending, change), word)

    def test_colour(self):
        for title, ending, change, word in COLOURS:
            with self.subTest(title=title):
                self.judge_images(self.replaced("rgb", ending, change), word)

    def judge_images(self, folder, word):
        """Where no image can be read the run ends with code 4 or 7; each is told."""
        code, said, out = self.run_case(folder)
        if word is RIGHT:
            self.assertEqual(code, 0, said)
            self.assert_right(out)
        else:
            self.assertNotEqual(code, 0, said)
            self.assertIn(word, said)


def clock(us):
    """At so many microseconds after half past twelve."""
    return f"12{30 + us // 60_000_000}{us % 60_000_000 // 10**6:02d}.{us // 1000 % 1000:03d}"


NAMES = (  # title, name of image i taken at us microseconds, word
    ("numbers", lambda i, us: f"{i:06d}", ""), ("seconds", lambda i, us: f"{1.3e9 + us / 1e6:.6f}", ""),
    ("time of day", lambda i, us: f"12-30-{i:02d}", "time of day"),
    ("date and time", lambda i, us: f"2024-05-01_12-{i // 4:02d}-{i % 4:02d}", "time of day"),
    ("across a minute", lambda i, us: clock(59_000_000 + 10 * us), "time of day"),
    ("clock and milliseconds", lambda i, us: f"12-30-{50 + us // 10**6:02d}.{us // 1000 % 1000:03d}", ""),
    ("milliseconds or numbers", lambda i, us: f"{33 * i}", "milliseconds"),
    ("parts", lambda i, us: f"seq{i // 3}_{i % 3}", "write rgb.txt"),
    ("no digits", lambda i, us: "abcdefgh"[i], "no number"),
)


class OddNames(Attack):
    def test_each_is_read_or_refused(self):
        for title, name, word in NAMES:
            folder = self.folder / title
            for i, (stamp, colour, _, depth) in enumerate(self.pairs(self.seq)):
                us = round(1e6 * float(stamp)) - 10**9
                for old, new in ((colour, f"rgb/{name(i, us)}.jpg"), (depth, f"depth/{name(i, us)}.png")):
                    (folder / new).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(self.seq / old, folder / new)
            shutil.copyfile(self.seq / "calibration.txt", folder / "calibration.txt")
            with self.subTest(title=title):
                code, said, _ = self.run_case(folder, names=folder)
                self.assertEqual(code, 4 if word else 0, said)
                self.assertIn(word, said)


def formatted(rows, form="{:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f}\n"):
    return "".join(form.format(*row) for row in rows)


def inverse(rows):
    """Each pose turned round."""
    turned = rows * [1, -1, -1, -1, -1, -1, -1, 1]
    for row in turned:
        v = row[4:7]
        row[1:4] += 2 * np.cross(v, np.cross(v, row[1:4]) + row[7] * row[1:4])
    return turned


LOST = [0] * 7 + [1]
W_FIRST = [0, 1, 2, 3, 7, 4, 5, 6]
TRAJECTORIES = (  # title, text of the rows, code, word
    ("TUM", formatted, 0, ""), ("CR LF", lambda r: formatted(r).replace("\n", "\r\n"), 0, ""),
    ("JSON", lambda r: json.dumps(r.tolist()), 4, "JSON"),
    ("JSON over lines", lambda r: json.dumps(r.tolist(), indent=1), 4, "JSON"),
    ("a printed array", lambda r: str(r[:3]), 4, "brackets"),
    ("tuples", lambda r: "".join(f"{tuple(x.tolist())}\n" for x in r), 4, "brackets"),
    ("qw first, headed", lambda r: "# t x y z qw qx qy qz\n" + formatted(r[:, W_FIRST]), 0, "as the header names"),
    ("qw first", lambda r: formatted(r[:, W_FIRST]), 0, "with qw first"),
    ("lost as identity", lambda r: formatted(np.vstack([r[:9], r[9:12] * ([1] + [0] * 7) + LOST, r[12:]])),
     0, "leap to 0 0 0 0 0 0 1"),
    ("number, stamp, 4x4", lambda r: "".join(f"{i} {x[0]} 1 0 0 .02 0 1 0 .01 0 0 1 0 0 0 0 1\n"
                                             for i, x in enumerate(r)), 4, "rotation matrix"),
    ("both orders", lambda r: formatted(np.vstack([r[:30], r[30:, W_FIRST]])), 0, "two orders"),
    ("decimal commas", lambda r: formatted(r).replace(".", ","), 4, "decimal"),
    ("millimetres", lambda r: formatted(r * [1, 1e3, 1e3, 1e3, 1, 1, 1, 1]), 0, "millimetres"),
    ("inverse", lambda r: formatted(inverse(r)), 0, "T_camera_world"),
    ("no quaternion", lambda r: formatted(r * 3), 4, "no unit quaternion"),
    ("tables of three", lambda r: formatted(r[:, :3], "{} {} {}\n"), 4, "columns"),
    ("empty", lambda r: "", 4, "empty"), ("nan", lambda r: formatted(r) + "2000 nan 0 0 0 0 0 1\n", 4, "nan"),
    ("stamps alike", lambda r: formatted(r[[0] * 9]), 0, "repeat a stamp"),
    ("milliseconds of no epoch", lambda r: formatted(r * ([1e3] + [1] * 7)), 4, ""),
    ("NumPy", lambda r: "\x93NUMPY", 4, "f.txt"), ("UTF-16", lambda r: formatted(r).encode("utf-16"), 4, "UTF-16"),
)


class OddTrajectories(Attack):
    def setUp(self):
        super().setUp()
        self.truth = self.seq / "groundtruth.txt"
        self.file = self.folder / "f.txt"

    def test_each_is_read_told_or_refused(self):
        rows = np.loadtxt(self.truth)
        for (title, text, code, word), swapped in itertools.product(TRAJECTORIES, (False, True)):
            made = text(rows)
            self.file.write_bytes(made if isinstance(made, bytes) else made.encode("latin-1"))
            pair = (self.truth, self.file) if swapped else (self.file, self.truth)
            with self.subTest(title=title, swapped=swapped):
                found, said = self.attack("eval", "--gt", pair[0], "--est", pair[1], names=self.folder if code else "")
                self.assertEqual(found, code, said)
                self.assertIn(word, said)

    def test_times_of_trajectories_with_stamps_are_refused(self):
        code, said = self.attack("eval", "--gt", self.truth, "--est", self.truth, "--times", self.truth)
        self.assertEqual(code, 2, said)


LISTS = (  # title, text of the rows of associations.txt, word
    ("tabs", lambda r: text_of(r).replace(" ", "\t"), RIGHT),
    ("CR LF", lambda r: text_of(r).replace("\n", "\r\n"), RIGHT),
    ("byte order mark", lambda r: "\ufeff" + text_of(r), RIGHT),
    ("a header", lambda r: "t rgb t d\n" + text_of(r), RIGHT),
    ("depth first", lambda r: text_of((c, d, a, b) for a, b, c, d in r), RIGHT),
    ("zeros at the end", lambda r: text_of(r) + "\0" * 500, RIGHT), ("twice", lambda r: text_of(r) * 2, RIGHT),
    ("commas", lambda r: text_of(r).replace(" ", ","), "read are lines `seconds rgb/FILE"),
    ("JSON", json.dumps, "read are lines"),
    ("no stamps", lambda r: text_of((b, d) for _, b, _, d in r), "read are lines"),
    ("nanoseconds", lambda r: text_of((f"{float(a):.0f}" + "0" * 9, b, f"{float(c):.0f}" + "0" * 9, d)
                                      for a, b, c, d in r), "read are lines"),
    ("times of day", lambda r: text_of((f"12:00:0{i}", r[i][1], f"12:00:0{i}", r[i][3]) for i in range(FRAMES)),
     "read are lines"),
    ("outside", lambda r: text_of((a, "../" + b, c, d) for a, b, c, d in r), "no usable line"),
    ("quotes", lambda r: text_of((a, f'"{b}"', c, d) for a, b, c, d in r), "no such file"),
    ("a zip", lambda r: "PK\x03\x04", "is a zip archive"), ("nothing", lambda r: "", "lists no image"),
)


class OddLists(Attack):
    def test_texts(self):
        for title, text, word in LISTS:
            folder = self.fresh()
            (folder / "associations.txt").write_text(text(self.pairs(folder)), encoding="utf-8", newline="")
            with self.subTest(title=title):
                self.judge(folder, word, names=folder)

    def test_one_image_for_all_is_told(self):
        folder = self.fresh()
        rows = self.pairs(folder)
        (folder / "associations.txt").write_text(text_of((a, rows[0][1], c, d) for a, _, c, d in rows),
                                                 encoding="utf-8")
        self.assertIn("are named by a line before", self.run_case(folder)[1])

    def test_stamps(self):
        for title, change, word in (("milliseconds", lambda t, i: t * 1e3, "are these stamps milliseconds"),
                                    ("a gap of an hour", lambda t, i: t + (3600 if i > 3 else 0),
                                     "a gap of over a minute"),
                                    ("all alike", lambda t, i: 5.0, ""), ("negative", lambda t, i: t - 2000, ""),
                                    ("nan", lambda t, i: math.nan, ""), ("falling", lambda t, i: 3000 - t, "")):
            folder = self.fresh()
            rows = self.pairs(folder)
            for i, row in enumerate(rows):
                row[0], row[2] = (f"{change(float(row[k]), i):.6f}" for k in (0, 2))
            (folder / "associations.txt").write_text("".join(" ".join(r) + "\n" for r in rows), encoding="utf-8")
            with self.subTest(title=title):
                code, said, _ = self.run_case(folder, names=folder)
                self.assertIn(word, said)
                if not word and code == 0:
                    self.assertIn("warning", said)


class OddOptions(Attack):
    def test_nonsense_is_refused(self):
        run = ("run", self.seq, "--out", self.folder / "none")
        for words in ((*run, "--to", "0"), (*run, "--to", "-1"), (*run, "--from", "99"), (*run, "--stride", "0"),
                      (*run, "--segmenter", "builtin", "--model", "net.onnx"), (*run, "--segmenter", "magic"),
                      (*run, "--set", "no.such=1"), (*run, "--set", "tracking.min_inliers=many"),
                      (*run, "--camera", self.folder), (*run, "--config", self.seq / "rgb"), ("run", self.seq),
                      ("run", "", "--out", "x"), ("eval",), ("eval", "--gt", self.seq), ("fly",)):
            with self.subTest(words=words):
                code, said = self.attack(*words)
                self.assertNotEqual(code, 0, said)


def damaged(data, rng):
    """One of the ways in which files break."""
    at = rng.randrange(len(data))
    words = data.split(b" ")
    word = rng.randrange(len(words))
    changed = list(words)
    changed[word] = rng.choice((b"nan", b"-1", b"1e308", b"", b"x" * 99, b"0", b"\n", b"9" * 40))
    return rng.choice((
        lambda: data[:at], lambda: data[at:], lambda: data[:at] + bytes(len(data) - at), lambda: data + data[at:],
        lambda: data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1:], lambda: b" ".join(changed),
        lambda: data[:at] + rng.randbytes(16) + data[at + 16:], lambda: data.replace(b"\n", b"\r"),
        lambda: b"".join(rng.sample(data.splitlines(keepends=True), len(data.splitlines())))))()


class Damage(Attack):
    """Any byte may be wrong: a documented end, whatever it is."""

    ROUNDS = 12

    def test_files_of_a_sequence(self):
        rng = random.Random(40)
        _, colour, _, depth = self.pairs(self.seq)[0]
        for part, n in itertools.product(("calibration.txt", "associations.txt", "groundtruth.txt", colour, depth),
                                         range(self.ROUNDS)):
            folder = self.fresh()
            file = folder / part
            file.write_bytes(damaged(file.read_bytes(), rng))
            with self.subTest(part=part, round=n):
                self.run_case(folder, names=folder)

    def test_trajectories_and_camera_files(self):
        rng = random.Random(41)
        truth = self.seq / "groundtruth.txt"
        for n in range(2 * self.ROUNDS):
            file = self.folder / f"damaged{n}"
            file.write_bytes(damaged(truth.read_bytes(), rng))
            with self.subTest(round=n):
                self.attack("eval", "--gt", truth, "--est", file, names=file)
            file.write_bytes(damaged(rng.choice([orb(), ours(), text_of(matrix())]).encode(), rng))
            with self.subTest(round=n, camera=file):
                self.run_case(self.seq, "--camera", file, names=file)

    def test_bags(self):
        rng = random.Random(42)
        said = list(recording(Messages(), frames_of(self.seq, self.pairs(self.seq)), list(C.values())))
        data = write_mcap(self.folder / "whole.mcap", said).read_bytes()
        for n in range(self.ROUNDS):
            bag = self.folder / f"damaged{n}.mcap"
            bag.write_bytes(damaged(data, rng))
            with self.subTest(round=n):
                self.run_case(bag, names=bag)


if __name__ == "__main__":
    unittest.main()
