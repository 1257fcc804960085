"""`ygslam eval --tracks` against TrackEval (used as a library): the same HOTA, IDF1 and CLEAR figures.

    python tests/tracking_against_trackeval_test.py --ygslam build/release/ygslam

Random tracks: several things that come and go, boxes off by some pixels, misses, false alarms,
identities that swap or break. TrackEval is the reference implementation of MOTChallenge.
"""
import argparse
import contextlib
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

with contextlib.redirect_stdout(io.StringIO()):  # it tells of data sets that it cannot read
    from trackeval.metrics import CLEAR, HOTA, Identity

BINARY = None
TOLERANCE = 1e-9


def random_tracks(rng, frames, things):
    """Boxes (frame, id, left, top, width, height) of truth and of a tracker."""
    truth, tracked, new_id = [], [], 100
    place = rng.uniform(0, 300, (things, 2))
    speed = rng.normal(0, 3, (things, 2))
    size = rng.uniform(20, 80, (things, 2))
    begin = rng.integers(0, max(1, frames // 3), things)
    end = rng.integers(frames // 2, frames + 1, things)
    name = {thing: thing + 10 for thing in range(things)}
    noise = rng.uniform(0, 8)
    for frame in range(frames):
        place += speed
        if things > 1 and rng.random() < 0.05:
            a, b = rng.choice(things, 2, replace=False)
            name[a], name[b] = name[b], name[a]
        for thing in range(things):
            if not begin[thing] <= frame < end[thing] or rng.random() < 0.03:
                continue
            truth.append((frame + 1, thing + 1, *place[thing], *size[thing]))
            if rng.random() < 0.03:
                new_id += 1
                name[thing] = new_id
            if rng.random() < 0.9:
                left, top = place[thing] + rng.normal(0, noise, 2)
                tracked.append((frame + 1, name[thing], left, top,
                                *np.maximum(5, size[thing] + rng.normal(0, noise, 2))))
        if rng.random() < 0.1:
            tracked.append((frame + 1, 5000 + rng.integers(3), *rng.uniform(0, 300, 2), 40, 40))
    return truth, tracked


def mot(rows):
    return "".join(f"{row[0]},{row[1]},{row[2]:.2f},{row[3]:.2f},{row[4]:.2f},{row[5]:.2f},1,-1,-1,-1\n"
                   for row in rows)


def as_written(rows):
    """What the file says, numbers rounded as in it."""
    return [(row[0], row[1], *(float(f"{v:.2f}") for v in row[2:])) for row in rows]


def iou(a, b):
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(0.0, width) * max(0.0, height)
    return both / (a[2] * a[3] + b[2] * b[3] - both)


def trackeval_data(truth, tracked):
    """The tables that TrackEval's metrics take."""
    data = {"gt_ids": [], "tracker_ids": [], "similarity_scores": []}
    names = [{name: k for k, name in enumerate(sorted({row[1] for row in rows}))}
             for rows in (truth, tracked)]
    frames = max((row[0] for row in truth + tracked), default=0)
    for frame in range(1, frames + 1):
        here = [[row for row in rows if row[0] == frame] for rows in (truth, tracked)]
        data["gt_ids"].append(np.array([names[0][row[1]] for row in here[0]], dtype=int))
        data["tracker_ids"].append(np.array([names[1][row[1]] for row in here[1]], dtype=int))
        data["similarity_scores"].append(
            np.array([[iou(a[2:], b[2:]) for b in here[1]] for a in here[0]])
            .reshape(len(here[0]), len(here[1])))
    return {**data, "num_gt_ids": len(names[0]), "num_tracker_ids": len(names[1]),
            "num_gt_dets": len(truth), "num_tracker_dets": len(tracked), "num_timesteps": frames}


def trackeval_numbers(truth, tracked):
    data = trackeval_data(truth, tracked)
    quiet = {"PRINT_CONFIG": False}
    hota = HOTA().eval_sequence(data)
    identity = Identity(quiet).eval_sequence(data)
    clear = CLEAR(quiet).eval_sequence(data)
    return {"hota": np.mean(hota["HOTA"]), "det_a": np.mean(hota["DetA"]),
            "ass_a": np.mean(hota["AssA"]), "idf1": identity["IDF1"],
            "id_precision": identity["IDP"], "id_recall": identity["IDR"], "mota": clear["MOTA"],
            "found": clear["CLR_TP"], "missed": clear["CLR_FN"], "false_alarms": clear["CLR_FP"],
            "id_switches": clear["IDSW"]}


class Tracks(unittest.TestCase):
    def evaluated(self, truth, tracked):
        with tempfile.TemporaryDirectory() as folder:
            files = [pathlib.Path(folder, name) for name in ("truth.txt", "tracks.txt")]
            for file, rows in zip(files, (truth, tracked)):
                file.write_text(mot(rows), encoding="utf-8")
            done = subprocess.run([BINARY, "eval", "--tracks", "--json", "--gt", files[0], "--est",
                                   files[1]], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_random_tracks_get_the_same_figures(self):
        switches = 0
        for seed in range(40):
            rng = np.random.default_rng(seed)
            truth, tracked = random_tracks(rng, int(rng.integers(5, 120)), int(rng.integers(1, 7)))
            with self.subTest(seed=seed):
                ours = self.evaluated(truth, tracked)
                wanted = trackeval_numbers(as_written(truth), as_written(tracked))
                for key, value in wanted.items():
                    self.assertAlmostEqual(ours[key], value, delta=TOLERANCE, msg=key)
                switches += ours["id_switches"]
        self.assertGreater(switches, 100)  # the cases are hard enough to tell anything

    def test_nothing_tracked(self):
        truth, _ = random_tracks(np.random.default_rng(1), 20, 2)
        ours = self.evaluated(truth, [])
        self.assertEqual((ours["hota"], ours["idf1"], ours["missed"]), (0, 0, len(truth)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ygslam", required=True)
    options, rest = parser.parse_known_args()
    BINARY = options.ygslam
    unittest.main(argv=[sys.argv[0], *rest])
