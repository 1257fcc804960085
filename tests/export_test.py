"""`ygslam export`: the static scene of a saved map, and what becomes of its files on full disks.

    python tests/export_test.py
"""
import json
import os
import resource
import struct
import unittest

from ygslam_cli import CliTest, sequence, ygslam


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def limit(largest_file):
    """For a child's start: no file larger than so many bytes, as on a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))


class Export(CliTest):
    def keep(self, *options, **how):
        """A run that leaves room.map and, in `own`, its scene."""
        return self.run_slam(sequence(), "--segmenter", f"masks:{sequence() / 'mask'}", "--save-map",
                             self.folder / "room.map", "--export", self.folder / "own", *options,
                             geometry=False, **how)

    def export(self, *options, out="scene", **how):
        return ygslam("export", self.folder / "room.map", "--out", self.folder / out, *options, **how)

    def test_without_the_dense_map_there_is_nothing_to_write(self):
        for option in ("--export", "--background"):
            done = self.run_slam(sequence(), "--set", "run.without=dense_map", option, self.folder / "scene")
            self.assert_error(done, 3, "dense_map", option)
            self.assertFalse((self.folder / "scene").exists())

    def test_a_saved_map_has_the_scene_of_its_run(self):
        self.assert_ran(self.keep())
        self.assert_ran(self.export())
        own, scene = contents(self.folder / "own"), contents(self.folder / "scene")
        self.assertEqual(set(own), set(scene))
        self.assertGreater(len(own["mesh.ply"]), 100000)
        for name, content in own.items():
            self.assertEqual(scene[name], content, name)
        info = json.loads(ygslam("map", "info", "--json", self.folder / "room.map").stdout)
        self.assertGreaterEqual(info["dense"]["views"], info["keyframes"])
        self.assertEqual(info["dense"]["bytes"], (self.folder / "room.map.dense").stat().st_size)
        self.assert_ran(ygslam("map", "check", self.folder / "room.map"))
        self.assert_ran(self.export("--set", "dense.voxel_m=0.05", out="coarse"))
        self.assertLess((self.folder / "coarse" / "mesh.ply").stat().st_size, len(own["mesh.ply"]) / 3)

    def test_a_run_that_goes_on_has_what_the_earlier_one_saw(self):
        self.assert_ran(self.keep("--to", "40"))
        before = contents(self.folder / "own")
        self.assert_ran(self.run_slam(sequence(), "--from", "38", "--to", "44", "--segmenter",
                                      f"masks:{sequence() / 'mask'}", "--load-map", self.folder / "room.map",
                                      "--export", self.folder / "on", geometry=False, out="second"))
        after = contents(self.folder / "on")
        self.assertGreater(len(after["mesh.ply"]), 0.97 * len(before["mesh.ply"]))

    def test_damage_is_found_wherever_it_is(self):
        self.assert_ran(self.keep("--to", "12"))
        file = self.folder / "room.map.dense"
        good = file.read_bytes()
        for i in range(25):
            at = i * (len(good) - 1) // 24 if i > 6 else 9 * i
            file.write_bytes(good[:at] + bytes([good[at] ^ 0x10]) + good[at + 1:])
            self.assert_error(self.export(), 6, file, out="scene")
        for bad in (b"", good[:40], good[:-1], good + b"x", b"SQLite format 3" + good[15:]):
            file.write_bytes(bad)
            self.assert_error(self.export(), 6, file, out="scene")
            self.assertEqual(ygslam("map", "check", self.folder / "room.map").returncode, 6)
        file.write_bytes(good[:8] + struct.pack("<I", 4) + good[12:])
        self.assert_error(self.export(), 6, file, "format 4", out="scene")
        file.unlink()
        self.assert_error(self.export(), 6, file, "not there", out="scene")
        with open(file, "wb") as holes:  # a view of 20 GB, of which nothing is on the disk
            holes.write(good[:80] + struct.pack("<QQ", 20 * 10**9, 0))
            holes.truncate(96 + 20 * 10**9)
        self.assert_error(self.export(), 6, file, "larger than any", out="scene")
        file.unlink()
        os.mkfifo(file)
        self.assert_error(self.export(timeout=60), 6, file, "no regular file", out="scene")
        file.unlink()
        self.assertEqual(ygslam("map", "check", self.folder / "room.map").returncode, 0)

    def test_a_full_disk_leaves_the_earlier_files_whole(self):
        self.assert_ran(self.keep("--to", "12"))
        old, coarse = contents(self.folder / "own"), ("--set", "dense.voxel_m=0.03")
        self.assert_ran(self.export(*coarse, out="new"))
        new = contents(self.folder / "new")
        for largest in (200, len(new["mesh.ply"]) - 1):
            done = self.export(*coarse, out="own", preexec_fn=limit(largest))
            self.assertEqual(done.returncode, 9, done.stderr)
            self.assertIn(str(self.folder / "own"), done.stderr.splitlines()[-1])
            after = contents(self.folder / "own")
            self.assertEqual(set(after), set(old), "no temporary file remains")
            self.assertEqual(after["mesh.ply"], old["mesh.ply"])
            for name, content in after.items():
                self.assertIn(content, (old[name], new[name]), name)
        kept = (self.folder / "room.map.dense").read_bytes()
        done = self.keep("--to", "14", "--quiet", preexec_fn=limit(len(kept) - 1))
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertEqual((self.folder / "room.map.dense").read_bytes(), kept)

    def test_a_voxel_size_that_would_not_fit_is_refused_with_what_it_would_take(self):
        gigabyte = 1 << 30
        for command in (["run", sequence(), "--out", self.folder / "out", "--dynamic", "geometry"],
                        ["export", self.folder / "none.map", "--out", self.folder / "out"]):
            done = ygslam(*command, "--set", "dense.voxel_m=0.005", preexec_fn=lambda: resource.setrlimit(
                resource.RLIMIT_AS, (2 * gigabyte, 2 * gigabyte)))
            self.assert_error(done, 3, "dense.voxel_m 0.005", "GB")
            self.assertGreater(float(done.stderr.split("would take ")[1].split(" GB")[0]), 2)


if __name__ == "__main__":
    unittest.main()
