#!/bin/sh
# Looks at the machine code of the two units of main.cpp.
#   sh tests/odr/symbols.sh NARROW.o WIDE.o PROGRAM
# 1. No function of ours has the same name in both, but for the exception type and its handler, which a whole
#    program shares on purpose.
# 2. In the program, no AVX or BMI instruction can be reached by calls from the SSE2 unit's functions.
set -eu
narrow=$1
wide=$2
program=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0

for object in narrow wide; do
    eval "file=\$$object"
    nm --defined-only "$file" | awk '$2 ~ /[TWVuBDR]/ { print $3 }' | sort -u >"$work/$object"
done
grep -q 7lambent4sse2 "$work/narrow" && grep -q 7lambent4avx2 "$work/wide" || {
    echo "the units hold no functions of ours: nothing was tested"
    exit 1
}
if comm -12 "$work/narrow" "$work/wide" | grep 7lambent | grep -v -e 7lambent5Error -e 7lambent13error_handler; then
    echo "^ in both units under one name: the linker keeps either"
    failures=1
fi

# Functions, their instructions and direct calls; then all that the SSE2 unit reaches.
objdump -d --no-show-raw-insn "$program" | awk '
/^[0-9a-f]+ <.*>:$/ { name = $2; sub(/^</, "", name); sub(/>:$/, "", name); next }
name == "" { next }
$2 ~ /^(v[a-z]|(shlx|shrx|sarx|mulx|rorx|andn|bzhi|pdep|pext)[lq]?$)/ && !($2 ~ /^ver/) { if (!(name in wide)) wide[name] = $2 }
/<[^>+]+>$/ { callee = $NF; sub(/^</, "", callee); sub(/>$/, "", callee); calls[name] = calls[name] " " callee }
END {
    for (name in calls) all[name] = 1
    for (name in wide) { all[name] = 1; ++wide_count }
    for (name in all) if (name ~ /7lambent4sse2|^_Z13narrow_report/) { queue[++last] = name; from[name] = "" }
    for (i = 1; i <= last; ++i) {
        n = split(calls[queue[i]], callees, " ")
        for (k = 1; k <= n; ++k) if (!(callees[k] in from)) { from[callees[k]] = queue[i]; queue[++last] = callees[k] }
    }
    for (i = 1; i <= last; ++i) if (queue[i] in wide) {
        print "reached from the SSE2 unit: " queue[i] " with " wide[queue[i]] ", called by " from[queue[i]]
        bad = 1
    }
    if (last < 1 || wide_count < 1) { print "nothing was tested: " last + 0 " functions reached, " wide_count + 0 " wide ones"; bad = 1 }
    exit bad
}' || failures=1
exit "$failures"
