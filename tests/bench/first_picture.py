#!/usr/bin/env python3
"""Seconds and bytes to the first complete picture over an emulated link, cold (nobody has looked at the scene yet) and
warm, beside the size of the scene's file.

  tests/bench/first_picture.py config/scenes/sponza.toml --scene PATH/sponza.glb --camera atrium

The picture is drawn by darm-probe in software on the same cores as the daemon. Cameras go over TCP, through the link.
"""
import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

from slow_link import SlowLink  # noqa: E402


def serve(arguments, state):
    command = [arguments.bin / "darmd", "serve", "--config", arguments.set_up, "--state-dir", state, "--address", "127.0.0.1",
               "--tcp-port", "0", "--udp-port", "0", "--metrics-port", "-1", "--http-port", "-1"]
    if arguments.scene:
        command += ["--scene", arguments.scene]
    daemon = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    found = re.search(r"ready: tcp 127\.0\.0\.1:(\d+)", daemon.stdout.readline())
    if not found:
        sys.exit("darmd did not start: " + " ".join(map(str, command)))
    return daemon, int(found[1])


def visit(arguments, port):
    done = subprocess.run(
        [arguments.bin / "darm-probe", "--server", f"127.0.0.1:{port}", "--setup", arguments.set_up, "--camera", arguments.camera,
         "--size", arguments.size, "--seconds", str(arguments.seconds), "--no-udp", "--json"],
        capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set_up")
    parser.add_argument("--scene", type=Path, help="the scene's file; without it, that of the set-up")
    parser.add_argument("--camera", required=True)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--seconds", type=float, default=8, help="of each visit")
    parser.add_argument("--mbit", type=float, default=20)
    parser.add_argument("--rtt", type=float, default=40, help="milliseconds")
    parser.add_argument("--bin", type=Path, default=ROOT / "build/release/bin")
    arguments = parser.parse_args()
    file = arguments.scene or ROOT / "config/scenes/default.glb"
    size = file.stat().st_size
    with tempfile.TemporaryDirectory(prefix="darm-first-") as state:
        daemon, port = serve(arguments, state)
        try:
            link = SlowLink(port, arguments.mbit, arguments.rtt)
            for name, to in (("cold", link.port), ("warm", link.port), ("warm, loopback", port)):
                report = visit(arguments, to)
                for what in ("first_picture", "first_image"):
                    m = report[what]
                    print(f"{name}, {what}: {m['seconds']:.2f} s, {m['bytes']['total'] / 1e6:.2f} MB, "
                          f"{m['bytes']['total'] / size:.3f} of the file's {size / 1e6:.2f} MB; {m['chunks']} of "
                          f"{report['chunks']} chunks; " + ", ".join(f"{k} {v}" for k, v in m["bytes"].items()), flush=True)
            link.stop()
        finally:
            daemon.terminate()
            daemon.wait()


if __name__ == "__main__":
    main()
