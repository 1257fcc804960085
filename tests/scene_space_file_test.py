"""Space, ground plan and objects of a scene, opened by programs of others, against what lay in memory.

    python tests/scene_space_file_test.py --samples build/release/src/scene_file/write_sample_scenes
"""
import collections
import json
import pathlib
import shutil
import tempfile

import numpy as np
import yaml
from PIL import Image

import scene_samples
from scene_samples import (CEILING, CHAIR, FLOOR, FREE, OCCUPIED, SCENES, Case, file_of,
                           quaternion_matrix, reader, run, tool, truth_of)

setUpModule, tearDownModule = scene_samples.write_samples, scene_samples.remove_samples


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
    scene_samples.main()
