#!/bin/sh
# The README's programs are those of examples/: each block behind a line "<!-- examples/FILE.cpp -->" is what stands
# between "// readme: begin" and "// readme: end" in that file, and its links lead somewhere.
#   sh tests/readme.sh [--write]      --write brings the README up to date
set -eu
cd "$(dirname -- "$0")/.."
fresh=$(mktemp)
trap 'rm -f "$fresh"' EXIT
awk '
inside { if (/^```$/) inside = 0; else next }
{ print }
/^<!-- examples\/.*\.cpp -->$/ { file = $2; blocks[++count] = file; wanted = 1; next }
wanted && /^```cpp$/ {
    taken = lines = regions = 0
    while ((getline line < file) > 0) {
        if (line ~ /^ *\/\/ readme: begin$/) { taken = 1; first = regions++ > 0 }
        else if (line ~ /^ *\/\/ readme: end$/) taken = 0
        else if (taken) {
            if (first && line !~ /^[ }]/) print ""
            print line
            first = 0
            ++lines
        }
    }
    close(file)
    if (lines == 0) { print "README.md: no region to show in " file > "/dev/stderr"; failed = 1 }
    inside = 1
}
{ wanted = 0 }
END {
    if (count == 0) { print "README.md: shows no program" > "/dev/stderr"; failed = 1 }
    exit failed
}' README.md >"$fresh"

if [ "${1:-}" = --write ]; then
    cp "$fresh" README.md
elif ! cmp -s "$fresh" README.md; then
    echo "README.md and examples/ differ; 'sh tests/readme.sh --write' mends it:"
    diff README.md "$fresh" || true
    exit 1
fi
failures=0
for link in $(sed '/^```/,/^```/d' README.md | grep -oE '\]\([^)#:]+\)' | tr -d '()]'); do
    [ -e "$link" ] || {
        echo "README.md: there is no $link"
        failures=1
    }
done
exit "$failures"
