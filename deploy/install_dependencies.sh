#!/usr/bin/env bash
# Installs what DARM is built from and runs on, on Debian 12. Asks dpkg first and installs only what is missing, so it can
# be run at any time. With --viewer also what the desktop viewer is built from, with --tests that and what tests/run.sh
# needs; with --list it only prints the packages.
set -euo pipefail

build=(
  ca-certificates ccache cmake g++ git libavcodec-dev libavutil-dev libboost1.81-dev libcli11-dev libdraco-dev
  libegl-dev libegl-mesa0 libegl1 libeigen3-dev libembree-dev libfmt-dev libgl1-mesa-dri libgles-dev libglm-dev
  libmeshoptimizer-dev libpng-dev libprotobuf-dev libspdlog-dev libssl-dev libstb-dev libtbb-dev libtinygltf-dev
  libtomlplusplus-dev libxxhash-dev ninja-build nlohmann-json3-dev pkg-config prometheus-cpp-dev
  protobuf-compiler python3 zlib1g-dev
)
viewer=(libglfw3-dev libimgui-dev)
tests=(chromium clang-19 clang-format-19 clang-tidy-19 libclang-rt-19-dev libgmock-dev libgtest-dev xvfb)

# Debian's npm does not get along with a node from elsewhere: what is there is used.
command -v node >/dev/null || build+=(nodejs)
command -v npm >/dev/null || build+=(npm)

packages=("${build[@]}")
list=false
for argument in "$@"; do
  case "$argument" in
    --viewer) packages+=("${viewer[@]}") ;;
    --tests) packages+=("${viewer[@]}" "${tests[@]}") ;;
    --list) list=true ;;
    -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
    *) echo "install_dependencies.sh: unknown argument $argument; known are --viewer, --tests, --list" >&2; exit 2 ;;
  esac
done
if $list; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "install_dependencies.sh: this is not Debian; install these yourself: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}\n' "$package" 2>/dev/null | head -n1 || true)
  [[ "$status" == installed ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  echo "dependencies: all ${#packages[@]} packages are there"
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "install_dependencies.sh: neither root nor sudo; have these installed: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}

echo "dependencies: installing ${#missing[@]} packages: ${missing[*]}"
# A machine whose package lists are there and fresh enough needs no update.
if ! apt-cache show "${missing[@]}" >/dev/null 2>&1; then
  "${as_root[@]}" apt-get update -q
  install
elif ! install; then
  echo "dependencies: once more with new package lists"
  "${as_root[@]}" apt-get update -q
  install
fi
