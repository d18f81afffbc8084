#!/usr/bin/env python3
"""Runs the numerical tests and prints the number of cases and the worst figure of each family.

usage: report.py [BUILD_FOLDER] [--all] [--json]   (default build/release; --all: every figure; exit 1 if a test fails)

A family's worst figure is the one that comes nearest to what is allowed.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def figures_of(report):
    """(test, figure, worst, allowed, cases) of every figure that worst.hpp recorded."""
    for suite in report["testsuites"]:
        for test in suite["testsuite"]:
            for what, text in test.items():
                parts = text.split() if isinstance(text, str) else []
                if len(parts) != 3:
                    continue
                try:
                    worst, allowed, cases = float(parts[0]), float(parts[1]), int(parts[2])
                except ValueError:
                    continue
                yield {"test": f"{suite['name']}.{test['name']}", "figure": what, "worst": worst, "allowed": allowed,
                       "cases": cases}


def nearness(figure):
    worst, allowed = figure["worst"], figure["allowed"]
    if worst != worst:
        return float("inf")
    return worst / allowed if allowed > 0 else (0.0 if worst <= allowed else float("inf"))


def run(program):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "report.json"
        code = subprocess.run([program, f"--gtest_output=json:{out}"], stdout=subprocess.DEVNULL).returncode
        return code, json.loads(out.read_text(encoding="utf-8"))


def main():
    options = [a for a in sys.argv[1:] if a.startswith("-")]
    folders = [a for a in sys.argv[1:] if not a.startswith("-")]
    if set(options) - {"--all", "--json"} or len(folders) > 1:
        print(__doc__, file=sys.stderr)
        return 2
    binaries = pathlib.Path(folders[0] if folders else ROOT / "build/release") / "bin"
    programs = sorted(binaries.glob("numerical_*"))
    if not programs:
        print(f"report.py: no numerical_* in {binaries}; build the tests first", file=sys.stderr)
        return 2
    families = []
    for program in programs:
        code, report = run(program)
        figures = list(figures_of(report))
        families.append({"family": program.name.removeprefix("numerical_"), "tests": report["tests"],
                         "failures": report["failures"], "crashed": code not in (0, 1), "figures": figures,
                         "cases": sum(f["cases"] for f in figures), "worst": max(figures, key=nearness, default=None)})
    if "--json" in options:
        print(json.dumps(families, indent=1))
    else:
        print(f"{'family':14}{'tests':>6}{'failed':>7}{'cases':>10}  worst figure, against what is allowed")
        for f in families:
            shown = sorted(f["figures"], key=nearness, reverse=True) if "--all" in options else [f["worst"]]
            print(f"{f['family']:14}{f['tests']:6}{f['failures']:7}{f['cases']:10}", end="")
            for i, w in enumerate(w for w in shown if w):
                print(" " * (37 if i else 0) + f"  {w['worst']:.3g} of {w['allowed']:.3g}: {w['figure']} ({w['test']})")
        print(f"{'all':14}{sum(f['tests'] for f in families):6}{sum(f['failures'] for f in families):7}"
              f"{sum(f['cases'] for f in families):10}")
    return 1 if any(f["failures"] or f["crashed"] for f in families) else 0


if __name__ == "__main__":
    sys.exit(main())
