#!/bin/sh
# Installs what is missing, builds the benchmarks and runs them.
#   [EMBREE4=PATH] sh bench/run.sh [--quick]      PATH: a library of Embree 4, see bench_bvh --help
# Leaves build/bench/<benchmark>.json, one object a line, and build/bench/report.html.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
quick=
case "${1:-}" in
--quick) quick=--quick ;;
'') ;;
*)
    echo "usage: sh bench/run.sh [--quick]" >&2
    exit 2
    ;;
esac
sh "$root/cmake/install_packages.sh" base bench

cd "$root"
cmake --preset release
cmake --build --preset release --target benchmarks

out=$root/build/bench
mkdir -p "$out"
status=0
for program in build/release/bench/bench_*; do
    [ -f "$program" ] && [ -x "$program" ] || continue
    name=$(basename "$program")
    echo "== $name"
    set --
    [ "$name" != bench_bvh ] || set -- --batch --double --compact ${EMBREE4:+--embree4 "$EMBREE4"}
    if ! "$program" $quick --json "$@" >"$out/$name.json"; then
        echo "$name failed" >&2
        status=1
    fi
done
if [ -x build/release/bench/micro ]; then
    echo "== micro"
    build/release/bench/micro ${quick:+--benchmark_min_time=0.05} --benchmark_format=json >"$out/micro.json" || status=1
fi
build/release/bench/report "$out" || status=1
exit "$status"
