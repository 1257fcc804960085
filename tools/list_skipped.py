#!/usr/bin/env python3
"""Lists the tests that the last ctest run of a build folder skipped, and why: they protect nothing here.

    python3 tools/list_skipped.py build/release
"""
import collections
import pathlib
import re
import sys


def skipped(text):
    """Reason to names of tests, out of ctest's LastTest.log."""
    reasons = collections.defaultdict(list)
    for name, output in re.findall(r"(?ms)^\d+/\d+ Test: (\S+)$(.*?)^Test time =", text):
        for reason, test in re.findall(r"(?m)^(?:\S+:\d+: Skipped\n)?(.*)\n\n?\[  SKIPPED \] (\S+) \(", output):
            reasons[reason].append(test)
        for test, reason in re.findall(r"(?m)^(\S+) \(.*\.\.\. skipped ['\"](.*)['\"]$", output):
            reasons[reason].append(f"{name}.{test}" if test == "setUpClass" else test)
    return reasons


def main():
    log = pathlib.Path(sys.argv[1]) / "Testing" / "Temporary" / "LastTest.log"
    reasons = skipped(log.read_text(encoding="utf-8", errors="replace"))
    count = sum(len(tests) for tests in reasons.values())
    if count == 0:
        return
    print(f"\nSKIPPED: {count} tests showed nothing here:")
    for reason, tests in sorted(reasons.items()):
        more = f" and {len(tests) - 4} more" if len(tests) > 4 else ""
        print(f"  {reason}: {', '.join(tests[:4])}{more}")


if __name__ == "__main__":
    main()
