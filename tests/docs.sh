#!/bin/sh
# Programs in the docs are ones that the tests compile. Behind a line "<!-- FILE [REGION] -->" a block of code is what
# stands between "// REGION: begin" and "// REGION: end" in FILE (REGION is "readme" where it isn't named), and no C++
# stands anywhere else. Links lead somewhere.
#   sh tests/docs.sh [--write]      --write brings the docs up to date
set -eu
cd "$(dirname -- "$0")/.."
fresh=$(mktemp)
trap 'rm -f "$fresh"' EXIT
failures=0

for page in README.md CONTRIBUTING.md SECURITY.md docs/*.md docs/guides/*.md; do
    awk -v page="$page" '
    inside { if (/^```$/) inside = 0; else next }
    { print }
    /^<!-- [^ ]+ ?[^ ]* -->$/ { file = $2; region = $3 == "-->" ? "readme" : $3; wanted = 1; next }
    wanted && /^```(cpp|cmake|sh)$/ {
        taken = lines = regions = 0
        mark = "^ *(//|#) " region ": "
        while ((getline line < file) > 0) {
            if (line ~ mark "begin$") {
                taken = 1
                first = regions++ > 0
                if (!first) { match(line, /^ */); indented = RLENGTH }
            }
            else if (line ~ mark "end$") taken = 0
            else if (taken) {
                if (line ~ /^ *(\/\/|#) [a-z_]+: (begin|end)$/) continue
                if (first && line !~ /^[ }]/) print ""
                print substr(line, 1, indented) ~ /^ *$/ ? substr(line, indented + 1) : line
                first = 0
                ++lines
            }
        }
        close(file)
        if (lines == 0) { print page ": no region " region " in " file > "/dev/stderr"; failed = 1 }
        inside = 1
        wanted = 0
        next
    }
    /^```cpp/ { print page ":" NR ": code that no test compiles" > "/dev/stderr"; failed = 1 }
    { wanted = 0 }
    END { exit failed }' "$page" >"$fresh" || failures=1
    if [ "${1:-}" = --write ]; then
        cmp -s "$fresh" "$page" || cp "$fresh" "$page"
    elif ! cmp -s "$fresh" "$page"; then
        echo "$page and the code it shows differ; 'sh tests/docs.sh --write' mends it:"
        diff "$page" "$fresh" || true
        failures=1
    fi
    for link in $(sed '/^```/,/^```/d' "$page" | grep -oE '\]\([^)#:]+\)' | tr -d '()]'); do
        [ -e "$(dirname -- "$page")/$link" ] || {
            echo "$page: there is no $link"
            failures=1
        }
    done
done
exit "$failures"
