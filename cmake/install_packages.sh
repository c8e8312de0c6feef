#!/bin/sh
# Installs Debian packages that are missing, and nothing when all are there.
#   sh cmake/install_packages.sh base [tests] [bench] [mpi] [docs] [all]
set -eu

# openimageio-tools is not needed: we look for the library itself, not for Debian's CMake package of it.
packages_of() {
    case $1 in
    base) echo g++ cmake ninja-build libglm-dev libtinygltf-dev libopenimageio-dev libopenexr-dev ;;
    tests) echo doctest-dev binutils ;;
    bench) echo libbenchmark-dev libembree-dev libtinyobjloader-dev valgrind ;;
    mpi) echo libopenmpi-dev openmpi-bin ;;
    docs) echo doxygen ;;
    all) echo clang clang-16 libclang-rt-14-dev clang-format pkg-config g++-aarch64-linux-gnu qemu-user ;;
    *)
        echo "install_packages.sh: no package set '$1'; there are: base tests bench mpi docs all" >&2
        exit 2
        ;;
    esac
}

wanted=
for set_name in "$@"; do
    names=$(packages_of "$set_name")
    wanted="$wanted $names"
done

if ! command -v dpkg-query >/dev/null 2>&1; then
    echo "This is no Debian: its packages$wanted are taken to be there under other names." >&2
    exit 0
fi

missing=
for package in $wanted; do
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo >/dev/null 2>&1; then
    as_root=sudo
else
    echo "Missing packages, and neither root nor sudo to install them. As root:" >&2
    echo "  apt-get install --no-install-recommends$missing" >&2
    exit 1
fi

echo "Installing$missing" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -y -q -o DPkg::Lock::Timeout=600 "$@" >"$log" 2>&1 || {
        tail -n 30 "$log" >&2
        echo "apt-get $* failed" >&2
        exit 1
    }
}
apt update
# shellcheck disable=SC2086  # a list of words
apt install --no-install-recommends $missing
