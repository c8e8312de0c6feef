#!/bin/sh
# Installs what is missing, builds the benchmarks and runs them.
#   [EMBREE4=PATH] sh bench/run.sh [--quick] [--peers PYTHON]
# --quick: a few minutes. PYTHON: an interpreter with what bench/peers/requirements.txt names: other renderers and Open
# Image Denoise join. EMBREE4: a library of Embree 4, see bench_bvh --help.
# Leaves in build/bench a file of JSON for each benchmark, one object a line, what it said (.log), and report.html.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
mode=full peers=
while [ $# -gt 0 ]; do
    case $1 in
    --quick) mode=quick ;;
    --peers)
        [ $# -ge 2 ] || { echo "--peers needs the path of a Python" >&2; exit 2; }
        peers=$(command -v "$2") || { echo "--peers: there is no program '$2'" >&2; exit 2; }
        case $peers in /*) ;; *) peers=$PWD/$peers ;; esac
        shift
        ;;
    *)
        echo "usage: sh bench/run.sh [--quick] [--peers PYTHON]" >&2
        exit 2
        ;;
    esac
    shift
done
sh "$root/cmake/install_packages.sh" base bench

cd "$root"
cmake --preset release
cmake --build --preset release --target benchmarks
# Left out of the report, where the packages that it needs are not there.
cmake --build --preset release --target render || echo "the program render cannot be built" >&2

bin=build/release/bench out=build/bench
mkdir -p "$out"
rm -rf "$out"/*.json "$out"/*.log "$out/pictures" "$out/references"
sh bench/machine.sh build/release "$mode" >"$out/machine.json"

failed=0
measure() { # NAME ARGUMENTS...: runs a benchmark, and notes how that went
    name=$1
    shift
    [ -x "$bin/$name" ] || return 0
    [ "$mode" = full ] || [ "$name" = micro ] || set -- --quick "$@"
    echo "== $name"
    start=$(date +%s) status=0
    "$bin/$name" "$@" >"$out/$name.json" 2>"$out/$name.log" || status=$?
    seconds=$(($(date +%s) - start))
    cat "$out/$name.log" >&2
    [ "$status" -eq 0 ] || { echo "$name failed" >&2; failed=1; }
    printf '{"bench": "%s", "seconds": %d, "status": %d, "command": "%s"}\n' "$name" "$seconds" "$status" \
        "$(printf '%s' "$bin/$name $*" | sed 's/\\/\\\\/g; s/"/\\"/g')" >>"$out/runs.json"
}
# The full run's numbers of samples and rounds are what half an hour on two processors has room for.
if [ "$mode" = full ]; then
    rounds=5 spp=1,4,16,64 reference=256
else
    rounds=3 spp=1,4,16 reference=128
fi
measure bench_bvh --json --rounds "$rounds" --batch --double --compact ${EMBREE4:+--embree4 "$EMBREE4"}
# With peers the benchmark would measure fewer of our own methods: here all join.
measure bench_error_time --json --spp "$spp" \
    --methods path,light,bsdf,independent,path+best,path+balanced,path+fast ${peers:+--peers "$peers"}
measure bench_denoise --json --reference-spp "$reference" --cache "$out/references" --pictures "$out/pictures" \
    ${peers:+--peers "$peers"}
measure bench_materials --json --spp 64 --pictures "$out/pictures" ${peers:+--peers "$peers"}
for name in filter skip frame load compile_time experiments; do
    measure "bench_$name" --json
done
[ "$mode" = quick ] || measure bench_instructions --json --instructions # where valgrind is; a minute and a half
least=0.2
[ "$mode" = full ] || least=0.01
measure micro --benchmark_format=json "--benchmark_min_time=$least"

"$bin/report" "$out" || failed=1
exit "$failed"
