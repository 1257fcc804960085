#!/usr/bin/env bash
# bench.sh BUILD [SEQUENCE...]: the benchmarks of a build folder that need nothing but themselves, and where a run's time
# goes (bench/budget.py) on these sequences; without any on 4 s of a rendered crowd.
set -euo pipefail
build=$1
shift
out=$build/bench/out
mkdir -p "$out"
for name in orb optim; do
  echo "== ${name}_bench"
  "$build/bench/${name}_bench" --benchmark_min_time=0.2 --benchmark_out="$out/$name.json" --benchmark_out_format=json
done
if (($# == 0)); then
  [ -d "$out/crowd" ] || "$build/ygslam" simulate crowd --seconds 4 --out "$out/crowd" >/dev/null
  set -- "$out/crowd"
fi
echo "== budget.py"
.venv/bin/python bench/budget.py "$@" --ygslam "$build/ygslam" --benchmarks "$out"
