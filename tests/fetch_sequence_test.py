"""tools/fetch_sequence.py against archives made here, over file:// URLs; no network is used.

    python tests/fetch_sequence_test.py
"""
import io
import pathlib
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

TOOL = pathlib.Path(__file__).resolve().parent.parent / "tools" / "fetch_sequence.py"
TUM = "rgbd_dataset_freiburg3_walking_xyz"
BONN = "rgbd_bonn_balloon"


def make_tar(path, entries, link=None):
    with tarfile.open(path, "w:gz") as tar:
        for name, content in entries.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
        if link:
            info = tarfile.TarInfo(link)
            info.type, info.linkname = tarfile.SYMTYPE, "/etc/passwd"
            tar.addfile(info)


def make_zip(path, entries):
    with zipfile.ZipFile(path, "w") as packed:
        for name, content in entries.items():
            packed.writestr(name, content)


def sequence(name):
    return {f"{name}/rgb.txt": b"1 rgb/1.png\n", f"{name}/rgb/1.png": b"x",
            f"{name}/depth.txt": b"1 depth/1.png\n"}


class FetchSequence(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="mit Leerzeichen ")
        self.addCleanup(self.folder.cleanup)
        self.mirror = pathlib.Path(self.folder.name, "mirror")
        self.mirror.mkdir()
        self.out = pathlib.Path(self.folder.name, "out")

    def fetch(self, name):
        return subprocess.run([sys.executable, TOOL, name, "--to", self.out, "--base-url",
                               self.mirror.as_uri()], capture_output=True, text=True, check=False)

    def assert_refused(self, name, what):
        done = self.fetch(name)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(what, done.stderr)
        left = list(self.out.iterdir()) if self.out.exists() else []
        self.assertEqual(left, [], "nothing half-fetched remains")

    def test_tum_and_bonn_sequences_arrive_complete(self):
        make_tar(self.mirror / f"{TUM}.tgz", sequence(TUM))
        make_zip(self.mirror / f"{BONN}.zip", sequence(BONN))
        for given, name in (("fr3_walking_xyz", TUM), (BONN, BONN)):
            done = self.fetch(given)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((self.out / name / "rgb" / "1.png").read_bytes(), b"x")
        self.assertEqual(len(list(self.out.iterdir())), 2)

    def test_what_is_there_already_is_not_fetched_again(self):
        (self.out / TUM).mkdir(parents=True)
        self.assertEqual(self.fetch(TUM).returncode, 0)

    def test_an_unknown_name_suggests_the_nearest(self):
        self.assert_refused("fr3_walking_xyx", TUM)

    def test_a_missing_archive_is_told_in_one_line(self):
        self.assert_refused(TUM, f"{TUM}.tgz")

    def test_a_truncated_archive_is_refused(self):
        make_tar(self.mirror / f"{TUM}.tgz", {**sequence(TUM), f"{TUM}/big": bytes(range(256)) * 99})
        path = self.mirror / f"{TUM}.tgz"
        path.write_bytes(path.read_bytes()[:-200])
        self.assert_refused(TUM, "cannot be unpacked")

    def test_paths_out_of_the_folder_and_links_are_refused(self):
        for evil in ("../evil", "/tmp/evil", "a/../../evil"):
            make_tar(self.mirror / f"{TUM}.tgz", {**sequence(TUM), evil: b"x"})
            self.assert_refused(TUM, "unsafe path")
            make_zip(self.mirror / f"{BONN}.zip", {**sequence(BONN), evil: b"x"})
            self.assert_refused(BONN, "unsafe path")
        make_tar(self.mirror / f"{TUM}.tgz", sequence(TUM), link=f"{TUM}/link")
        self.assert_refused(TUM, "link")

    def test_an_archive_without_a_sequence_is_refused(self):
        make_zip(self.mirror / f"{BONN}.zip", {"readme": b"x"})
        self.assert_refused(BONN, "no rgb.txt")

    def test_the_list_names_both_datasets(self):
        done = subprocess.run([sys.executable, TOOL, "--list"], capture_output=True, text=True,
                              check=True)
        self.assertIn(TUM, done.stdout)
        self.assertIn(BONN, done.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
