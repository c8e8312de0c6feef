#!/bin/sh
# The include rules hold, and each of them is noticed when broken.
#   sh tests/include_rules.sh [CMAKE [ROOT]]      without them: cmake, and the project around this script
set -eu
cmake=${1:-cmake}
root=${2:-$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)}
command -v "$cmake" >/dev/null || {
    echo "usage: sh tests/include_rules.sh [CMAKE [ROOT]]; no program '$cmake'" >&2
    exit 2
}
rules=$root/cmake/IncludeRules.cmake
"$cmake" -D LAMBENT_INCLUDE_DIR="$root/include" -P "$rules"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
# caught FILE LINE REASON: with LINE in FILE the rules must fail and say REASON
caught() {
    rm -rf "$work/include"
    mkdir -p "$work/include/lambent/$(dirname "$1")"
    printf '%s\n' "$2" >"$work/include/lambent/$1"
    if "$cmake" -D LAMBENT_INCLUDE_DIR="$work/include" -P "$rules" >"$work/out" 2>&1; then
        echo "not noticed: $2 in $1"
        failures=1
    elif ! tr -s ' \n' ' ' <"$work/out" | grep -q "$3"; then
        echo "noticed for another reason: $2 in $1"
        cat "$work/out"
        failures=1
    fi
}
caught core/a.hpp '#include <lambent/film/film.hpp>' 'core may include only core'
caught denoise/a.hpp '#include <lambent/scene/scene.hpp>' 'denoise may include only'
caught bvh/a.hpp '  # include <lambent/scene/scene.hpp>' 'bvh may include only'
caught render/a.hpp '#include <lambent/io/exr.hpp>' 'render may include only'
caught lambent.hpp '#include <lambent/io/exr.hpp>' 'the umbrella leaves io out'
caught film/a.hpp '#include <glm/vec3.hpp>' 'core/matrix.hpp only'
caught bvh/a.hpp '#include <immintrin.h>' 'core/simd_mask.hpp only'
caught scene/a.hpp '#include <OpenEXR/ImfHeader.h>' 'through io only'
caught scene/a.hpp '#include <tiny_gltf.h>' 'through io only'
caught film/a.hpp '#include <iostream>' 'not outside io'
caught film/a.hpp '#include <thread>' 'core/parallel.hpp only'
caught film/a.hpp '#include "film.hpp"' 'angle brackets'
caught other/a.hpp '#include <vector>' 'no room'
exit "$failures"
