#!/usr/bin/env python3
"""Holds the rules of who may include what (ARCHITECTURE.md, "The house"). Prints every fault; exit 1 if there is one."""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PEERS = ("actors/renderer", "actors/tile_scheduler", "actors/encoder", "actors/session")
BELOW = ("actors/atlas", "actors/scene", "actors/types")

# Room -> rooms it may include besides itself. Peers are handled apart. The longest prefix decides.
ROOMS = {
    "actors/types": (),
    "actors/runtime": (),
    "actors/scene": ("actors/types",),
    "actors/atlas": ("actors/scene", "actors/types"),
    "actors/renderer/trace": BELOW,
    "actors/renderer": BELOW,
    "actors/tile_scheduler": BELOW,
    "actors/encoder": BELOW,
    "actors/session": BELOW + ("proto",),
    "proto": (),
    "client": ("proto", "client/core"),
    "client/core": ("proto",),
    "client/probe": ("proto", "client/core"),
    "client/load": ("proto", "client/core"),
    "client/desktop": ("proto", "client/core"),
    "daemon": ("actors", "proto"),
}

# Library -> where alone its headers may be included (besides tests).
LIBRARIES = {
    r"(boost/)?(asio|beast)\b": r"actors/session/|actors/.*_actor\.|client/|daemon/[^/]*$",
    r"boost/beast": r"actors/session/web_listener\.cpp",
    r"openssl/": r"actors/session/(self_signed|tls_context)\.cpp|client/core/byte_stream\.cpp",
    r"GLFW/": r"client/desktop/(window|controls|overlay)\.cpp",
    r"imgui|backends/imgui": r"client/desktop/overlay\.cpp",
    r"tiny_?gltf": r"actors/scene/",
    r"embree3/": r"actors/renderer/trace/",
    r"libav(codec|util)/|libswscale/": r"actors/encoder/h264_|client/core/video_decoder|tests/",
    r"toml\+\+|toml\.hpp": r"daemon/config/toml_value\.cpp|client/core/camera_path\.cpp",
    r"prometheus/": r"daemon/observe/prometheus_sink\.cpp",
}

INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)', re.MULTILINE)


def room_of(path):
    fits = [room for room in ROOMS if path.startswith(room + "/")]
    return max(fits, key=len) if fits else None


def in_room(path, room):
    return path.startswith(room + "/")


def fault_of_own(path, room, included):
    """Why `path` (in `room`) may not include our file `included`, or None."""
    target = room_of(included)
    if target is None:
        return None if (ROOT / included).exists() is False else "is outside of every room"
    if in_room(included, room):
        return None
    if target == "actors/runtime" and in_room(path, "actors"):
        if included == "actors/runtime/overflow.hpp":
            return None
        if room == "actors/session" or "_actor." in pathlib.PurePath(path).name:
            return None
        return "only *_actor.* and session/ may include runtime/ (overflow.hpp is free)"
    if any(in_room(included, allowed) for allowed in ROOMS[room]):
        return None
    if in_room(path, "actors/renderer") and in_room(included, "actors/renderer"):
        return None
    if any(in_room(path, peer) for peer in PEERS):
        if included.endswith("_messages.hpp") and any(in_room(included, peer) for peer in PEERS):
            return None
        if in_room(included, "actors/renderer/trace"):
            return None
        if room == "actors/encoder" and target == "proto":
            return None
    return f"{room} may not include {target}"


def faults_of(path, text):
    room = room_of(path)
    if room is None:
        return
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        own, library = match.groups()
        included = own or library
        if own:
            if not (ROOT / own).exists() and (ROOT / path).parent.joinpath(own).exists():
                yield line, f'"{own}": includes are relative to the repository root'
                continue
            if room_of(own):
                reason = fault_of_own(path, room, own)
                if reason:
                    yield line, f'"{own}": {reason}'
                continue
        for pattern, allowed in LIBRARIES.items():
            if re.match(pattern, included) and not re.match(allowed, path):
                yield line, f"<{included}>: a library behind one door ({allowed})"


def main():
    names = subprocess.run(["git", "ls-files", "*.hpp", "*.cpp", "*.h"], cwd=ROOT, check=True, capture_output=True,
                           text=True).stdout.split()
    count = 0
    for name in names:
        path = ROOT / name
        if not path.exists() or name.startswith("tests/"):
            continue
        for line, text in faults_of(name, path.read_text(encoding="utf-8")):
            print(f"{name}:{line}: {text}")
            count += 1
        if name.endswith(".hpp") and "#pragma once" not in path.read_text(encoding="utf-8"):
            print(f"{name}:1: #pragma once is missing")
            count += 1
    print(f"includes: {len(names)} files, {count} faults")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
