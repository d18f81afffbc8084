#!/usr/bin/env bash
# Installs what the tests need, builds everything and runs every test and check. Run it again at any time.
#   --quick       release build and its tests only: no clang-tidy, no sanitizers
#   --no-install  trust that the packages are there
# The last lines are ctest's own: "100% tests passed, 0 tests failed out of N".
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

quick=false
install=true
for argument in "$@"; do
  case "$argument" in
    --quick) quick=true ;;
    --no-install) install=false ;;
    -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
    *) echo "run.sh: unknown argument $argument; known are --quick, --no-install" >&2; exit 2 ;;
  esac
done

begin=$SECONDS
step() {
  local name=$1 start=$SECONDS
  shift
  echo "== $name"
  "$@"
  echo "== $name: $((SECONDS - start)) s (total $((SECONDS - begin)) s)"
}
configure() {
  env -u CC -u CXX cmake --preset release -DDARM_TESTS=ON > build/release.configure.log ||
    { cat build/release.configure.log; return 1; }
}
build() {
  NINJA_STATUS='[release %f/%t %es] ' ninja -C build/release all benches
}
# promtool alone: its package would start a Prometheus at the port where darmd has its metrics.
fetch_promtool() {
  command -v promtool > /dev/null && return
  mkdir -p build/tools
  (cd build/tools && apt-get download -q prometheus && dpkg-deb --fsys-tarfile prometheus_*.deb |
    tar x --strip-components=3 ./usr/bin/promtool && rm prometheus_*.deb) ||
    echo "promtool: not to be had; its checks are skipped"
}

export CTEST_OUTPUT_ON_FAILURE=1 PATH="$PWD/build/tools:$PATH"
mkdir -p build
if $install; then step "packages" ./deploy/install_dependencies.sh --tests; step "promtool" fetch_promtool; fi
step "configure" configure
step "build release" build
if $quick; then
  exec ctest --test-dir build/release -j "$(nproc)"
fi
step "build asan" bash tests/sanitized.sh build asan
step "build tsan" bash tests/sanitized.sh build tsan
echo "== all tests and checks"
exec ctest --test-dir build/release -C Checks -j "$(nproc)"
