"""Reads the pictures that the programs write, and compares them as darm-probe does."""
import array
import math
import struct
import sys
import zlib
from pathlib import Path


def read_png(path):
    """(width, height, bytes) of an 8-bit RGB picture, top row first."""
    data = Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert (depth, colour, interlace) == (8, 2, 0), "not 8-bit RGB"
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, stride = zlib.decompress(packed), 3 * width
    above, rows = bytearray(stride), []
    for y in range(height):
        start = y * (stride + 1)
        row = bytearray(raw[start + 1:start + 1 + stride])
        unfilter(raw[start], row, above)
        rows.append(row)
        above = row
    return width, height, b"".join(rows)


def unfilter(kind, row, above):
    """PNG's row filters (ISO/IEC 15948, 9.2), for three bytes a pixel."""
    for i in range(len(row) if kind else 0):
        left = row[i - 3] if i >= 3 else 0
        corner = above[i - 3] if i >= 3 else 0
        if kind == 1:
            guess = left
        elif kind == 2:
            guess = above[i]
        elif kind == 3:
            guess = (left + above[i]) // 2
        else:
            near_left, near_above = abs(above[i] - corner), abs(left - corner)
            near_corner = abs(left + above[i] - 2 * corner)
            if near_left <= near_above and near_left <= near_corner:
                guess = left
            else:
                guess = above[i] if near_above <= near_corner else corner
        row[i] = (row[i] + guess) & 255


def read_pfm(path):
    """(width, height, display values 0..1) of a linear picture, top row first."""
    data = Path(path).read_bytes()
    _, size, scale, body = data.split(b"\n", 3)
    width, height = map(int, size.split())
    values = array.array("f", body[:12 * width * height])
    if (float(scale) < 0) != (sys.byteorder == "little"):
        values.byteswap()
    stride, rows = 3 * width, []
    for y in reversed(range(height)):  # stored bottom row first
        rows.extend(map(encoded, values[y * stride:(y + 1) * stride]))
    return width, height, rows


def encoded(linear):
    v = min(1.0, max(0.0, linear))
    return v * 12.92 if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055


def psnr(png, reference):
    """dB against `reference` (NAME.pfm) by its two halves, whose noise cancels (client/core/image_metrics.hpp)."""
    width, height, picture = read_png(png)
    base = str(reference)[:-len(".pfm")]
    halves = [read_pfm(f"{base}.{half}.pfm") for half in "ab"]
    assert all(half[:2] == (width, height) for half in halves), "pictures of different sizes"
    error = sum((p / 255 - a) * (p / 255 - b) for p, a, b in zip(picture, halves[0][2], halves[1][2]))
    return -10 * math.log10(max(1e-10, error / len(picture)))
