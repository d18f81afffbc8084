#!/usr/bin/env python3
"""Holds the names of metrics together: every one that is measured is told about (daemon/observe/metric_help.cpp), every
one told about is measured, and dashboards and alerts use no other. Prints every fault; exit 1 if there is one."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
HELP = ROOT / "daemon/observe/metric_help.cpp"
MEASURE = {"count": "counter", "observe": "histogram", "set": "gauge"}
# A call may hold its name on the next line, choose between two, or have it in a constant.
CALL = re.compile(r"\b(count|observe|set)\(([^;]*?\"darm_\w+\"[^;]*);")
CONSTANT = re.compile(r"constexpr const char\* \w+ = \"(darm_\w+)\"")


def measured():
    """Name -> kind, and faults."""
    kinds, faults = {}, []
    for folder in ("actors", "daemon"):
        for path in sorted((ROOT / folder).rglob("*.cpp")):
            text = path.read_text()
            for method, arguments in CALL.findall(text):
                kind = MEASURE[method]
                for name in re.findall(r"\"(darm_\w+)\"", arguments):
                    if kinds.setdefault(name, kind) != kind:
                        faults.append(f"{path.relative_to(ROOT)}: {name} is a {kinds[name]} elsewhere, a {kind} here")
            for name in CONSTANT.findall(text):
                kinds.setdefault(name, "counter")
    return kinds, faults


def used_in(path):
    """The names that Prometheus will be asked for, and those that texts speak of."""
    text = path.read_text()
    asked = " ".join(re.findall(r"\bexpr\"?: *(.*)", text))
    return set(re.findall(r"\bdarm_\w+", asked)), set(re.findall(r"\bdarm_\w+", text))


def main():
    kinds, faults = measured()
    told = set(re.findall(r"\{\"(darm_\w+)\",", HELP.read_text()))
    faults += [f"{name} is measured, but {HELP.relative_to(ROOT)} says nothing of it" for name in sorted(set(kinds) - told)]
    faults += [f"{HELP.relative_to(ROOT)} tells of {name}, which nobody measures" for name in sorted(told - set(kinds))]
    for name, kind in sorted(kinds.items()):
        if (kind == "counter") != name.endswith("_total"):
            faults.append(f"{name} is a {kind}: counters, and they alone, end in _total")
    shown = {name for name, kind in kinds.items() if kind != "histogram"}
    shown |= {name + end for name, kind in kinds.items() if kind == "histogram" for end in ("_bucket", "_sum", "_count")}
    deployed = sorted((ROOT / "deploy/grafana").glob("*.json")) + sorted((ROOT / "deploy/prometheus").glob("*.yml"))
    for path in deployed:
        asked, named = used_in(path)
        absent = (asked - shown) | (named - shown - set(kinds))
        faults += [f"{path.relative_to(ROOT)}: there is no {name}" for name in sorted(absent)]
    print("\n".join(faults) if faults else f"{len(kinds)} metrics, {len(deployed)} files that use them: all agree")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
