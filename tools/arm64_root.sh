#!/usr/bin/env bash
# arm64_root.sh PACKAGES...: unpacks Debian's libraries for 64-bit ARM, and OpenVINO's, into .venv/arm64-root, for the
# preset `arm64`. This machine's own packages stay as they are. `tools/setup.sh arm64` calls it with what a build needs.
# Debian's mirror is $YGSLAM_DEBIAN_MIRROR, or the usual one.
set -euo pipefail
cd "$(dirname "$0")/.."

root=.venv/arm64-root
triple=aarch64-linux-gnu
processor=cortex-a76  # as cmake/toolchains/aarch64-linux-gnu.cmake has it, which says why
compiler=$("$triple-g++" -dumpversion)
openvino=$(grep '^openvino==' tools/requirements.txt)
. /etc/os-release
packages=(libc6-dev "libstdc++-${compiler%%.*}-dev" "$@")
wanted="$VERSION_CODENAME $openvino $processor ${packages[*]}"
if [ "$(cat "$root/ready" 2>/dev/null)" = "$wanted" ]; then exit; fi

echo "setup: libraries for 64-bit ARM in $root"
[ -x .venv/bin/python ] || python3 -m venv .venv
rm -rf "$root"
mkdir -p "$root"
all=$(IFS=,; echo "${packages[*]}")
mmdebstrap --quiet --variant=extract --architectures=arm64 --skip=check/qemu --include="$all" \
  --extract-hook="'$PWD/tools/arm64_dpkg.sh' \"\$1\" '$PWD/$root'" \
  "$VERSION_CODENAME" - ${YGSLAM_DEBIAN_MIRROR:+"$YGSLAM_DEBIAN_MIRROR"} |
  tar -x -C "$root" --no-same-owner --exclude='./dev/*'
# What the packages' scripts would set up, which are not run: Debian's choice among implementations.
for library in blas lapack; do
  ln -s "$library/lib$library.so.3" "$root/usr/lib/$triple/lib$library.so.3"
done
# Links to /lib would leave the folder: a linker took the static library.
find "$root/usr/lib/$triple" -maxdepth 1 -type l -lname '/lib/*' | while read -r link; do
  ln -sfn "../../..$(readlink "$link")" "$link"
done
# Python for 64-bit ARM, under the emulator.
printf '#!/bin/sh\nexec qemu-aarch64-static -cpu %s -L "%s" "%s/usr/bin/python3" "$@"\n' "$processor" "$PWD/$root" "$PWD/$root" \
  > "$root/python3"
chmod +x "$root/python3"

wheels=$(mktemp -d)
trap 'rm -rf "$wheels"' EXIT
.venv/bin/pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: --dest "$wheels" \
  --platform manylinux_2_35_aarch64 --platform manylinux_2_31_aarch64 --platform manylinux_2_28_aarch64 "$openvino"
.venv/bin/python -m zipfile -e "$wheels"/openvino-*.whl "$root/opt/openvino"
echo "$wanted" > "$root/ready"
