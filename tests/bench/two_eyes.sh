#!/usr/bin/env bash
# Two clients at different eyes before one daemon at once, each against its own reference of all effects: the table of
# the private layer in ARCHITECTURE.md. Usage: two_eyes.sh OUT "CAMERA A" "CAMERA B" darmd-options...
#   e.g. two_eyes.sh out mirror "-3,1.9,1.4 -6,1.5,-0.1 50" --config config/scenes/default.toml
# SECONDS_EACH (45), SPP (200) and SIZE (640x360) from the environment; PROBE: more options of darm-probe, e.g.
# "--view-phystex 0". References are rendered once and kept in OUT.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$1 cameras=("$2" "$3")
shift 3
bin=build/release/bin size=${SIZE:-640x360}
mkdir -p "$out"
for i in 0 1; do
  [[ -f $out/reference-$i.pfm ]] || "$bin/darmd" render "$@" --camera "${cameras[i]}" --size "$size" \
    --spp "${SPP:-200}" --until-psnr 42 --state-dir "$out/render" --out "$out/reference-$i.png"
done
rm -rf "$out/state"
"$bin/darmd" serve "$@" --state-dir "$out/state" --address 127.0.0.1 --tcp-port 0 --udp-port 0 --metrics-port 0 --http-port -1 \
  > "$out/serve.log" 2>&1 &
daemon=$!
trap 'kill "$daemon" 2> /dev/null || true' EXIT
until grep -q "ready: tcp" "$out/serve.log"; do
  kill -0 "$daemon" || { cat "$out/serve.log" >&2; exit 1; }
  sleep 0.2
done
port=$(grep -o 'tcp [0-9.]*:[0-9]*' "$out/serve.log" | grep -o '[0-9]*$')
clients=()
for i in 0 1; do
  # shellcheck disable=SC2086
  "$bin/darm-probe" --server "127.0.0.1:$port" --setup config/scenes/default.toml --camera "${cameras[i]}" \
    --size "$size" --seconds "${SECONDS_EACH:-45}" --reference "$out/reference-$i.pfm" --out "$out/picture-$i.png" \
    --json ${PROBE:-} > "$out/report-$i.json" &
  clients+=($!)
done
for client in "${clients[@]}"; do wait "$client"; done
python3 - "$out" <<'PY'
import json, sys
for i in (0, 1):
    r = json.load(open(f"{sys.argv[1]}/report-{i}.json"))
    print(f"eye {i}: {r['psnr']:.2f} dB (reference's own {r['reference_psnr']:.1f}), {r['view_slots_used']} private slots, "
          f"{r['view_bytes'] / 1e6:.2f} MB private, {r['stream_bytes'] / 1e6:.2f} MB shared")
PY
