"""MCAP streams: on standard input and through a Unix socket, written by the library of others.

    python tests/pipe_test.py
"""
import asyncio
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import numpy as np
from mcap.reader import NonSeekingReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import get_types_from_msg

from bag_test import FRAMES, RESULTS, BagTest
from bags import DEPTH, INFO, RGB, STORE, write_mcap
from view_test import Client
from ygslam_cli import BINARY, HANG_S, ROOT, CliTest, trajectory, ygslam

CAMERA = os.environ.get("YGSLAM_CAMERA_STREAM",
                        str(ROOT / "build" / "release" / "tests" / "camera_stream"))

PERIOD_S = 1 / 30


def records(data):
    """(opcode, bytes) of each record after the magic."""
    at = 8
    while at < len(data) - 8:
        length = int.from_bytes(data[at + 1:at + 9], "little")
        yield data[at], data[at:at + 9 + length]
        at += 9 + length


def is_colour(opcode, record):
    return opcode == 5 and b"rgb8" in record[:200]


def place_of_frame(data, number):
    """Where the record of a colour image begins."""
    at, frames = 8, 0
    for opcode, record in records(data):
        frames += is_colour(opcode, record)
        if frames > number:
            return at
        at += len(record)
    raise AssertionError("no such frame")


# A loaded machine drops many frames.
HOWEVER_LATE = ("--set", "run.max_lost_share=1")


class Pipe(BagTest):
    def mcap(self, name="run.mcap", compression="zstd", said=None, **how):
        return write_mcap(self.folder / name, said or self.said(), compression, **how)

    def start(self, *options, out="out", source="-", stdin=subprocess.PIPE):
        """`ygslam run -`, running."""
        if "--realtime" not in options:
            options += ("--deterministic",)
        return subprocess.Popen(
            [BINARY, "run", source, "--out", self.folder / out, "--dynamic", "geometry",
             *map(str, options)], stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=False)

    def finish(self, process, data=b""):
        stdout, stderr = process.communicate(data, timeout=HANG_S)
        return subprocess.CompletedProcess(process.args, process.returncode,
                                           stdout.decode(), stderr.decode(errors="replace"))

    def piped(self, data, *options, out="out"):
        return self.finish(self.start(*options, out=out), data)

    def test_a_file_on_standard_input_is_not_replaced(self):
        file = self.mcap()
        before = file.read_bytes()
        with open(file, "rb") as data:
            done = self.finish(self.start("--mcap", file, stdin=data), None)
        self.assert_error(done, 2, file, "the recording that is read")
        self.assertEqual(file.read_bytes(), before)
        self.assertFalse((self.folder / "out").exists())

    def test_file_and_pipe_give_the_same_bytes(self):
        for rgb, depth, compression, how in (
                ("rgb8", "16UC1", "zstd", {}), ("png", "compressedDepth", "lz4", {}),
                ("bgra8", "32FC1", "", {"use_chunking": False, "use_statistics": False})):
            with self.subTest(rgb=rgb, compression=compression):
                bag = self.mcap("bag", compression, self.said(rgb=rgb, depth=depth), **how)
                self.run_bag(bag, out="folder")
                done = subprocess.run(
                    ["/bin/bash", "-c", 'set -o pipefail; cat "$0" | "$1" run - --out "$2" '
                     "--deterministic --dynamic geometry", bag, BINARY, self.folder / "piped"],
                    check=False, capture_output=True, text=True, timeout=HANG_S)
                self.assert_ran(done)
                self.assert_same("piped")
                self.assertEqual(self.metrics("piped")["frames"], FRAMES)
                self.assertEqual(self.metrics("piped")["dropped"], 0)

    def test_from_to_and_stride_are_those_of_a_file(self):
        bag = self.mcap()
        for options in (("--from", "2", "--to", "11", "--stride", "3"), ("--to", "6")):
            self.run_bag(bag, *options, out="folder")
            self.assert_ran(self.piped(bag.read_bytes(), *options, out="piped"))
            self.assert_same("piped")

    def test_depth_that_comes_apart_from_colour_is_paired_alike(self):
        for shift_ms in (-14, 9, 17):
            said = list(self.said())
            for topic, _, message in said:
                if topic == DEPTH:
                    ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
                    ns += shift_ms * 10**6
                    message.header.stamp.sec, message.header.stamp.nanosec = divmod(ns, 10**9)
            bag = self.mcap(said=said[:20] + said[21:])  # and a colour image without any
            self.run_bag(bag, out="folder")
            self.assert_ran(self.piped(bag.read_bytes(), out="piped"))
            self.assert_same("piped")

    def test_through_a_unix_socket(self):
        bag = self.mcap()
        self.run_bag(bag, out="folder")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "camera"
            done = ygslam("run", f"unix:{path}", "--out", self.folder / "x")
            self.assert_error(done, 4, f"unix:{path}", "No such file", out="x")
            with socket.socket(socket.AF_UNIX) as server:
                server.bind(str(path))
                server.listen(1)
                process = self.start(source=f"unix:{path}", stdin=subprocess.DEVNULL)
                connection, _ = server.accept()
                with connection:
                    connection.sendall(bag.read_bytes())
                self.assert_ran(self.finish(process, None))
        self.assert_same("out")

    def test_a_camera_in_real_time(self):
        """Frames as they come, a stall that is told, then the end."""
        data = self.mcap("plain.mcap", "", use_chunking=False).read_bytes()
        process = self.start("--realtime", "--view", "0", "-v")
        process.stdin.write(data[:8])
        shown = 0
        for opcode, record in records(data):
            process.stdin.write(record)
            process.stdin.flush()
            if is_colour(opcode, record):
                shown += 1
                time.sleep(2.6 if shown == 10 else PERIOD_S)
        process.stdin.write(data[-8:])
        done = self.finish(process, b"")
        self.assertIn(done.returncode, (0, 7), done.stderr)  # a loaded machine drops many
        metrics = self.metrics()
        self.assertEqual(metrics["frames"], FRAMES)
        self.assertEqual(metrics["readable"], FRAMES)
        self.assertLess(metrics["dropped"], FRAMES - 4)
        self.assertRegex(self.log(), r"standard input: nothing has come for 2 s; waiting")
        self.assertRegex(self.log(), r"standard input: goes on after 2\.\d s")

    def test_more_than_can_be_done_is_dropped_and_counted(self):
        data = self.mcap("plain.mcap", "", use_chunking=False).read_bytes()
        done = self.piped(data, "--realtime")
        self.assertIn(done.returncode, (0, 7), done.stderr)
        metrics = self.metrics()
        self.assertEqual(metrics["readable"], FRAMES)
        self.assertGreater(metrics["dropped"], 0)
        told = (f"{FRAMES} frames, {metrics['dropped']} dropped (too late), "
                f"{100 * metrics['coverage']:.1f} % tracked")
        self.assertTrue(done.stdout.startswith(told), done.stdout)
        self.assertIn(told, self.log())

    def test_one_that_breaks_off_ends_with_what_there_is(self):
        data = self.mcap("plain.mcap", "", use_chunking=False).read_bytes()
        whole = self.mcap("chunks.mcap").read_bytes()
        for name, part, words in (("cut", data[:len(data) * 2 // 3], "ends early after"),
                                  ("chunk", whole[:len(whole) * 2 // 3], "ends early after"),
                                  ("noise", data[:place_of_frame(data, 9)] + b"\x77" * 4000,
                                   "is damaged after")):
            with self.subTest(name=name):
                done = self.piped(part, out=name)
                self.assert_ran(done)
                self.assertEqual(done.stderr.count("standard input"), 1, done.stderr)
                self.assertIn(words, done.stderr)
                frames = self.metrics(name)["frames"]
                self.assertGreater(frames, 4)
                self.assertLess(frames, FRAMES)

    def test_a_damaged_chunk_is_left_out(self):
        data = bytearray(self.mcap().read_bytes())
        data[len(data) // 2] ^= 0x55
        done = self.piped(bytes(data))
        self.assert_ran(done)
        self.assertIn("are left out, the first:", done.stderr)
        self.assertLess(self.metrics()["frames"], FRAMES)

    def test_what_is_no_stream_is_refused(self):
        start = self.mcap().read_bytes()
        for name, data, code, part in (
                ("text", b"a diary of mine", 4, "begins with 'a diary ', is no MCAP stream"),
                ("nothing", b"", 4, "ended before the first byte"),
                ("short", start[:5], 4, "is no MCAP stream"),
                ("ros1", b"#ROSBAG V2.0\n" + bytes(99), 4, "give it as a file"),
                ("magic", start[:8], 4, "no topic with colour images"),
                ("colour", self.mcap("c", said=[m for m in self.said() if m[0] != DEPTH])
                 .read_bytes(), 4, "no topic with depth images")):
            with self.subTest(name=name):
                done = self.piped(data, out="x")
                self.assert_error(done, code, "standard input", part, out="x")
        no_camera = self.mcap("n", said=[m for m in self.said() if m[0] != INFO]).read_bytes()
        self.assert_error(self.piped(no_camera, out="x"), 3, "no CameraInfo", "--camera", out="x")
        far = list(self.said())
        for topic, _, message in far:
            if topic == DEPTH:
                message.header.stamp.sec += 5
        self.assert_error(self.piped(self.mcap("f", said=far).read_bytes(), out="x"), 4,
                          "has a depth image within 20 ms", out="x")

    def test_which_topics_is_guessed_or_asked(self):
        def others(first):
            both = sorted([*self.said(), *self.said(rgb_topic="/other/image",
                                                    depth_topic="/other/depth", info_topic=None)],
                          key=lambda said: said[1])
            return both if first else [*self.said(), *self.said(rgb_topic="/other/image",
                                                                info_topic=None)]
        data = self.mcap(said=others(True)).read_bytes()
        self.assert_error(self.piped(data, out="x"), 4, RGB, "/other/image", "--rgb-topic", out="x")
        self.assert_ran(self.piped(data, "--rgb-topic", RGB, "--depth-topic", "/other/depth"))
        self.assertEqual(self.metrics()["frames"], FRAMES)
        done = self.piped(self.mcap(said=others(False)).read_bytes())
        self.assert_ran(done)
        self.assertIn("/other/image came later and are not used", done.stderr)

    def test_it_ends_when_it_is_interrupted_while_nothing_comes(self):
        data = self.mcap("plain.mcap", "", use_chunking=False).read_bytes()
        process = self.start("--realtime")
        process.stdin.write(data[:place_of_frame(data, 8)])
        process.stdin.flush()
        self.wait_for(lambda: len(list((self.folder / "out").glob("log.txt"))) == 1)
        time.sleep(1)
        began = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(timeout=HANG_S)
        self.assertLess(time.monotonic() - began, 20)
        done = self.finish(process, None)
        self.assertEqual(done.returncode, 130, done.stderr)
        self.assertNotIn("ends early", done.stderr)
        self.assertGreater(self.metrics()["readable"], 4)
        # and before the first byte
        process = self.start(out="none")
        time.sleep(0.5)
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=HANG_S)
        self.assertEqual(self.finish(process, None).returncode, 143)
        self.assertFalse((self.folder / "none").exists())

    def test_the_page_stops_it_while_nothing_comes(self):
        async def stop(port, token):
            client = await Client.connect(port, token)
            return await client.call("stop")
        data = self.mcap("plain.mcap", "", use_chunking=False).read_bytes()
        process = self.start("--realtime", "--view", "0", *HOWEVER_LATE)
        process.stdin.write(data[:place_of_frame(data, 8)])
        process.stdin.flush()
        address = None
        while not address:
            line = process.stderr.readline().decode()
            self.assertTrue(line, "no address was told")
            address = re.search(r"look at http://127\.0\.0\.1:(\d+)/#(\w+)", line)
        self.wait_for(lambda: (self.folder / "out" / "log.txt").exists())  # a frame has come
        self.assertTrue(asyncio.run(stop(int(address[1]), address[2]))[0])
        process.wait(timeout=HANG_S)
        self.assert_ran(self.finish(process, None))
        self.assertGreater(self.metrics()["readable"], 4)

    def wait_for(self, what):
        end = time.monotonic() + HANG_S
        while not what():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)

    def test_other_commands_and_options(self):
        bag = self.mcap()
        self.assert_ran(self.piped(bag.read_bytes(), "--save-map", self.folder / "room.map"))
        done = subprocess.run(
            [BINARY, "localize", "-", "--map", self.folder / "room.map", "--out",
             self.folder / "again", "--dynamic", "geometry"], input=bag.read_bytes(), check=False,
            capture_output=True, timeout=HANG_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        for command in ("inspect", "calibrate"):
            self.assert_error(ygslam(command, "-", stdin=subprocess.DEVNULL), 2,
                              "streams are for run and localize only", out="x")
        done = ygslam("run", "-", "--out", self.folder / "x", "--background", self.folder / "b",
                      stdin=subprocess.DEVNULL)
        self.assert_error(done, 2, "--background", out="x")

    def test_a_long_stream_takes_no_more_memory(self):
        """Four times the bytes, hardly more memory: a camera that stands still makes no map."""
        peaks = []
        for frames in (40, 160):
            said = []
            for i in range(frames):
                for topic, _, message in list(self.said())[:3]:
                    message.header.stamp.sec, message.header.stamp.nanosec = divmod(
                        (1000 * 30 + i) * 10**9 // 30, 10**9)
                    said.append((topic, (1000 * 30 + i) * 10**9 // 30, message))
            data = self.mcap(f"{frames}.mcap", "", said, use_chunking=False).read_bytes()
            # Not a child of this one, whose memory would count as its own.
            done = subprocess.run(
                ["/bin/bash", "-c", '"$0" run - --out "$1" --deterministic --dynamic geometry; '
                 "exit $?", BINARY, self.folder / f"out{frames}"], input=data, check=False,
                capture_output=True, timeout=HANG_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            peaks.append(self.metrics(f"out{frames}")["peak_rss_mb"])
        self.assertLess(peaks[1], peaks[0] + 10, "MB; the stream grew by 46")


class CameraStream(CliTest):
    """include/ygslam/camera_stream.hpp, by the example that uses it."""

    def recorded(self, seconds="0.5"):
        file = self.folder / "camera.mcap"
        with open(file, "wb") as out:
            subprocess.run([CAMERA, seconds], stdout=out, check=True, timeout=HANG_S)
        return file

    def test_it_is_what_others_read(self):
        file = self.recorded()
        with open(file, "rb") as data:
            reader = NonSeekingReader(data, validate_crcs=True, decoder_factories=[DecoderFactory()])
            said = {}
            for schema, channel, message, decoded in reader.iter_decoded_messages(
                    log_time_order=False):
                said.setdefault(channel.topic, []).append(decoded)
                stamp = decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec
                self.assertEqual(message.log_time, stamp)
                self.assertEqual(message.sequence, len(said[channel.topic]) - 1)
                # as ROS 2's own definitions have it
                STORE.deserialize_cdr(message.data, schema.name)
                _, fields = get_types_from_msg(schema.data.decode(), schema.name)[schema.name]
                self.assertEqual(fields, STORE.fielddefs[schema.name][1])
        infos, colours, depths = (said[f"/camera/{name}"] for name in (
            "color/camera_info", "color/image_raw", "aligned_depth_to_color/image_raw"))
        self.assertEqual((len(infos), len(colours), len(depths)), (15, 15, 15))
        self.assertEqual(list(infos[3].k), [525, 0, 319.5, 0, 525, 239.5, 0, 0, 1])
        self.assertEqual((infos[3].distortion_model, list(infos[3].d)), ("plumb_bob", [0] * 5))
        self.assertEqual((depths[3].encoding, depths[3].step, set(depths[3].data[0::2])),
                         ("16UC1", 1280, {2000 & 255}))
        frame = np.frombuffer(colours[3].data, np.uint8).reshape(480, 640, 3)
        first = np.frombuffer(colours[0].data, np.uint8).reshape(480, 640, 3)
        np.testing.assert_array_equal(frame[:, :-6], first[:, 6:])

    def test_what_it_sees_is_tracked_live_and_from_its_recording(self):
        done = subprocess.run(
            ["/bin/bash", "-c", 'set -o pipefail; "$0" 2 | tee "$2" | "$1" run - --out "$3" '
             "--realtime --dynamic geometry --view 0 --set run.max_lost_share=1", CAMERA, BINARY,
             self.folder / "room.mcap", self.folder / "out"], check=False, capture_output=True, text=True, timeout=HANG_S)
        self.assert_ran(done)
        metrics = self.metrics()
        self.assertEqual(metrics["readable"], 60)
        self.assertEqual(metrics["tracked"] + metrics["dropped"], 60)
        frames = dict(trajectory(self.folder / "out" / "trajectory.txt"))
        (first, _), (last, pose) = min(frames.items()), max(frames.items())
        # 2 px a frame at 525 px and 2 m: the wall goes left, so the camera goes right.
        way = 30 * (float(last) - float(first)) * 2 * 2.0 / 525
        self.assertAlmostEqual(pose[0], way, delta=0.1 * way)
        self.assert_ran(self.run_slam(self.folder / "room.mcap", out="file"))
        with open(self.folder / "room.mcap", "rb") as data:
            self.assert_ran(self.run_slam("-", out="pipe", stdin=data))
        for name in RESULTS:
            self.assertEqual((self.folder / "file" / name).read_bytes(),
                             (self.folder / "pipe" / name).read_bytes(), name)

    def test_it_says_when_nobody_reads_any_more(self):
        done = subprocess.run(
            ["/bin/bash", "-c", '(trap "" PIPE; "$0" 60; echo "ended with $?" >&2) | head -c 100 '
             ">/dev/null", CAMERA], check=False, capture_output=True, text=True, timeout=50)
        self.assertIn("ended with 1", done.stderr)


if __name__ == "__main__":
    unittest.main()
