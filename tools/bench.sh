#!/usr/bin/env bash
# Runs the benchmarks of a build folder that need nothing but themselves.
set -euo pipefail
for name in orb optim; do
  echo "== ${name}_bench"
  "$1/bench/${name}_bench" --benchmark_min_time=0.2
done
