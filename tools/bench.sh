#!/usr/bin/env bash
# Runs every benchmark of a build folder.
set -euo pipefail
for benchmark in "$1"/bench/*_bench; do
  [ -x "$benchmark" ] || continue
  echo "== $(basename "$benchmark")"
  "$benchmark" --benchmark_min_time=0.2
done
