#!/usr/bin/env bash
# arm64_package.sh FOLDER: the Debian package for 64-bit ARM, of what `make arm64` built, into FOLDER.
# What it depends on is read in the records of tools/arm64_dpkg.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD/.venv/arm64-root
out=$(realpath -m "$1")
export DEB_HOST_ARCH=arm64 DPKG_ADMINDIR=$root/var/lib/dpkg
export LD_LIBRARY_PATH=$root/usr/lib/aarch64-linux-gnu:$root/lib/aarch64-linux-gnu  # where dpkg-shlibdeps looks
rm -f build/arm64/ygslam_*_arm64.deb
(cd build/arm64 && cpack -G DEB >&2)
mkdir -p "$out"
rm -f "$out"/ygslam_*_arm64.deb
mv build/arm64/ygslam_*_arm64.deb "$out"
ls "$out"/ygslam_*_arm64.deb
