"""A made-up result folder of `ygslam bench`, with known figures and every kind of fault."""
import json
import struct

from PIL import Image

TUM = "rgbd_dataset_freiburg3_walking_xyz"
HOSTILE = "own<script>alert(1)</script>_50%&$#{"
# ATE RMSE [m] of each run; the S.D. is made half of it, RPE twice and thrice, rotation in degrees.
ATE_M = {
    (TUM, "off"): [0.70, 0.60, 0.80], (TUM, "full"): [0.0140, 0.0110, 0.0120],
    ("walking_static", "off"): [0.020, 0.040, 0.030],
    ("walking_static", "full"): [0.004, None, 0.006],  # run 2 crashed
    ("rgbd_bonn_balloon", "off"): [0.30, 0.31, 0.32],
    ("rgbd_bonn_balloon", "full"): [0.025, 0.021, 0.023],  # run 1 was lost, with a figure
    ("own", "off"): [None, None, None], ("own", "full"): [None, None, None],  # nothing ran
}
STATUS = {("walking_static", "full", 2): "crashed", ("rgbd_bonn_balloon", "full", 1): "lost",
          **{("own", mode, n): "failed" for mode in ("off", "full") for n in (1, 2, 3)}}


def statistics_of(rmse):
    return {"rmse": rmse, "std": rmse / 2, "mean": rmse, "median": rmse, "min": 0, "max": rmse}


def metrics(rmse, coverage):
    def rpe(scale):
        return {"trans_m": statistics_of(scale * rmse),
                "rot_deg": statistics_of(10 * scale * rmse)}
    return {"coverage": coverage, "ate": statistics_of(rmse),
            "rpe": {"frames30": rpe(2), "sec1": rpe(3)}, "precision": "f32", "peak_rss_mb": 100,
            "timing_ms": {"track": {"mean": 7.5, "median": 7, "p95": 9, "max": 12},
                          "segment": None}, "cpu_ms": {"track": {"mean": 6}}, "startup_s": 0.5}


def write_poses(run, truth_file):
    """40 poses on a straight way, estimated 10 mm beside it but for the last pose."""
    tum, rows, truth = [], ["t_s,x_m,y_m,z_m,truth_x_m,truth_y_m,truth_z_m,ate_m,ate_deg,"
                            "rpe30_m,rpe30_deg,rpe1s_m,rpe1s_deg"], []
    for i in range(40):
        t, x, y = 100 + i / 30, 0.02 * i, 0.3 * (i / 40) ** 2
        side = 0.01 if i < 39 else 0
        tum.append(f"{t:.6f} {x} {y + side} 0 0 0 0 1")
        truth.append(f"{t:.6f} {x} {y} 0 0 0 0 1")
        rpe = f"{side},0.1,," if i < 10 else ",,,"
        rows.append(f"{t:.6f},{x},{y + side},0,{x},{y},0,{side},0.2,{rpe}")
    (run / "trajectory.txt").write_text("\n".join(tum) + "\n", encoding="utf-8")
    (run / "errors.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    truth_file.parent.mkdir(parents=True, exist_ok=True)
    truth_file.write_text("\n".join(truth) + "\n", encoding="utf-8")


def write_map(path):
    points = [(0.1 * i, 0.1 * j, 2.0, 200, 100, 10 * i) for i in range(9) for j in range(9)]
    names = [("float", c) for c in "xyz"] + [("uchar", c) for c in ("red", "green", "blue")]
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(points)}\n" + "".join(
        f"property {kind} {name}\n" for kind, name in names) + "end_header\n"
    path.write_bytes(header.encode() + b"".join(struct.pack("<fffBBB", *p) for p in points))


def write_results(root):
    modes, kinds = ["off", "full"], {TUM: "tum", "walking_static": "rendered",
                                     "rgbd_bonn_balloon": "bonn", "own": "folder"}
    rows = {TUM: "fr3_walking_xyz", "walking_static": "fr3_walking_static"}
    sequences = [{"id": name, "name": HOSTILE if name == "own" else name, "kind": kind,
                  "paper_row": rows.get(name), "frames": 827, "error": None,
                  "truth": {"duration_s": 28.5, "length_m": 5.8, "speed_mps": 0.2035,
                            "angular_speed_degps": 5.5}} for name, kind in kinds.items()]
    sequences.append({"id": "broken", "name": "broken", "kind": "folder", "paper_row": None,
                      "frames": None, "truth": None, "error": "associations.txt:3: no stamp"})
    for (name, mode), values in ATE_M.items():
        for number, value in enumerate(values, 1):
            run = root / "runs" / name / mode / f"{number:02d}"
            run.mkdir(parents=True)
            status = STATUS.get((name, mode, number), "ok")
            (run / "run.json").write_text(json.dumps({
                "format": 1, "status": status, "timings_valid": True,
                "error": None if status == "ok" else f"because of {status}"}), encoding="utf-8")
            if value is not None:
                (run / "metrics.json").write_text(json.dumps(
                    metrics(value, 0.4 if status == "lost" else 1.0)), encoding="utf-8")
            if name == TUM:
                write_poses(run, root / "sequences" / TUM / "groundtruth.txt")
                write_map(run / "map.ply")
    inspect = root / "sequences" / TUM / "inspect"
    inspect.mkdir()
    Image.new("RGB", (64, 48), (10, 200, 30)).save(inspect / "checks.png")
    (root / "sweep.json").write_text(json.dumps({
        "format": 1, "version": "1.2.3", "machine": "a machine", "started": "2026-01-01T00:00:00Z",
        "wall_s": 3723, "timings_valid": True, "modes": modes, "sequences": sequences,
        "options": {"modes": modes, "runs": 3, "jobs": 1, "way": "realtime", "seed": 7,
                    "segmenter": "model", "model": "net.onnx", "precision": "f32",
                    "config": {"orb.features": 900}}}), encoding="utf-8")
