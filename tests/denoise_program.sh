#!/bin/sh
# The program denoise, run as users do.
#   sh tests/denoise_program.sh DENOISE RENDER
set -eu
denoise=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$2" builtin:cornell --size 48x32 --spp 4 --denoise none --float --quiet --out "$folder/noisy.exr"
cd "$folder"
wrong() {
    echo "denoise_program: $1" >&2
    exit 1
}
expect() { # exit code, what it says, arguments
    code=0
    "$denoise" $3 >said 2>&1 || code=$?
    [ "$code" = "$1" ] || wrong "denoise $3: exit code $code instead of $1"
    grep -q -e "$2" said || wrong "denoise $3: does not say '$2' but '$(cat said)'"
}
expect 0 'wrote  *a.exr, a.png' 'noisy.exr --out a.exr --preview a.png --stats a.json --threads 1'
expect 0 'wrote' 'noisy.exr --out=b.exr --method best --threads 2'
expect 0 'wrote' 'a.exr --out again.exr' # a denoised file gives its noisy radiance
expect 0 'wrote' 'noisy.exr --out off.exr --kernel 0 --float'
expect 0 'usage: denoise' '--help'
cmp a.exr b.exr || wrong 'threads change the image'
cmp a.exr noisy.exr >said 2>&1 && wrong 'nothing was denoised'
cmp off.exr noisy.exr || wrong 'kernel 0 changes the file'
grep -q '"missing": \["statistics"\]' a.json || wrong 'planes are missing'
# A file that brings its statistics is denoised as the renderer does it.
"$2" builtin:cornell --size 48x32 --spp 16 --denoise none --aov all,statistics --float --quiet --out statistics.exr
"$2" builtin:cornell --size 48x32 --spp 16 --denoise best --aov none --float --quiet --out best.exr
expect 0 'denoised 0.' 'statistics.exr --out same.exr --aov none --float --stats s.json'
grep -q '"missing": \[\]' s.json || wrong 'statistics are missing'
cmp best.exr same.exr || wrong 'the renderer and the program denoise differently'
grep -q '"method": "best"' a.json || wrong 'the method is not best'
expect 1 'nothing.exr' 'nothing.exr --out c.exr'
expect 1 'no/such' 'noisy.exr --out no/such/c.exr'
expect 2 'out F.exr is missing' 'noisy.exr'
expect 2 'best|balanced|fast' 'noisy.exr --out c.exr --method oidn'
expect 2 'must be odd' 'noisy.exr --out c.exr --kernel 4'
expect 2 'greater than 0' 'noisy.exr --out c.exr --sigma-normal 0'
expect 2 'no image' '--out c.exr'
[ ! -e c.exr ] || wrong 'a file was written in spite of an error'
