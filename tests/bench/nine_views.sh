#!/usr/bin/env bash
# The nine evaluation views through socket and codec: picture, ceiling, codec, slots. Each view starts from an empty
# radiance store. usage: tests/bench/nine_views.sh SCENES_DIR OUT_DIR [SCENE:FILE:CAMERA ...]
#   SCENES_DIR  holds sponza.glb, sibenik.glb and quake_oacmpdm10.glb
#   OUT_DIR     gets pictures, reports (*.json) and references (made once: SPP samples a pixel, 64 unless set)
# Needs codec_bench (ninja -C build/release codec_bench). Q=128 sets the density; SECONDS_EACH=60 and CEILING=15 the time
# of a view and of its ceiling.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
bin=build/release/bin
scenes=$1
out=$2
shift 2
views=("$@")
if [[ ${#views[@]} -eq 0 ]]; then
  views=(sponza:sponza:{atrium,arcade,gallery} sibenik:sibenik:{nave,altar,choir} quake:quake_oacmpdm10:{spawn,court,hall})
fi
mkdir -p "$out"

serve() {  # scene file state -> sets daemon, port
  "$bin/darmd" serve --config "config/scenes/$1.toml" --scene "$scenes/$2.glb" --q "${Q:-64}" --state-dir "$3" \
    --tcp-port 0 --udp-port 0 --metrics-port -1 --http-port -1 --allow-lossless > "$3/serve.log" 2>&1 &
  daemon=$!
  until grep -q '^darmd ready' "$3/serve.log"; do
    kill -0 "$daemon" || { cat "$3/serve.log" >&2; exit 1; }
    sleep 0.2
  done
  port=$(grep -o 'tcp [0-9.]*:[0-9]*' "$3/serve.log" | grep -o '[0-9]*$')
}

for view in "${views[@]}"; do
  IFS=: read -r scene file camera <<< "$view"
  reference=$out/reference-$scene-$camera
  if [[ ! -f $reference.pfm ]]; then
    "$bin/darmd" render "$scenes/$file.glb" --config "config/scenes/$scene.toml" --camera "$camera" --size 1280x720 \
      --spp "${SPP:-64}" --effects view-independent --state-dir "$out" --out "$reference.png"
  fi
  state=$out/state-$scene-${Q:-64}
  mkdir -p "$state"
  rm -f "$state"/*.store
  serve "$scene" "$file" "$state"
  probe() {
    "$bin/darm-probe" --server "127.0.0.1:$port" --setup "config/scenes/$scene.toml" --camera "$camera" --size 1280x720 \
      --view-phystex 0 --reference "$reference.pfm" --out "$out/$scene-$camera-$1.png" --json --view-phystex 0 "${@:2}" > "$out/$scene-$camera-$1.json"
  }
  probe main --seconds "${SECONDS_EACH:-60}" --ceiling-seconds "${CEILING:-15}"
  # Few slots are judged by what converged light would show: the coarser tiles that now matter are lit first.
  probe 1024 --lossless --phystex 1024 --seconds "${FEW_SLOTS:-25}" --series-interval 1000
  probe 2048 --lossless --phystex 2048 --seconds 8 --series-interval 1000
  probe unlimited --lossless --phystex 8192 --seconds 6 --series-interval 1000
  kill "$daemon"
  wait "$daemon" || true
  # On the light that is now in the store: two sessions of a running daemon would differ by the light between them.
  "$bin/codec_bench" "config/scenes/$scene.toml" "$scenes/$file.glb" "$camera" "$state" "${Q:-64}" \
    > "$out/$scene-$camera-codec.json"
  python3 - "$out" "$scene" "$camera" <<'PY'
import json, sys
out, scene, camera = sys.argv[1:]
load = lambda kind: json.load(open(f"{out}/{scene}-{camera}-{kind}.json"))
main, slots = load("main"), [load(kind)["psnr"] for kind in ("unlimited", "2048", "1024")]
codec = load("codec")["settled"]["rgb"]
print(f"{scene} {camera}: {main['psnr']:.2f} dB {main['mssim']:.3f}, ceiling {main['ceiling_psnr']:.2f} "
      f"{main['ceiling_mssim']:.3f}, reference {main['reference_psnr']:.1f}, codec {codec:.1f}; "
      f"slots unlimited {slots[0]:.2f}, 4096 {slots[1]:.2f}, 1024 {slots[2]:.2f}")
PY
done
