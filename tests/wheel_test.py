"""The wheel of `make wheel` where there is no compiler and none of Debian's libraries it was built with.

    python tests/wheel_test.py --wheels dist

Needs root, mmdebstrap and Debian's mirror ($YGSLAM_DEBIAN_MIRROR, or the one this machine uses); skipped
without them. $YGSLAM_CLEAN_ROOT may name a tarball of a Debian with python3-venv.
"""
import argparse
import os
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

from package_test import call, release

ROOT = pathlib.Path(__file__).resolve().parent.parent
WHEELS = None


def ten_lines():
    """The second example of docs/python.md, word for word."""
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.S)[1]


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0 or release() is None or shutil.which("mmdebstrap") is None:
            raise unittest.SkipTest("a clean root needs root, a Debian and mmdebstrap")
        tag = f"cp{sys.version_info.major}{sys.version_info.minor}-"
        wheels = sorted(WHEELS.glob(f"ygslam-*-{tag}*manylinux*.whl"), key=lambda path: path.stat().st_mtime)
        if not wheels:
            raise unittest.SkipTest(f"no manylinux wheel in {WHEELS}: `make wheel` makes one")
        cls.wheel = wheels[-1]
        folder = tempfile.TemporaryDirectory(prefix="ygslam-wheel-")
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name) / "root"
        cls.make_root()
        cls.install()

    @classmethod
    def make_root(cls):
        given = os.environ.get("YGSLAM_CLEAN_ROOT")
        if given:
            cls.root.mkdir()
            done = call("tar", "-xf", given, "-C", cls.root)
        else:
            mirror = os.environ.get("YGSLAM_DEBIAN_MIRROR")
            done = call("mmdebstrap", "--variant=apt", "--include=python3-venv", release(), cls.root,
                        *([mirror] if mirror else []))
        if done.returncode != 0 and not given:
            raise unittest.SkipTest(f"no clean root can be made: {done.stderr[-300:]}")
        assert done.returncode == 0, done.stderr
        for place in ("dev", "proc"):
            mounted = call("mount", "--rbind", f"/{place}", cls.root / place)
            assert mounted.returncode == 0, mounted.stderr
            cls.addClassCleanup(call, "umount", "-l", cls.root / place)

    @classmethod
    def install(cls):
        """Into a bare environment, from files alone: what the wheel needs is fetched out here."""
        files = cls.root / "tmp" / "wheels"
        done = call(sys.executable, "-m", "pip", "download", "--quiet", "--only-binary=:all:", "-d", files,
                    f"{cls.wheel}[report]")
        assert done.returncode == 0, done.stderr
        done = cls.inside("python3 -m venv /tmp/venv && /tmp/venv/bin/pip install --no-index "
                          f"--find-links /tmp/wheels '/tmp/wheels/{cls.wheel.name}[report]'")
        assert done.returncode == 0, done.stdout + done.stderr

    @classmethod
    def inside(cls, script):
        return call("chroot", cls.root, "/bin/bash", "-c", script,
                    env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "LC_ALL": "C"})

    def test_1_nothing_is_there_that_it_could_have_been_built_with(self):
        done = self.inside("command -v cc c++ gcc g++ cmake; ls /usr/lib/x86_64-linux-gnu | "
                           "grep -E 'opencv|embree|yaml-cpp|libtbb|spdlog|turbojpeg'")
        self.assertEqual(done.stdout, "")

    def test_2_the_program_runs(self):
        done = self.inside("set -e; cd $(mktemp -d); export PATH=/tmp/venv/bin:$PATH; ygslam --version; "
                           "ygslam simulate walking_xyz --out seq --size 320x240 --seconds 0.6 --threads 1; "
                           "ygslam run seq --out out; ygslam eval --gt seq/groundtruth.txt --est out/trajectory.txt")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("100.0 % tracked", done.stdout)

    def test_3_the_ten_lines_of_the_docs_run(self):
        script = self.root / "tmp" / "ten_lines.py"
        script.write_text(ten_lines(), encoding="utf-8")
        done = self.inside("set -e; cd $(mktemp -d); export PATH=/tmp/venv/bin:$PATH; ygslam simulate walking_xyz "
                           "--out office_bag --size 320x240 --seconds 0.6 --threads 1 >/dev/null; "
                           "python /tmp/ten_lines.py; head -1 office.txt")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"\d+ poses, \d+ points of the room without the people")

    def test_4_plots_and_reports_are_made(self):
        done = self.inside("set -e; cd $(mktemp -d); export PATH=/tmp/venv/bin:$PATH; ygslam simulate walking_xyz "
                           "--out seq --size 320x240 --seconds 0.6 --threads 1 >/dev/null; "
                           "ygslam run seq --out out; ygslam eval --gt seq/groundtruth.txt --est out/trajectory.txt "
                           "--plot plot.svg; ygslam bench seq --modes off --runs 1 --out bench; "
                           "grep -c '<svg' plot.svg bench/report/index.html")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_5_licences_of_what_it_brings_along_are_in_it(self):
        found = self.inside("find /tmp/venv -path '*ygslam-*licenses*' -name '*.copyright' -printf '%f\\n'").stdout
        brought = self.inside("ls /tmp/venv/lib/python3*/site-packages/ygslam.libs").stdout
        for library, package in (("libembree3", "libembree3-3"), ("libopencv_core", "libopencv-core406"),
                                 ("libsqlite3", "libsqlite3-0")):
            self.assertIn(library, brought)
            self.assertIn(f"{package}.copyright", found)
        self.assertNotIn("libopenvino", brought)
        self.assertNotIn("libtbb", brought)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheels", required=True, help="the folder of `make wheel`")
    known, rest = parser.parse_known_args()
    WHEELS = pathlib.Path(known.wheels).resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
