"""Files of a scene, each opened by programs of others, against the scene as it lay in memory.

    python tests/scene_file_test.py --samples build/release/src/scene_file/scene_file_test

A test whose reader is missing is skipped; `make setup` installs them. The GLB validator wants Node.js.
"""
import collections
import importlib
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy as np
import yaml
from PIL import Image

SCENES = ("level", "camera", "tilted", "empty")
FIELDS = ("x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "label", "instance", "prob")
CELL_FIELDS = ("x", "y", "z", "state", "log_odds", "red", "green", "blue", "label", "instance", "prob")
UNKNOWN, FREE, OCCUPIED = 0, 1, 2
CHAIR, CEILING, FLOOR = 56, 82, 80
SAMPLES_BINARY = None
FOLDER = None


def setUpModule():
    global FOLDER
    FOLDER = tempfile.TemporaryDirectory()
    subprocess.run([SAMPLES_BINARY, "--gtest_filter=ExportScene.SamplesForOtherReaders"], check=True,
                   env=os.environ | {"YGSLAM_SAMPLE_SCENES": FOLDER.name}, stdout=subprocess.DEVNULL)


def tearDownModule():
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


class Cloud(Case):
    def test_ply_by_plyfile(self):
        plyfile = reader("plyfile")
        for scene in SCENES:
            ply = plyfile.PlyData.read(file_of(scene, "cloud.ply"))
            self.assertEqual(ply["vertex"].data.dtype.names, FIELDS)
            self.assert_table(ply["vertex"].data, truth_of(scene)["cloud"])
            names = dict(line.split(" ", 2)[1:] for line in ply.comments)
            self.assertEqual({int(label) for label in names},
                             set(truth_of(scene)["cloud"]["label"].astype(int)))
            self.assertEqual(names.get("56"), None if scene == "empty" else "chair")

    def test_ply_by_trimesh(self):
        trimesh = reader("trimesh")
        for scene in SCENES[:3]:
            cloud = trimesh.load(file_of(scene, "cloud.ply"))
            truth = truth_of(scene)["cloud"]
            np.testing.assert_array_equal(cloud.vertices, truth["xyz"])
            np.testing.assert_array_equal(cloud.colors[:, :3], truth["rgb"])
            self.assert_table(cloud.metadata["_ply_raw"]["vertex"]["data"], truth)

    def test_pcd_by_pypcd4(self):
        pypcd4 = reader("pypcd4")
        for scene in SCENES[:3]:
            cloud = pypcd4.PointCloud.from_path(file_of(scene, "cloud.pcd"))
            truth = truth_of(scene)["cloud"]
            self.assertEqual((cloud.fields, cloud.points), (("x", "y", "z", "rgb", "label"), 1000))
            self.assert_table(cloud.pc_data, truth, ("x", "y", "z", "label"))
            rgb = pypcd4.PointCloud.decode_rgb(cloud.pc_data["rgb"])
            np.testing.assert_array_equal(rgb, truth["rgb"])

    def test_pcd_by_its_header(self):
        for scene in SCENES:
            head, _, data = pathlib.Path(file_of(scene, "cloud.pcd")).read_bytes().partition(
                b"DATA binary\n")
            header = dict(line.split(" ", 1) for line in head.decode().splitlines() if line[0] != "#")
            kinds = [f"<{kind.lower()}{size}" for kind, size in
                     zip(header["TYPE"].split(), header["SIZE"].split())]
            table = np.frombuffer(data, list(zip(header["FIELDS"].split(), kinds)))
            truth = truth_of(scene)["cloud"]
            self.assertEqual(int(header["WIDTH"]) * int(header["HEIGHT"]), len(table))
            self.assertEqual(int(header["POINTS"]), len(table))
            self.assert_table(table, truth, ("x", "y", "z", "label"))
            bgr = np.ascontiguousarray(table["rgb"]).view(np.uint8).reshape(-1, 4)
            np.testing.assert_array_equal(bgr[:, 2::-1], truth["rgb"])


class Mesh(Case):
    def test_ply_by_plyfile(self):
        plyfile = reader("plyfile")
        for scene in SCENES:
            ply, truth = plyfile.PlyData.read(file_of(scene, "mesh.ply")), truth_of(scene)
            self.assert_table(ply["vertex"].data, truth["vertices"])
            faces = list(ply["face"]["vertex_indices"])
            np.testing.assert_array_equal(np.array(faces).reshape(-1, 3), truth["triangles"])

    def test_ply_by_trimesh(self):
        trimesh = reader("trimesh")
        for scene in SCENES[:3]:
            mesh, truth = trimesh.load(file_of(scene, "mesh.ply"), process=False), truth_of(scene)
            np.testing.assert_array_equal(mesh.faces, truth["triangles"])
            np.testing.assert_array_equal(mesh.vertices, truth["vertices"]["xyz"])
            np.testing.assert_array_equal(mesh.visual.vertex_colors[:, :3], truth["vertices"]["rgb"])
            self.assert_table(mesh.metadata["_ply_raw"]["vertex"]["data"], truth["vertices"])
            # Boxes whose corners turn counter-clockwise have a volume, and it is positive.
            self.assertGreater(mesh.submesh([range(36, 48)], append=True).volume, 0.1)

    def test_ply_by_assimp(self):
        tool("assimp")
        for scene in SCENES[:3]:
            info = run("assimp", "info", file_of(scene, "mesh.ply"))
            self.assertRegex(info, rf"Faces: +{len(truth_of(scene)['triangles'])}\n")


def object_of_triangle(truth):
    """By majority of the corners, the first one where all differ; 0 is background."""
    listed = {thing["id"] for thing in truth["objects"]}
    corners = truth["vertices"]["instance"][truth["triangles"]].astype(int)
    corners = np.where(np.isin(corners, list(listed)), corners, 0)
    return np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])


def positions_of(truth, triangles):
    return truth["vertices"]["xyz"][truth["triangles"][triangles]]


class Glb(Case):
    def assert_box(self, box, thing):
        np.testing.assert_allclose(box["centre_m"], thing["centre_m"], atol=1e-6)
        np.testing.assert_allclose(box["size_m"], thing["size_m"], atol=1e-6)
        np.testing.assert_allclose(quaternion_matrix(box["rotation_xyzw"]).T, thing["axes"], atol=1e-5)

    def test_by_pygltflib(self):
        pygltflib = reader("pygltflib")
        types = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}
        widths = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
        for scene in SCENES:
            glb, truth = pygltflib.GLTF2().load(file_of(scene, "mesh.glb")), truth_of(scene)
            blob = glb.binary_blob()

            def values(number):
                accessor = glb.accessors[number]
                view = glb.bufferViews[accessor.bufferView]
                kind, width = types[accessor.componentType], widths[accessor.type]
                step = view.byteStride or width * np.dtype(kind).itemsize
                first = view.byteOffset + accessor.byteOffset if view.byteOffset else accessor.byteOffset
                return np.ndarray((accessor.count, width), kind, blob, first,
                                  (step, np.dtype(kind).itemsize))

            owner = object_of_triangle(truth)
            names = [glb.nodes[child].name for child in glb.nodes[0].children]
            self.assertEqual(names[0], "background")
            things = {0: None} | {thing["id"]: thing for thing in truth["objects"]}
            for child, (number, thing) in zip(glb.nodes[0].children, things.items()):
                node, mine = glb.nodes[child], np.flatnonzero(owner == number)
                if thing:
                    self.assertEqual(node.extras["id"], thing["id"])
                    self.assertEqual(node.extras["state"], thing["state"])
                    self.assertEqual(node.extras["label"], thing["label"])
                    self.assertTrue(node.name.endswith(f" {number}"))
                    self.assert_box(node.extras["box"], thing)
                if not len(mine):
                    self.assertIsNone(node.mesh)
                    continue
                (primitive,) = glb.meshes[node.mesh].primitives
                corners = values(primitive.indices)[:, 0].reshape(-1, 3)
                source = truth["triangles"][mine]
                attributes = primitive.attributes
                np.testing.assert_array_equal(values(attributes.POSITION)[corners],
                                              truth["vertices"]["xyz"][source])
                normals = np.stack([truth["vertices"][f] for f in ("nx", "ny", "nz")], 1)
                np.testing.assert_allclose(values(attributes.NORMAL)[corners], normals[source],
                                           atol=1e-6)
                for name, field in (("_CLASS", "label"), ("_INSTANCE", "instance"),
                                    ("_PROBABILITY", "prob")):
                    np.testing.assert_array_equal(values(getattr(attributes, name))[:, 0][corners],
                                                  truth["vertices"][field][source])
                light = values(attributes.COLOR_0)[:, :3][corners] / 65535
                shade = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
                np.testing.assert_array_equal(np.round(255 * shade), truth["vertices"]["rgb"][source])

    def test_by_trimesh(self):
        trimesh = reader("trimesh")
        for scene in SCENES[:3]:
            glb, truth = trimesh.load(file_of(scene, "mesh.glb"), process=False), truth_of(scene)
            owner = object_of_triangle(truth)
            for node in glb.graph.nodes_geometry:
                number = 0 if node == "background" else int(node.split()[-1])
                transform, name = glb.graph[node]
                mesh, mine = glb.geometry[name], np.flatnonzero(owner == number)
                np.testing.assert_array_equal(mesh.triangles, positions_of(truth, mine))
                np.testing.assert_array_equal(mesh.vertex_attributes["_CLASS"].reshape(-1)[mesh.faces],
                                              truth["vertices"]["label"][truth["triangles"][mine]])
                # The way up has become +Y.
                heights = positions_of(truth, mine) @ truth["up_world"] / np.linalg.norm(truth["up_world"])
                turned = trimesh.transform_points(mesh.vertices, transform)[:, 1][mesh.faces]
                np.testing.assert_allclose(turned, heights, atol=1e-5)

    def test_by_assimp(self):
        tool("assimp")
        for scene in SCENES[:3]:
            info = run("assimp", "info", file_of(scene, "mesh.glb"))
            self.assertRegex(info, rf"Faces: +{len(truth_of(scene)['triangles'])}\n")
            self.assertRegex(info, r"Meshes: +3\n")
            self.assertRegex(info, r"Nodes: +5\n")


class GltfValidator(Case):
    def test_khronos_validator_finds_no_fault(self):
        tool("node")
        modules = pathlib.Path(sys.prefix, "gltf-validator", "node_modules")
        environment = os.environ | {"NODE_PATH": f"{modules}:{os.environ.get('NODE_PATH', '')}"}
        program = ("const v = require('gltf-validator'), fs = require('fs');"
                   "v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))"
                   ".then(r => console.log(JSON.stringify(r)));")
        if subprocess.run(["node", "-e", "require('gltf-validator')"], env=environment,
                          capture_output=True, check=False).returncode:
            raise unittest.SkipTest("no gltf-validator")
        for scene in SCENES:
            report = json.loads(run("node", "-e", program, file_of(scene, "mesh.glb"), env=environment))
            self.assertEqual((report["issues"]["numErrors"], report["issues"]["numWarnings"]), (0, 0),
                             report["issues"])
            self.assertEqual(report["info"]["totalTriangleCount"], len(truth_of(scene)["triangles"]))


class Octomap(Case):
    def states(self, tree, size):
        """Index to state of every cell; leaves that were pruned are cut into theirs."""
        cells = {}
        for leaf in tree.begin_leafs():
            state = OCCUPIED if tree.isNodeOccupied(leaf) else FREE
            side = round(leaf.getSize() / size)
            low = np.round(np.array(leaf.getCoordinate()) / size - side / 2).astype(int)
            for offset in np.ndindex(side, side, side):
                cells[tuple(low + offset)] = state
        return cells

    def test_by_pyoctomap(self):
        pyoctomap = reader("pyoctomap")
        colours = {entry["label"]: tuple(entry["colour"]) for entry in
                   json.loads(pathlib.Path(file_of("level", "labels.json")).read_text("utf-8"))["labels"]}
        for scene in SCENES[:3]:
            truth = truth_of(scene)
            cells = truth["cells"]
            states = dict(zip(map(tuple, cells["xyz"].astype(int)), cells["state"]))
            plain = pyoctomap.OcTree(truth["cell_m"])
            self.assertTrue(plain.readBinary(file_of(scene, "space.bt")))
            self.assertEqual(self.states(plain, truth["cell_m"]), states)
            coloured = pyoctomap.ColorOcTree(truth["cell_m"]).read(file_of(scene, "space.ot"))
            self.assertAlmostEqual(coloured.getResolution(), truth["cell_m"])
            self.assertEqual(coloured.getNumLeafNodes(), len(states))
            for i in range(0, len(states), 7):
                centre = (cells["xyz"][i] + 0.5) * truth["cell_m"]
                node = coloured.search(centre)
                self.assertAlmostEqual(node.getLogOdds(), cells["log_odds"][i], places=6)
                if cells["state"][i] == OCCUPIED:
                    self.assertEqual(tuple(node.getColor()), colours[cells["label"][i]])

    def test_by_octomap_tools(self):
        for name in ("convert_octree", "bt2vrml"):
            tool(name)
        for scene in SCENES[:3]:
            truth = truth_of(scene)
            with tempfile.TemporaryDirectory() as folder:
                binary, full = str(pathlib.Path(folder, "a.bt")), str(pathlib.Path(folder, "a.ot"))
                # From full to binary, and from there to full and back: the same tree.
                run("convert_octree", file_of(scene, "space.ot"), binary)
                run("convert_octree", file_of(scene, "space.bt"), full)
                again = str(pathlib.Path(folder, "b.bt"))
                run("convert_octree", full, again)
                data = {path: pathlib.Path(path).read_bytes().partition(b"\ndata\n")[2]
                        for path in (binary, again, file_of(scene, "space.bt"))}
                self.assertEqual(len(set(data.values())), 1)
                shutil.copy(file_of(scene, "space.bt"), binary)
                run("bt2vrml", binary)
                boxes = pathlib.Path(binary + ".wrl").read_text("utf-8").count("Shape {")
                occupied = np.count_nonzero(truth["cells"]["state"] == OCCUPIED)
                self.assertTrue(0 < boxes <= occupied, (boxes, occupied))

    def test_an_empty_tree_opens(self):
        pyoctomap = reader("pyoctomap")
        tree = pyoctomap.OcTree(0.1)
        self.assertTrue(tree.readBinary(file_of("empty", "space.bt")))
        self.assertEqual(tree.size(), 0)


class Voxels(Case):
    ARRAYS = ("cell_m", "index", "state", "log_odds", "colour", "label", "instance", "prob",
              "label_ids", "label_names")

    def assert_voxels(self, voxels, scene):
        truth = truth_of(scene)
        self.assertEqual(set(voxels), set(self.ARRAYS))
        self.assertEqual(voxels["cell_m"], truth["cell_m"])
        np.testing.assert_array_equal(voxels["index"], truth["cells"]["xyz"])
        np.testing.assert_array_equal(voxels["colour"], truth["cells"]["rgb"])
        self.assert_table(voxels, truth["cells"], ("state", "log_odds", "label", "instance", "prob"))
        names = dict(zip(voxels["label_ids"], voxels["label_names"]))
        self.assertEqual([names[label] for label in (0, CHAIR, FLOOR, CEILING, 255)],
                         ["person", "chair", "floor", "ceiling", "unknown"])

    def test_by_numpy(self):
        for scene in SCENES:
            with np.load(file_of(scene, "voxels.npz")) as voxels:
                self.assert_voxels(dict(voxels), scene)

    def test_by_their_headers(self):
        for scene in SCENES:
            voxels = {}
            with zipfile.ZipFile(file_of(scene, "voxels.npz")) as packed:
                self.assertIsNone(packed.testzip())
                for name in packed.namelist():
                    data = packed.read(name)
                    magic, length = struct.unpack("<8sH", data[:10])
                    self.assertEqual(magic, b"\x93NUMPY\x01\0")
                    header = yaml.safe_load(data[10:10 + length].decode().replace("(", "[")
                                            .replace(")", "]").replace(",]", "]"))
                    array = np.frombuffer(data[10 + length:], header["descr"])
                    voxels[name.removesuffix(".npy")] = array.reshape(header["shape"])
            self.assert_voxels(voxels, scene)


def map_server_cells(shades, settings):
    """nav2's map_io in trinary mode: -1 unknown, 0 free, 100 occupied; row 0 is the lowest y."""
    dark = shades / 255 if settings["negate"] else 1 - shades / 255
    cells = np.full(shades.shape, -1)
    cells[dark > settings["occupied_thresh"]] = 100
    cells[dark < settings["free_thresh"]] = 0
    return cells[::-1]


def read_pgm(path):
    """A second reader, after the format's description; ours has no comments."""
    kind, size, most, pixels = pathlib.Path(path).read_bytes().split(b"\n", 3)
    assert (kind, most) == (b"P5", b"255")
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width)


class Grid(Case):
    def load(self, scene):
        settings = yaml.safe_load(pathlib.Path(file_of(scene, "grid.yaml")).read_text("utf-8"))
        path = file_of(scene, settings["image"])
        with Image.open(path) as image:
            shades = np.array(image)
        np.testing.assert_array_equal(shades, read_pgm(path))
        return settings, map_server_cells(shades, settings)

    def test_the_thresholds_are_map_servers(self):
        settings, _ = self.load("level")
        found = map_server_cells(np.array([[89, 90, 205, 206]]), settings)
        self.assertEqual(found.tolist(), [[100, -1, -1, 0]])
        self.assertEqual((settings["mode"], settings["negate"]), ("trinary", 0))

    def test_every_known_place_is_where_the_scene_has_it(self):
        for scene in SCENES[:3]:
            settings, grid = self.load(scene)
            truth = truth_of(scene)
            pose = settings["world_from_map"]
            rotation = quaternion_matrix(pose["rotation_xyzw"])
            up = np.array(truth["up_world"]) / np.linalg.norm(truth["up_world"])
            np.testing.assert_allclose(rotation[:, 2], up, atol=1e-6)
            cells, size = truth["cells"], truth["cell_m"]
            self.assertAlmostEqual(settings["resolution"], size)
            p_map = ((cells["xyz"] + 0.5) * size - pose["translation_m"]) @ rotation
            places = np.floor((p_map[:, :2] - settings["origin"][:2]) / size + 1e-6).astype(int)
            height = p_map[:, 2]
            occupied, label = cells["state"] == OCCUPIED, cells["label"]
            obstacle = occupied & (height > 0.11) & (height < 1.49) & (label != CEILING) & \
                ~((label == FLOOR) & (height < 0.3))
            self.assertGreater(np.count_nonzero(obstacle), 100)
            rows, columns = places[obstacle].T[::-1]
            self.assertTrue((grid[rows, columns] == 100).all(), scene)
            if scene == "tilted":
                continue  # cells stand askew to pixels
            told = collections.defaultdict(lambda: -1)
            for place in map(tuple, places[(cells["state"] == FREE) & (abs(height) < 0.3)]):
                told[place] = 0
            for place in map(tuple, places[occupied & (abs(height) < 0.1)]):
                told[place] = 0
            for place in map(tuple, places[obstacle]):
                told[place] = 100
            expected = [[told[column, row] for column in range(grid.shape[1])]
                        for row in range(grid.shape[0])]
            np.testing.assert_array_equal(grid, expected)

    def test_an_empty_scene_is_one_unknown_pixel(self):
        self.assertEqual(self.load("empty")[1].tolist(), [[-1]])


class Objects(Case):
    def test_boxes_and_states(self):
        for scene in SCENES:
            path, truth = pathlib.Path(file_of(scene, "objects.json")), truth_of(scene)
            found = json.loads(path.read_text("utf-8"))
            self.assertEqual(found, yaml.safe_load(path.read_text("utf-8")), "JSON is YAML, too")
            floor = quaternion_matrix(found["world_from_floor"]["rotation_xyzw"])
            np.testing.assert_allclose(floor[:, 2], found["up_world"], atol=1e-5)
            self.assertEqual(len(found["objects"]), len(truth["objects"]))
            for entry, thing in zip(found["objects"], truth["objects"]):
                for field in ("id", "label", "state"):
                    self.assertEqual(entry[field], thing[field])
                box = entry["box"]
                np.testing.assert_allclose(box["centre_m"], thing["centre_m"], atol=1e-6)
                np.testing.assert_allclose(box["size_m"], thing["size_m"], atol=1e-6)
                axes = quaternion_matrix(box["rotation_xyzw"])
                np.testing.assert_allclose(axes.T, thing["axes"], atol=1e-5)
                ahead = floor.T @ axes[:, 0]
                self.assertAlmostEqual(np.arctan2(ahead[1], ahead[0]), box["yaw_rad"], places=5)

    def test_labels_have_names_and_colours_of_their_own(self):
        path = pathlib.Path(file_of("empty", "labels.json"))
        labels = json.loads(path.read_text("utf-8"))["labels"]
        self.assertEqual(len(labels), 84)
        for field in ("label", "name", "colour"):
            self.assertEqual(len({str(entry[field]) for entry in labels}), 84, field)


if __name__ == "__main__":
    position = sys.argv.index("--samples")
    SAMPLES_BINARY = sys.argv[position + 1]
    del sys.argv[position:position + 2]
    unittest.main(verbosity=2)
