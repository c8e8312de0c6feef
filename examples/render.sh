#!/bin/sh
# Installs what is missing, builds the renderer and runs it with the arguments given.
#   sh examples/render.sh [render's arguments]      paths are taken from the folder you call it in
# Without arguments it renders builtin:cornell, denoised, to out.exr and out.png in the project's root.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
sh "$root/cmake/install_packages.sh" base

build=$root/build/release
log=$build/build.log
mkdir -p "$build"
[ -x "$build/examples/render" ] || echo "Building the renderer; the first time takes a few minutes." >&2
quietly() {
    (cd "$root" && "$@") >"$log" 2>&1 || {
        cat "$log" >&2
        echo "The build failed: $log" >&2
        exit 1
    }
}
if [ ! -f "$build/build.ninja" ] || [ -n "$(find "$root/CMakePresets.json" -newer "$build/build.ninja")" ]; then
    quietly cmake --preset release
fi
quietly cmake --build --preset release --target render

if [ $# -eq 0 ]; then
    set -- builtin:cornell --out "$root/out.exr" --preview "$root/out.png"
fi
exec "$build/examples/render" "$@"
