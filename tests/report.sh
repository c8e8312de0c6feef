#!/bin/sh
# The benchmarks' report: charts, tables, escaping, and a broken file that is told.
#   sh tests/report.sh REPORT      REPORT: the program
set -eu
report=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
expect() { # COUNT PATTERN: so many lines of the page hold it
    found=$(grep -c -e "$2" "$work/report.html" || true)
    [ "$found" -eq "$1" ] || {
        echo "$found lines with '$2' instead of $1"
        failures=1
    }
}
for spp in 1 4; do
    for method in path 'a<b'; do
        echo "{\"scene\": \"box\", \"method\": \"$method\", \"spp\": $spp, \"seconds\": 0.$spp, \"rel_mse\": 0.25e-1, \"rmse\": 1, \"efficiency\": 2}"
    done
done >"$work/bench_error_time.json"
echo '{"scene":"box","class":"ao","mrays_per_s":12.3456789,"wrong":0,"batch":false}' >"$work/bench_bvh.json"
printf '{\n  "benchmarks": [\n    {\n      "name": "warp/16",\n      "cpu_time": 3.5e+00,\n' >"$work/micro.json"
: >"$work/bench_filter.json" # a benchmark that wrote nothing

"$report" "$work" >/dev/null
expect 1 '<svg '
expect 2 '<polyline '
expect 1 '<td>12.35</td><td>0</td><td>false</td>'
expect 1 '<td>warp/16</td><td>3.5</td>'
expect 0 'a<b'
expect 0 'nan\|inf<'
expect 0 'https*:'
expect 0 bench_filter

echo '{"scene": "box", "class": [1]}' >"$work/bench_bvh.json"
if "$report" "$work" >/dev/null 2>&1; then
    echo "a broken file was not told"
    failures=1
fi
exit "$failures"
