#!/usr/bin/env bash
# Tests under sanitizers. usage: tests/sanitized.sh build|run asan|tsan
#   asan: address and undefined behaviour, all unit, actor and numerical tests and a second of libFuzzer per parser
#   tsan: data races, in every test that starts threads of ours and needs no minutes of compiling for it
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
step=$1
preset=$2
case "$preset" in
  asan) tests='^(unit|actor|numerical|fuzz)_' ;;
  tsan) tests='^(unit_runtime|unit_observe|unit_lifecycle|unit_client|unit_radiance_store|actor_runtime|actor_encoder|integration_session)$' ;;
  *) echo "sanitized.sh: unknown preset $preset" >&2; exit 2 ;;
esac

# Libraries of the system are not instrumented: what they do among themselves is theirs to know.
supp=$PWD/tests/sanitizers
export ASAN_OPTIONS=strict_string_checks=1:detect_stack_use_after_return=1
export LSAN_OPTIONS=suppressions=$supp/lsan.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
export TSAN_OPTIONS=suppressions=$supp/tsan.supp:halt_on_error=1:second_deadlock_stack=1

if [[ $step == build ]]; then
  env -u CC -u CXX cmake --preset "$preset" > "build/$preset.configure.log" || { cat "build/$preset.configure.log"; exit 1; }
  mapfile -t targets < <(ctest --test-dir "build/$preset" -N -R "$tests" | sed -nE 's/^ *Test *#[0-9]+: //p')
  [[ ${#targets[@]} -gt 0 ]] || { echo "sanitized.sh: no tests match $tests" >&2; exit 1; }
  NINJA_STATUS="[$preset %f/%t %es] " ninja -C "build/$preset" "${targets[@]}"
else
  exec ctest --test-dir "build/$preset" -R "$tests" --output-on-failure --no-tests=error -j "$(nproc)"
fi
