"""Clouds and meshes of a scene, each opened by programs of others, against what lay in memory.

    python tests/scene_file_test.py --samples build/release/src/scene_file/write_sample_scenes
"""
import json
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np

import scene_samples
from scene_samples import (FIELDS, SCENES, Case, file_of, quaternion_matrix, reader, run, tool,
                           truth_of)

setUpModule, tearDownModule = scene_samples.write_samples, scene_samples.remove_samples


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


if __name__ == "__main__":
    scene_samples.main()
