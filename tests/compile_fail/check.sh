#!/bin/sh
# A case compiles with -DRIGHT; without it, it does not, and the compiler names the reason: the extended regular
# expression behind "// names: " in the case's first line.
#   sh tests/compile_fail/check.sh CASE.cpp COMPILER [flags...]
set -eu
case_file=$1
shift
reason=$(sed -n '1s|^// names: ||p' "$case_file")
[ -n "$reason" ] || {
    echo "$case_file: its first line names no reason"
    exit 1
}
"$@" -fsyntax-only -DRIGHT "$case_file" || {
    echo "$case_file does not compile with -DRIGHT either: it would fail for any reason"
    exit 1
}
output=$(mktemp)
trap 'rm -f "$output"' EXIT
if "$@" -fsyntax-only "$case_file" >"$output" 2>&1; then
    echo "$case_file compiles, and must not"
    exit 1
fi
if ! grep -qE "$reason" "$output"; then
    echo "$case_file does not compile, but the compiler does not name: $reason"
    cat "$output"
    exit 1
fi
