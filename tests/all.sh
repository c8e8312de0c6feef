#!/bin/sh
# The suite under other compilers, sanitizers, flags and machines; hours on a small computer.
#   sh tests/all.sh [configuration...]
# Each builds in build/all/<configuration>. Prints a line for each, and last "N passed, N failed" of all.
# What holds under -ffast-math has programs of its own in each (fast_math, and watertight_*): other tests compare NaN and
# infinities, which only bits tell there.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
every="compilers dev clang asan tsan clang-asan sse2 avx2 no-contract no-oiio aarch64"
[ $# -gt 0 ] || set -- $every
sh "$root/cmake/install_packages.sh" base tests bench mpi all
cd "$root"
all=$root/build/all
mkdir -p "$all"
results=$all/results.txt
: >"$results"

# suite NAME TESTS cmake-arguments: TESTS is a regular expression, of names of tests; but for all of them, ".",
# the rooms' programs alone are built
suite() {
    name=$1 tests=$2
    target=all
    [ "$tests" = . ] || target=test_rooms
    shift 2
    echo "== $name"
    build=$all/$name
    built=0
    { cmake -S . -B "$build" -G Ninja "$@" && cmake --build "$build" --target "$target" -- -k 0; } >"$build.build.log" 2>&1 || built=$?
    [ "$built" -eq 0 ] || tail -n 40 "$build.build.log"
    ctest --test-dir "$build" --verbose --no-tests=error -R "$tests" >"$build.tests.log" 2>&1 || true
    sh tests/count.sh "$build.tests.log" "$built" >"$build.count" || true
    cat "$build.count"
    printf '%-12s %s\n' "$name" "$(tail -n 1 "$build.count")" >>"$results"
}
# Rays, film and denoising by every compiler that is here, as C++20 and C++23, without exceptions and run-time types.
compilers() {
    echo "== compilers"
    passed=0 failed=0
    for compiler in g++ clang++ clang++-16; do
        command -v "$compiler" >/dev/null || continue
        for level in 20 2b; do
            if "$compiler" -std=c++$level -O1 -fno-exceptions -fno-rtti -Wall -Wextra -Wpedantic -Wshadow -Wconversion \
                -Wsign-conversion -Wno-psabi -Werror -Iinclude tests/consumer/parts.cpp -o "$all/parts" && "$all/parts"; then
                passed=$((passed + 1))
            else
                failed=$((failed + 1))
                echo "FAILED: $compiler -std=c++$level"
            fi
        done
    done
    printf '%-12s %s\n' compilers "$passed passed, $failed failed" | tee -a "$results"
}
release=-DCMAKE_BUILD_TYPE=Release
debug=-DCMAKE_BUILD_TYPE=RelWithDebInfo
native=-DLAMBENT_NATIVE=ON
strict=-DLAMBENT_WERROR=ON
no_bench=-DLAMBENT_BUILD_BENCH=OFF
address='-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer'
rooms='^(core|sampling|bvh|film|denoise|material|light|scene|render|fast_math)$'
programs='^(core|sampling|bvh|film|denoise|material|light|scene|render|fast_math|io)$'

configuration() {
    case $1 in
    compilers) compilers ;;
    dev) suite dev . $debug $native $strict ;;
    clang) suite clang . $release $native $strict -DCMAKE_CXX_COMPILER=clang++ ;;
    asan) suite asan "$programs" $debug $native $no_bench "-DCMAKE_CXX_FLAGS=$address" ;;
    tsan) TSAN_OPTIONS="suppressions=$root/tests/tsan.supp" suite tsan "$programs" $debug $native $no_bench "-DCMAKE_CXX_FLAGS=-fsanitize=thread -fno-omit-frame-pointer" ;;
    clang-asan) suite clang-asan "$programs" $debug $native $no_bench -DCMAKE_CXX_COMPILER=clang++ "-DCMAKE_CXX_FLAGS=$address" ;;
    sse2) suite sse2 . $release $strict $no_bench ;;
    avx2) suite avx2 "$programs" $release $strict $no_bench '-DCMAKE_CXX_FLAGS=-mavx2 -mfma' ;;
    no-contract) suite no-contract "$programs" $release $native $no_bench -DCMAKE_CXX_FLAGS=-ffp-contract=off ;;
    no-oiio) suite no-oiio . $release $native $strict $no_bench -DLAMBENT_WITH_OIIO=OFF ;;
    aarch64)
        arm=$all/aarch64-root
        mkdir -p "$arm/include" "$arm/share/cmake"
        cp -R /usr/include/glm /usr/include/doctest "$arm/include"
        for package in glm doctest; do
            for folder in /usr/share/cmake /usr/lib/cmake; do
                [ ! -d "$folder/$package" ] || cp -R "$folder/$package" "$arm/share/cmake"
            done
        done
        suite aarch64 "$rooms" $release $strict $no_bench -DLAMBENT_BUILD_EXAMPLES=OFF \
            -DLAMBENT_AARCH64_ROOT="$arm" -DCMAKE_TOOLCHAIN_FILE="$root/tests/aarch64.cmake"
        ;;
    *)
        echo "all.sh: no configuration '$1'; there are: $every" >&2
        exit 2
        ;;
    esac
}
for chosen in "$@"; do
    configuration "$chosen"
done

echo
cat "$results"
awk '{ passed += $2; failed += $4 } END { printf "%d passed, %d failed\n", passed, failed; exit failed > 0 }' "$results"
