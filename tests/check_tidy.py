#!/usr/bin/env python3
"""clang-tidy over our sources that do not include a heavy library themselves, so that it stays within minutes.

Sources of one folder are checked as one: most of the time goes to headers, which are the same for all of them. Where
two cannot stand in one translation unit (names of theirs collide), their group is halved until they do not meet.

usage: check_tidy.py BUILD_FOLDER [FILE ...]   (BUILD_FOLDER has the compile_commands.json; FILES: only these)
"""
import concurrent.futures
import itertools
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Headers that take clang-tidy longer than a few seconds each.
HEAVY = re.compile(r'#\s*include\s*[<"](boost/|toml|nlohmann/|spdlog/|prometheus/|Eigen/|tiny_?gltf|draco/|'
                   r'CLI/|google/protobuf|.*\.pb\.h)')
LARGEST_GROUP = 15
# That the sources are included in one another is the method here.
TIDY = ["clang-tidy-19", "--quiet", "--checks=-bugprone-suspicious-include"]


def compile_flags(build):
    """By source: the flags that decide what it says, without those of the other compiler's code and warnings."""
    with open(pathlib.Path(build) / "compile_commands.json", encoding="utf-8") as file:
        entries = json.load(file)
    flags = {}
    for entry in entries:
        words = iter(shlex.split(entry["command"])[1:])
        flags[os.path.realpath(entry["file"])] = list(itertools.chain.from_iterable(
            [word, next(words)] if word == "-isystem" else [word]
            for word in words if word == "-isystem" or re.match("-I|-D|-std=", word)))
    return flags


def sources(flags):
    tracked = subprocess.run(["git", "ls-files", "actors/*.cpp", "client/*.cpp", "daemon/*.cpp", "proto/*.cpp"], cwd=ROOT,
                             check=True, capture_output=True, text=True).stdout.split()
    for name in tracked:
        path = ROOT / name
        if not path.exists() or os.path.realpath(path) not in flags:
            continue
        header = path.with_suffix(".hpp")
        text = path.read_text(encoding="utf-8") + (header.read_text(encoding="utf-8") if header.exists() else "")
        if not HEAVY.search(text):
            yield name


def groups(names, flags):
    """Sources of one folder with the same flags, in groups of about one size."""
    def kind(name):
        return os.path.dirname(name), flags[os.path.realpath(ROOT / name)]
    for _, members in itertools.groupby(sorted(names, key=kind), kind):
        members = list(members)
        count = -(-len(members) // LARGEST_GROUP)
        for i in range(count):
            yield members[i * len(members) // count:(i + 1) * len(members) // count]


def check(group, flags):
    """What clang-tidy says of the group, and whether that is a fault."""
    with tempfile.TemporaryDirectory() as folder:
        unit = pathlib.Path(folder) / "group.cpp"
        unit.write_text("".join(f'#include "{ROOT / name}"\n' for name in group), encoding="utf-8")
        run = subprocess.run([*TIDY, f"--config-file={ROOT / '.clang-tidy'}", unit, "--",
                              *flags[os.path.realpath(ROOT / group[0])]], cwd=ROOT, capture_output=True, text=True)
    if "[clang-diagnostic-error]" in run.stdout and len(group) > 1:
        half = len(group) // 2
        parts = [check(group[:half], flags), check(group[half:], flags)]
        return "".join(output for output, _ in parts), any(bad for _, bad in parts)
    fault = run.returncode != 0
    return (run.stdout or run.stderr) if fault else "", fault


def main():
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    flags = compile_flags(sys.argv[1])
    named = [os.path.relpath(os.path.realpath(name), ROOT) for name in sys.argv[2:]]
    names = sorted(set(named)) or list(sources(flags))
    unknown = [name for name in names if os.path.realpath(ROOT / name) not in flags]
    if unknown or not names:
        print(f"tidy: {', '.join(unknown) or 'no sources'}: not in {sys.argv[1]}/compile_commands.json", file=sys.stderr)
        return 2

    def timed(group):
        begin = time.monotonic()
        return group, *check(group, flags), time.monotonic() - begin

    bad = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        for group, output, fault, seconds in pool.map(timed, groups(names, flags)):
            if fault:
                bad += 1
                print(output.strip())
            print(f"{'FAULT' if fault else 'ok':5} {seconds:5.1f} s  {os.path.dirname(group[0])}: "
                  f"{', '.join(os.path.basename(name) for name in group)}", flush=True)
    print(f"tidy: {len(names)} files, {bad} groups with faults")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
