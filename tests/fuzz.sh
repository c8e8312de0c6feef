#!/bin/sh
# Builds the libFuzzer targets of tests/fuzz with address and undefined-behaviour sanitizers, seeds each with the shared
# scenes' files of its kind, and runs it.
#   sh tests/fuzz.sh [EXECUTIONS [TARGET...]]      1000000 of all; TARGET as denoise, exr, film, gltf, image, mtl, obj, tree
# A finding stops its target and lies in build/fuzz/findings. Last line: "N passed, N failed".
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
executions=1000000
if [ $# -gt 0 ]; then
    executions=$1
    shift
fi
cd "$root"
[ $# -gt 0 ] || set -- $(ls tests/fuzz | sed -n 's/_fuzz\.cpp$//p')
work=$root/build/fuzz
shared=$root/../shared/scenes
clang=${CLANGXX:-clang++}
sanitizers='-fsanitize=address,undefined -fno-sanitize-recover=all'
mkdir -p "$work/findings"

printf 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }\n' >"$work/empty.cpp"
if ! "$clang" -fsanitize=fuzzer "$work/empty.cpp" -o "$work/empty" >/dev/null 2>&1; then
    echo "SKIPPED: fuzzing: $clang cannot link libFuzzer (Debian: clang, libclang-rt-14-dev)"
    echo "0 passed, 0 failed"
    exit 0
fi
[ -d "$shared" ] || echo "SKIPPED: seeds of the shared scenes: no folder $shared"

exr=$(pkg-config --cflags --libs OpenEXR 2>/dev/null || echo "-I/usr/include/OpenEXR -I/usr/include/Imath -lOpenEXR")
build() { # NAME SOURCE flags...
    name=$1 source=$2
    shift 2
    # shellcheck disable=SC2086  # lists of words
    "$clang" -std=c++20 -O1 -g -Wno-psabi -fno-omit-frame-pointer $sanitizers -Iinclude -Itests "$source" -o "$work/$name" "$@" \
        -Wl,--as-needed $exr -ltinygltf -lpthread
}
seed() { # TARGET extensions...
    corpus=$work/corpus/$1
    mkdir -p "$corpus"
    shift
    for extension in "$@"; do
        [ ! -d "$shared" ] || find "$shared" -type f -name "*.$extension" -size -256k | while read -r file; do
            cp "$file" "$corpus/$(printf %s "$file" | cksum | cut -d' ' -f1).$extension"
        done
    done
}

make_seeds() { # TARGET: small files of each kind
    build seeds tests/fuzz/seeds.cpp
    "$work/seeds" "$1" "$work/corpus/$1"
}

passed=0 failed=0
for target in "$@"; do
    length=65536 flags=
    case $target in
    exr)
        seed exr exr
        make_seeds exr
        length=16384
        ;;
    film | tree)
        seed "$target" none
        make_seeds "$target"
        length=16384
        ;;
    denoise)
        seed denoise none
        length=4096
        ;;
    gltf) seed gltf gltf glb ;;
    image)
        seed image png jpg jpeg hdr
        make_seeds image
        flags='-DLAMBENT_HAS_OIIO=1 -lOpenImageIO -lOpenImageIO_Util'
        ;;
    *) seed "$target" "$target" ;;
    esac
    echo "== $target: $executions executions of up to $length bytes"
    log=$work/$target.log
    # shellcheck disable=SC2086
    if build "$target" "tests/fuzz/${target}_fuzz.cpp" -fsanitize=fuzzer $flags &&
        "$work/$target" -runs="$executions" -max_len="$length" -timeout=2 -rss_limit_mb=2048 -malloc_limit_mb=256 \
            -print_final_stats=1 -artifact_prefix="$work/findings/$target-" "$work/corpus/$target" >"$log" 2>&1; then
        passed=$((passed + 1))
        grep -E 'number_of_executed_units|average_exec_per_sec|peak_rss' "$log"
    else
        failed=$((failed + 1))
        grep -E 'ERROR|SUMMARY|runtime error|Test unit written' "$log" || tail -n 20 "$log"
    fi
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
