#!/bin/sh
# The stress suite in full, about an hour on two processors: rays at edges and vertices in any number, under compiler
# flags that round differently and in every SIMD layout; every property of tests/stress, a hundred times as large as in
# the quick suite; radiance with a closed form by every sampler and strategy, and means of the reference scenes.
#   sh tests/stress.sh [--rays TOTAL] [--jobs N] [--seed S]     1e9 rays, as many jobs as processors, seed 1
# Builds in build/stress. Prints what each program did; then the table of properties, with the figure of the textbook's
# way beside ours; a line for each set of flags; and last "N passed, N failed". The table is build/stress/properties.txt
# too. CXX and CXXFLAGS count; the flags of a set come after those.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
rays=1e9
jobs=$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
seed=1
usage() {
    echo "usage: sh tests/stress.sh [--rays TOTAL] [--jobs N] [--seed S]" >&2
    exit 2
}
while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || usage
    case $1 in
    --rays) rays=$2 ;;
    --jobs) jobs=$2 ;;
    --seed) seed=$2 ;;
    *) usage ;;
    esac
    shift 2
done
sh "$root/cmake/install_packages.sh" base tests
cd "$root"
work=$root/build/stress
rm -rf "$work"
mkdir -p "$work"

# Each a name and flags.
sets='plain -O2
native -O2 -march=native
uncontracted -O2 -march=native -ffp-contract=off
fast-math -O3 -march=native -ffast-math
avx2 -O2 -mavx2 -mfma
plain-fast-math -O2 -ffast-math'
case $(uname -m) in
x86_64) grep -q '^flags.* avx2' /proc/cpuinfo 2>/dev/null || sets=$(echo "$sets" | grep -v '^avx2 ') ;;
*) sets=$(echo "$sets" | grep -v '^avx2 ') ;;
esac
number=$(echo "$sets" | wc -l)
each=$(awk "BEGIN { printf \"%.0f\", $rays / $number }")

echo "$sets" >"$work/sets"
# one: a set's line and seed; its program is built and run, its exit status written
cat >"$work/one.sh" <<EOF
name=\$1 seed=\$2
shift 2
status=0
{ \${CXX:-g++} -std=c++20 -Wno-psabi \${CXXFLAGS:-} "\$@" -I include -I tests tests/stress/watertight.cpp -o "$work/\$name" &&
    "$work/\$name" --rays $each --seed "\$seed"; } >"$work/\$name.log" 2>&1 || status=\$?
echo "\$status" >"$work/\$name.status"
EOF
awk -v seed="$seed" '{ name = $1; $1 = ""; print name, seed + NR - 1, $0 }' "$work/sets" |
    xargs -P "$jobs" -L 1 sh "$work/one.sh"

passed=0 failed=0
: >"$work/table"
while read -r name flags; do
    echo "== $name: $flags"
    cat "$work/$name.log"
    status=$(cat "$work/$name.status" 2>/dev/null || echo none)
    if [ "$status" = 0 ]; then
        passed=$((passed + 1)) verdict=passed
    else
        failed=$((failed + 1)) verdict="FAILED ($status)"
    fi
    awk -v flags="$flags" -v verdict="$verdict" '
        /^Moeller/ { plain = $(NF - 3) }
        $1 == "all" { counted = $7; doubles = $8; even = $10 }
        END { printf "%-40s %12s %7s %11s %9s %6s %9s  %s\n", flags, $1, $3, counted, doubles, even, plain, verdict }
    ' "$work/$name.log" >>"$work/table"
done <"$work/sets"

# What the suite leaves out for its time. Each a function that builds and runs it.
light() {
    name=$1
    echo "== $name"
    status=0
    "$name" >"$work/$name.log" 2>&1 || status=$?
    cat "$work/$name.log"
    if [ "$status" = 0 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
}
closed_forms() {
    ${CXX:-g++} -std=c++20 -Wno-psabi ${CXXFLAGS:-} -O2 -march=native -I include -I tests tests/support/main.cpp \
        tests/render/closed_forms_test.cpp -pthread -o "$work/closed_forms" &&
        "$work/closed_forms" --no-skip --test-case='stress:*' --duration
}
# Reads scenes and images, whose libraries CMake finds.
means() {
    cmake -S . -B "$work/means_build" -G Ninja -D CMAKE_BUILD_TYPE=Release &&
        cmake --build "$work/means_build" --parallel "$jobs" --target test_reference &&
        "$work/means_build/tests/test_reference" --no-skip --test-case='stress:*' --duration
}
# Every property, by the programs of the quick suite in their full size.
properties() {
    cmake -S . -B "$work/means_build" -G Ninja -D CMAKE_BUILD_TYPE=Release -D LAMBENT_NATIVE=ON &&
        cmake --build "$work/means_build" --parallel "$jobs" --target test_stress render denoise merge &&
        LAMBENT_STRESS=full "$work/means_build/tests/test_stress" --duration
}
files() {
    programs=$work/means_build/examples
    sh tests/stress/files.sh "$programs/render" "$programs/denoise" "$programs/merge"
}
layouts() {
    [ "$(uname -m)" = x86_64 ] || { echo "SKIPPED: layouts: not an x86" && return; }
    for unit in 'sse2 -march=x86-64' 'avx -mavx' 'avx2 -mavx2 -mfma' 'avx512 -mavx512f -mavx512vl -mavx512dq -mavx512bw -mfma'; do
        layout=${unit%% *}
        # shellcheck disable=SC2086
        ${CXX:-g++} -std=c++20 -Wno-psabi ${CXXFLAGS:-} -O2 ${unit#* } -D LAMBENT_UNIT="${layout}_report" -I include -I tests \
            -c tests/stress/layouts/unit.cpp -o "$work/$layout.o"
    done
    ${CXX:-g++} -std=c++20 ${CXXFLAGS:-} -O2 -D LAMBENT_ALL_LAYOUTS -I tests tests/stress/layouts/main.cpp "$work"/sse2.o \
        "$work"/avx.o "$work"/avx2.o "$work"/avx512.o -pthread -o "$work/layouts_program" && "$work/layouts_program"
}
light properties
light files
light layouts
light closed_forms
light means

echo
cat "$work"/*.log | sed -n 's/^STRESS //p' >"$work/properties.txt"
printf '%-13s | %-88s | %9s | %8s | %9s | %8s | %9s\n' subject 'inputs -> figure; naive' inputs failures worst bound naive
cat "$work/properties.txt"
echo
printf '%-40s %12s %7s %11s %9s %6s %9s\n' flags rays misses counted doubles even plain/1e6
cat "$work/table"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
