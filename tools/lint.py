#!/usr/bin/env python3
"""clang-tidy on the translation units of a build folder: all, or those that a change can touch.

    python3 tools/lint.py build/clang -j 2                          # all
    python3 tools/lint.py build/clang -j 2 --since .ci/lint_base    # what changed since that commit, and what includes it
    ... --record .ci/lint_base   # and notes the commit there, if nothing was found and all is committed: the next base

A translation unit is a module's sources compiled together. Where the commit is not known here, or the linter's
settings or the compiler's changed since, all are looked at.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
IS_LINTED = re.compile(r"/Unity/|_test\.cpp$")
CONCERNS_ALL = re.compile(r"^(\.clang-tidy|cmake/YgslamCompiler\.cmake|tools/lint\.py)$")
INCLUDE = re.compile(rb'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], check=False, capture_output=True, text=True)


def changed_since(base_file):
    """Paths that differ from the commit, those not committed yet included; None: not to be told."""
    commit = base_file.read_text(encoding="utf-8").split()[0] if base_file.exists() else ""
    if not commit or git("merge-base", "--is-ancestor", commit, "HEAD").returncode != 0:
        return None
    changed = git("diff", "--name-only", commit).stdout.splitlines()
    changed += git("ls-files", "--others", "--exclude-standard").stdout.splitlines()
    if any(CONCERNS_ALL.search(path) for path in changed):
        return None
    return {ROOT / path for path in changed}


def includes_of(file, known):
    """The project's files that a file includes, by name; as the compiler would find them."""
    if file not in known:
        found = set()
        for name in INCLUDE.findall(file.read_bytes()):
            for folder in (file.parent, ROOT / "src", ROOT / "include", ROOT):
                path = (folder / name.decode()).resolve()
                if path.is_file():
                    found.add(path)
                    break
        known[file] = found
    return known[file]


def all_that_it_includes(file, known):
    seen, waiting = {file}, [file]
    while waiting:
        for path in includes_of(waiting.pop(), known) - seen:
            seen.add(path)
            waiting.append(path)
    return seen


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-j", dest="jobs", default="2")
    parser.add_argument("--since", type=pathlib.Path, help="file that names a commit")
    parser.add_argument("--record", type=pathlib.Path, help="file to write the commit to")
    options = parser.parse_args()
    commands = json.loads((options.build / "compile_commands.json").read_text(encoding="utf-8"))
    units = sorted({entry["file"] for entry in commands if IS_LINTED.search(entry["file"])})
    chosen = units
    changed = changed_since(options.since) if options.since else None
    if changed is not None:
        known = {}
        chosen = [unit for unit in units if changed & all_that_it_includes(pathlib.Path(unit), known)]
    print(f"lint: {len(chosen)} of {len(units)} translation units", flush=True)
    if chosen:
        patterns = [f"^{re.escape(unit)}$" for unit in chosen]
        done = subprocess.run(["run-clang-tidy-16", "-p", options.build, "-j", options.jobs, "-quiet", *patterns],
                              check=False)
        if done.returncode != 0:
            sys.exit(1)
    if options.record and not git("status", "--porcelain").stdout:
        options.record.write_text(git("rev-parse", "HEAD").stdout, encoding="utf-8")


if __name__ == "__main__":
    main()
