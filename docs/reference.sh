#!/bin/sh
# Installs what is missing and makes the reference of the headers: build/docs/html/index.html. Fails on any warning, and on a
# struct, class, enumeration, type, variable or function of ours without a comment; members of structs may lack one.
#   sh docs/reference.sh
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
sh "$root/cmake/install_packages.sh" docs
cd "$root"
out=build/docs
mkdir -p "$out"
{
    cat docs/Doxyfile
    echo "WARN_IF_UNDOCUMENTED = YES
          WARN_AS_ERROR = NO
          WARN_LOGFILE = $out/warnings.txt"
} | doxygen -
# A deduction guide says nothing that its class does not.
grep -v -e ' of \(class\|struct\) .* is not documented' -e ' -> .* is not documented' "$out/warnings.txt" >"$out/left.txt" || true
if [ -s "$out/left.txt" ]; then
    cat "$out/left.txt" >&2
    exit 1
fi
echo "$root/$out/html/index.html"
