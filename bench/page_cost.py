#!/usr/bin/env python3
"""What a whole run in real time takes of a core, with a client of the live page that takes every topic, and without.

    .venv/bin/python bench/page_cost.py SEQUENCE ... --ygslam build/release/ygslam [--rounds 3]

Processor time of the process, its start and its end with all files included, over the recording's length; in turns.
"""
import argparse
import asyncio
import csv
import os
import socket
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
from view_test import Client  # noqa: E402

from matrix import print_table


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


async def watch(port):
    """Takes every topic until the run ends. @return how many bytes came."""
    for _ in range(200):
        try:
            client = await Client.connect(port)
            break
        except OSError:
            await asyncio.sleep(0.02)
    else:
        sys.exit("error: no page came")
    await client.subscribe(list(client.topics))
    taken = 0
    try:
        async for _, _, data in client.messages():
            taken += len(data)
    except Exception:  # the connection ends with the run
        return taken


def of_a_core(arguments, sequence, watched):
    """@return processor time over the recording's length, bytes that a client got."""
    with tempfile.TemporaryDirectory() as out:
        port = free_port()
        process = subprocess.Popen([arguments.ygslam, "--quiet", "run", sequence, "--out", out, "--realtime",
                                    "--view", str(port), *arguments.options.split()],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        taken = asyncio.run(watch(port)) if watched else 0
        _, status, usage = os.wait4(process.pid, 0)
        if os.waitstatus_to_exitcode(status) not in (0, 7):
            sys.exit(f"error: {sequence}: the run failed")
        stamps = [float(row["stamp"]) for row in csv.DictReader((Path(out) / "frames.csv").open())]
    return (usage.ru_utime + usage.ru_stime) / (stamps[-1] - stamps[0]), taken


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", type=Path, nargs="+")
    parser.add_argument("--ygslam", required=True)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--options", default="", help="more words for `ygslam run`")
    arguments = parser.parse_args()
    rows = []
    for sequence in arguments.sequences:
        shares, taken_mb = {False: [], True: []}, 0
        for _ in range(arguments.rounds):
            for watched in (False, True):
                share, taken = of_a_core(arguments, sequence, watched)
                shares[watched].append(share)
                taken_mb = max(taken_mb, taken / 1e6)
        rows.append([sequence.name, *(f"{statistics.median(s):.2f} ({min(s):.2f} to {max(s):.2f})" for s in shares.values()),
                     f"{taken_mb:.1f}"])
    print_table(["sequence", "of a core without a client", "with one", "it took [MB]"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
