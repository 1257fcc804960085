"""The live page (`--view`): seen, driven and attacked by independent clients.

    python tests/view_test.py
"""
import asyncio
import http.client
import json
import os
import pty
import re
import shutil
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest
import urllib.error
import urllib.request

import numpy as np
import websockets
from plyfile import PlyData
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ygslam_cli import BINARY, FRAMES, CliTest, sequence, trajectory, ygslam

EVERY_FRAME = {"/tf", "/odometry", "/camera/image/compressed", "/camera/camera_info",
               "/camera/annotations", "/objects", "/state"}
OF_THE_MAP = {"/landmarks", "/path", "/loops", "/cloud", "/mesh", "/mesh/classes"}
OF_THE_PAGE = {"/history", "/floor"}  # and of no recording
ADD, DELETE, TRIANGLE_LIST = 0, 2, 11  # of visualization_msgs/Marker
PROTOCOL = "foxglove.websocket.v1"
WAIT_S = 120  # far beyond anything a loaded machine needs
PLACES = 64  # connections at once
PAUSE_S = 4  # longer than the sequence
SOON_S = 4  # less than a connection without a request is waited for


class Client:
    """Speaks Foxglove's protocol, version 1."""

    def __init__(self, connection):
        self.connection = connection
        self.topics, self.services, self.info = {}, {}, None

    @classmethod
    async def connect(cls, port, token="", protocol=PROTOCOL, **how):
        query = f"?token={token}" if token else ""
        client = cls(await websockets.connect(f"ws://127.0.0.1:{port}/ws{query}", max_size=None,
                                              subprotocols=[protocol], **how))
        client.info = json.loads(await client.next())
        for channel in json.loads(await client.next())["channels"]:
            client.topics[channel["topic"]] = channel
        for service in json.loads(await client.next())["services"]:
            client.services[service["name"]] = service["id"]
        return client

    async def next(self):
        return await asyncio.wait_for(self.connection.recv(), WAIT_S)

    async def subscribe(self, topics):
        await self.connection.send(json.dumps({"op": "subscribe", "subscriptions": [
            {"id": self.topics[t]["id"] + 100, "channelId": self.topics[t]["id"]} for t in topics]}))

    async def messages(self):
        """(topic, stamp, bytes) as they come."""
        of_id = {c["id"] + 100: topic for topic, c in self.topics.items()}
        while True:
            data = await self.next()
            if isinstance(data, bytes) and data[0] == 1:
                subscription, stamp_ns = struct.unpack_from("<IQ", data, 1)
                yield of_id[subscription], stamp_ns, data[13:]

    async def step(self, frames):
        """Drives a paused run on. @return stamps of the frames, which came one by one."""
        await self.subscribe(["/odometry"])
        seen, stamps = self.messages(), []
        for _ in range(frames):
            await self.call("step")
            stamps.append((await anext(seen))[1])
        return stamps

    async def whole_frame(self, topics, after_ns):
        """Waits for these topics of one frame after this stamp. @return its stamp."""
        newest = {}
        async for topic, stamp_ns, _ in self.messages():
            newest[topic] = stamp_ns
            stamps = {newest.get(wanted) for wanted in topics}
            if len(stamps) == 1 and stamps.isdisjoint({None, after_ns}):
                return stamps.pop()

    async def call(self, name):
        """(success, message) of a service; messages that come meanwhile are passed over."""
        head = struct.pack("<BIII", 2, self.services[name], 77, 3)
        await self.connection.send(head + b"cdr" + b"\0\1\0\0")
        while True:
            data = await self.next()
            if isinstance(data, str):
                said = json.loads(data)
                if said["op"] == "serviceCallFailure":
                    return False, said["message"]
            elif data[0] == 3:
                assert struct.unpack_from("<II", data, 1) == (self.services[name], 77)
                body = data[16:]
                length = struct.unpack_from("<I", body, 8)[0]
                return bool(body[4]), body[12:12 + length - 1].decode()


def cubes(points):
    """Of 1 m, as places, with how many points lie in each."""
    places, counts = np.unique(np.floor(points).astype(int), axis=0, return_counts=True)
    return dict(zip(map(tuple, places), counts))


class Watched(CliTest):
    """Runs with a page."""

    def setUp(self):
        super().setUp()
        self.runs = []
        self.addCleanup(lambda: [run.kill() for run in self.runs])

    def start(self, *options, out="out"):
        """A run with a page. @return process, port, token."""
        return self.start_command("run", sequence(), "--out", self.folder / out, "--deterministic",
                                  "--segmenter", f"masks:{sequence() / 'mask'}", *options)

    def start_command(self, *words):
        run = subprocess.Popen([BINARY, *map(str, words), "--view", "0"],
                               stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.runs.append(run)
        for line in run.stderr:
            found = re.search(r"look at http://127\.0\.0\.1:(\d+)/#(\w+)", line)
            if found:
                return run, int(found[1]), found[2]
        self.fail("no address was told")

    def end(self, run):
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=WAIT_S)
        self.assertIn(run.returncode, (0, 130), "at the end, or on the way there")

    def end_of_page(self, run):
        """Waits until the page stays after the end, then ends it."""
        for line in run.stderr:
            if "stays" in line:
                break
        self.end(run)
        self.assertEqual(run.returncode, 0, "the work was done")

    def fetch(self, port, path="/", **headers):
        """(status, body, headers) of a page's file."""
        request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=WAIT_S) as answer:
                return answer.status, answer.read().decode(), answer.headers
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode(), error.headers


class View(Watched):
    def test_a_client_sees_every_frame_it_can_take_and_the_map(self):
        async def look(port):
            client = await Client.connect(port)
            self.assertEqual(set(client.topics), EVERY_FRAME | OF_THE_MAP | OF_THE_PAGE)
            await client.subscribe(client.topics)
            seen = {}
            async for topic, stamp_ns, data in client.messages():
                seen[topic] = stamp_ns, data
                if len(seen) == len(client.topics):
                    return client.topics, seen
        run, port, _ = self.start("--view-stay")
        topics, seen = asyncio.run(look(port))
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(topics["/odometry"]["schema"], "nav_msgs/msg/Odometry"))
        stamp_ns, data = seen["/odometry"]
        odometry = store.deserialize_cdr(data, "nav_msgs/msg/Odometry")
        stamp = odometry.header.stamp
        self.assertEqual(stamp.sec * 10**9 + stamp.nanosec, stamp_ns)
        self.assertEqual(odometry.child_frame_id, "camera")
        self.end(run)

    def test_who_comes_late_gets_every_tile_of_the_mesh(self):
        async def look(port):
            client = await Client.connect(port)
            await client.subscribe(["/mesh", "/mesh/classes"])
            store = get_typestore(Stores.EMPTY)
            kind = "visualization_msgs/msg/MarkerArray"
            store.register(get_types_from_msg(client.topics["/mesh"]["schema"], kind))
            corners, classes = {}, set()
            async for topic, _, data in client.messages():
                self.assertLess(len(data), 1_000_000, "a tile at once")
                for marker in store.deserialize_cdr(data, kind).markers:
                    self.assertIn(marker.action, (ADD, DELETE))
                    if marker.action == DELETE:
                        corners.pop(marker.id, None)
                        continue
                    self.assertEqual((marker.type, marker.header.frame_id), (TRIANGLE_LIST, "map"))
                    if topic == "/mesh":
                        self.assertEqual(len(marker.colors), len(marker.points))
                        corners[marker.id] = np.array([[p.x, p.y, p.z] for p in marker.points])
                    else:
                        classes.add(marker.ns)
                if not corners or "floor" not in classes:
                    continue
                if filled <= cubes(np.concatenate(list(corners.values()))).keys():
                    return
        run, port, _ = self.start("--view-stay")
        for line in run.stderr:
            if "stays" in line:
                break
        mapped = PlyData.read(self.folder / "out" / "map.ply")["vertex"].data
        whole = np.stack([mapped["z"], -mapped["x"], -mapped["y"]], axis=1)  # x forward, z up
        # Fewer may be small loose pieces, which are left out.
        filled = {cube for cube, points in cubes(whole).items() if points > 0.02 * len(whole)}
        self.assertGreater(len(filled), 4)
        asyncio.run(look(port))
        self.end(run)

    def test_frames_that_were_missed_are_counted(self):
        damaged = self.folder / "damaged"
        shutil.copytree(sequence(), damaged)
        for image in sorted((damaged / "rgb").iterdir())[5:7]:
            image.write_bytes(b"no image")

        async def look(port):
            client = await Client.connect(port)
            await client.subscribe(["/state"])
            store = get_typestore(Stores.EMPTY)
            kind = "diagnostic_msgs/msg/DiagnosticArray"
            store.register(get_types_from_msg(client.topics["/state"]["schema"], kind))
            async for _, _, data in client.messages():
                status = store.deserialize_cdr(data, kind).status[0]
                if status.message == "the run has ended":
                    return {entry.key: entry.value for entry in status.values}
        run, port, _ = self.start_command("run", damaged, "--out", self.folder / "out", "--view-stay")
        self.assertEqual(asyncio.run(look(port))["missed frames"], "2")
        self.end(run)

    def test_who_comes_after_the_end_sees_it_as_it_was(self):
        async def look(port):
            client = await Client.connect(port)
            await client.subscribe(client.topics)
            seen = set()
            async for topic, _, data in client.messages():
                if topic != "/state" or b"the run has ended" in data:
                    seen.add(topic)
                if seen == set(client.topics):
                    return
        run, port, _ = self.start("--view-stay")
        for line in run.stderr:
            if "stays" in line:
                break
        asyncio.run(look(port))
        self.end(run)

    def test_looking_on_changes_nothing(self):
        async def look(port):
            client = await Client.connect(port)
            await client.subscribe(client.topics)
            async for _ in client.messages():
                pass
        run, port, _ = self.start()
        try:
            asyncio.run(look(port))
        except websockets.ConnectionClosed:
            pass
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        alone = self.run_slam(sequence(), "--segmenter", f"masks:{sequence() / 'mask'}",
                              out="alone", geometry=False)
        self.assert_ran(alone)
        for name in ("trajectory.txt", "trajectory_live.txt", "map.ply"):
            self.assertEqual((self.folder / "out" / name).read_bytes(),
                             (self.folder / "alone" / name).read_bytes(), name)

    def test_it_is_driven_by_who_has_the_token_alone(self):
        async def drive(port, token):
            onlooker = await Client.connect(port)
            done, why = await onlooker.call("pause")
            self.assertFalse(done)
            self.assertIn("token", why)
            driver = await Client.connect(port, token)
            self.assertEqual(len(set(await driver.step(3))), 3)
            self.assertEqual(await driver.call("pause"), (True, "paused"))
            self.assertEqual((await driver.call("save"))[0], False)
            self.assertTrue((await driver.call("slower"))[0])
            self.assertTrue((await driver.call("stop"))[0])
        run, port, token = self.start("--view-paused")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        self.assertEqual(len(trajectory(self.folder / "out" / "trajectory.txt")), 3)
        self.assert_sound()

    def test_a_pause_makes_no_frame_of_realtime_late(self):
        async def drive(port, token):
            driver = await Client.connect(port, token)
            await driver.step(1)
            await asyncio.sleep(PAUSE_S)
            await driver.call("resume")
        run, port, token = self.start_command(
            "run", sequence(), "--out", self.folder / "out", "--realtime", "--segmenter",
            f"masks:{sequence() / 'mask'}", "--view-paused")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        metrics = json.loads((self.folder / "out" / "metrics.json").read_text("utf-8"))
        self.assertLess(metrics["dropped"], FRAMES / 2, "a loaded machine drops some")

    def test_the_sequence_is_not_taken_for_an_address(self):
        done = ygslam("run", "--view", sequence(), "--out", self.folder / "out")
        self.assert_error(done, 2, "a SEQUENCE goes before")

    def test_a_signal_that_ends_the_page_after_the_end_is_no_failure(self):
        self.end_of_page(self.start("--view-stay")[0])
        run, _, _ = self.start_command("simulate", "walking_xyz", "--out", self.folder / "sim",
                                       "--seconds", "0.2", "--size", "160x120", "--view-stay")
        self.end_of_page(run)

    def test_a_signal_while_it_leaves_changes_nothing(self):
        async def stop(port, token):
            driver = await Client.connect(port, token)
            await driver.call("stop")
            await driver.connection.wait_closed()
        for delay_ms in (0, 0, 1, 2, 4, 8, 16):
            run, port, token = self.start("--view-paused")
            asyncio.run(stop(port, token))
            time.sleep(delay_ms / 1000)
            run.send_signal(signal.SIGINT)
            said = run.communicate(timeout=WAIT_S)[1]
            self.assertEqual(run.returncode, 0, said)

    def test_paused_is_said(self):
        async def drive(port, token):
            driver = await Client.connect(port, token)
            await driver.subscribe(["/state"])
            said = driver.messages()

            async def heard(words):
                async for _, _, data in said:
                    if words in data:
                        return
            await heard(b"paused before the first frame")
            await driver.call("step")
            await heard(b"paused; ")
            for _ in range(4):  # it must not end before it is paused again
                await driver.call("slower")
            await driver.call("resume")
            async for _, _, data in said:
                if b"paused" not in data:
                    break
            await driver.call("pause")
            await heard(b"paused; tracking")
            await driver.call("stop")
        run, port, token = self.start("--view-paused")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)

    def test_paused_is_said_on_the_terminal(self):
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        run = subprocess.Popen([BINARY, "run", sequence(), "--out", self.folder / "out", "--dynamic",
                                "off", "--view", "0", "--view-paused"], stderr=theirs,
                               stdout=subprocess.DEVNULL)
        self.runs.append(run)
        os.close(theirs)
        said = b""
        while b"paused on the page" not in said:
            said += os.read(ours, 4096)
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.wait(WAIT_S), 130)

    def test_stopped_before_the_first_frame_it_ends_in_peace(self):
        async def drive(port, token):
            await (await Client.connect(port, token)).call("stop")
        run, port, token = self.start("--view-paused")
        asyncio.run(drive(port, token))
        said = run.communicate(timeout=WAIT_S)[1]
        self.assertEqual(run.returncode, 0, said)
        self.assertNotIn("error", said)

    def test_a_map_is_saved_when_asked(self):
        async def drive(port, token):
            driver = await Client.connect(port, token)
            await driver.step(5)
            self.assertTrue((await driver.call("save"))[0])
            self.assertFalse((await driver.call("reset"))[0], "its map file would hold two worlds")
            await driver.call("stop")
        run, port, token = self.start("--view-paused", "--save-map", self.folder / "room.map")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        self.assert_ran(ygslam("map", "check", self.folder / "room.map"))

    def test_what_cannot_begin_spoils_no_recording(self):
        old = self.folder / "run.mcap"
        self.assert_ran(self.run_slam(sequence(), "--mcap", old))
        before = old.read_bytes()
        taken = socket.create_server(("127.0.0.1", 0))
        done = self.run_slam(sequence(), "--mcap", old, "--view", str(taken.getsockname()[1]),
                             out="other")
        self.assert_error(done, 2, "in use", out="other")
        self.assertEqual(old.read_bytes(), before)

    def test_options_of_the_page_want_a_page_and_sound_tokens(self):
        for options, part in ((("--view-stay",), "--view"), (("--view-token", "abc"), "--view"),
                              (("--view", "0", "--view-token", "a+b="), "--view-token")):
            self.assert_error(self.run_slam(sequence(), *options), 2, part)

    def test_reset_begins_anew(self):
        async def drive(port, token):
            driver = await Client.connect(port, token)
            await driver.step(10)
            self.assertTrue((await driver.call("reset"))[0])
            await driver.call("resume")
        run, port, token = self.start("--view-paused")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        self.assert_sound()
        self.assertEqual(len(trajectory(self.folder / "out" / "trajectory.txt")), FRAMES - 10)

    def test_a_rendering_is_shown_and_driven(self):
        async def drive(port, token):
            driver = await Client.connect(port, token)
            stamps = await driver.step(3)
            self.assertEqual(len(set(stamps)), 3)
            self.assertEqual((await driver.call("reset"))[0], False)
            self.assertEqual((await driver.call("save"))[0], False)
            wanted = {"/camera/image/compressed", "/tf", "/cloud"}
            await driver.subscribe(wanted)
            for _ in range(2):  # sooner one after the other than clouds of a run that goes on
                await driver.call("step")
                stamps.append(await driver.whole_frame(wanted, stamps[-1]))
            self.assertTrue((await driver.call("stop"))[0])
        run, port, token = self.start_command(
            "simulate", "walking_xyz", "--out", self.folder / "sim", "--seconds", "1", "--size",
            "160x120", "--view-paused")
        asyncio.run(drive(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        pairs = self.pairs(self.folder / "sim")
        self.assertIn(len(pairs), (5, 6), "what was shown, and what was rendered ahead of it")

    def test_frames_that_are_localised_are_shown(self):
        async def watch(port, token):
            driver = await Client.connect(port, token)
            self.assertEqual(len(await driver.step(2)), 2)
            self.assertTrue((await driver.call("resume"))[0])
        room = self.folder / "room.map"
        common = ("--deterministic", "--dynamic", "geometry")
        self.assert_ran(ygslam("run", sequence(), "--out", self.folder / "first", "--save-map", room,
                               *common))
        run, port, token = self.start_command(
            "localize", sequence(), "--map", room, "--out", self.folder / "again", "--mcap",
            self.folder / "again.mcap", "--view-paused", *common)
        asyncio.run(watch(port, token))
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)
        self.assertGreater((self.folder / "again.mcap").stat().st_size, 10_000)

    def test_strangers_are_refused(self):
        run, port, token = self.start("--view-stay", "--view-origin", "https://friend.example")
        status, page, headers = self.fetch(port)
        self.assertEqual(status, 200)
        self.assertIn("YG-SLAM", page)
        self.assertIn("default-src 'self'", headers["Content-Security-Policy"])
        for name in re.findall(r'(?:src|href)="(\w+\.\w+)"', page):
            self.assertEqual(self.fetch(port, "/" + name)[0], 200, name)
        self.assertEqual(self.fetch(port, "/../etc/passwd")[0], 404)
        self.assertEqual(self.fetch(port, Host="evil.example")[0], 403)
        self.assertEqual(self.fetch(port, Host=f"evil.example:{port}")[0], 403)
        self.assertEqual(self.fetch(port, Origin="https://evil.example")[0], 403)
        self.assertEqual(self.fetch(port, Origin=f"http://127.0.0.1:{port}")[0], 200)

        async def knock():
            for origin, code in (("https://evil.example", 403), ("null", 403),
                                 (f"http://127.0.0.1:{port}", None),
                                 ("https://friend.example", None)):
                if code is None:
                    await Client.connect(port, origin=origin)
                    continue
                with self.assertRaises(websockets.InvalidStatus) as refused:
                    await Client.connect(port, origin=origin)
                self.assertEqual(refused.exception.response.status_code, code)
            with self.assertRaises(websockets.InvalidStatus) as refused:
                await Client.connect(port, token="0" * len(token))
            self.assertEqual(refused.exception.response.status_code, 401)
            with self.assertRaises(websockets.InvalidStatus):
                await Client.connect(port, protocol="chat")
            self.assertEqual((await Client.connect(port, protocol="foxglove.sdk.v1")).info["name"],
                             "ygslam")
        asyncio.run(knock())
        self.end(run)

    def test_at_an_address_that_others_reach_nobody_looks_on_without_the_token(self):
        async def knock(port, token):
            with self.assertRaises(websockets.InvalidStatus) as refused:
                await Client.connect(port)
            self.assertEqual(refused.exception.response.status_code, 401)
            self.assertTrue((await Client.connect(port, token)).topics)
        run = subprocess.Popen(
            [BINARY, "run", sequence(), "--out", self.folder / "out", "--dynamic", "off",
             "--view", "0.0.0.0:0", "--view-stay", "--view-token", "open-sesame"],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.runs.append(run)
        port = int(re.search(r"look at http://[^:]+:(\d+)/#open-sesame", next(
            line for line in run.stderr if "look at" in line))[1])
        asyncio.run(knock(port, "open-sesame"))
        self.end(run)

    def test_nonsense_and_clients_that_stop_reading_hold_nobody_up(self):
        async def pester(port, token):
            clients = []
            for _ in range(50):
                clients.append(await Client.connect(port))
                await clients[-1].subscribe(clients[-1].topics)  # and never read
            self.assertEqual(len(clients), 50)
            rude = await Client.connect(port)
            for message in ("", "{", "[]", '{"op":"subscribe","subscriptions":[{"id":1}]}', b"", b"\2",
                            b"\2" + b"\xff" * 40, "x" * 60000):
                await rude.connection.send(message)
                self.assertEqual(json.loads(await rude.next())["op"], "status")
            await rude.connection.send("x" * 100000)
            with self.assertRaises(websockets.ConnectionClosed):
                await rude.next()
            await (await Client.connect(port, token)).call("resume")
            await asyncio.to_thread(with_idlers.communicate, timeout=WAIT_S)  # all still connected
        with_idlers, port, token = self.start("--view-paused")
        slow = [socket.create_connection(("127.0.0.1", port)) for _ in range(5)]
        for s in slow:
            s.sendall(b"GET / HTTP/1.1\r\nHost: ")  # and never goes on
        garbage = socket.create_connection(("127.0.0.1", port))
        garbage.sendall(b"\x16\x03\x01\x02\x00" * 5000)
        asyncio.run(pester(port, token))
        self.assertEqual(with_idlers.returncode, 0)
        self.assertEqual(self.metrics()["frames"], FRAMES)

    def test_connections_that_never_ask_keep_nobody_out(self):
        """More of them than there are places, opened again as soon as they are closed."""
        def knock(number):
            s = socket.create_connection(("127.0.0.1", port), timeout=WAIT_S)
            s.sendall(b"GET / HTTP/1.1\r\nHost: 127.0" if number % 2 else b"")
            s.setblocking(False)
            return s

        def is_closed(s):
            try:
                return not s.recv(1)
            except BlockingIOError:
                return False
            except OSError:
                return True

        def besiege():
            while not over.wait(0.002):
                for i, s in enumerate(half_open):
                    if is_closed(s):
                        s.close()
                        half_open[i] = knock(i)

        async def soon(look):
            """Who was slower than all who came after, on a loaded machine, comes again."""
            end = time.monotonic() + SOON_S
            while True:
                try:
                    return await look()
                except (OSError, http.client.HTTPException, websockets.WebSocketException):
                    if time.monotonic() > end:
                        raise

        async def look(port):
            early = await Client.connect(port)
            for i in range(PLACES + 6):
                half_open.append(knock(i))
            siege.start()
            for _ in range(5):
                self.assertEqual((await soon(lambda: asyncio.to_thread(self.fetch, port)))[0], 200)
                await (await soon(lambda: Client.connect(port))).subscribe(["/odometry"])
            await early.connection.ping()  # who looks on stays
            await early.subscribe(["/odometry"])
            async for topic, _, _ in early.messages():
                self.assertEqual(topic, "/odometry")
                return
        half_open, over = [], threading.Event()
        run, port, _ = self.start("--view-stay")
        siege = threading.Thread(target=besiege)
        try:
            asyncio.run(look(port))
        finally:
            over.set()
            siege.join()
            for s in half_open:
                s.close()
        self.end(run)

    def test_an_address_in_use_or_impossible_is_told(self):
        taken = socket.create_server(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        for address, part in ((str(port), "in use"), ("203.0.113.7:80", "ssign"),
                              ("robot:80", "ADDRESS:PORT"), ("99999", "ADDRESS:PORT")):
            done = self.run_slam(sequence(), "--view", address)
            self.assert_error(done, 2, "--view", part)


if __name__ == "__main__":
    unittest.main()
