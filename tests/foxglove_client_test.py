"""The live page's protocol, looked at by Foxglove's own client (npm @foxglove/ws-protocol).

    python tests/foxglove_client_test.py

Skipped where it is not installed (`make setup` installs it beside the Python environment if there is npm).
"""
import json
import os
import pathlib
import subprocess
import sys
import unittest

from rosbags.typesys import Stores, get_typestore

from view_test import EVERY_FRAME, OF_THE_MAP, OF_THE_PAGE, Watched
from ygslam_cli import FRAMES

MODULES = pathlib.Path(os.environ.get("YGSLAM_FOXGLOVE", pathlib.Path(sys.prefix, "foxglove")),
                       "node_modules")
# Subscribes to all, calls `resume`, `stop` once every topic came, and says what came until then.
SCRIPT = r"""
const {FoxgloveClient} = require('@foxglove/ws-protocol'), WebSocket = require('ws');
const client = new FoxgloveClient({ws: new WebSocket(process.argv[1],
                                                     [FoxgloveClient.SUPPORTED_SUBPROTOCOL])});
const seen = {topics: {}, schemas: {}, first: {}, info: null, said: [], errors: []};
const topicOf = new Map(), typeOf = new Map();
const services = {};
// In the request's encoding: CDR of an empty message.
const call = (name, callId) => client.sendServiceCallRequest(
    {serviceId: services[name], callId, encoding: 'cdr', data: new DataView(new ArrayBuffer(4))});
let stopped = false;
client.on('error', (error) => seen.errors.push(String(error)));
client.on('status', (status) => seen.errors.push(status.message));
client.on('serverInfo', (info) => { seen.info = info; });
client.on('advertise', (channels) => {
  for (const channel of channels) {
    seen.schemas[channel.topic] = [channel.encoding, channel.schemaName, channel.schemaEncoding];
    typeOf.set(channel.topic, channel.schemaName);
    topicOf.set(client.subscribe(channel.id), channel.topic);
  }
});
client.on('advertiseServices', (advertised) => {
  for (const {name, id} of advertised) services[name] = id;
  setTimeout(() => call('resume', 5), 300);
});
client.on('serviceCallResponse', (response) => seen.said.push(response.callId));
client.on('serviceCallFailure', (failure) => seen.errors.push(failure.message));
client.on('message', ({subscriptionId, timestamp, data}) => {
  const topic = topicOf.get(subscriptionId);
  (seen.topics[topic] ??= []).push(String(timestamp));
  seen.first[topic] ??= Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString('hex');
  if (!stopped && Object.keys(seen.topics).length === topicOf.size) {
    stopped = true;
    call('stop', 6);
  }
});
client.on('close', () => process.stdout.write(JSON.stringify(seen), () => process.exit(0)));
"""


def is_there():
    try:
        return subprocess.run(["node", "-e", "require('@foxglove/ws-protocol'); require('ws')"],
                              env={**os.environ, "NODE_PATH": str(MODULES)}, check=False,
                              capture_output=True).returncode == 0
    except FileNotFoundError:
        return False


@unittest.skipUnless(is_there(), "no @foxglove/ws-protocol")
class FoxgloveClient(Watched):
    def test_it_sees_and_drives_a_run(self):
        run, port, token = self.start("--view-paused", "--view-stay")
        done = subprocess.run(["node", "-e", SCRIPT, f"ws://127.0.0.1:{port}/ws?token={token}"],
                              env={**os.environ, "NODE_PATH": str(MODULES)}, check=False,
                              capture_output=True, text=True, timeout=200)
        self.end(run)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        seen = json.loads(done.stdout)
        self.assertEqual((seen["errors"], seen["said"][0]), ([], 5))
        self.assertEqual(set(seen["topics"]), EVERY_FRAME | OF_THE_MAP | OF_THE_PAGE)
        for topic, stamps in seen["topics"].items():
            self.assertEqual(stamps, sorted(stamps, key=int), topic)
            self.assertLessEqual(len(set(stamps)), FRAMES + 1, topic)  # and a state before the first
        store = get_typestore(Stores.ROS2_HUMBLE)
        for topic in ("/tf", "/odometry", "/path", "/cloud", "/state"):
            encoding, schema, schema_encoding = seen["schemas"][topic]
            self.assertEqual((encoding, schema_encoding), ("cdr", "ros2msg"))
            store.deserialize_cdr(bytes.fromhex(seen["first"][topic]), schema)


if __name__ == "__main__":
    unittest.main()
