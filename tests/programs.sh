#!/bin/sh
# What render, denoise and merge have in common, and what takes a terminal or a signal.
#   sh tests/programs.sh RENDER DENOISE MERGE
set -eu
render=$1 denoise=$2 merge=$3
guide=$(CDPATH='' cd -- "$(dirname -- "$0")/../docs/guides" && pwd)/programs.md
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
wrong() {
    echo "programs: $1" >&2
    [ ! -f said ] || head -c 2000 said >&2
    exit 1
}
expect() { # exit code, what it says, program, arguments
    code=0
    "$3" $4 >said 2>&1 || code=$?
    [ "$code" = "$1" ] || wrong "$3 $4: exit code $code instead of $1"
    grep -q -e "$2" said || wrong "$3 $4: does not say '$2'"
}

# Help: complete, and its examples are command lines that the programs take.
for program in "$render" "$denoise" "$merge"; do
    expect 0 '^usage: ' "$program" --help
    grep -q 'exit code: 0 done' said || wrong 'the exit codes are not in the help'
    grep -qi 'not yet' said && wrong 'the help speaks of what is not there yet'
    grep '^      [a-z]' said >examples
    [ "$(wc -l <examples)" -ge 3 ] || wrong 'there are no examples in the help'
    while read -r name arguments; do
        eval "program_of_example=\$$name"
        expect 0 '^usage: ' "$program_of_example" "$arguments --help"
    done <examples
done
"$render" --help >said
for option in --time-limit --error-target --resume --sample-range --checkpoint --crop --pixel --explain --validate; do
    grep -q "^      render .*$option" said || wrong "there is no example of $option"
done

# So are those of the guide.
sed -n '/^```sh/,/^```/s/^\(render\|denoise\|merge\) /&/p' "$guide" | sed 's/  *#.*//' >examples
[ "$(wc -l <examples)" -ge 20 ] || wrong 'there are no examples in the guide'
while read -r name arguments; do
    eval "program_of_example=\$$name"
    expect 0 '^usage: ' "$program_of_example" "$arguments --help"
done <examples

# A wrong name or value: the nearest right one.
expect 2 "unknown option '--sp'; did you mean '--spp'?" "$render" 'builtin:cornell --sp 3'
expect 2 "did you mean '--method'?" "$denoise" 'a.exr --metod best'
expect 2 "did you mean '--preview'?" "$merge" 'a.film b.film --previw x.png'
expect 2 "did you mean 'stratified'?" "$render" 'builtin:cornell --sampler stratfied'
expect 2 "did you mean 'balanced'?" "$merge" 'a.film b.film --denoise balance'
expect 2 "did you mean 'albedo'?" "$denoise" 'a.exr --aov albdo --out b.exr'
expect 2 "unknown option '--zzzzzzzzzzzzz'$" "$render" 'builtin:cornell --zzzzzzzzzzzzz'
expect 1 'none.film' "$merge" 'a.film none.film'
expect 1 'none.exr' "$denoise" 'none.exr --out b.exr'

# Interrupted: the command line that it prints goes on to the same bytes, whatever the names.
"$render" builtin:cornell --size 32x24 --spp 1000000 --quiet --checkpoint --out "it's half.exr" >said 2>&1 &
child=$!
tries=0
while [ ! -f "it's half.film" ] && [ "$tries" -lt 600 ]; do
    tries=$((tries + 1))
    sleep 0.1
done
kill -INT "$child"
code=0
wait "$child" || code=$?
[ "$code" = 130 ] || wrong "interrupted: exit code $code"
command=$(sed -n 's/^  //p' said)
done=$(sed -n 's/^interrupted: \([0-9]*\) samples a pixel are saved.*/\1/p' said)
more=$((done + 3))
eval "$command --spp $more" || wrong "'$command' does not go on"
"$render" builtin:cornell --size 32x24 --spp $more --quiet --out whole.exr
cmp whole.exr "it's half.exr" || wrong 'what went on is another image'

# Progress: lines now and then where stderr is no terminal, a bar where it is one.
scene='builtin:cornell --size 64x48 --spp 1000000000 --denoise none --out p.exr'
expect 0 '[0-9.]* %, .* samples, .*/s, 0:0[0-9] left' "$render" "$scene --time-limit 2.5"
expect 0 'error .* for a target of' "$render" "builtin:cornell --size 32x24 --error-target 1e-9 --time-limit 2.5 --out p.exr"
if command -v script >/dev/null 2>&1; then
    script -qec "'$render' builtin:cornell --size 64x48 --spp 64 --denoise none --out p.exr" /dev/null >said 2>&1 </dev/null
    tr '\r' '\n' <said >lines
    grep -q '^\[#*\.\.*\] *[0-9]* %, .*/s, 0:[0-9]* left' lines || wrong 'there is no bar on a terminal'
    grep -q '^\[#*\] 100 %' lines || wrong 'the bar does not come to its end'
    script -qec "'$render' builtin:cornell --size 64x48 --spp 64 --quiet --denoise none --out p.exr" /dev/null >said 2>&1 </dev/null
    [ ! -s said ] || wrong '--quiet is not'
else
    echo 'SKIPPED: progress on a terminal: there is no program script'
fi
