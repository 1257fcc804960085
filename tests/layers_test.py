"""The layers of src/: a folder includes only what lies below it, heavy libraries stay in .cpp files.

    python tests/layers_test.py
"""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)

# Bottom up. Folders of one line do not know each other.
LAYERS = (("core",), ("geometry", "image"), ("scene",), ("features", "segment", "optim", "inertial", "volume"), ("objects",), ("map", "motion"),
          ("tracking", "mapping", "loop", "dense"), ("system",), ("live",), ("facade",), ("app",))
# Beside the layers: what each may use.
SIDE = {"io": {"core", "geometry", "image"},
        "bag": {"core", "geometry", "image", "io"},
        "eval": {"core", "geometry", "image", "io"},
        "benchmark_runs": {"core", "geometry", "image", "io", "eval"},
        "simulation": {"core", "geometry", "image", "io"},
        "scene_file": {"core", "geometry", "image", "io", "scene"},
        "scene_picture": {"core", "geometry", "image", "io", "scene"},
        "map_file": {"core", "geometry", "image", "io", "features", "map"}}
# Rooms of a folder, bottom up: a room includes only from itself, rooms before it and the folder itself.
ROOMS = {"simulation": ("surface", "render", "world", "people", "sensor", "sequence", "random"),
         "motion": ("flow", "masks", "checks", "classification"),
         "dense": ("scene_naming", "background")}
USERS_OF_SIDE = {"system", "live", "facade", "app"}

HEAVY = re.compile(r"^(opencv2/|openvino/|yaml-cpp/|png\.h|turbojpeg\.h|ceres/|embree|CLI/|sqlite3\.h|zstd\.h|lz4frame\.h|bzlib\.h|zlib\.h|boost/|octomap/)")
CV_VIEW = "image/cv_view.hpp"  # hands our images to OpenCV; for .cpp files


def layer_of(folder):
    for level, folders in enumerate(LAYERS):
        if folder in folders:
            return level
    return None


def may_use(user, used):
    """Whether the folder `user` may include from the folder `used`."""
    if user == used:
        return True
    if user in SIDE:
        return used in SIDE[user]
    if used in SIDE:
        return user in USERS_OF_SIDE
    return layer_of(used) < layer_of(user)


def includes_of(text):
    """(kind, name) of each include line; kind is `<` or a double quote."""
    return INCLUDE.findall(text)


def source_files():
    """Path inside src/ to text, of all C++ files."""
    return {path.relative_to(ROOT / "src").as_posix(): path.read_text(encoding="utf-8")
            for path in sorted((ROOT / "src").rglob("*"))
            if path.suffix in (".hpp", ".cpp", ".h") and path.is_file()}


def layer_faults(files):
    """Includes of `files` (path to text) that go up or sideways."""
    faults = []
    for path, text in files.items():
        user = path.split("/", maxsplit=1)[0]
        for kind, name in includes_of(text):
            used = name.split("/", maxsplit=1)[0]
            if kind == '"' and name in files and not may_use(user, used):
                faults.append(f"src/{path} includes {name}: {user} must not use {used}")
    return faults


def room_faults(files):
    """Includes of `files` that go up between the rooms of one folder, and rooms without a place.

    Tests may use every room of their folder.
    """
    faults = []
    for path, text in files.items():
        folder, _, rest = path.partition("/")
        if folder not in ROOMS:
            continue
        order = ("", *ROOMS[folder])
        room = rest.rpartition("/")[0]
        if room not in order:
            faults.append(f"src/{path}: no such room")
            continue
        for kind, name in [] if path.endswith("_test.cpp") else includes_of(text):
            used_folder, _, used = name.partition("/")
            used = used.rpartition("/")[0]
            if kind == '"' and used_folder == folder and used not in order[:order.index(room) + 1]:
                faults.append(f"src/{path} includes {name}: {room} must not use {used}")
    return faults


def reach_heavy(files):
    """Headers from which a heavy library is reached, each with the library's header."""
    heavy = {path: next(name for _, name in includes_of(text) if HEAVY.match(name))
             for path, text in files.items()
             if path.endswith(".hpp") and any(HEAVY.match(n) for _, n in includes_of(text))}
    grown = True
    while grown:
        grown = False
        for path, text in files.items():
            if path in heavy or not path.endswith(".hpp"):
                continue
            found = next((heavy[n] for _, n in includes_of(text) if n in heavy), None)
            if found:
                heavy[path], grown = found, True
    return heavy


def heavy_faults(files):
    """Places where a folder's header brings a heavy library into another folder."""
    heavy = reach_heavy(files)
    faults = []
    for path, text in files.items():
        for _, name in includes_of(text):
            if name not in heavy or name.split("/")[0] == path.split("/")[0]:
                continue
            if name == CV_VIEW and path.endswith(".cpp"):
                continue
            faults.append(f"src/{path} gets {heavy[name]} through {name}")
    return faults


class Layers(unittest.TestCase):
    def test_every_folder_has_its_place(self):
        folders = {path.split("/", maxsplit=1)[0] for path in source_files()}
        unknown = {f for f in folders if layer_of(f) is None and f not in SIDE}
        self.assertEqual(unknown, set())

    def test_no_folder_includes_upward_or_sideways(self):
        self.assertEqual(layer_faults(source_files()), [])

    def test_no_room_includes_upward(self):
        self.assertEqual(room_faults(source_files()), [])

    def test_every_quoted_include_exists(self):
        files = source_files()
        missing = [f"src/{path}: {name}" for path, text in files.items()
                   for kind, name in includes_of(text)
                   if kind == '"' and name not in files and not (ROOT / "include" / name).exists()]
        self.assertEqual(missing, [])

    def test_heavy_libraries_do_not_leave_their_folder(self):
        self.assertEqual(heavy_faults(source_files()), [])

    def test_the_installed_header_needs_the_standard_library_only(self):
        for path in sorted((ROOT / "include").rglob("*.hpp")):
            for kind, name in includes_of(path.read_text(encoding="utf-8")):
                self.assertEqual(kind, "<", f"{path}: {name}")
                self.assertRegex(name, r"^([a-z_]+|ygslam/[a-z_]+\.hpp)$", str(path))

    def test_tests_and_benchmarks_are_never_included(self):
        for path, text in source_files().items():
            for _, name in includes_of(text):
                self.assertFalse(name.startswith(("tests/", "bench/")), f"src/{path}: {name}")


class TheCheckItself(unittest.TestCase):
    """It would see what it is there for."""

    def test_upward_and_sideways_includes_are_seen(self):
        files = {"core/a.hpp": '#include "tracking/b.hpp"\n', "tracking/b.hpp": "",
                 "mapping/c.cpp": '#include "tracking/b.hpp"\n', "map/d.hpp": "",
                 "motion/e.cpp": '  #  include "map/d.hpp"\n', "eval/f.cpp": '#include "map/d.hpp"\n',
                 "tracking/g.cpp": '#include "map/d.hpp"\n'}
        self.assertEqual(len(layer_faults(files)), 4)

    def test_upward_includes_between_rooms_are_seen(self):
        files = {"simulation/surface/a.cpp": '#include "simulation/world/b.hpp"\n',
                 "simulation/world/b.hpp": '#include "simulation/c.hpp"\n',
                 "simulation/c.hpp": "", "simulation/attic/d.cpp": ""}
        self.assertEqual(len(room_faults(files)), 2)

    def test_heavy_headers_are_seen_through_others(self):
        files = {"segment/inner.hpp": "#include <openvino/runtime/core.hpp>\n",
                 "segment/outer.hpp": '#include "segment/inner.hpp"\n',
                 "segment/own.cpp": '#include "segment/inner.hpp"\n',
                 "tracking/user.cpp": '#include "segment/outer.hpp"\n',
                 CV_VIEW: "#include <opencv2/core/mat.hpp>\n",
                 "features/fine.cpp": f'#include "{CV_VIEW}"\n',
                 "features/bad.hpp": f'#include "{CV_VIEW}"\n'}
        self.assertEqual(len(heavy_faults(files)), 2)


if __name__ == "__main__":
    unittest.main(verbosity=2)
