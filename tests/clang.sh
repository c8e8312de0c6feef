#!/bin/sh
# What lambent.hpp includes by clang, where it is found: it also reads templates that gcc looks into only where they are
# used. For the least processor and for this one.
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
clang=$(command -v clang++) || {
    echo 'SKIPPED: headers by clang: there is no clang++ (sh cmake/install_packages.sh all)'
    exit 0
}
status=0
for flags in '' -march=native; do
    # shellcheck disable=SC2086
    "$clang" -std=c++20 $flags -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wno-psabi -Werror \
        "-I$root/include" -include lambent/lambent.hpp -fsyntax-only -x c++ /dev/null || status=1
done
exit $status
