#!/usr/bin/env bash
# From a fresh Debian 12 to the running daemon: packages, release build, `darmd serve` on the default scene. Run it again
# at any time: it does only what is missing. --build-only stops after the build; other arguments go to `darmd serve`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build_only=false
serve=()
for argument in "$@"; do
  case "$argument" in
    --build-only) build_only=true ;;
    -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
    *) serve+=("$argument") ;;
  esac
done

echo "== 1/3 packages"
./deploy/install_dependencies.sh

echo "== 2/3 build (release; some minutes the first time)"
if [[ ! -f build/release/build.ninja ]]; then
  # Debian's compiler, whatever CC and CXX say; the daemon alone needs no tests.
  env -u CC -u CXX cmake --preset release -DDARM_TESTS=OFF
fi
# Without npm's registry darmd is whole but for its page: that is no reason to stop. The next run tries again.
packages=client/web/packages.stamp
left_out=build/release/web_left_out
if [[ -e $left_out ]]; then cmake --preset release -DDARM_WEB=ON > /dev/null && rm "$left_out"; fi
if [[ ! -e build/release/$packages ]]; then
  echo "the web client's packages: asking npm, which takes minutes to give up where its registry cannot be reached"
fi
if ninja -C build/release -t query "$packages" &> /dev/null && ! ninja -C build/release "$packages"; then
  echo "quickstart.sh: npm could not get the web client's packages (its own words are above), so darmd's page will only" \
    "say that it is missing; other clients work. Run this again once npm reaches its registry." >&2
  cmake --preset release -DDARM_WEB=OFF > /dev/null
  touch "$left_out"
fi
targets=(darmd darm-probe)
NINJA_STATUS='[%f/%t %es] ' ninja -C build/release "${targets[@]}"
if $build_only; then
  echo "built: build/release/bin/darmd and darm-probe"
  exit 0
fi

echo "== 3/3 serve"
mkdir -p state
cat <<'TEXT'
The daemon prints a ready line with its addresses once clients can connect; stop it with Ctrl-C. Then walk in:

  http://localhost:9080/   on this machine; from others https://THIS-MACHINE:9080/ (browsers ask about the certificate first)

or, without a browser, in another terminal:

  build/release/bin/darm-probe --server 127.0.0.1:9010 --setup config/scenes/default.toml --camera hall --size 1280x720 --seconds 20 --out picture.png

A camera is a name from config/scenes/default.toml or "px,py,pz tx,ty,tz fovy". Metrics: http://127.0.0.1:9090/metrics
TEXT
exec build/release/bin/darmd serve --config config/scenes/default.toml "${serve[@]}"
