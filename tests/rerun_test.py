"""The recording of a run (`--mcap`), opened by Rerun's own reader.

    python tests/rerun_test.py

Rerun (PyPI rerun-sdk) takes 500 MB and is installed by `make setup-nightly` alone: $YGSLAM_RERUN names its program,
else one beside this Python or on the path is taken, else the test is skipped.
"""
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from mcap_test import EVERY_FRAME, OF_THE_MAP
from ygslam_cli import HANG_S, CliTest, sequence

RERUN = (os.environ.get("YGSLAM_RERUN") or shutil.which("rerun", path=Path(sys.executable).parent)
         or shutil.which("rerun"))
FRAMES = 20


@unittest.skipUnless(RERUN, "no Rerun here")
class Rerun(CliTest):
    def rerun(self, *arguments):
        done = subprocess.run([RERUN, *map(str, arguments)], check=False, capture_output=True,
                              text=True, timeout=HANG_S, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        complaints = [line for line in (done.stdout + done.stderr).splitlines()
                      if re.search(r"\b(WARN|ERROR)\b", line)
                      and "Application ID requires migration" not in line]  # of any file's name
        self.assertEqual(complaints, [])
        return done.stdout

    def test_it_makes_of_it_what_it_shows(self):
        self.assert_ran(self.run_slam(sequence(), "--to", FRAMES, "--mcap", self.folder / "run.mcap"))
        self.rerun("mcap", "convert", "run.mcap", "-o", "run.rrd")
        self.rerun("rrd", "verify", "run.rrd")
        rows = {}  # of what Rerun draws, not of the messages' fields
        for count, entity, columns in re.findall(r"with (\d+) rows.* - (/\S+) - data columns: \[(.*)\]",
                                                 self.rerun("rrd", "print", "-v", "run.rrd")):
            for column in re.findall(r"@(\w+:\w+)", columns):
                rows[entity, column] = rows.get((entity, column), 0) + int(count)
        self.assertEqual({entity for entity, _ in rows} - {"/__mcap_properties"},
                         EVERY_FRAME | OF_THE_MAP)
        self.assertGreater(rows["/tf", "Transform3D:translation"], 2 * FRAMES)
        self.assertEqual(rows["/camera/camera_info", "Pinhole:image_from_camera"], FRAMES)
        self.assertEqual(rows["/camera/image/compressed", "EncodedImage:blob"], FRAMES)
        for cloud in ("/cloud", "/landmarks"):
            self.assertGreaterEqual(rows[cloud, "Points3D:positions"], 1)


if __name__ == "__main__":
    unittest.main()
