#!/bin/sh
# What the programs do where files fail: a full disk, a place that cannot be written, a kill amid a write, no file handles
# left, missing textures. Each time a clear error, and what was there before stays whole.
#   sh tests/stress/files.sh RENDER DENOISE MERGE
# Prints lines of the stress suite's table. The naive way is to write onto the file itself.
set -eu
render=$1 denoise=$2 merge=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
tries=0 failures=0 all_failures=0
wrong() {
    echo "files: $1"
    [ ! -s said ] || sed 's/^/    /' said
    failures=$((failures + 1))
}
row() { # property, naive figure
    awk -v property="$1" -v tries="$tries" -v failures="$failures" -v naive="$2" 'BEGIN {
        printf "STRESS %-13s | %-88s | %9.3g | %8d | %9.2e | %8.1e | %9.2e\n", "files", property, tries, failures, failures, 0, naive }'
    [ "$2" -gt 0 ] || wrong "the naive way loses nothing: this test sees no fault"
    all_failures=$((all_failures + failures))
    tries=0 failures=0
}
# expect CODE TEXT command...: it ends with this code and says the text; nothing that was there has changed.
expect() {
    expected=$1 text=$2
    shift 2
    tries=$((tries + 1))
    code=0
    "$@" >said 2>&1 || code=$?
    [ "$code" = "$expected" ] || wrong "$*: ended with $code instead of $expected"
    grep -q -e "$text" said || wrong "$*: does not say '$text'"
    links=$(find . -type l ! -name '*.part')
    [ -z "$links" ] || { wrong "$*: $links counts as written" && rm $links; }
    sha256sum -c --quiet sums >/dev/null 2>&1 || wrong "$*: a file that was there changed"
}
# Pictures of the same few samples, so that a file is either the old one or the new one.
picture() {
    "$render" builtin:cornell --size 40x30 --quiet --threads 2 --float "$@"
}
picture --spp 2 --checkpoint --out old.exr --stats old.json
picture --sample-range 2:4 --out more.exr
"$render" builtin:cornell --size 8x6 --spp 1 --quiet --aov none --denoise none --out tiny.exr
"$denoise" old.exr --out clean.exr >said 2>&1
"$merge" both.film old.film more.film --quiet
sha256sum ./*.exr ./*.film old.json >sums

# Full disks: a device that is always full stands in for the file under way, then no file may grow beyond some bytes.
full() { # the file that cannot be written, command...
    file=$1
    shift
    ln -sf /dev/full "$file.part"
    expect 1 "$file" "$@"
    rm -f "$file.part"
}
limited() { # blocks of 512 bytes, command...
    (
        trap '' XFSZ # the signal would end the program, whose write is to fail
        ulimit -f "$1"
        shift
        exec "$@"
    )
}
if [ -c /dev/full ]; then
    full old.exr picture --spp 3 --out old.exr
    full old.film picture --spp 3 --checkpoint --out old.exr
    full tiny.exr "$render" builtin:cornell --size 8x6 --spp 2 --quiet --aov none --denoise none --out tiny.exr
    full old.json picture --spp 3 --out other.exr --stats old.json
    rm -f other.*
    full clean.exr "$denoise" old.exr --out clean.exr
    full both.film "$merge" both.film old.film more.film --quiet
fi
bytes=$(wc -c <clean.exr)
for blocks in 1 8 $((bytes / 512 - 1)) $((bytes / 512)); do
    expect 1 'clean.exr' limited "$blocks" "$denoise" old.exr --float --out clean.exr
    expect 1 'both.film' limited "$blocks" "$merge" both.film old.film more.film --quiet
done
[ -z "$(find . -name '*.part')" ] || wrong 'a file under way is left over'
cp old.film naive
limited 1 cat old.film more.film >naive 2>/dev/null || true
row 'disk full at first and amid a write -> unclear errors, files lost; naive: in place' "$(cmp -s old.film naive && echo 0 || echo 1)"

# Places where no file can be.
mkdir folder.exr
for place in folder.exr nowhere/a.exr old.exr/a.exr /proc/a.exr; do
    expect 1 "${place%/*}" picture --spp 1 --out "$place"
    expect 1 "${place%/*}" "$denoise" old.exr --out "$place"
done
for input in none.exr folder.exr more.film old.json; do
    expect 1 "$input" "$denoise" "$input" --out clean.exr
    [ "$input" = more.film ] || expect 1 "$input" "$merge" both.film "$input" --quiet
done
row 'places and inputs that are none -> unclear errors, files lost; naive: in place' 1

# Killed amid a write: a pipe that nobody empties stands in for the film under way; then at any moment.
mkfifo old.film.part
exec 3<>old.film.part
"$render" builtin:cornell --size 160x120 --spp 1 --quiet --checkpoint --out old.exr >said 2>&1 &
writer=$!
dd bs=1 count=1 of=byte 2>/dev/null <&3 # it has begun
kill -9 $writer
wait $writer 2>/dev/null && wrong 'the writer was not killed'
exec 3<&-
rm -f old.film.part byte
tries=$((tries + 1))
sha256sum -c --quiet sums >/dev/null 2>&1 || wrong 'killed amid a write: a file changed'
mkdir new
picture --spp 3 --checkpoint --out new/old.exr
for delay in 0.01 0.02 0.03 0.04 0.05 0.06 0.07 0.08 0.1 0.12; do
    "$render" builtin:cornell --size 40x30 --quiet --threads 2 --float --checkpoint --spp 3 --out old.exr >said 2>&1 &
    writer=$!
    sleep $delay
    kill -9 $writer 2>/dev/null || true
    wait $writer 2>/dev/null || true
    tries=$((tries + 1))
    for file in old.exr old.film; do
        grep "$file" sums | sha256sum -c --quiet >/dev/null 2>&1 || cmp -s $file new/$file ||
            wrong "killed after $delay s: $file is neither the old nor the new one"
    done
done
rm -f ./*.part && rmdir folder.exr
sha256sum ./*.exr ./*.film old.json >sums
cp old.film naive
mkfifo pipe
cat pipe >naive &
writer=$!
{ printf x; kill -9 $writer; } >pipe
wait $writer 2>/dev/null || true
row 'kill -9 amid a write -> files neither old nor new; naive: in place' "$(cmp -s old.film naive && echo 0 || echo 1)"

# Few file handles, down to none beside the standard ones.
for handles in 3 4 5 6 8 12; do
    tries=$((tries + 1))
    code=0
    (ulimit -n $handles && picture --spp 3 --out few.exr) >said 2>&1 || code=$?
    case $code in
    0) cmp -s few.exr new/old.exr || wrong "$handles file handles: another picture" ;;
    1) grep -q -e 'few' said || wrong "$handles file handles: an unclear error" ;;
    127) grep -q -e 'shared' said || wrong "$handles file handles: not even the loader's error" ;;
    *) wrong "$handles file handles: ended with $code" ;;
    esac
    [ "$code" = 0 ] || [ ! -e few.exr ] || wrong "$handles file handles: a file in spite of an error"
    rm -f few.*
done
row 'few file handles -> crashes, files in spite of errors; naive: a file of nothing' "$( (: >nothing) && [ ! -s nothing ] && echo 1)"

# Textures and parts of scenes that are missing.
cat >scene.mtl <<'END'
newmtl a
Kd 0.5 0.5 0.5
map_Kd missing_texture.png
END
printf 'mtllib scene.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n' >scene.obj
sed 's/scene.mtl/missing_library.mtl/' scene.obj >library.obj
printf '{"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":"missing_buffer.bin"}],"scenes":[{}]}' >scene.gltf
expect 0 'missing_texture.png: no such file' "$render" scene.obj --size 8x8 --spp 1 --out scene.exr
expect 0 missing_library.mtl "$render" library.obj --size 8x8 --spp 1 --out library.exr
expect 1 'File not found : missing_buffer.bin' "$render" scene.gltf --size 8x8 --spp 1 --out buffer.exr
[ -e scene.exr ] && [ -e library.exr ] && [ ! -e buffer.exr ] || wrong 'pictures of scenes with missing parts'
row 'missing textures, libraries, buffers -> unnamed; naive: nobody looks' 1

[ "$all_failures" = 0 ]
