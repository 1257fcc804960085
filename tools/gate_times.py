#!/usr/bin/env python3
"""Where the time of the gate went: phases of .ci/run, translation units, entries of ctest, tests.

    python3 tools/gate_times.py [build/ci build/asan ...] [--rows 15]

Reads what a run left behind: build/gate_phases.tsv, and of each build folder .ninja_log and
Testing/Temporary/LastTest.log.
"""
import argparse
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent


def print_table(title, rows, count):
    """rows: (seconds, name)"""
    rows = sorted(rows, reverse=True)
    print(f"\n{title}: {len(rows)}, {sum(seconds for seconds, _ in rows):.0f} s in all")
    for seconds, name in rows[:count]:
        print(f"{seconds:9.1f}  {name}")


def phases(file):
    return [(float(seconds), name) for name, seconds in
            (line.split("\t") for line in file.read_text(encoding="utf-8").splitlines())]


def build_steps(log):
    """The last time that each output was made."""
    steps = {}
    for line in log.read_text(encoding="utf-8").splitlines()[1:]:
        start_ms, end_ms, _, output, _ = line.split("\t")
        steps[output] = (int(end_ms) - int(start_ms)) / 1e3
    return [(seconds, output) for output, seconds in steps.items() if output.endswith((".o", ".gch"))]


def entries_and_tests(log):
    """Of a ctest run: its entries, and the GoogleTest tests within them."""
    text = log.read_text(encoding="utf-8", errors="replace")
    entries = [(float(seconds), name) for name, seconds in
               re.findall(r"(?ms)^\d+/\d+ Test: (\S+)$.*?^Test time = +([\d.]+) sec", text)]
    tests = [(int(ms) / 1e3, name) for name, ms in
             re.findall(r"\[ +(?:OK|FAILED) +\] (\S+?)(?:, where .*)? \((\d+) ms\)", text)]
    return entries, tests


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("builds", nargs="*", type=pathlib.Path, default=[ROOT / "build" / "ci"])
    parser.add_argument("--rows", type=int, default=15)
    options = parser.parse_args()
    phase_file = ROOT / "build" / "gate_phases.tsv"
    if phase_file.exists():
        print_table("phases", phases(phase_file), 100)
    for build in options.builds:
        print_table(f"{build}: translation units", build_steps(build / ".ninja_log"), options.rows)
        log = build / "Testing" / "Temporary" / "LastTest.log"
        if log.exists():
            entries, tests = entries_and_tests(log)
            print_table(f"{build}: ctest entries", entries, options.rows)
            print_table(f"{build}: tests in C++", tests, options.rows)


if __name__ == "__main__":
    main()
