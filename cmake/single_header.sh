#!/bin/sh
# The library in one file, for who wants to drop it into a source tree: core, sampling, bvh, film and denoise.
#   sh cmake/single_header.sh [ROOM...] >lambent_single.hpp
# What a room includes comes along. It still needs GLM. Each header appears once, behind those that it includes.
set -eu
cd "$(dirname -- "$0")/../include"
[ $# -gt 0 ] || set -- core sampling bvh film denoise
for room in "$@"; do
    [ -d "lambent/$room" ] || {
        echo "single_header.sh: no room '$room'" >&2
        exit 2
    }
done
echo '// lambent in one file, made by cmake/single_header.sh of the headers in include/.'
sed 's|^|// |; s| *$||' ../LICENSE
echo '#pragma once'
for room in "$@"; do find "lambent/$room" -name '*.hpp'; done | LC_ALL=C sort | awk '
function expand(file,    line, name) {
    if (file in seen) return
    seen[file] = 1
    while ((getline line < file) > 0) body[file] = body[file] line "\n"
    close(file)
    lines_of(file)
}
function lines_of(file,    lines, n, i, name) {
    n = split(body[file], lines, "\n") - 1
    # what it includes of ours first, wherever the line stands
    for (i = 1; i <= n; ++i)
        if (lines[i] ~ /^#include <lambent\//) {
            name = lines[i]
            gsub(/^#include <|>.*$/, "", name)
            expand(name)
        }
    print "\n// ---- " file
    for (i = 1; i <= n; ++i) {
        if (lines[i] ~ /^#pragma once/ || lines[i] ~ /^#include <lambent\//) continue
        if (lines[i] ~ /^#include </ && depth == 0) {
            if (lines[i] in included) continue
            included[lines[i]] = 1
        }
        if (lines[i] ~ /^#if/) ++depth
        if (lines[i] ~ /^#endif/) --depth
        print lines[i]
    }
}
{ expand($0) }'
