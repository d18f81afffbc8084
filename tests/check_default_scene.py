#!/usr/bin/env python3
"""Holds the default scene's hall to be without cracks: seen from inside, each edge of one of its shell's triangles is
another's too, so that nothing outside shines through where they meet. Prints the open ones; exit 1 if there are any."""
import collections
import json
import pathlib
import struct
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENE = ROOT / "config/scenes/default.glb"
SHELL = {"walls", "window wall", "vault", "floor"}
OUTSIDE = -3.2  # metres: the window wall's far face is open
FORMATS = {5123: "H", 5125: "I", 5126: "f"}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def rows(document, binary, index):
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    size = SIZES[accessor["type"]]
    values = struct.unpack_from(f"<{accessor['count'] * size}{FORMATS[accessor['componentType']]}", binary,
                                view.get("byteOffset", 0) + accessor.get("byteOffset", 0))
    return [values[i:i + size] for i in range(0, len(values), size)]


def shell_edges(data):
    """Directed edges of the shell's triangles by the positions of their ends."""
    (length,) = struct.unpack_from("<I", data, 12)
    document, binary = json.loads(data[20:20 + length]), data[20 + length + 8:]
    edges = collections.Counter()
    found = set()
    for node in document["nodes"]:
        if node.get("name") not in SHELL:
            continue
        found.add(node["name"])
        primitive = document["meshes"][node["mesh"]]["primitives"][0]
        positions = [tuple(v + 0.0 for v in p) for p in rows(document, binary, primitive["attributes"]["POSITION"])]
        corners = [i for (i,) in rows(document, binary, primitive["indices"])]
        for i in range(0, len(corners), 3):
            a, b, c = (positions[k] for k in corners[i:i + 3])
            edges.update([(a, b), (b, c), (c, a)])
    assert found == SHELL, f"not in the scene: {SHELL - found}"
    return edges


def main():
    edges = shell_edges(SCENE.read_bytes())
    faults = [f"an open edge: {a} to {b}" for (a, b), count in edges.items()
              if edges.get((b, a), 0) != count and min(a[2], b[2]) > OUTSIDE]
    print("\n".join(faults[:20]) or f"default scene: {len(edges)} edges, none open")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
