"""Bags that were damaged, or made to keep a reader busy: told in a line, in little time and memory.

    python tests/hostile_bags_test.py
"""
import bz2
import contextlib
import json
import random
import resource
import signal
import sqlite3
import struct
import subprocess
import time
import unittest

import numpy as np
import zstandard
from rosbags.rosbag2 import StoragePlugin

from bag_test import FRAMES, BagTest
from bags import RGB, STORE1, Messages, recording, write_mcap, write_ros1, write_ros2
from ygslam_cli import BINARY, HANG_S, HEIGHT, WIDTH

CHUNK_BYTES = 1 << 29  # the largest that is read


def mcap_text(text):
    return struct.pack("<I", len(text)) + text


def mcap_record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


class HostileBags(BagTest):
    def test_a_record_whose_kind_was_hit_does_not_end_the_bag_unseen(self):
        data = bytearray(write_mcap(self.folder / "a.mcap", self.said(), "").read_bytes())
        at, chunks = 8, 0
        while True:
            kind, length = struct.unpack_from("<BQ", data, at)
            chunks += kind == 6
            if chunks == 2:
                break
            at += 9 + length
        data[at] ^= 4  # a chunk says that it is the footer
        bag = self.folder / "hit.mcap"
        bag.write_bytes(data)
        self.assertIn("are left out, the first:", self.run_bag(bag).stderr)
        self.assertGreater(self.metrics()["frames"], FRAMES // 2)
        with open(bag, "rb") as stream:
            done = self.run_bag("-", out="piped", stdin=stream)
        self.assertIn("are left out, the first:", done.stderr)
        self.assert_same("piped", "out")

    def test_reading_through_a_bag_is_interrupted(self):
        """Many small chunks, each of which unpacks to much."""
        bag = self.folder / "long.mcap"
        zeros = zstandard.compress(bytes(1 << 26))
        chunk = mcap_record(6, struct.pack("<QQQI", 0, 0, 1 << 26, 0) + mcap_text(b"zstd")
                            + struct.pack("<Q", len(zeros)) + zeros)
        noise = mcap_record(0xF0, random.Random(1).randbytes(1 << 20))  # which nobody reads
        bag.write_bytes(b"\x89MCAP0\r\n" + (chunk + noise) * 60)
        process = subprocess.Popen([BINARY, "run", bag, "--out", self.folder / "out", "--dynamic",
                                    "geometry"], stderr=subprocess.PIPE, text=True)
        time.sleep(0.3)
        process.send_signal(signal.SIGTERM)
        began = time.monotonic()
        said = process.communicate(timeout=HANG_S)[1]
        self.assertLess(time.monotonic() - began, 20)
        # A quick machine has read it all by then.
        self.assertIn(process.returncode, (143, 4), said)
        self.assertFalse((self.folder / "out").exists())

    def test_zeros_that_were_never_written_are_not_searched(self):
        """A file of 2 TB, of which a few MB are on the disk."""
        bag = write_mcap(self.folder / "a.mcap", self.said())
        with open(bag, "rb+") as file:
            file.truncate(bag.stat().st_size * 2 // 3)
            file.truncate(2 << 40)
        self.assertIn("ends early", self.run_bag(bag, timeout=60).stderr)
        self.assertGreater(self.metrics()["frames"], FRAMES // 4)

    def test_zeros_after_a_bag_of_ros_1_are_not_searched(self):
        bag = write_ros1(self.folder / "a.bag", recording(Messages(STORE1), self.frames, self.camera))
        with open(bag, "rb+") as file:
            file.truncate(2 << 40)
        self.assertIn("ends early", self.run_bag(bag, timeout=60).stderr)
        self.assertEqual(self.metrics()["frames"], FRAMES)

    def test_a_topic_may_have_any_bytes_for_a_name(self):
        said = list(self.said())
        next(message for topic, _, message in said[30:] if topic == RGB).width = 7
        bag = write_mcap(self.folder / "a.mcap", said, "", use_chunking=False)
        bag.write_bytes(bag.read_bytes().replace(b"/camera/color", b"/\xff\xfemera/color"))
        self.run_bag(bag)
        (skipped,) = self.metrics()["skipped_images"]
        self.assertIn("mera/color", json.dumps(skipped))

    def test_few_bytes_that_unpack_to_many_fill_no_memory(self):
        """40 cameras of 40 MB of zeros each, in a file of 100 kB."""
        info = self.messages.info(1, self.camera, (WIDTH, HEIGHT), terms=np.zeros(5_000_000))
        said = ((f"/camera{i}/camera_info", i, info) for i in range(40))
        bag = write_mcap(self.folder / "bomb.mcap", said)
        self.assertLess(bag.stat().st_size, 1 << 20)

        def limit():
            resource.setrlimit(resource.RLIMIT_DATA, (1 << 30, 1 << 30))
        done = self.run_slam(bag, preexec_fn=limit)
        self.assert_error(done, 4, bag, "no topic with colour images")

    def test_a_file_that_unpacks_to_hundreds_of_gigabytes_is_read_to_a_gigabyte(self):
        """Chunks of 512 MB of zeros: 40 of them in 650 kB, alone and behind what is there to read."""
        packed = zstandard.ZstdCompressor().compress(bytes(CHUNK_BYTES))
        chunk = mcap_record(6, struct.pack("<QQQI", 0, 0, CHUNK_BYTES, 0) + mcap_text(b"zstd")
                            + struct.pack("<Q", len(packed)) + packed)
        whole = write_mcap(self.folder / "a.mcap", self.said()).read_bytes()
        bag = self.folder / "bomb.mcap"
        bag.write_bytes(whole[:8] + 40 * chunk)
        self.assert_error(self.run_slam(bag, timeout=60), 4, bag, "unpacks to more than 1 GiB and 300 times",
                          out="none")
        end = whole.rindex(b"\x0f\x04\0\0\0\0\0\0\0")  # where the data ends
        bag.write_bytes(whole[:end] + 40 * chunk)
        self.assertIn("warning: " + str(bag) + ": unpacks to more", self.run_bag(bag, timeout=60).stderr)
        self.assertEqual(self.metrics()["frames"], FRAMES)

    def test_what_chunks_of_ros_1_promise_counts_whether_they_keep_it_or_not(self):
        def fields(**values):
            data = b"".join(struct.pack("<I", len(key) + 1 + len(value)) + key.encode() + b"=" + value
                            for key, value in values.items())
            return struct.pack("<I", len(data)) + data
        packed = bz2.compress(bytes(1000))
        chunk = (fields(op=b"\5", compression=b"bz2", size=struct.pack("<I", CHUNK_BYTES))
                 + struct.pack("<I", len(packed)) + packed)
        bag = self.folder / "bomb.bag"
        bag.write_bytes(b"#ROSBAG V2.0\n" + 1000 * chunk)
        self.assert_error(self.run_slam(bag, timeout=60), 4, bag, "unpacks to more than", out="none")

    def test_messages_of_sqlite_that_unpack_to_gigabytes_are_read_to_one(self):
        bag = write_ros2(self.folder / "bag", self.said(), StoragePlugin.SQLITE3)
        (file,) = bag.glob("*.db3")
        packed = zstandard.ZstdCompressor().compress(bytes(CHUNK_BYTES))
        with contextlib.closing(sqlite3.connect(file)) as data:
            data.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 0, ?)", 60 * [(packed,)])
            data.commit()
        self.assertIn("unpacks to more than 1 GiB", self.run_bag(bag, timeout=120).stderr)
        self.assertEqual(self.metrics()["frames"], FRAMES)

    def test_topics_without_end_leave_the_first_as_they_are(self):
        info = self.messages.info(1, self.camera, (WIDTH, HEIGHT))
        others = [(f"/camera{i}/camera_info", i, info) for i in range(10100)]
        said = list(self.said())
        self.run_bag(self.seq, out="folder")
        done = self.run_bag(write_mcap(self.folder / "after.mcap", [*said, *others]))
        self.assertIn("a topic after the first 9999", done.stderr)
        self.assert_same("out")
        bag = write_mcap(self.folder / "before.mcap", [*others, *said])
        self.assert_error(self.run_slam(bag, out="other"), 4, bag, "no topic with colour images",
                          out="other")

    def test_pages_that_lead_back_to_others_come_to_an_end(self):
        """Thirteen pages, each of which names the next a hundred times: 10^26 topics."""
        file = self.folder / "loop.db3"
        with contextlib.closing(sqlite3.connect(file)) as bag:
            bag.execute("PRAGMA page_size = 4096")
            bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,"
                        " serialization_format TEXT)")
            bag.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)")
            bag.executemany("INSERT INTO topics VALUES(?, ?, 'x/msg/Y', 'cdr')",
                            ((i, f"/topic{i}") for i in range(20000)))
            bag.commit()
            (root,) = bag.execute("SELECT rootpage FROM sqlite_master WHERE name = 'topics'").fetchone()
        data = bytearray(file.read_bytes())
        page = bytes(data[(root - 1) * 4096:root * 4096])
        self.assertEqual(page[0], 5, "an inner page")
        cells = [at for (at,) in struct.iter_unpack(">H", page[12:12 + 2 * int.from_bytes(page[3:5], "big")])]
        leaves = [int.from_bytes(page[at:at + 4], "big") for at in cells]
        self.assertGreater(len(leaves), 100)
        for here, there in zip([root, *leaves[1:13]], [*leaves[1:13], leaves[0]]):
            inner = bytearray(page)
            for at in (*cells, 8):
                inner[at:at + 4] = there.to_bytes(4, "big")
            data[(here - 1) * 4096:here * 4096] = inner
        file.write_bytes(data)
        self.assert_error(self.run_slam(file, timeout=60), 4, file, "topics come again")


if __name__ == "__main__":
    unittest.main()
