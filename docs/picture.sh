#!/bin/sh
# Renders docs/cornell.png, the README's picture.
#   sh docs/picture.sh
set -eu
cd "$(dirname -- "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sh examples/render.sh builtin:cornell --size 400x400 --spp 256 --denoise best --exposure 1 --aov none \
    --out "$work/cornell.exr" --preview docs/cornell.png
