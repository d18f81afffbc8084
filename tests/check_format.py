#!/usr/bin/env python3
"""clang-format over every tracked C++ file, two processes. Exit 1 and the names if one is not formatted."""
import concurrent.futures
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main():
    names = subprocess.run(["git", "ls-files", "*.hpp", "*.cpp"], cwd=ROOT, check=True, capture_output=True,
                           text=True).stdout.split()
    names = [name for name in names if (ROOT / name).exists()]
    chunks = [names[i:i + 20] for i in range(0, len(names), 20)]

    def check(chunk):
        run = subprocess.run(["clang-format-19", "--dry-run", "-Werror", *chunk], cwd=ROOT, capture_output=True, text=True)
        return sorted({line.split(":")[0] for line in run.stderr.splitlines() if "error:" in line})

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        bad = [name for found in pool.map(check, chunks) for name in found]
    for name in bad:
        print(f"{name}: not formatted; run clang-format-19 -i on it")
    print(f"format: {len(names)} files, {len(bad)} faults")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
