#!/usr/bin/env bash
# run_tests.sh BUILD [options of ctest]: runs the tests of a build folder, then names those that were skipped.
set -uo pipefail
build=$1
shift
ctest --test-dir "$build" --output-on-failure "$@"
status=$?
python3 "$(dirname "$0")/list_skipped.py" "$build"
exit $status
