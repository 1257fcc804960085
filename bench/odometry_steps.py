#!/usr/bin/env python3
"""Whether the odometry pose jumps where the map is corrected.

    ygslam simulate corridor_loop --out SEQ
    ygslam run SEQ --out OUT --mcap RUN.mcap --realtime --dynamic off --segmenter none
    .venv/bin/python bench/odometry_steps.py SEQ OUT RUN.mcap

A step is the way from one frame to the next. Told is by how much a step of the odometry pose
(T_odom_camera, as a robot gets it) differs from the true one: at frames in which the world pose was
corrected by --corrected metres or more, and at all others.
"""
import argparse
from pathlib import Path

import numpy as np
from mcap_ros2.reader import read_ros2_messages

from rendered_seeds import micros, read_table, read_tum


def odometry(file):
    """Place of the camera in odom by stamp [us]."""
    places = {}
    for message in read_ros2_messages(str(file), topics=["/odometry"]):
        stamp, at = message.ros_msg.header.stamp, message.ros_msg.pose.pose.position
        places[stamp.sec * 10**6 + round(stamp.nanosec / 1e3)] = np.array([at.x, at.y, at.z])
    return places


def steps_m(places):
    """Of frames that follow each other: stamp of the second, length."""
    stamps = sorted(places)
    return {b: float(np.linalg.norm(places[b] - places[a])) for a, b in zip(stamps, stamps[1:])}


def extra_steps_m(odom, truth):
    """Only where both have the same two frames."""
    both = sorted(set(odom) & set(truth))
    mine = steps_m({s: odom[s] for s in both})
    true = steps_m({s: truth[s] for s in both})
    return {s: abs(mine[s] - true[s]) for s in mine}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("mcap", type=Path)
    parser.add_argument("--corrected", type=float, default=0.01)
    options = parser.parse_args()
    truth = {s: p[:3] for s, p in read_tum(options.sequence / "groundtruth.txt").items()}
    correction_m = {micros(row["stamp"]): float(row["correction_m"])
                    for row in read_table(options.out / "frames.csv")}
    extra = extra_steps_m(odometry(options.mcap), truth)
    corrected = [s for s in extra if correction_m[s] >= options.corrected]
    others = [1000 * extra[s] for s in extra if correction_m[s] < options.corrected]
    print(f"{len(corrected)} frames corrected by {1000 * options.corrected:.0f} mm or more")
    for stamp in corrected:
        print(f"  {1e-6 * stamp:.3f} s: the world pose by {1000 * correction_m[stamp]:.1f} mm, "
              f"step of odometry off by {1000 * extra[stamp]:.2f} mm")
    print(f"{len(others)} other steps off by [mm]: median {np.median(others):.2f}, "
          f"99 % {np.percentile(others, 99):.2f}, at most {max(others):.2f}")


if __name__ == "__main__":
    main()
