#!/bin/sh
# The benchmarks' report: charts, tables, escaping, a chart as a file, and broken files that are told.
#   sh tests/report.sh REPORT      REPORT: the program
set -eu
report=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
expect() { # COUNT PATTERN [FILE]: so many lines of the page hold it
    found=$(grep -c -e "$2" "$work/${3:-report.html}" || true)
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

# The chart of rays: a circle for each ratio but the base's, builds', doubles' and those of several threads; in a
# logarithmic scale, where 4 lies as far above 2 as 2 above 1.
ray() { # SCENE CLASS LIBRARY VARIANT BATCH THREADS RATIO
    echo "{\"scene\":\"$1\",\"class\":\"$2\",\"library\":\"$3\",\"variant\":\"$4\",\"batch\":$5,\"threads\":$6,\"ratio_to_embree\":$7}"
}
{
    ray a/hall ao lambent float false 1 2.0
    ray a/hall ao lambent float true 1 4.0
    ray geomean ao lambent float false 1 1.0
    ray 'b<c' ao lambent float false 1 2.0
    ray a/hall ao embree high false 1 1.0
    ray a/hall ao lambent double false 1 0.5
    ray a/hall ao lambent float false 8 3.0
    ray a/hall build lambent fast false 1 1.5
    ray a/hall shadow lambent float false 1 null
} >"$work/bench_bvh.json"
"$report" "$work" --bvh-svg "$work/rays.svg" >/dev/null
expect 2 '<svg '
expect 1 '<svg .*xmlns=' rays.svg
expect 0 '<svg .*xmlns='
expect 4 '>hall<\|>b&lt;c<\|>geometric mean<\|>ao<' rays.svg # scenes, and the one class with ratios
expect 0 'shadow\|build\|double\|b<c\|nan\|inf' rays.svg
centres() { # X|Y NAME,CLASS,SCENE: of its circles
    grep -o "<circle[^>]*><title>$2:" "$work/rays.svg" | sed "s/.*c$1='\([^']*\)'.*/\1/"
}
[ "$(grep -o '<title>' "$work/rays.svg" | wc -l)" -eq 4 ] || { echo "not 4 dots"; failures=1; }
one=$(centres x 'lambent float, ao, geomean') two=$(centres x 'lambent float, ao, a/hall')
four=$(centres x 'lambent float, batch, ao, a/hall')
awk "BEGIN { exit !($two > $one + 1 && $four - $two - ($two - $one) < .01 && ($two - $one) - ($four - $two) < .01) }" || {
    echo "ratios 1, 2, 4 lie at $one, $two, $four"
    failures=1
}
awk "BEGIN { exit !($(centres y 'lambent float, ao, geomean') > $(centres y 'lambent float, ao, b&lt;c')) }" || {
    echo "the means do not come last"
    failures=1
}

echo '{"scene":"box","class":"ao","mrays_per_s":1}' >"$work/bench_bvh.json"
if "$report" "$work" --bvh-svg "$work/none.svg" >/dev/null 2>&1; then
    echo "a chart without ratios was not refused"
    failures=1
fi

echo '{"scene": "box", "class": [1]}' >"$work/bench_bvh.json"
if "$report" "$work" >/dev/null 2>&1; then
    echo "a broken file was not told"
    failures=1
fi
exit "$failures"
