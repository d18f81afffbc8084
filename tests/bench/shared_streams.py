#!/usr/bin/env python3
"""What clients beside each other cost the daemon: one alone, several who share a stream, several with one each.

  tests/bench/shared_streams.py config/scenes/sponza.toml --scene PATH/sponza.glb --camera atrium

Each run begins with an empty store. Clients are darm-probes, which decode and draw on the same cores: the share of the machine
that is left to light falls with their number, what a frame costs does not.
"""
import argparse
import json
import re
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def serve(arguments, folder, share):
    text = Path(arguments.set_up).read_text()
    if "[stream]" in text:
        sys.exit("the set-up has a [stream] of its own")
    set_up = Path(arguments.set_up).parent / f".shared_streams_{share}.toml".lower()
    set_up.write_text(f"{text}\n[stream]\nshare = {str(share).lower()}\n")  # beside it: paths in it are relative
    command = [arguments.bin / "darmd", "serve", "--config", set_up, "--state-dir", folder / "state", "--address", "127.0.0.1",
               "--tcp-port", "0", "--udp-port", "0", "--metrics-port", "0", "--http-port", "-1"]
    if arguments.scene:
        command += ["--scene", arguments.scene]
    daemon = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    found = re.search(r"ready: tcp 127\.0\.0\.1:(\d+), .*metrics http://127\.0\.0\.1:(\d+)", daemon.stdout.readline())
    set_up.unlink()
    if not found:
        sys.exit("darmd did not start: " + " ".join(map(str, command)))
    return daemon, int(found[1]), int(found[2])


def metrics(port):
    values = {}
    for line in urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics").read().decode().splitlines():
        if line.startswith("#"):
            continue
        name, value = line.rsplit(" ", 1)
        name = name.split("{")[0]
        values[name] = values.get(name, 0) + float(value)
    return values


def processor_seconds(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100


def run(arguments, clients, share):
    with tempfile.TemporaryDirectory(prefix="darm-shared-") as folder:
        daemon, port, metrics_port = serve(arguments, Path(folder), share)
        try:
            before = processor_seconds(daemon)
            probes = [subprocess.Popen(
                [arguments.bin / "darm-probe", "--server", f"127.0.0.1:{port}", "--setup", arguments.set_up, "--camera",
                 arguments.camera[i % len(arguments.camera)], "--size", arguments.size, "--seconds", str(arguments.seconds),
                 "--view-phystex", "0", "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
                for i in range(clients)]
            reports = [json.loads(p.communicate()[0]) for p in probes]
            used = processor_seconds(daemon) - before
            seen = metrics(metrics_port)
        finally:
            daemon.terminate()
            daemon.wait()
    frames = seen["darm_encoder_frames_total"]
    coded = seen["darm_encoder_processor_seconds_total"]
    return {
        "clients": clients, "share": share, "frames": frames, "key_frames": seen["darm_encoder_key_frames_total"],
        "encode_cpu_seconds": round(coded, 2), "trace_seconds": round(seen["darm_view_trace_seconds_sum"], 2),
        "texel_samples": seen["darm_renderer_texel_samples_total"], "daemon_cpu_seconds": round(used, 1),
        "answers": sum(r["answers"] for r in reports), "error": max(r.get("error", 0) or 0 for r in reports),
        "joins": seen.get("darm_stream_joins_total", 0), "splits": seen.get("darm_stream_splits_total", 0)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set_up")
    parser.add_argument("--scene", type=Path, help="the scene's file; without it, that of the set-up")
    parser.add_argument("--camera", required=True, nargs="+", help="of the clients in turn")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--clients", type=int, default=4)
    parser.add_argument("--bin", type=Path, default=ROOT / "build/release/bin")
    arguments = parser.parse_args()
    for clients, share in ((1, True), (arguments.clients, True), (arguments.clients, False)):
        print(json.dumps(run(arguments, clients, share)), flush=True)


if __name__ == "__main__":
    main()
