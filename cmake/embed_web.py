#!/usr/bin/env python3
"""Writes a C++ file that holds the files of a folder as darm::web_client_files(), each also gzip-compressed, and
brotli-compressed where FILE.br lies beside it.  usage: embed_web.py FOLDER OUT.cpp"""
import gzip
import hashlib
import pathlib
import re
import sys

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
}
# esbuild's hash in a name: it changes with the content.
LASTING = re.compile(r"-[A-Z0-9]{8}\.[a-z]+$")


def literal(data):
    """`data` as adjacent string literals: compilers read them far faster than lists of numbers."""
    octal = ["\\%03o" % byte for byte in range(256)]
    plain = {byte: chr(byte) for byte in range(32, 127) if chr(byte) not in '"\\?'}
    table = [plain.get(byte, octal[byte]) for byte in range(256)]
    lines = ("".join(table[byte] for byte in data[at:at + 100]) for at in range(0, len(data), 100))
    return "\n".join(f'    "{line}"' for line in lines) or '    ""'


def main():
    folder, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    text = ["// Made by cmake/embed_web.py.", '#include "daemon/web_client.hpp"', "namespace darm {", "namespace {",
            "std::span<const std::uint8_t> bytes(const char* data, std::size_t size) {",
            "  return {reinterpret_cast<const std::uint8_t*>(data), size};", "}"]
    entries = []
    for number, path in enumerate(sorted(p for p in folder.iterdir() if p.suffix in TYPES)):
        plain = path.read_bytes()
        forms = {"plain": plain, "gzip": gzip.compress(plain, 9, mtime=0), "brotli": b""}
        brotli = path.with_name(path.name + ".br")
        if brotli.exists():
            forms["brotli"] = brotli.read_bytes()
        if len(forms["gzip"]) >= len(plain):
            forms["gzip"] = b""
        for form, data in forms.items():
            text.append(f"const char k{number}_{form}[] =\n{literal(data)};")
        spans = ", ".join(f"bytes(k{number}_{form}, {len(data)})" for form, data in forms.items())
        lasting = "true" if LASTING.search(path.name) else "false"
        tag = hashlib.sha256(plain).hexdigest()[:16]
        entries.append(f'    {{"/{path.name}", "{TYPES[path.suffix]}", "{tag}", {lasting}, {spans}}},')
    text += ["}  // namespace", "session::WebFiles web_client_files() {", "  static const session::WebFile kFiles[] = {",
             *entries, "  };", "  return kFiles;", "}", "}  // namespace darm", ""]
    out.write_text("\n".join(text), encoding="ascii")


if __name__ == "__main__":
    main()
