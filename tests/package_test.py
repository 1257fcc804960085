"""The Debian package on a system that has nothing else: a fresh Debian of the release it was built on.

    python tests/package_test.py --build build/release

Needs root, mmdebstrap and Debian's mirror ($YGSLAM_DEBIAN_MIRROR, or the one this machine uses); skipped
without them. $YGSLAM_CLEAN_ROOT may name a tarball of such a system.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD = None
LIMIT_S = 1500


def call(*command, **how):
    how = {"timeout": LIMIT_S, **how}
    return subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          check=False, errors="replace", **how)


def release():
    """Debian's name of this system's release; None elsewhere."""
    text = pathlib.Path("/etc/os-release").read_text(encoding="utf-8")
    found = dict(re.findall(r'(?m)^(\w+)="?([^"\n]*)', text))
    return found.get("VERSION_CODENAME") if found.get("ID") == "debian" else None


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0 or release() is None:
            raise unittest.SkipTest("only root may make a clean root, of a Debian only")
        given = os.environ.get("YGSLAM_CLEAN_ROOT")
        if not given and shutil.which("mmdebstrap") is None:
            raise unittest.SkipTest("no mmdebstrap here")
        folder = tempfile.TemporaryDirectory(prefix="ygslam-package-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.root = cls.folder / "root"
        cls.make_package()
        cls.make_root(given)

    @classmethod
    def make_package(cls):
        """As `cpack -G DEB` makes it, of what is built already."""
        stage = cls.folder / "stage"
        done = call("cmake", "--install", BUILD, "--prefix", stage / "usr", "--strip")
        assert done.returncode == 0, done.stderr
        done = call("cpack", "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", cls.folder,
                    "-D", "CPACK_INSTALL_CMAKE_PROJECTS=", "-D",
                    f"CPACK_INSTALLED_DIRECTORIES={stage};/", "-D", "CPACK_SET_DESTDIR=OFF",
                    "-D", "CPACK_PACKAGING_INSTALL_PREFIX=/", cwd=cls.folder)
        assert done.returncode == 0, done.stdout + done.stderr
        cls.deb, = cls.folder.glob("*.deb")
        shutil.rmtree(stage)

    @classmethod
    def make_root(cls, given):
        if given:
            cls.root.mkdir()
            done = call("tar", "-xf", given, "-C", cls.root)
        else:
            mirror = os.environ.get("YGSLAM_DEBIAN_MIRROR")
            done = call("mmdebstrap", "--variant=apt", release(), cls.root,
                        *([mirror] if mirror else []))
        if done.returncode != 0 and not given:
            raise unittest.SkipTest(f"no clean root can be made: {done.stderr[-300:]}")
        assert done.returncode == 0, done.stderr
        shutil.copy("/etc/resolv.conf", cls.root / "etc" / "resolv.conf")
        shutil.copy(cls.deb, cls.root / "tmp" / "ygslam.deb")
        for place in ("dev", "proc"):
            mounted = call("mount", "--rbind", f"/{place}", cls.root / place)
            assert mounted.returncode == 0, mounted.stderr
            cls.addClassCleanup(call, "umount", "-l", cls.root / place)
        done = cls.inside("apt-get update -qq && apt-get install -y -qq --no-install-recommends "
                          "/tmp/ygslam.deb")
        assert done.returncode == 0, done.stdout + done.stderr

    @classmethod
    def inside(cls, script, user="root"):
        return call("chroot", f"--userspec={user}", cls.root, "/bin/bash", "-c", script,
                    env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "LC_ALL": "C",
                         "DEBIAN_FRONTEND": "noninteractive"})

    def test_1_it_says_what_it_is_and_what_it_needs(self):
        fields = dict(re.findall(r"(?m)^ ?([\w-]+): (.*)", call("dpkg", "-I", self.deb).stdout))
        self.assertEqual(fields["Package"], "ygslam")
        for library in ("libsqlite3-0", "libzstd1", "libopencv-core", "libc6"):
            self.assertIn(library, fields["Depends"])
        files = call("dpkg", "-c", self.deb).stdout
        for file in ("/usr/bin/ygslam", "/usr/include/ygslam/camera_stream.hpp",
                     "/usr/share/man/man1/ygslam.1.gz", "/usr/lib/ygslam/libopenvino",
                     "/usr/share/bash-completion/completions/ygslam",
                     "/usr/share/zsh/vendor-completions/_ygslam", "/usr/share/doc/ygslam/LICENSE"):
            self.assertIn(f" .{file}", files)
        self.assertNotIn("__pycache__", files)

    def test_2_it_runs_there_and_not_as_root(self):
        done = self.inside("ygslam --version", "nobody")
        self.assertRegex(done.stdout, r"^\d+\.\d+\.\d+\n$", done.stderr)
        done = self.inside(
            "set -e; cd $(mktemp -d); ygslam simulate static_xyz --out seq --size 320x240 "
            "--seconds 0.4 --threads 1; ygslam run seq --out out --dynamic geometry --mcap run.mcap; "
            "ygslam eval --gt seq/groundtruth.txt --est out/trajectory.txt", "nobody")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("100.0 % tracked", done.stdout)

    def test_3_the_network_runs_there(self):
        shared = pathlib.Path(os.environ.get("YGSLAM_SHARED", "../shared")).resolve()
        model = shared / "models" / "yolov8n-seg_480x640.onnx"
        if not model.exists():
            self.skipTest(f"no model at {model}")
        shutil.copyfile(model, self.root / "tmp" / "model.onnx")
        done = self.inside(
            "set -e; cd $(mktemp -d); ygslam simulate static_xyz --out seq --size 320x240 "
            "--seconds 0.4 --threads 1; ygslam run seq --out out --model /tmp/model.onnx", "nobody")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_4_shells_and_man_find_what_is_theirs(self):
        done = self.inside("source /usr/share/bash-completion/completions/ygslam; "
                           "COMP_WORDS=(ygslam simul); COMP_CWORD=1; _ygslam; echo ${COMPREPLY[@]}")
        self.assertEqual(done.stdout, "simulate\n", done.stderr)
        done = self.inside("zcat /usr/share/man/man1/ygslam.1.gz | grep '^.TH'")
        self.assertTrue(done.stdout.startswith('.TH YGSLAM "1" '), done.stdout)

    def test_5_it_goes_as_it_came(self):
        done = self.inside("apt-get remove -y -qq ygslam && find / -xdev -path /tmp -prune -o "
                           "-iname '*ygslam*' ! -path '/var/*' -print")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([line for line in done.stdout.splitlines() if line.startswith("/")], [])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, help="the configured and built folder")
    known, rest = parser.parse_known_args()
    BUILD = pathlib.Path(known.build).resolve()
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
