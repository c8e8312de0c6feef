#!/bin/sh
# The benchmarks' report: sections and charts, what failed and what was left out, escaping, a chart as a file, and broken
# files that are told.
#   sh tests/report.sh REPORT      REPORT: the program
set -eu
report=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
fail() {
    echo "$1"
    failures=1
}
expect() { # COUNT PATTERN [FILE]: so many lines of the page hold it
    found=$(grep -c -e "$2" "$work/${3:-report.html}" || true)
    [ "$found" -eq "$1" ] || fail "$found lines with '$2' instead of $1"
}
part() { # ID: the lines of a section of the page
    sed -n "/<h2 id='$1'>/,/<h2 id=/p" "$work/report.html" >"$work/part.html"
}
inside() { # ID COUNT PATTERN: so many lines of the section hold it
    part "$1"
    found=$(grep -c -e "$3" "$work/part.html" || true)
    [ "$found" -eq "$2" ] || fail "section $1: $found lines with '$3' instead of $2"
}
draw() {
    "$report" "$work" "$@" >/dev/null
    # Whatever the page has, it carries: no address, no file but the JSON beside it, nothing that a style sheet loads.
    expect 0 'https*:\|<link\|<script\|@import\|url(\|<iframe\|<object'
    if grep -o " \(src\|href\|data\|poster\|srcset\)='[^']*'" "$work/report.html" |
        grep -v -e "src='data:image/png;base64," -e "href='#[a-z]*'" -e "href='[a-z_]*\.json'"; then
        fail "the page loads something"
    fi
    expect 0 '[^a-z]nan[^a-z]\|[^a-z]inf[^a-z]'
}

# An empty folder: every section says that it was not measured, and the page that machine and peers are unknown.
draw
for section in error materials rays denoising filters skipping instructions frame memory loading compiling experiments small; do
    inside "$section" 1 'Not measured: [a-z_]*\.json has no rows'
done
expect 1 'machine.json is absent'
expect 13 '<li>.* left no rows'

for spp in 1 4; do
    for method in path 'a<b'; do
        echo "{\"scene\": \"box\", \"method\": \"$method\", \"spp\": $spp, \"seconds\": 0.$spp, \"rel_mse\": 0.${spp}e-1, \"rmse\": 1, \"efficiency\": 2, \"wrong\": 0}"
    done
    for method in raw best; do
        for scene in box 'mean of all scenes'; do
            echo "{\"scene\": \"$scene\", \"method\": \"$method\", \"spp\": $spp, \"rel_mse\": 0.$spp, \"seconds\": 0.5}" >>"$work/bench_denoise.json"
        done
    done
done >"$work/bench_error_time.json"
echo '{"scene": "box", "method": "render", "first_image_s": 0.1, "peak_mib": 12.5}' >>"$work/bench_error_time.json"
echo '{"scene":"box","class":"ao","library":"lambent","variant":"float","batch":false,"threads":1,"rays":9999,"mrays_per_s":12.3456789,"wrong":0}' >"$work/bench_bvh.json"
printf '{\n  "benchmarks": [\n    {\n      "name": "warp/16",\n      "cpu_time": 3.5e+00,\n' >"$work/micro.json"
: >"$work/bench_filter.json" # a benchmark that wrote nothing
echo '{"scene": "box", "feature": "alpha", "seconds_with_skip": 1, "seconds_without": 2.5, "ratio": 2.5, "equal": 1}' >"$work/bench_skip.json"
echo '{"scene": "box", "feature": "alpha", "instructions_with_skip": 100, "instructions_without": 150, "ratio": 1.5, "equal": 1}' >"$work/bench_instructions.json"
echo '{"scene": "box", "load_s": 1, "build_s": 1, "render_s": 5, "denoise_s": 2, "write_s": 1, "total_s": 10, "peak_mib": 100.5, "wrong": 0}' >"$work/bench_frame.json"
echo '{"scene": "box.glb", "library": "lambent_images", "seconds": 0.25, "right": true}' >"$work/bench_load.json"
echo '{"header": "a.hpp", "mode": "-c", "seconds": 0.5, "ratio_to_vector": 4.5, "budget": 5, "within": "true"}' >"$work/bench_compile_time.json"
echo '{"scene": "box", "differs": "by <design>", "mean_ratio": 0.995, "wrong": 0}' >"$work/bench_materials.json"
echo '{"experiment": "E1", "scene": "room", "method": "raw", "spp": 5, "rel_mse": 0.5}' >"$work/bench_experiments.json"
echo '{"date": "2001-02-03", "flags": "-O3 <x>"}' >"$work/machine.json"
echo '{"bench": "bench_skip", "seconds": 7, "status": 0, "command": "bin/bench_skip --quick"}' >"$work/runs.json"
echo 'Open Image Denoise is left out: no --peers' >"$work/bench_denoise.log"
mkdir "$work/pictures"
for what in 4_raw 4_best reference beside_cycles; do
    printf '\211PNG\r\n' >"$work/pictures/box_$what.png" # no picture, but bytes are bytes
done

draw
inside error 1 '<svg '
inside error 2 '<polyline '
inside error 1 'path *slope 1<' # error and time grow alike, here
inside rays 1 '<svg '           # rays a second; there is no Embree to compare with
inside rays 1 'Embree is not there'
inside rays 1 '<td>9999</td><td>12.35</td><td>0</td>'
inside denoising 1 "<input type='range'"
[ "$(grep -o "src='data:image/png;base64,iVBORw0K'" "$work/report.html" | wc -l)" -eq 4 ] || fail "not four pictures"
inside materials 1 '<figcaption>box: means&#39; ratio 0.995. by &lt;design&gt;'
inside filters 1 'Not measured: bench_filter.json'
inside skipping 1 '<title>alpha, box: 2.5<'
[ "$(grep -c 'Made by <code>bin/bench_skip --quick</code>' "$work/report.html")" -eq 1 ] || fail "no command at a chart"
inside skipping 1 'bin/bench_skip --quick</code>, 7 s, status 0'
inside instructions 1 '<title>alpha, box: 1.5<'
inside instructions 1 '<td>100</td><td>150</td><td>1.5</td>'
inside frame 1 '<title>box, render: 50<'
inside memory 1 '<title>box: 100.5 MiB<'
inside memory 1 '<title>render: 12.5 MiB<'
inside loading 1 '<title>lambent: 0.25 s<\|<title>lambent_images: 0.25 s<'
inside compiling 1 '<title>a.hpp, -c: 4.5, 0.5 s<'
inside experiments 1 '<svg '
inside small 1 '<td>warp/16</td><td>3.5</td>'
expect 0 'a<b\|<x>'
expect 1 '2001-02-03'
expect 2 'Open Image Denoise is left out: no --peers</li>' # at the top, and in its section
expect 1 'no row failed its check'
expect 0 'FAILED'
[ "$(grep -o '<svg ' "$work/report.html" | wc -l)" -eq "$(grep -o '<figcaption>[^<]* Made by <code>' "$work/report.html" | wc -l)" ] ||
    fail "a chart does not say what it shows and what made it"

# Rays are counted by who answers them, and crossed out where they are many.
for wrong in 1 3; do
    echo "{\"scene\":\"box\",\"class\":\"bounce\",\"library\":\"lambent\",\"variant\":\"float\",\"batch\":false,\"threads\":1,\"rays\":15000,\"ratio_to_embree\":$wrong,\"wrong\":$wrong}"
done >>"$work/bench_bvh.json"
draw
expect 1 '<li>bench_bvh: lambent float answers 4 of 39999 rays unlike double'
inside rays 1 '<title>FAILED: lambent float, bounce, box: 3<'
inside rays 1 '<title>lambent float, bounce, box: 1<'

# What failed stands at the top by name, in its chart as a cross and in its table in red; so does a missed budget.
echo '{"scene": "box", "feature": "front", "seconds_with_skip": 1, "seconds_without": 3, "ratio": 3.0, "equal": 0}' >>"$work/bench_skip.json"
echo '{"scene": "box", "feature": "front", "instructions_with_skip": 100, "instructions_without": 100, "ratio": 1, "equal": 0}' >>"$work/bench_instructions.json"
echo '{"header": "b.hpp", "mode": "-c", "seconds": 0.5, "ratio_to_vector": 9.5, "budget": 5, "within": "false"}' >>"$work/bench_compile_time.json"
echo '{"scene": "box", "load_s": 1, "build_s": 1, "render_s": 50, "denoise_s": 2, "write_s": 1, "total_s": 10, "wrong": 1}' >>"$work/bench_frame.json"
printf '    },\n    {\n      "name": "bad",\n      "error_occurred": true,\n      "cpu_time": 1.0,\n' >>"$work/micro.json"
echo '{"bench": "bench_load", "seconds": 1, "status": 1, "command": "bin/bench_load"}' >>"$work/runs.json"
echo 'the <reason>' >"$work/bench_load.log"
draw
expect 0 'no row failed its check'
expect 1 '<li>bench_skip: scene box, feature front,.* equal 0'
expect 1 '<li>bench_instructions: scene box, feature front,.* equal 0'
expect 1 '<li>bench_compile_time: header b.hpp,.* within false'
expect 1 '<li>bench_frame: scene box.* wrong 1'
expect 1 '<li>micro: function bad, wrong true'
expect 1 '<li>bench_load ended with status 1; the &lt;reason&gt;'
inside skipping 1 '<title>FAILED: front, box: 3<'
inside compiling 1 '<title>FAILED: b.hpp, -c: 9.5'
inside skipping 1 "<tr class='bad'><td>box</td><td>front<"
inside frame 1 'FAILED'
rm "$work"/*.json "$work"/*.log

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
draw --bvh-svg "$work/rays.svg"
inside rays 1 '<svg '
expect 1 '<svg .*xmlns=' rays.svg
expect 0 '<svg .*xmlns='
[ "$(grep -o '>hall<\|>b&lt;c<\|>geometric mean<\|>ao<' "$work/rays.svg" | sort -u | wc -l)" -eq 4 ] || fail "a scene or the class has no label"
expect 0 'shadow\|build\|double\|b<c\|nan\|inf' rays.svg
centres() { # x|y NAME,CLASS,SCENE: of its circles
    grep -o "<circle[^>]*><title>$2:" "$work/rays.svg" | sed "s/.*c$1='\([^']*\)'.*/\1/"
}
[ "$(grep -o '<title>[^<]*: [0-9]' "$work/rays.svg" | wc -l)" -eq 4 ] || fail "not 4 dots"
one=$(centres x 'lambent float, ao, geomean') two=$(centres x 'lambent float, ao, a/hall')
four=$(centres x 'lambent float, batch, ao, a/hall')
awk "BEGIN { exit !($two > $one + 1 && $four - $two - ($two - $one) < .01 && ($two - $one) - ($four - $two) < .01) }" ||
    fail "ratios 1, 2, 4 lie at $one, $two, $four"
awk "BEGIN { exit !($(centres y 'lambent float, ao, geomean') > $(centres y 'lambent float, ao, b&lt;c')) }" ||
    fail "the means do not come last"

refused() { # REASON ARGUMENTS...
    reason=$1
    shift
    if "$report" "$work" "$@" >/dev/null 2>&1; then fail "$reason"; fi
}
echo '{"scene":"box","class":"ao","mrays_per_s":1}' >"$work/bench_bvh.json"
refused "a chart without ratios was not refused" --bvh-svg "$work/none.svg"
echo '{"scene": "box", "class": [1]}' >"$work/bench_bvh.json"
refused "a broken file was not told"
exit "$failures"
