#!/usr/bin/env python3
"""clang-tidy over our sources that do not include a heavy library themselves, so that it stays within minutes.

usage: check_tidy.py BUILD_FOLDER [FILE ...]   (BUILD_FOLDER has the compile_commands.json; FILES: only these)
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Headers that take clang-tidy longer than a few seconds each.
HEAVY = re.compile(r'#\s*include\s*[<"](boost/|toml|nlohmann/|spdlog/|prometheus/|Eigen/|tiny_?gltf|draco/|'
                   r'CLI/|google/protobuf|.*\.pb\.h)')


def sources(build):
    with open(pathlib.Path(build) / "compile_commands.json", encoding="utf-8") as file:
        compiled = {os.path.realpath(entry["file"]) for entry in json.load(file)}
    tracked = subprocess.run(["git", "ls-files", "actors/*.cpp", "client/*.cpp", "daemon/*.cpp", "proto/*.cpp"], cwd=ROOT,
                             check=True, capture_output=True, text=True).stdout.split()
    for name in tracked:
        path = ROOT / name
        if not path.exists() or os.path.realpath(path) not in compiled:
            continue
        header = path.with_suffix(".hpp")
        text = path.read_text(encoding="utf-8") + (header.read_text(encoding="utf-8") if header.exists() else "")
        if not HEAVY.search(text):
            yield name


def main():
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    build = sys.argv[1]
    names = sys.argv[2:] or list(sources(build))

    def check(name):
        begin = time.monotonic()
        run = subprocess.run(["clang-tidy-19", "-p", build, "--quiet", "--extra-arg=-Wno-unknown-warning-option",
                              "--extra-arg=-Wno-unused-command-line-argument", name],
                             cwd=ROOT, capture_output=True, text=True)
        return name, run.returncode, run.stdout, time.monotonic() - begin

    bad = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        for name, code, output, seconds in pool.map(check, names):
            if code != 0:
                bad += 1
                print(output.strip())
            print(f"{'FAULT' if code else 'ok':5} {seconds:5.1f} s  {name}", flush=True)
    print(f"tidy: {len(names)} files, {bad} with faults")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
