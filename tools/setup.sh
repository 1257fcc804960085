#!/usr/bin/env bash
# Installs what the project builds and runs with: Debian packages and a local Python environment.
# setup.sh checks: what the checks of the sources need, too.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  build-essential cmake ninja-build ccache git python3-venv python3-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-calib3d-dev
  libopencv-video-dev libopencv-features2d-dev libturbojpeg0-dev libpng-dev libeigen3-dev
  libyaml-cpp-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libembree-dev libsqlite3-dev
  libzstd-dev liblz4-dev libbz2-dev libboost-dev
  libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev libceres-dev
  liboctomap-dev octomap-tools assimp-utils
)
if [ "${1:-}" = checks ]; then packages+=(clang-16 clang-format-16 clang-tidy-16); fi
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

if [ "${1:-}" = checks ]; then exit; fi
[ -x .venv/bin/python ] || python3 -m venv .venv
echo "setup: Python environment in .venv (OpenVINO, evo, the report's Matplotlib and plotly, readers of exports)"
.venv/bin/pip install --quiet --disable-pip-version-check -r tools/requirements.txt
# Its metrics need NumPy and SciPy only; what it would pull in for video data sets is large.
.venv/bin/pip install --quiet --disable-pip-version-check --no-deps trackeval==1.3.0
# Khronos' validator of GLB files and Foxglove's own client, for one test each; where there is no
# Node.js these are skipped.
if command -v npm >/dev/null; then
  npm install --silent --no-audit --no-fund --prefix .venv/gltf-validator gltf-validator@2.0.0-dev.3.10
  npm install --silent --no-audit --no-fund --prefix .venv/foxglove @foxglove/ws-protocol@0.8.0 ws@8.23.0
fi
