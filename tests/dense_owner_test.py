"""Whose the dense map is that lies beside a map: another map's is told, not used, and not lost.

    python tests/dense_owner_test.py
"""
import json
import pathlib
import resource
import struct
import tempfile
import unittest

from ygslam_cli import HEIGHT, WIDTH, CliTest, sequence, ygslam

HEADER, HASH, SIGHT, RECORD = 72, 8, 8, 16  # bytes: without hash; of a record: its size and hash
IDENTITY = 56  # where it begins
OTHER_MAP = "is of another map"


def hash_of(content):
    """src/map_file/row_hash.hpp"""
    most = (1 << 64) - 1
    value, whole = 0x9e3779b97f4a7c15 ^ len(content), len(content) // 8 * 8
    for (word,) in struct.iter_unpack("<Q", content[:whole]):
        value = ((value ^ word) * 0xff51afd7ed558ccd) & most
        value ^= value >> 32
    value ^= int.from_bytes(content[whole:], "little")
    for factor in (0xff51afd7ed558ccd, 0xc4ceb9fe1a85ec53):
        value = ((value ^ (value >> 33)) * factor) & most
    return value ^ (value >> 33)


def in_format_2(dense):
    """The file as it was written before maps had an identity."""
    header = dense[:8] + struct.pack("<I", 2) + dense[12:IDENTITY]
    old, at = header + struct.pack("<Q", hash_of(header)), HEADER + HASH
    while at < len(dense):
        size, _ = struct.unpack_from("<QQ", dense, at)
        record = dense[at + RECORD + SIGHT:at + RECORD + size]
        old += struct.pack("<QQ", len(record), hash_of(record)) + record
        at += RECORD + size
    return old


def rendered(folder, world, *options):
    done = ygslam("simulate", world, "--out", folder, "--size", f"{WIDTH}x{HEIGHT}", "--threads", "1", *options)
    assert done.returncode == 0, done.stderr
    return folder


class DenseOwner(CliTest):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="ygslam-rooms-")
        cls.addClassCleanup(folder.cleanup)
        # Stamps and camera are those of the other sequence, the place is not.
        cls.room_b = rendered(pathlib.Path(folder.name, "b"), "twin_rooms", "--seconds", "1.4")

    def setUp(self):
        super().setUp()
        self.map = self.folder / "room.map"
        self.dense = self.folder / "room.map.dense"

    def save(self, folder, file=None, *options, out="mapped", **how):
        file = file or self.map
        self.assert_ran(self.run_slam(folder, "--to", 40, "--save-map", file, *options, out=out, **how))

    def put_room_a_beside_room_b(self):
        """What a run leaves that ends between its two saves. @return the dense map of room A"""
        self.save(self.room_b)
        largest = self.dense.stat().st_size - 1  # no file larger, as on a full disk
        self.save(sequence())
        of_a = self.dense.read_bytes()
        done = self.run_slam(self.room_b, "--to", 40, "--save-map", self.map, out="cut", preexec_fn=lambda:
                             resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest)))
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertEqual(self.dense.read_bytes(), of_a)
        return of_a

    def info(self, file=None):
        done = ygslam("map", "info", "--json", file or self.map)
        self.assert_ran(done)
        return json.loads(done.stdout)

    def scene_of(self, name, *options):
        """Of a run that goes on with the map. @return its surface, and what it said"""
        done = self.run_slam(self.room_b, "--from", 10, "--to", 40, "--load-map", self.map, "--export",
                             self.folder / name, *options, out=f"run_{name}")
        self.assert_ran(done)
        return (self.folder / name / "mesh.ply").read_bytes(), done.stderr

    def test_a_run_that_ended_between_its_saves_puts_nothing_of_the_old_room_into_the_new(self):
        of_a = self.put_room_a_beside_room_b()
        self.assert_error(ygslam("export", self.map, "--out", self.folder / "scene"), 6, self.dense, OTHER_MAP,
                          out="scene")
        self.assert_error(ygslam("map", "check", self.map), 6, self.dense, OTHER_MAP)
        self.assertIn(OTHER_MAP, self.info()["dense"]["fault"])
        told = ygslam("map", "info", self.map).stdout
        self.assertRegex(told, rf"keyframes +\d[\s\S]*dense map +none that can be used: .*{OTHER_MAP}")
        beside, said = self.scene_of("beside")
        self.assertRegex(said, rf"warning: .*room\.map\.dense: {OTHER_MAP}")
        self.assertEqual(self.dense.read_bytes(), of_a, "it is left alone")
        self.dense.unlink()
        alone, said = self.scene_of("alone")
        self.assertNotIn(OTHER_MAP, said)
        self.assertEqual(beside, alone)

    def test_a_foreign_dense_map_is_put_aside_before_another_takes_its_name(self):
        of_a = self.put_room_a_beside_room_b()
        aside = self.folder / "room.map.dense.1"
        aside.write_text("something else\n")
        _, said = self.scene_of("on", "--save-map", self.map)
        second = self.folder / "room.map.dense.2"
        self.assertRegex(said, r"warning: .*room\.map\.dense: was of another map, and is now .*\.dense\.2")
        self.assertEqual(second.read_bytes(), of_a)
        self.assertEqual(aside.read_text(), "something else\n")
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)
        self.assert_ran(ygslam("export", self.map, "--out", self.folder / "scene"))
        again = self.dense.read_bytes()
        _, said = self.scene_of("again", "--save-map", self.map)
        self.assertNotIn("another map", said)
        self.assertNotEqual(self.dense.read_bytes(), again, "its own is written over")
        self.assertFalse((self.folder / "room.map.dense.3").exists())

    def test_recover_beside_a_foreign_dense_map_says_so_and_leaves_it(self):
        self.save(sequence(), self.folder / "a.map", out="a")
        self.save(self.room_b)
        new = self.folder / "new.map"
        foreign = self.folder / "new.map.dense"
        of_a = (self.folder / "a.map.dense").read_bytes()
        foreign.write_bytes(of_a)
        done = ygslam("map", "recover", self.map, "-o", new)
        self.assert_ran(done)
        self.assertRegex(done.stdout, rf"(?m)^.*new\.map\.dense: {OTHER_MAP}.*it stays as it is$")
        self.assertEqual(foreign.read_bytes(), of_a)
        self.assert_error(ygslam("export", new, "--out", self.folder / "scene"), 6, foreign, OTHER_MAP, out="scene")
        foreign.write_bytes(self.dense.read_bytes())  # a recovered map is the same map
        self.assert_ran(ygslam("export", new, "--out", self.folder / "scene"))

    def test_a_merged_map_is_a_new_one(self):
        walk = rendered(self.folder / "walk", "room_walk", "--without", "movers", "--fps", 8, "--seconds", 8)
        for name, first in ("a", 0), ("b", 3):
            self.assert_ran(self.run_slam(walk, "--from", first, "--save-map", self.folder / f"{name}.map", out=name))
        dense = self.folder / "both.map.dense"
        of_a = (self.folder / "a.map.dense").read_bytes()
        dense.write_bytes(of_a)
        done = ygslam("map", "merge", self.folder / "a.map", self.folder / "b.map", "-o", self.folder / "both.map",
                      "--same-place")
        self.assert_ran(done)
        self.assertRegex(done.stdout, rf"(?m)^.*both\.map\.dense: {OTHER_MAP}")
        self.assertEqual(dense.read_bytes(), of_a)
        names = {self.info(self.folder / f"{name}.map")["uuid"] for name in ("a", "b", "both")}
        self.assertEqual(len(names), 3)

    def test_a_map_keeps_its_name_while_it_goes_on_and_another_has_another(self):
        self.save(sequence())
        first, dense = self.info(), self.dense.read_bytes()
        self.assert_ran(self.run_slam(sequence(), "--from", 10, "--load-map", self.map, "--save-map", self.map,
                                      out="on"))
        self.assertEqual(self.info()["uuid"], first["uuid"])
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)
        self.assertNotEqual(self.dense.read_bytes(), dense)
        self.save(sequence(), self.folder / "same.map", out="same")
        self.assertEqual((self.folder / "same.map.dense").read_bytes(), dense, "runs repeat to the byte")
        self.assertEqual(self.info(self.folder / "same.map")["uuid"], first["uuid"])
        self.save(self.room_b)
        self.assertNotEqual(self.info()["uuid"], first["uuid"], "replaced by another")
        self.assertFalse((self.folder / "room.map.dense.1").exists(), "and its dense map with it")

    def test_a_live_run_begins_a_map_of_its_own(self):
        names = set()
        for name in ("one", "two"):
            file = self.folder / f"{name}.map"
            self.assert_ran(ygslam("run", sequence(), "--out", self.folder / name, "--dynamic", "geometry", "--to", 8,
                                   "--save-map", file))
            names.add(self.info(file)["uuid"])
        self.assertEqual(len(names), 2)

    def test_a_file_of_before_is_taken_where_it_shows_what_the_map_does(self):
        self.save(sequence())
        self.assert_ran(ygslam("export", self.map, "--out", self.folder / "new"))
        of_a = in_format_2(self.dense.read_bytes())
        self.dense.write_bytes(of_a)
        self.assertIn("does not say of which map", ygslam("map", "info", self.map).stdout)
        self.assertFalse(self.info()["dense"]["names_map"])
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)
        self.assert_ran(ygslam("export", self.map, "--out", self.folder / "old"))
        self.assertEqual((self.folder / "old" / "mesh.ply").read_bytes(),
                         (self.folder / "new" / "mesh.ply").read_bytes())
        self.assert_ran(self.run_slam(sequence(), "--from", 10, "--to", 20, "--load-map", self.map, "--save-map",
                                      self.map, out="on"))
        self.assertTrue(self.info()["dense"]["names_map"], "saved again it says so")
        self.assertFalse((self.folder / "room.map.dense.1").exists())
        self.save(self.room_b)
        self.dense.write_bytes(of_a)
        places = "shows other places"
        self.assert_error(ygslam("export", self.map, "--out", self.folder / "scene"), 6, self.dense, places, out="scene")
        self.assert_error(ygslam("map", "check", self.map), 6, self.dense, places)
        _, said = self.scene_of("beside", "--save-map", self.map)
        self.assertRegex(said, rf"warning: .*{places}[\s\S]*warning: .*is now .*\.dense\.1")
        self.assertEqual((self.folder / "room.map.dense.1").read_bytes(), of_a)


if __name__ == "__main__":
    unittest.main()
