"""What the tables of bench/ share: runs that are measured once, a line of JSON each, and printed as often as wanted."""
import argparse
import concurrent.futures
import json
from pathlib import Path


def parser_of(doc):
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--ygslam")
    return parser


def measured(results, key, jobs, workers=1):
    """The lines of the file, with those of the jobs that it has not yet.
    @param key of a line: which job it is of. @param jobs by key: what measures the line."""
    lines = [json.loads(line) for line in results.read_text("utf-8").splitlines()] if results.is_file() else []
    done = {key(line) for line in lines}
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        for line in pool.map(lambda job: job(), [job for name, job in jobs.items() if name not in done]):
            lines.append(line)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
    return lines


def print_table(head, rows):
    for row in [head, ["---", *["---:"] * (len(head) - 1)], *rows]:
        print("| " + " | ".join(row) + " |")
    print()
