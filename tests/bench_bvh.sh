#!/bin/sh
# The benchmark of rays as its users run it: keys, files that go out and come back, threads, refusals. No times.
#   sh tests/bench_bvh.sh BENCH_BVH      BENCH_BVH: the program
set -eu
bench=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
fail() {
    echo "$1"
    failures=1
}
count() { # PATTERN FILE
    grep -c -e "$1" "$2" || true
}
expect() { # COUNT PATTERN FILE: so many lines of the file hold it
    found=$(count "$2" "$work/$3")
    [ "$found" -eq "$1" ] || fail "$3: $found lines with '$2' instead of $1"
}
refused() { # STATUS ARGUMENTS...
    wanted=$1
    shift
    status=0
    "$bench" "$@" >/dev/null 2>"$work/message" || status=$?
    [ "$status" -eq "$wanted" ] || fail "'$*' ended with $status instead of $wanted"
    [ -s "$work/message" ] || fail "'$*' said nothing"
}

small="builtin:cornell --size 32 --rounds 1 --json"
"$bench" $small --double --threads 2 --embree absent.so >"$work/alone.json" 2>"$work/message"
expect 1 'absent.so' message # Embree is told to be missing, and done without
expect 10 '"library":"lambent","variant":"float",' alone.json # five classes on one thread, five on two
expect 5 '"variant":"float",.*"threads":2' alone.json
expect 10 '"variant":"double",.*"wrong":0,"differing":0,' alone.json # it is the reference
for key in scene class library variant batch build_s bytes_per_triangle mrays_per_s ratio_to_embree wrong; do
    [ "$(count "\"$key\":" "$work/alone.json")" -ge 20 ] || fail "there is no key $key"
done
expect 3 '"class":"build",.*"mtris_per_s":' alone.json
answers() { # THREADS: what was counted, without times
    grep "\"threads\":$1,.*mrays_per_s" "$work/alone.json" | sed 's/.*\("class":"[^"]*"\).*\("variant":"[^"]*"\).*\("wrong":[0-9]*,"differing":[0-9]*\).*/\1 \2 \3/'
}
[ "$(answers 1)" = "$(answers 2)" ] || fail "two threads answered otherwise than one"

"$bench" $small --batch >"$work/embree.json" 2>"$work/message" # where Embree 3 is installed
if [ ! -s "$work/message" ]; then
    expect 12 '"library":"embree","variant":"high",.*"ratio_to_embree":1.0000' embree.json # five classes, builds, and their means
    expect 5 '"variant":"high-packets8","batch":true,.*mrays_per_s' embree.json
    expect 5 '"variant":"high-packets16","batch":true,.*mrays_per_s' embree.json
    expect 5 '"scene":"geomean",.*"variant":"float","batch":false,.*"worst_scene":"builtin:cornell"' embree.json
fi

mkdir "$work/out" "$work/again"
"$bench" $small --write-rays "$work/out" >/dev/null
tri=$work/out/builtin:cornell.tri
[ $(($(od -An -tu4 -N4 "$tri") * 36 + 4)) -eq "$(wc -c <"$tri")" ] || fail "the soup is not as long as it says"
for class in primary:0 ao:1 shadow:1 bounce:0 bounce2:0; do
    rays=$work/out/builtin:cornell_${class%:*}.rays
    set -- $(od -An -tu4 -N16 "$rays")
    [ "$1 $2 $4" = "1398358354 ${class#*:} 0" ] || fail "${class%:*} has the head $*"
    [ $(($3 * 32 + 16)) -eq "$(wc -c <"$rays")" ] || fail "${class%:*} is not as long as it says"
done
"$bench" --soup "$tri" --rays "$work/out/builtin:cornell_ao.rays" --classes none --rounds 1 --json --embree absent.so \
    --double 2>/dev/null >"$work/back.json"
ao() { # what was counted for ao, and the triangles
    sed -n "s/.*\"class\":\"[^\"]*ao.*\"variant\":\"float\".*\"threads\":1,\(\"triangles\":[0-9]*\).*\(\"rays\":[0-9]*\).*\(\"wrong.*\),\"ratio_to_embree\":.*/\1 \2 \3/p" "$work/$1"
}
[ -n "$(ao back.json)" ] && [ "$(ao back.json)" = "$(ao alone.json)" ] || fail "rays from a file: '$(ao back.json)', made: '$(ao alone.json)'"
"$bench" --soup "$tri" --write-rays "$work/again" --size 32 >/dev/null
cmp -s "$tri" "$work/again/builtin:cornell.tri" || fail "a soup came back changed"

refused 2 $small --classes primary,reflections
refused 2 $small --rounds 0
refused 1 "$work/no.glb" --json
refused 1 $small --embree4 "$work/no.so"
head -c 1000 "$tri" >"$work/short.tri"
refused 1 --soup "$work/short.tri"
refused 1 $small --rays "$tri"
"$bench" --help >"$work/help"
expect 1 '0x53594152' help
exit "$failures"
