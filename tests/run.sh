#!/bin/sh
# Installs what is missing, builds everything in release and runs the quick suite.
#   sh tests/run.sh [preset]
# Last line: "N passed, N failed", counting doctest's cases and each of the other checks once.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
preset=${1:-release}
sh "$root/cmake/install_packages.sh" base tests

cd "$root"
build=$root/build/$preset
cmake --preset "$preset"
built=0
cmake --build --preset "$preset" -- -k 0 || built=$?

log=$build/tests.log
jobs=$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
echo "Running the tests: $log"
ctest --preset "$preset" --verbose --no-tests=error -j "$jobs" >"$log" 2>&1 || true
sh tests/count.sh "$log" "$built"
