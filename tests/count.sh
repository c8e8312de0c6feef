#!/bin/sh
# Counts the tests in the output of `ctest --verbose`: doctest's cases one by one, any other check once.
#   sh tests/count.sh LOG [status of the build]
# Prints what failed with its output, the skips, and last "N passed, N failed".
set -eu
awk -v built="${2:-0}" '
# Every line of a test begins with its number: "12: text".
/^[0-9]+: / {
    id = $1; sub(":", "", id)
    text = $0; sub(/^[0-9]+: /, "", text); gsub(/\033\[[0-9;]*m/, "", text)
    output[id] = output[id] "    " text "\n"
    if (text ~ /^SKIPPED: /) skips[++skipped] = substr(text, 10)
    if (text ~ /^\[doctest\] test cases: /) {
        split(text, part, /[|:]/)
        cases[id] = 1; passed_in[id] += part[3]; failed_in[id] += part[4]
    }
}
# "3/10 Test  #3: name .....   Passed    0.01 sec"
/^ *[0-9]+\/[0-9]+ Test +#[0-9]+: / {
    id = $0; sub(/^[^#]*#/, "", id); sub(/:.*/, "", id)
    name = $0; sub(/^[^#]*#[0-9]+: /, "", name); sub(/ .*/, "", name)
    ++ran
    ok = $0 ~ / Passed /
    good = id in cases ? passed_in[id] : ok
    bad = id in cases ? failed_in[id] : !ok
    if (!ok && bad == 0) bad = 1 # it crashed, or failed after its last case
    passed += good; failed += bad
    if (!ok) print "FAILED: " name "\n" output[id]
}
END {
    if (built != 0) { print "FAILED: the build"; if (failed == 0) failed = 1 }
    if (ran == 0 && failed == 0) { print "FAILED: no test ran"; failed = 1 }
    if (skipped > 0) {
        line = skipped " skipped:"
        for (i = 1; i <= skipped; ++i) line = line (i > 1 ? "; " : " ") skips[i]
        print line
    }
    printf "%d passed, %d failed\n", passed, failed
    exit failed > 0
}' "$1"
