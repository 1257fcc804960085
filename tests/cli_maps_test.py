"""Map files on the command line: `ygslam map`, `localize`, `run --save-map` and `--load-map`."""
import json
import os
import pathlib
import re
import sqlite3
import unittest

from ygslam_cli import CliTest, lines_of, sequence, ygslam


class Maps(CliTest):
    """Files that are no maps; what is wrong inside of maps is tested beside the code."""

    def test_what_is_no_map_is_code_6_with_one_line(self):
        letter = self.folder / "letter.txt"
        letter.write_text("Dear all,\n")
        empty = self.folder / "empty.map"
        empty.touch()
        database = self.folder / "other.map"
        with sqlite3.connect(database) as other:
            other.execute("CREATE TABLE shopping(item TEXT)")
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        for file, cause in ((letter, "is not a map"), (empty, "is empty"), (self.folder, "is a folder"),
                            (database, "another program"), (pipe, "no regular file"),
                            (self.folder / "none.map", "No such file")):
            for command in (["info"], ["check"], ["recover", "-o", self.folder / "new.map"],
                            ["export", "-o", self.folder / "new.ply"]):
                done = ygslam("map", *command, file, timeout=20)
                self.assertEqual(done.returncode, 6, f"{command} {file}: {done.stderr}")
                self.assertRegex(done.stderr, rf"^error: {re.escape(str(file))}: .*{cause}.*\n$")
                self.assertEqual(done.stdout, "")
        self.assertEqual(letter.read_text(), "Dear all,\n")
        self.assertFalse((self.folder / "new.map").exists() or (self.folder / "new.ply").exists())

    def test_exports_know_two_endings(self):
        done = ygslam("map", "export", self.folder / "none.map", "-o", self.folder / "room.obj")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(".ply", done.stderr)


class KeptMaps(CliTest):
    """--save-map, --load-map and localize."""

    def setUp(self):
        super().setUp()
        self.map = self.folder / "room.ygmap"

    def save(self, **how):
        done = self.run_slam(sequence(), "--to", 40, "--save-map", self.map, out="mapped", **how)
        self.assert_ran(done)

    def localize(self, *options, **how):
        return ygslam("localize", sequence(), "--map", self.map, "--out", self.folder / "placed",
                      "--dynamic", "geometry", "--deterministic", *options, **how)

    def states(self, out):
        lines = lines_of(self.folder / out / "frames.csv")
        column = lines[0].split(",").index("state")
        return [line.split(",")[column] for line in lines[1:]]

    def test_a_map_is_saved_found_again_and_left_as_it_is(self):
        self.save()
        self.assertEqual(os.listdir(self.folder).count("room.ygmap-wal"), 0, "one file")
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)
        before = self.map.read_bytes()
        done = self.localize("--from", 10, "--to", 40)
        self.assert_ran(done)
        self.assertEqual(set(self.states("placed")[1:]), {"tracking"})
        self.assertEqual(self.map.read_bytes(), before)
        self.assertFalse((self.folder / "placed" / "map.ply").exists())

    def test_a_damaged_map_says_how_to_save_the_rest(self):
        self.save()
        whole = self.map.read_bytes()
        middle = len(whole) // 2
        for damaged in (whole[:-4096], whole[:middle] + bytes(256) + whole[middle + 256:]):
            self.map.write_bytes(damaged)
            done = self.localize("--quiet")
            self.assertEqual(done.returncode, 6, done.stderr)
            self.assertRegex(done.stderr, rf"^error: {re.escape(str(self.map))}: .*ygslam map recover.*\n$")
            done = ygslam("map", "check", self.map)
            self.assertEqual(done.returncode, 6, done.stderr)
            self.assertIn("damaged, what is wrong in it:", done.stdout)
            self.assertRegex(done.stderr, r"damaged: \d+ faults?; `ygslam map recover .* saves what is good")

    def test_a_run_goes_on_with_a_map_and_saves_it_again(self):
        self.save()
        first = ygslam("map", "info", self.map).stdout
        done = self.run_slam(sequence(), "--from", 10, "--load-map", self.map, "--save-map",
                             self.map, out="second")
        self.assert_ran(done)
        self.assertEqual(set(self.states("second")[1:]), {"tracking"})
        self.assertNotEqual(ygslam("map", "info", self.map).stdout, first)
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)

    def test_a_map_that_is_replaced_is_named(self):
        self.save()
        replaced = f"{self.map}: the map in it is replaced"
        done = self.run_slam(sequence(), "--to", 10, "--save-map", self.map, out="new")
        self.assertIn(replaced, done.stderr)
        done = self.run_slam(sequence(), "--to", 10, "--load-map", self.map, "--save-map", self.map,
                             out="on")
        self.assert_ran(done)
        self.assertNotIn(replaced, done.stderr)

    def test_no_map_another_camera_or_a_damaged_one_is_code_6(self):
        self.assert_error(self.localize(), 6, "room.ygmap")
        self.save()
        camera = self.folder / "camera.yaml"
        camera.write_text("fx: 400\nfy: 400\ncx: 160\ncy: 120\nwidth: 320\nheight: 240\n")
        for command in (self.localize, ):
            self.assert_error(command("--camera", camera), 6, "room.ygmap")
        content = bytearray(self.map.read_bytes())
        content[len(content) // 2] ^= 0x10
        self.map.write_bytes(content)
        done = self.run_slam(sequence(), "--load-map", self.map, out="third")
        self.assert_error(done, 6, "room.ygmap")
        self.assertFalse((self.folder / "third").exists())

    def test_a_map_that_cannot_be_written_is_code_9(self):
        file = self.folder / "none" / "map"
        done = self.run_slam(sequence(), "--to", 10, "--save-map", file)
        self.assert_error(done, 9, f"{file}: No such file")
        self.assertFalse((self.folder / "out").exists())

    def test_the_map_may_lie_in_the_new_folder_of_the_run(self):
        self.map = self.folder / "mapped" / "room.ygmap"
        self.save()
        self.assertEqual(ygslam("map", "check", self.map).returncode, 0)

    def test_the_dense_map_lies_beside_the_map_where_a_link_leads_to_it(self):
        self.save()
        link = self.folder / "links" / "room.map"
        link.parent.mkdir()
        link.symlink_to(self.map)
        dense = pathlib.Path(f"{self.map}.dense")
        dense.unlink()
        self.assert_ran(self.run_slam(sequence(), "--to", 30, "--save-map", link, out="again"))
        self.assertEqual([path.name for path in link.parent.iterdir()], ["room.map"])
        self.assertTrue(link.is_symlink() and dense.is_file())
        self.assertRegex(ygslam("map", "info", link).stdout, r"dense map +[1-9]")

    def test_a_run_without_a_dense_map_leaves_none_that_is_not_of_its_map(self):
        without = ("--set", "run.without=[dense_map]")
        dense = pathlib.Path(f"{self.map}.dense")
        done = self.run_slam(sequence(), "--to", 20, "--save-map", self.map, *without, out="none")
        self.assert_ran(done)
        self.assertFalse(dense.exists())
        self.assertNotIn(".dense", done.stdout)
        self.save()
        content = dense.read_bytes()
        self.assert_ran(self.run_slam(sequence(), "--from", 10, "--to", 20, "--load-map", self.map,
                                      "--save-map", self.map, *without, out="on"))
        self.assertEqual(dense.read_bytes(), content, "the map goes on, and with it what was seen of it")
        self.assert_ran(self.run_slam(sequence(), "--to", 20, "--save-map", self.map, *without, out="new"))
        self.assertFalse(dense.exists(), "the map was replaced")

    def test_recover_says_that_it_leaves_out_the_dense_map(self):
        self.save()
        dense = pathlib.Path(f"{self.map}.dense")
        for name, words in (("new.map", f"{dense}: not recovered, {self.folder / 'new.map'} has no dense map"),
                            ("second.map", None)):
            done = ygslam("map", "recover", self.map, "-o", self.folder / name)
            self.assert_ran(done)
            self.assertFalse((self.folder / f"{name}.dense").exists())
            self.assertEqual(words in done.stdout.splitlines() if words else "dense" not in done.stdout, True)
            dense.unlink(missing_ok=True)

    def test_what_is_no_dense_map_hides_no_map(self):
        self.save()
        dense = pathlib.Path(f"{self.map}.dense")
        dense.write_bytes(b"junk" * 100)
        shown = ygslam("map", "info", self.map)
        self.assert_ran(shown)
        self.assertRegex(shown.stdout, rf"keyframes +\d[\s\S]*dense map +none that can be used: {re.escape(str(dense))}: ")
        told = ygslam("map", "info", "--json", self.map)
        self.assert_ran(told)
        self.assertIn(str(dense), json.loads(told.stdout)["dense"]["fault"])
        self.assertEqual(ygslam("map", "check", self.map).returncode, 6)

    def test_a_call_that_fails_leaves_no_empty_map(self):
        none = self.folder / "none.onnx"
        for code, options in ((6, ["--load-map", none, "--dynamic", "geometry"]),
                              (5, ["--model", none]), (4, ["--segmenter", f"masks:{none}"])):
            done = ygslam("run", sequence(), "--out", self.folder / "out", "--save-map", self.map,
                          *options)
            self.assert_error(done, code, "none.onnx")
            self.assertFalse(self.map.exists(), options)

    def test_a_map_is_kept_where_the_folder_of_the_run_cannot_be_written(self):
        (self.folder / "mapped" / "metrics.json").mkdir(parents=True)
        done = self.run_slam(sequence(), "--to", 40, "--save-map", self.map, out="mapped")
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertRegex(ygslam("map", "check", self.map).stdout, r"whole: [1-9]\d* keyframes")

    def test_no_map_is_exported_over_or_merged_with_itself(self):
        self.map = self.folder / "room.ply"
        self.save()
        before = self.map.read_bytes()
        done = ygslam("map", "export", self.map, "-o", self.map)
        self.assert_error(done, 9, "room.ply: is a map: not replaced")
        copy = self.folder / "copy.ygmap"
        copy.write_bytes(before)
        for other in (self.map, copy):
            done = ygslam("map", "merge", self.map, other, "-o", self.folder / "both.ygmap")
            self.assert_error(done, 2, f"{other}: the same map")
        self.assertEqual(self.map.read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
