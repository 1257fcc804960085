"""Sample scenes as files, and as they lay in memory, for the tests of exported files.

A test whose reader is missing is skipped; `make setup` installs them. The GLB validator wants Node.js.
"""
import importlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

SCENES = ("level", "camera", "tilted", "empty")
FIELDS = ("x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "label", "instance", "prob")
CELL_FIELDS = ("x", "y", "z", "state", "log_odds", "red", "green", "blue", "label", "instance", "prob")
UNKNOWN, FREE, OCCUPIED = 0, 1, 2
CHAIR, CEILING, FLOOR = 56, 82, 80
SAMPLES_BINARY = None
FOLDER = None


def write_samples():
    global FOLDER
    FOLDER = tempfile.TemporaryDirectory()
    subprocess.run([SAMPLES_BINARY, FOLDER.name], check=True)


def remove_samples():
    FOLDER.cleanup()


def file_of(scene, name):
    return str(pathlib.Path(FOLDER.name, scene, name))


def truth_of(scene):
    """The scene's lists as arrays; cells that are unknown are left out."""
    truth = json.loads(pathlib.Path(file_of(scene, "truth.json")).read_text("utf-8"))
    for name, columns in (("cloud", FIELDS), ("vertices", FIELDS), ("cells", CELL_FIELDS)):
        table = np.array(truth[name], dtype=float).reshape(-1, len(columns))
        truth[name] = {field: table[:, i] for i, field in enumerate(columns)}
        truth[name]["xyz"] = table[:, :3]
        truth[name]["rgb"] = table[:, [columns.index(c) for c in ("red", "green", "blue")]]
    truth["triangles"] = np.array(truth["triangles"], dtype=int).reshape(-1, 3)
    known = truth["cells"]["state"] != UNKNOWN
    truth["cells"] = {name: column[known] for name, column in truth["cells"].items()}
    return truth


def reader(name):
    """A Python package, or the end of the test."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise unittest.SkipTest(f"no {name}") from error


def tool(name):
    if not shutil.which(name):
        raise unittest.SkipTest(f"no {name}")
    return name


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options).stdout


def quaternion_matrix(xyzw):
    x, y, z, w = xyzw
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Case(unittest.TestCase):
    def assert_table(self, found, expected, fields=FIELDS):
        """Columns of one by the names of the other, exactly as they were in memory."""
        for field in fields:
            np.testing.assert_array_equal(np.asarray(found[field]).astype(float), expected[field],
                                          err_msg=field)


def main():
    """The command line of both test files: --samples PROGRAM, then unittest's."""
    global SAMPLES_BINARY
    position = sys.argv.index("--samples")
    SAMPLES_BINARY = sys.argv[position + 1]
    del sys.argv[position:position + 2]
    unittest.main(module="__main__", verbosity=2)
