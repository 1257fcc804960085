#!/usr/bin/env python3
"""Memory of a run over a long stream with faults, as a robot's camera has them in a bad week.

A short rendered recording is played to and fro on standard input of `ygslam run -`. Now and then a
stamp is far off, a clock is set, images cannot be read, depth has holes or is missing, or the writer
is started again. With an IMU in the recording, its readings are played, too, to and fro; they stop, or their clock is
off for a while. Prints memory (RSS), kB a frame over the last half; code 1 above --max-growth.

  ygslam simulate walking_xyz --seconds 6 --size 160x120 --imu BMI085 --out soak --mcap soak.mcap
  python bench/soak_stream.py soak.mcap --ygslam build/release/ygslam --out soak_run --frames 100000 \
    --options "--imu-calibration soak/imu.yaml"
"""
import argparse
import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

STEP_NS = 10**9 // 30
SAMPLES = 40
MAGIC = b"\x89MCAP0\r\n"
TYPES = {"/camera/image/compressed": "sensor_msgs/msg/CompressedImage",
         "/camera/depth/image": "sensor_msgs/msg/Image",
         "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
         "/camera/depth/camera_info": "sensor_msgs/msg/CameraInfo"}
COLOUR, DEPTH = list(TYPES)[:2]
IMU = "/imu"
GYRO = slice(-192, -168)  # of a sensor_msgs/Imu: two covariances and the accelerometer's reading follow


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(word):
    return struct.pack("<I", len(word)) + word.encode()


def message(topic, stamp_ns, data):
    """The message with another stamp in its header."""
    seconds, ns = divmod(max(stamp_ns, 0), 10**9)
    channel = [*TYPES, IMU].index(topic) + 1
    head = struct.pack("<HIQQ", channel, 0, max(stamp_ns, 0), max(stamp_ns, 0))
    return record(5, head + data[:4] + struct.pack("<iI", seconds, ns) + data[12:])


def beginning():
    said = MAGIC + record(1, text("ros2") + text("soak"))
    for number, (topic, kind) in enumerate((TYPES | {IMU: "sensor_msgs/msg/Imu"}).items(), 1):
        said += record(3, struct.pack("<H", number) + text(kind) + text("ros2msg") + text(""))
        said += record(4, struct.pack("<HH", number, number) + text(topic) + text("cdr")
                       + struct.pack("<I", 0))
    return said


def end():
    return record(15, bytes(4)) + record(2, bytes(20)) + MAGIC


def recorded(file):
    """Topic to bytes, of each frame, and of each the IMU's readings since the one before: how long before it [ns], bytes."""
    frames, readings = {}, []
    with open(file, "rb") as data:
        for _, channel, said in make_reader(data).iter_messages():
            if channel.topic in TYPES:
                frames.setdefault(said.log_time, {})[channel.topic] = said.data
            elif channel.topic == IMU:
                seconds, ns = struct.unpack("<iI", said.data[4:12])
                readings.append((seconds * 10**9 + ns, said.data))
    stamps = sorted(frames)
    before = [[(now - t, data) for t, data in readings if last < t <= now]
              for last, now in zip(stamps, stamps[1:])]
    return [frames[stamp] for stamp in stamps], [[], *before]


class Faults:
    """What a stream suffers, by chance; how often is counted."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.counts, self.left = {}, {}

    def begins(self, name, chance):
        now = self.rng.random() < chance
        self.counts[name] = self.counts.get(name, 0) + now
        return now

    def lasts(self, name, chance, most):
        """@return whether it is on in this frame; it lasts up to `most` frames."""
        if self.left.get(name, 0) == 0 and self.begins(name, chance):
            self.left[name] = int(self.rng.integers(1, most + 1))
        self.left[name] = max(0, self.left.get(name, 0) - 1)
        return self.left[name] > 0

    def of_bytes(self, frame):
        """Colour cut off, depth with a hole, of another size, or missing."""
        frame = dict(frame)
        if self.lasts("colour cut off", 1 / 700, 90):
            frame[COLOUR] = frame[COLOUR][:len(frame[COLOUR]) // 2]
        if self.lasts("depth hole", 1 / 300, 60):
            depth = bytearray(frame[DEPTH])
            depth[len(depth) // 3:len(depth) // 3 * 2] = bytes(len(depth) // 3 * 2 - len(depth) // 3)
            frame[DEPTH] = bytes(depth)
        if self.lasts("depth cut off", 1 / 900, 30):
            frame[DEPTH] = frame[DEPTH][:-100]
        if self.lasts("no depth", 1 / 900, 120):
            del frame[DEPTH]
        if self.lasts("no colour", 1 / 2000, 60):
            del frame[COLOUR]
        return frame

    def of_stamp(self, stamp_ns):
        if self.begins("stamp far off", 1 / 100):
            stamp_ns += int(self.rng.integers(-900, 3600)) * 10**9
        if self.lasts("stamp repeated", 1 / 500, 20):
            stamp_ns -= stamp_ns % (64 * STEP_NS)
        return stamp_ns

    def of_clock(self):
        """By how much the clock is set now."""
        if self.begins("clock set", 1 / 2500):
            return int(self.rng.integers(-900, 1800)) * 10**9
        return 0

    def of_readings(self, readings):
        """None, or with another clock."""
        off_ns = 0.03 * 10**9 if self.lasts("IMU's clock off", 1 / 3000, 600) else 0
        return [] if self.lasts("IMU stopped", 1 / 1500, 90) else [(ns - int(off_ns), data) for ns, data in readings]

    def of_writer(self, said):
        """What comes in place of `said` where the writer ends and another one begins."""
        if self.begins("writer ended well", 1 / 4000):
            return end() + beginning() + said
        if self.begins("writer ended", 1 / 4000):
            return beginning() + said
        if self.begins("writer killed", 1 / 4000):
            return said[:int(self.rng.integers(1, len(said)))] + beginning() + said
        if self.begins("noise", 1 / 8000):
            return b"\x77" * 500 + beginning() + said
        return said


def backwards(readings):
    """As an IMU reads where time goes back: it turns the other way, forces are the same."""
    for before_ns, data in reversed(readings):
        turned = bytearray(data)
        turned[GYRO] = struct.pack("<3d", *(-rate for rate in struct.unpack("<3d", data[GYRO])))
        yield STEP_NS - before_ns, bytes(turned)


def to_and_fro(frames, readings):
    """Frames, each with the readings since the one before."""
    while True:
        yield from zip(frames, readings)
        yield from ((frames[i], list(backwards(readings[i + 1]))) for i in range(len(frames) - 2, 0, -1))
        readings = [list(backwards(readings[1])), *readings[1:]]


def rss_mb(pid):
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    sys.exit("the run has ended")


def play(frames, readings, count, faults, process):
    """Writes the stream. @return (frame, RSS in MB), many times."""
    out, memory = process.stdin, []
    stamp_ns = 1000 * 10**9
    out.write(beginning())
    for number, (frame, before) in zip(range(count), to_and_fro(frames, readings)):
        stamp_ns = max(10**9, stamp_ns + STEP_NS + faults.of_clock())
        its_ns = faults.of_stamp(stamp_ns)
        frame = faults.of_bytes(frame)
        for before_ns, data in faults.of_readings(before) if before else ():
            out.write(message(IMU, stamp_ns - before_ns, data))
        out.write(faults.of_writer(b"".join(message(t, its_ns, frame[t]) for t in frame)))
        if number % max(1, count // SAMPLES) == 0 or number == count - 1:
            memory.append((number, rss_mb(process.pid)))
            print(f"{number:8} {memory[-1][1]:8.1f}", flush=True)
    out.write(end())
    out.close()
    return memory


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", help="MCAP of `ygslam simulate`")
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--max-growth", type=float, default=0.1, help="[kB a frame]")
    parser.add_argument("--options", default="", help="more words for `ygslam run`")
    o = parser.parse_args()
    faults = Faults(o.seed)
    print("   frame   RSS MB")
    with subprocess.Popen([o.ygslam, "run", "-", "--out", o.out, "--dynamic", "geometry",
                           *o.options.split()], stdin=subprocess.PIPE) as process:
        memory = play(*recorded(o.recording), o.frames, faults, process)
    half = np.array(memory[len(memory) // 2:])
    growth_kb = 1024 * float(np.polyfit(half[:, 0], half[:, 1], 1)[0])
    metrics = json.loads((o.out / "metrics.json").read_text(encoding="utf-8"))
    print("faults: " + ", ".join(f"{name} {count}" for name, count in faults.counts.items()))
    print(", ".join(f"{key} {metrics[key]}" for key in (
        "frames", "readable", "tracked", "coverage", "left_out", "colour_without_depth",
        "skipped_image_count", "lost_interval_count", "keyframes", "landmarks", "peak_rss_mb")))
    for file in sorted(o.out.iterdir()):
        print(f"{file.name} {file.stat().st_size / 1e6:.2f} MB")
    print(f"code {process.returncode}; over the last half {growth_kb:+.3f} kB a frame")
    return int(process.returncode not in (0, 7) or growth_kb > o.max_growth)


if __name__ == "__main__":
    sys.exit(main())
