#!/bin/sh
# Prints what the figures were measured on as one JSON object: date, processor, system, compiler, flags, revision, load.
#   sh bench/machine.sh BUILD_FOLDER MODE
set -eu
build=$1 mode=$2
cd "$(dirname -- "$0")/.."
setting() { # NAME of the build's configuration
    sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"
}
first=
member() { # NAME VALUE
    value=$(printf '%s' "$2" | tr '\n\t' '  ' | sed 's/\\/\\\\/g; s/"/\\"/g')
    printf '%s"%s": "%s"' "${first:-{}" "$1" "$value"
    first=', '
}
fact() { # FILE PATTERN: what stands behind a colon in the first line that matches
    sed -n "s/^$2[^:]*: *//p" "$1" 2>/dev/null | head -n 1
}
native=
[ "$(setting LAMBENT_NATIVE)" != ON ] || native=' -march=native'
changes=
[ -z "$(git status --porcelain --untracked-files=no 2>/dev/null)" ] || changes=' with changes'

member date "$(date -u '+%Y-%m-%d %H:%M UTC')"
member mode "$mode"
member processor "$(fact /proc/cpuinfo 'model name')"
member "logical processors" "$(getconf _NPROCESSORS_ONLN)"
member memory "$(awk '/^MemTotal/ { printf "%.1f GiB", $2 / 1048576 }' /proc/meminfo)"
member system "$(. /etc/os-release && echo "$PRETTY_NAME"), $(uname -s -r -m)"
member compiler "$("$(setting CMAKE_CXX_COMPILER)" --version | head -n 1)"
member flags "-std=c++20 $(setting CMAKE_CXX_FLAGS) $(setting CMAKE_CXX_FLAGS_RELEASE)$native"
member revision "$(git describe --always --tags 2>/dev/null || echo unknown)$changes"
member "load average before the first benchmark (others at work make times noisy)" "$(cut -d ' ' -f 1-3 /proc/loadavg)"
printf '}\n'
