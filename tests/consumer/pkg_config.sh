#!/bin/sh
# A program built by hand with what pkg-config says of the installed library.
#   sh pkg_config.sh COMPILER FOLDER_OF_LAMBENT_PC PKG_CONFIG OUTPUT
set -eu
main=$(dirname -- "$0")/main.cpp
PKG_CONFIG_PATH=$2
export PKG_CONFIG_PATH
flags=$("$3" --cflags --libs lambent)
eval "set -- \"\$1\" \"\$4\" $flags" # it escapes spaces for a shell
compiler=$1 program=$2
shift 2
"$compiler" -O0 "$main" -o "$program" "$@"
"$program"
