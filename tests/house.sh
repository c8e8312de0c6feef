#!/bin/sh
# Rules about our own files that no compiler checks.
#   sh tests/house.sh [ROOT]      without it: the project around this script
set -eu
cd "${1:-$(dirname -- "$0")/..}"
failures=$(mktemp)
trap 'rm -f "$failures"' EXIT

sources() {
    find include tests examples bench -type f \( -name '*.hpp' -o -name '*.cpp' -o -name '*.inl' \) | sort
}
headers() {
    find include -type f -name '*.hpp' | sort
}
# Comments and strings taken out line by line, so that prose may say what code may not.
code_of() {
    sed -e 's/"\([^"\\]\|\\.\)*"/""/g' -e 's|//.*||' "$1"
}

sources | while read -r file; do
    lines=$(wc -l <"$file")
    [ "$lines" -le 450 ] || echo "$file: $lines lines, 450 are allowed"
    if grep -nE '//.*\b(TODO|FIXME|XXX)\b' "$file"; then echo "$file: unfinished work is no comment"; fi
done >>"$failures"

headers | while read -r file; do
    [ "$(head -n 1 "$file")" = '#pragma once' ] || echo "$file: its first line is not #pragma once"
    sed -nE 's/^[ \t]*#[ \t]*define[ \t]+([A-Za-z_0-9]+).*/\1/p' "$file" | grep -v '^LAMBENT_' |
        sed "s|^|$file: a macro without our prefix: |" || true
    code_of "$file" | grep -nE '\b(std::(cout|cerr|clog)|printf|fprintf|puts|putchar|perror)\b' |
        sed "s|^|$file: prints: |" || true
    code_of "$file" | grep -nE '\b(exit|_Exit|quick_exit|terminate)[ \t]*\(' | sed "s|^|$file: ends the program: |" || true
    [ "$file" = include/lambent/core/error.hpp ] ||
        code_of "$file" | grep -nE '\b(throw\b|abort[ \t]*\()' | sed "s|^|$file: only core/error.hpp throws: |" || true
    code_of "$file" | grep -nE '^using namespace\b' | sed "s|^|$file: opens a namespace for its users: |" || true
done >>"$failures"

# The umbrella holds every header outside io/.
headers | sed 's|^include/||' | grep -v -e '^lambent/io/' -e '^lambent/lambent.hpp$' | while read -r header; do
    grep -q "^#include <$header>$" include/lambent/lambent.hpp || echo "include/lambent/lambent.hpp: lacks <$header>"
done >>"$failures"

if [ -s "$failures" ]; then
    cat "$failures"
    exit 1
fi
