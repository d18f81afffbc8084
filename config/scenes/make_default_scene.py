#!/usr/bin/env python3
"""Writes default.glb, the scene that darmd shows when it is given none: a small vaulted hall.

Plain Python 3, no packages; the same script gives the same file. Units are metres, Y is up. The hall spans
x -6..6, y 0..8, z -3..3. Its windows are openings in the wall at z = -3: a sun that travels along about
(0.25, -0.5, 1) shines in. Sun and sky come from the set-up (default.toml), not from this file.

    python3 make_default_scene.py [OUT]
"""
import json
import math
import os
import random
import struct
import sys
import zlib

TAU = 2 * math.pi


# --- vectors -------------------------------------------------------------------------------------------------------

def add(a, b): return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
def sub(a, b): return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
def cross(a, b): return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
def length(a): return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a):
    n = length(a)
    return (a[0] / n, a[1] / n, a[2] / n) if n > 1e-20 else (0.0, 1.0, 0.0)


# --- shapes --------------------------------------------------------------------------------------------------------

class Shape:
    """Triangles with positions, normals and texture coordinates."""

    def __init__(self):
        self.positions, self.normals, self.uvs, self.triangles = [], [], [], []

    def vertex(self, p, n, uv):
        self.positions.append(tuple(round(c, 6) + 0.0 for c in p))  # equal where surfaces meet, however computed
        self.normals.append(n)
        self.uvs.append(uv)
        return len(self.positions) - 1

    def triangle(self, a, b, c):
        e1 = sub(self.positions[b], self.positions[a])
        e2 = sub(self.positions[c], self.positions[a])
        if length(cross(e1, e2)) > 1e-9:  # the poles of spheres and the tips of leaves have none
            self.triangles.append((a, b, c))

    def grid(self, point, nu, nv, uv=None, normal=None):
        """The surface point(u, v), u and v in 0..1; its front is where cross(dp/du, dp/dv) points."""
        first = len(self.positions)
        h = 1e-4
        for j in range(nv + 1):
            for i in range(nu + 1):
                u, v = i / nu, j / nv
                if normal:
                    n = normal(u, v)
                else:
                    u0, u1, v0, v1 = max(u - h, 0), min(u + h, 1), max(v - h, 0), min(v + h, 1)
                    n = unit(cross(sub(point(u1, v), point(u0, v)), sub(point(u, v1), point(u, v0))))
                self.vertex(point(u, v), n, uv(u, v) if uv else (u, v))
        for j in range(nv):
            for i in range(nu):
                a = first + j * (nu + 1) + i
                b, c, d = a + 1, a + nu + 2, a + nu + 1
                self.triangle(a, b, c)
                self.triangle(a, c, d)
        return self

    def quad(self, origin, du, dv, nu=1, nv=1, metres=1.0):
        """A rectangle; texture coordinates count metres, v downwards."""
        lu, lv = length(du) / metres, length(dv) / metres
        n = unit(cross(du, dv))
        return self.grid(lambda u, v: tuple(origin[k] + du[k] * u + dv[k] * v for k in range(3)), nu, nv,
                         lambda u, v: (u * lu, (1 - v) * lv), lambda u, v: n)

    def band(self, one, other, normal):
        """Between two polylines that run the same way: every vertex of either is one of its triangles', so that what
        shares the line elsewhere leaves no cracks."""
        flat = [k for k in range(3) if abs(normal[k]) < 0.5]
        at = lambda p: self.vertex(p, normal, (p[flat[0]], -p[flat[1]]) if normal[0] == 0 else (p[2], -p[1]))
        lines = [[at(p) for p in line] for line in (one, other)]
        along = unit(sub(other[-1], other[0]))
        far = lambda line, i: sum(a * b for a, b in zip(along, sub(line[i], line[0])))
        i = [0, 0]
        while i[0] + 1 < len(one) or i[1] + 1 < len(other):
            ends = [i[k] + 1 == len(line) for k, line in enumerate((one, other))]
            side = 1 if ends[0] else 0 if ends[1] else int(far(other, i[1] + 1) < far(one, i[0] + 1))
            a, b, c = lines[0][i[0]], lines[1][i[1]], lines[side][i[side] + 1]
            p = [self.positions[k] for k in (a, b, c)]
            turned = sum(x * y for x, y in zip(cross(sub(p[1], p[0]), sub(p[2], p[0])), normal)) < 0
            self.triangle(*((a, c, b) if turned else (a, b, c)))
            i[side] += 1
        return self

    def box(self, low, high, metres=1.0):
        (x0, y0, z0), (x1, y1, z1) = low, high
        dx, dy, dz = (x1 - x0, 0, 0), (0, y1 - y0, 0), (0, 0, z1 - z0)
        neg = lambda a: (-a[0], -a[1], -a[2])
        self.quad((x0, y0, z1), dx, dy, metres=metres)
        self.quad((x1, y0, z0), neg(dx), dy, metres=metres)
        self.quad((x1, y0, z1), neg(dz), dy, metres=metres)
        self.quad((x0, y0, z0), dz, dy, metres=metres)
        self.quad((x0, y1, z1), dx, neg(dz), metres=metres)
        self.quad((x0, y0, z0), dx, dz, metres=metres)
        return self

    def revolve(self, profile, sides, steps):
        """profile(t) -> (radius, y), going up; the outside is the front."""
        def point(u, v):
            r, y = profile(v)
            a = -u * TAU
            return (r * math.cos(a), y, r * math.sin(a))
        return self.grid(point, sides, steps, lambda u, v: (2 * u, 1 - v))

    def sphere(self, centre, radius, sides=32, rings=20):
        def normal(u, v):
            a, b = -u * TAU, (v - 0.5) * math.pi
            return (math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b))
        return self.grid(lambda u, v: add(centre, tuple(radius * c for c in normal(u, v))), sides, rings,
                         lambda u, v: (u, 1 - v), normal)


VAULT_STEPS = 36
# Heights at which the window wall ends in vertices: what meets it there has them too.
WINDOW_ROWS = (0, 0.9, 1.6, 2.3, 3.0, 4.2, 5)


def hall_walls():
    s = Shape()
    for sign in (1, -1):                                     # x = -6 and x = +6
        x, up = -6 * sign, (0, 5, 0)
        start, along = (x, 0, 3), (0, 0, -5)                 # the last metre meets the window wall
        if sign < 0:
            start, along = (x, 0, -2), (0, 0, 5)
        s.quad(start, along, up, 5, 5)
        s.band([(x, y, -2) for y in range(6)], [(x, y, -3) for y in WINDOW_ROWS], (sign, 0, 0))
    s.quad((6, 0, 3), (-12, 0, 0), (0, 5, 0), 12, 5)         # z = +3
    for x, sign in ((-6, 1), (6, -1)):                       # the half discs under the vault
        n = (sign, 0, 0)
        def lunette(u, v, x=x, sign=sign):
            a = u * math.pi
            return (x, 5 + 3 * v * math.sin(a), 3 * v * math.cos(a) * sign)
        s.grid(lunette, VAULT_STEPS, 3, lambda u, v: (3 * v * math.cos(u * math.pi), -3 * v * math.sin(u * math.pi)),
               lambda u, v, n=n: n)
    return s


def window_wall():
    """The wall at z = -3, 0.4 m thick, with three arched openings."""
    s = Shape()
    inner, outer, half, sill, spring, top = -3.0, -3.4, 0.95, 0.9, 3.0, 4.2
    centres = (-3.0, 0.0, 3.0)
    rows = [y for y in WINDOW_ROWS if sill <= y <= spring] + [top]

    def arch(c):
        """Of the opening, from its left springing to its right one."""
        steps = [math.pi * (1 - i / 20) for i in range(21)]
        return [(c - half, spring)] + [(c + half * math.cos(a), spring + half * math.sin(a)) for a in steps[1:-1]] + \
               [(c + half, spring)]

    def pier(x0, x1):
        return [x0, (x0 + x1) / 2, x1]

    edges = [-6.0] + [e for c in centres for e in (c - half, c + half)] + [6.0]
    piers = [pier(*edges[i:i + 2]) for i in range(0, len(edges), 2)]
    below = sorted({x for p in piers for x in p} | set(centres))                     # along the sills
    above = sorted({x for p in piers for x in p} | {x for c in centres for x, _ in arch(c)})
    metres = range(-6, 7)

    for z, n in ((inner, (0, 0, 1)), (outer, (0, 0, -1))):
        s.band([(x, 0, z) for x in metres], [(x, sill, z) for x in below], n)
        for xs in piers:
            for x0, x1 in zip(xs, xs[1:]):
                s.band([(x0, y, z) for y in rows], [(x1, y, z) for y in rows], n)
        for c in centres:
            s.band([(x, y, z) for x, y in arch(c)], [(x, top, z) for x, _ in arch(c)], n)
        s.band([(x, top, z) for x in above], [(x, 5, z) for x in metres], n)
    for c in centres:
        s.quad((c - half, sill, inner), (2 * half, 0, 0), (0, 0, outer - inner), 2, 1)                # the sill
        for x, n in ((c - half, (1, 0, 0)), (c + half, (-1, 0, 0))):                                  # its sides
            s.band([(x, y, inner) for y in rows[:-1]], [(x, y, outer) for y in rows[:-1]], n)
        outline = arch(c)

        def soffit(u, v, outline=outline):
            x, y = outline[round(u * 20)]
            return (x, y, outer + (inner - outer) * v)

        def inwards(u, v, c=c):
            a = math.pi * (1 - u)
            return (-math.cos(a), -math.sin(a), 0)
        s.grid(soffit, 20, 1, normal=inwards)
    return s


def vault():
    s = Shape()
    def point(u, v):
        a = v * math.pi
        return (-6 + 12 * u, 5 + 3 * math.sin(a), -3 * math.cos(a))
    # Seen from below: the front looks inwards.
    return s.grid(point, 12, VAULT_STEPS, lambda u, v: (12 * u, 9.4 * v))


def rib():
    """An arch across the vault, 0.3 m wide."""
    s = Shape()
    r, w, depth = 2.86, 0.15, 0.14  # up to the vault, whose other side is in the sun
    def at(radius, x, v):
        a = v * math.pi
        return (x, 5 + radius * math.sin(a), -radius * math.cos(a))
    s.grid(lambda u, v: at(r, -w + 2 * w * u, v), 2, VAULT_STEPS)
    s.grid(lambda u, v: at(r + depth * u, w, v), 1, VAULT_STEPS)
    s.grid(lambda u, v: at(r + depth * (1 - u), -w, v), 1, VAULT_STEPS)
    return s


def column():
    s = Shape()
    s.box((-0.32, 0, -0.32), (0.32, 0.16, 0.32))
    bulge = lambda y, height, r, out: lambda t: (r + out * math.sin(math.pi * t), y + height * t)
    s.revolve(bulge(0.16, 0.14, 0.24, 0.07), 20, 5)
    s.revolve(bulge(0.30, 0.08, 0.24, 0.04), 20, 3)
    s.revolve(lambda t: (0.24 - 0.025 * t, 0.38), 20, 1)
    s.revolve(lambda t: (0.215 - 0.035 * t * t, 0.38 + 3.82 * t), 20, 8)
    s.revolve(bulge(4.20, 0.08, 0.18, 0.03), 20, 3)
    s.revolve(lambda t: (0.18 + 0.13 * t * t, 4.28 + 0.34 * t), 20, 5)
    s.box((-0.34, 4.62, -0.34), (0.34, 5.0, 0.34))
    return s


def banner():
    """Cloth hung from a rod at y = 0, 1.5 m wide and 3.4 m long, with folds that grow downwards."""
    s = Shape()
    def point(u, v):
        down = 1 - v
        x = (u - 0.5) * (1.5 - 0.12 * down)
        fold = 0.015 + 0.075 * down ** 0.7
        z = fold * math.sin(u * TAU * 3.5 + 0.9 * down) + 0.02 * down * math.sin(u * TAU * 1.5 + 2.0)
        y = -3.4 * down - 0.05 * down * math.sin(u * math.pi)
        return (x, y, z)
    s.grid(point, 44, 22, lambda u, v: (u, 1 - v))
    return s


def rod():
    s = Shape()
    def point(u, v):
        a = u * TAU
        return (-0.95 + 1.9 * v, 0.025 * math.cos(a), 0.025 * math.sin(a))
    s.grid(point, 12, 1)
    for x in (-0.95, 0.95):
        s.sphere((x, 0, 0), 0.05, 12, 8)
    return s


def table():
    s = Shape()
    s.box((-1.1, 0.72, -0.45), (1.1, 0.78, 0.45))
    s.box((-0.98, 0.62, -0.36), (0.98, 0.72, -0.33))
    s.box((-0.98, 0.62, 0.33), (0.98, 0.72, 0.36))
    for x in (-1.0, 1.0):
        for z in (-0.36, 0.36):
            s.box((x - 0.04, 0, z - 0.04), (x + 0.04, 0.72, z + 0.04))
    return s


def bench():
    s = Shape()
    s.box((-0.95, 0.40, -0.16), (0.95, 0.45, 0.16))
    for x in (-0.8, 0.8):
        s.box((x - 0.04, 0, -0.13), (x + 0.04, 0.40, 0.13))
    return s


def mirror_frame():
    s = Shape()
    w, h, t, d = 0.8, 2.2, 0.09, 0.07  # half width, height, thickness, depth; faces +x
    for z0, z1, y0, y1 in ((-w - t, -w, -t, h + t), (w, w + t, -t, h + t), (-w, w, -t, 0), (-w, w, h, h + t)):
        s.box((0, y0, z0), (d, y1, z1))
    return s


def vase():
    s = Shape()
    profile = lambda t: (0.05 + 0.07 * math.sin(math.pi * (0.12 + 0.80 * t)) ** 2 + 0.02 * t, 0.32 * t)
    s.revolve(profile, 28, 20)
    s.revolve(lambda t: (profile(1 - t)[0] - 0.008, profile(1 - t)[1]), 28, 20)
    s.revolve(lambda t: (1e-4 + (profile(0)[0] - 1e-4) * t, 0.0), 28, 1)
    return s


def pot():
    s = Shape()
    s.revolve(lambda t: (0.16 + 0.09 * t, 0.38 * t), 28, 4)
    s.revolve(lambda t: (0.27 - 0.02 * (1 - math.sin(math.pi * t)), 0.38 + 0.06 * t), 28, 4)
    s.revolve(lambda t: (0.25 - 0.02 * t, 0.44), 28, 1)
    s.revolve(lambda t: (0.23, 0.44 - 0.04 * t), 28, 1)
    s.revolve(lambda t: (0.23 - 0.229 * t, 0.40), 28, 1)
    return s


def leaves():
    s = Shape()
    rng = random.Random(7)
    for k in range(46):
        turn = k * 2.39996 + rng.uniform(-0.2, 0.2)
        reach = rng.uniform(0.35, 0.75)
        rise = rng.uniform(0.45, 1.15) * (1.15 - 0.45 * reach)
        width = rng.uniform(0.09, 0.14)
        out, side = (math.cos(turn), 0, math.sin(turn)), (-math.sin(turn), 0, math.cos(turn))
        def point(u, v, reach=reach, rise=rise, width=width, out=out, side=side):
            away = reach * v
            y = 0.40 + rise * math.sin(v * math.pi * 0.62) + 0.03 * math.cos((u - 0.5) * math.pi)
            return tuple(out[i] * away + side[i] * (u - 0.5) * width * 2 + (0, y, 0)[i] for i in range(3))
        s.grid(point, 2, 6, lambda u, v: (u, 1 - v))
    return s


# --- textures ------------------------------------------------------------------------------------------------------

def png(width, height, channels, pixel):
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            rows += bytes(max(0, min(255, int(round(c)))) for c in pixel(x, y))
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b"")


class Noise:
    """Smooth noise that repeats after `period` cells."""

    def __init__(self, period, seed):
        rng = random.Random(seed)
        self.period = period
        self.values = [rng.random() for _ in range(period * period)]

    def __call__(self, x, y):
        p = self.period
        ix, iy = math.floor(x), math.floor(y)
        fx, fy = x - ix, y - iy
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        at = lambda i, j: self.values[(j % p) * p + i % p]
        top = at(ix, iy) * (1 - fx) + at(ix + 1, iy) * fx
        low = at(ix, iy + 1) * (1 - fx) + at(ix + 1, iy + 1) * fx
        return top * (1 - fy) + low * fy


def floor_png():
    """2 x 2 m: four tiles to a side, pale and dark stone with veins, grout between."""
    size, tiles = 512, 4
    coarse, fine = Noise(8, 1), Noise(64, 2)
    def pixel(x, y):
        tx, ty = x * tiles // size, y * tiles // size
        cx, cy = x * tiles / size - tx - 0.5, y * tiles / size - ty - 0.5
        if max(abs(cx), abs(cy)) > 0.487:
            return (96, 88, 78)
        u, v = x / size, y / size
        vein = coarse(u * 8 + 3.1 * tx, v * 8 + 1.7 * ty) * 0.7 + fine(u * 64, v * 64) * 0.3
        shade = 0.86 + 0.22 * (vein - 0.5) + 0.05 * math.sin(7 * tx + 5 * ty)
        base = (196, 176, 148) if (tx + ty) % 2 == 0 else (118, 74, 58)
        # Few grey steps keep the file small.
        return tuple(4 * round(c * shade / 4) for c in base)
    return png(size, size, 3, pixel)


def floor_normal_png():
    """Bevelled tile edges for the floor's texture."""
    size, tiles = 256, 4
    def slope(c):
        edge = (abs(c) - 0.455) / 0.045
        return 0.0 if edge <= 0 else math.copysign(0.45 * math.sin(min(edge, 1.0) * math.pi), c)
    def pixel(x, y):
        cx = x * tiles / size % 1 - 0.5 + tiles / size / 2
        cy = y * tiles / size % 1 - 0.5 + tiles / size / 2
        n = unit((slope(cx), -slope(cy), 1.0))
        return tuple(127.5 + 127.5 * c for c in n)
    return png(size, size, 3, pixel)


def wood_png():
    size = 256
    grain, broad = Noise(64, 3), Noise(8, 4)
    def pixel(x, y):
        u, v = x / size, y / size
        ring = 0.5 + 0.5 * math.sin(TAU * (6 * v + 1.6 * broad(u * 2, v * 8)))
        shade = 0.72 + 0.22 * ring + 0.16 * (grain(u * 8, v * 64) - 0.5)
        return tuple(4 * round(c * shade / 4) for c in (150, 98, 56))
    return png(size, size, 3, pixel)


def leaf_png():
    """A pointed leaf in alpha, with a pale middle rib."""
    w, h = 64, 128
    def pixel(x, y):
        u, v = (x + 0.5) / w * 2 - 1, 1 - (y + 0.5) / h
        half = 0.95 * math.sin(math.pi * v ** 0.8) ** 0.8 if 0 < v < 1 else 0
        stem = 0.08 if v < 0.1 else 0
        inside = abs(u) < max(half, stem)
        rib = 1.25 if abs(u) < 0.06 else 1.0 + 0.10 * math.sin(30 * v - 9 * abs(u))
        return (52 * rib, 104 * rib, 40 * rib, 255 if inside else 0)
    return png(w, h, 4, pixel)


# --- the file ------------------------------------------------------------------------------------------------------

class Glb:
    def __init__(self):
        self.binary = bytearray()
        self.doc = {"asset": {"version": "2.0", "generator": "DARM make_default_scene.py"}, "scene": 0,
                    "scenes": [{"name": "hall", "nodes": []}], "nodes": [], "meshes": [], "materials": [], "cameras": [],
                    "accessors": [], "bufferViews": [], "images": [], "textures": [],
                    "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}]}
        self.used = set()
        self.lights = []

    def view(self, data):
        while len(self.binary) % 4:
            self.binary.append(0)
        self.doc["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.doc["bufferViews"]) - 1

    def accessor(self, rows, kind, code, component, bounds=False):
        flat = [c for row in rows for c in row]
        a = {"bufferView": self.view(struct.pack("<%d%s" % (len(flat), code), *flat)), "componentType": component,
             "count": len(flat) if kind == "SCALAR" else len(rows), "type": kind}
        if bounds:
            single = [struct.unpack("<3f", struct.pack("<3f", *r)) for r in rows]
            a["min"] = [min(r[i] for r in single) for i in range(3)]
            a["max"] = [max(r[i] for r in single) for i in range(3)]
        self.doc["accessors"].append(a)
        return len(self.doc["accessors"]) - 1

    def texture(self, name, data):
        self.doc["images"].append({"name": name, "mimeType": "image/png", "bufferView": self.view(data)})
        self.doc["textures"].append({"source": len(self.doc["images"]) - 1, "sampler": 0})
        return {"index": len(self.doc["textures"]) - 1}

    def material(self, name, color=(1, 1, 1), metallic=0.0, roughness=0.8, texture=None, extensions=None, **more):
        pbr = {"baseColorFactor": [*color, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
        if texture:
            pbr["baseColorTexture"] = texture
        m = {"name": name, "pbrMetallicRoughness": pbr, **more}
        if extensions:
            m["extensions"] = extensions
            self.used |= set(extensions)
        self.doc["materials"].append(m)
        return len(self.doc["materials"]) - 1

    def mesh(self, name, shape, material):
        code, component = ("H", 5123) if len(shape.positions) < 65536 else ("I", 5125)
        self.doc["meshes"].append({"name": name, "primitives": [{
            "attributes": {"POSITION": self.accessor(shape.positions, "VEC3", "f", 5126, True),
                           "NORMAL": self.accessor(shape.normals, "VEC3", "f", 5126),
                           "TEXCOORD_0": self.accessor(shape.uvs, "VEC2", "f", 5126)},
            "indices": self.accessor(shape.triangles, "SCALAR", code, component), "material": material}]})
        return len(self.doc["meshes"]) - 1

    def node(self, name, **members):
        self.doc["nodes"].append({"name": name, **members})
        self.doc["scenes"][0]["nodes"].append(len(self.doc["nodes"]) - 1)

    def light(self, name, color, candela):
        self.used.add("KHR_lights_punctual")
        self.lights.append({"name": name, "type": "point", "color": list(color), "intensity": candela})
        return {"KHR_lights_punctual": {"light": len(self.lights) - 1}}

    def camera(self, name, position, target, fovy_degrees):
        self.doc["cameras"].append({"name": name, "type": "perspective", "perspective": {
            "yfov": math.radians(fovy_degrees), "znear": 0.05, "aspectRatio": 16 / 9}})
        back = unit(sub(position, target))
        right = unit(cross((0, 1, 0), back))
        up = cross(back, right)
        self.node(name, camera=len(self.doc["cameras"]) - 1, translation=list(position), rotation=quaternion(right, up, back))

    def write(self, path):
        self.doc["extensionsUsed"] = sorted(self.used)
        self.doc["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        while len(self.binary) % 4:
            self.binary.append(0)
        self.doc["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.doc, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as out:
            out.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(self.binary)))
            out.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            out.write(struct.pack("<II", len(self.binary), 0x004E4942) + self.binary)


def quaternion(x, y, z):
    """Rotation (x, y, z, w) whose matrix has these columns."""
    trace = x[0] + y[1] + z[2]
    if trace > 0:
        s = 2 * math.sqrt(1 + trace)
        return [(y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s, s / 4]
    if x[0] > y[1] and x[0] > z[2]:
        s = 2 * math.sqrt(1 + x[0] - y[1] - z[2])
        return [s / 4, (y[0] + x[1]) / s, (z[0] + x[2]) / s, (y[2] - z[1]) / s]
    if y[1] > z[2]:
        s = 2 * math.sqrt(1 + y[1] - x[0] - z[2])
        return [(y[0] + x[1]) / s, s / 4, (z[1] + y[2]) / s, (z[0] - x[2]) / s]
    s = 2 * math.sqrt(1 + z[2] - x[0] - y[1])
    return [(z[0] + x[2]) / s, (z[1] + y[2]) / s, s / 4, (x[1] - y[0]) / s]


def build_hall(glb):
    plaster = glb.material("plaster", (0.80, 0.74, 0.65), roughness=0.95)
    ceiling = glb.material("vault plaster", (0.82, 0.79, 0.74), roughness=0.95)
    stone = glb.material("stone", (0.70, 0.66, 0.58), roughness=0.7)
    tiles = glb.material("tiles", roughness=0.35, texture=glb.texture("tiles", floor_png()),
                         normalTexture={**glb.texture("tile bevels", floor_normal_png()), "scale": 0.8})
    glb.node("walls", mesh=glb.mesh("walls", hall_walls(), plaster))
    glb.node("window wall", mesh=glb.mesh("window wall", window_wall(), plaster))
    glb.node("vault", mesh=glb.mesh("vault", vault(), ceiling))
    glb.node("floor", mesh=glb.mesh("floor", Shape().quad((-6, 0, 3), (12, 0, 0), (0, 0, -6), 12, 6, metres=2.0), tiles))
    cornice = Shape().box((-6, 4.88, 2.86), (6, 5.02, 3.0)).box((-6, 4.88, -3.0), (6, 5.02, -2.86))
    glb.node("cornices", mesh=glb.mesh("cornices", cornice, stone))
    column_mesh, rib_mesh = glb.mesh("column", column(), stone), glb.mesh("rib", rib(), stone)
    for i, x in enumerate((-4.5, -1.5, 1.5, 4.5)):
        glb.node("rib %d" % (i + 1), mesh=rib_mesh, translation=[x, 0, 0])
        for side, z in (("south", -2.4), ("north", 2.4)):
            glb.node("column %s %d" % (side, i + 1), mesh=column_mesh, translation=[x, 0, z])


def build_cloth(glb):
    brass = glb.material("brass", (0.88, 0.66, 0.32), metallic=1.0, roughness=0.35)
    rod_mesh = glb.mesh("rod", rod(), brass)
    for name, color, x in (("red", (0.62, 0.05, 0.04), -3), ("blue", (0.05, 0.12, 0.55), 0), ("green", (0.06, 0.38, 0.09), 3)):
        cloth = glb.material(name + " cloth", color, roughness=1.0, doubleSided=True)
        glb.node(name + " banner", mesh=glb.mesh(name + " banner", banner(), cloth), translation=[x, 4.2, 2.3])
        glb.node(name + " rod", mesh=rod_mesh, translation=[x, 4.2, 2.3])


def build_furniture(glb):
    wood = glb.material("wood", roughness=0.55, texture=glb.texture("wood", wood_png()))
    glb.node("table", mesh=glb.mesh("table", table(), wood), translation=[1.2, 0, 0.2])
    bench_mesh = glb.mesh("bench", bench(), wood)
    glb.node("bench 1", mesh=bench_mesh, translation=[1.2, 0, 0.95])
    glb.node("bench 2", mesh=bench_mesh, translation=[1.1, 0, -0.65], rotation=quaternion(*turned(-4)))
    mirror = glb.material("mirror", (0.95, 0.95, 0.95), metallic=1.0, roughness=0.02)
    glb.node("mirror", mesh=glb.mesh("mirror", Shape().quad((0.03, 0, 0.8), (0, 0, -1.6), (0, 2.2, 0)), mirror), translation=[-5.99, 0.7, 0])
    glb.node("mirror frame", mesh=glb.mesh("mirror frame", mirror_frame(), wood), translation=[-5.99, 0.7, 0])
    copper = glb.material("copper", (0.93, 0.58, 0.45), metallic=1.0, roughness=0.25)
    glb.node("ball", mesh=glb.mesh("ball", Shape().sphere((0, 0, 0), 0.3, 36, 22), copper), translation=[-1.4, 0.3, 0.2],
             extras={"darm_dynamic": True})
    clay = glb.material("clay", (0.60, 0.28, 0.16), roughness=0.9)
    leaf = glb.material("leaf", roughness=0.6, texture=glb.texture("leaf", leaf_png()), alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    pot_mesh, leaf_mesh = glb.mesh("pot", pot(), clay), glb.mesh("leaves", leaves(), leaf)
    for i, (x, z) in enumerate(((4.9, 1.3), (-5.2, -1.6))):
        glb.node("pot %d" % (i + 1), mesh=pot_mesh, translation=[x, 0, z])
        glb.node("plant %d" % (i + 1), mesh=leaf_mesh, translation=[x, 0, z])


def build_glass(glb):
    clear = lambda **volume: {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.5},
                              **({"KHR_materials_volume": volume} if volume else {})}
    solid = glb.material("glass", roughness=0.0, extensions=clear(thicknessFactor=0.3, attenuationDistance=0.6, attenuationColor=[0.75, 0.93, 0.88]))
    thin = glb.material("tinted pane", (0.72, 0.86, 0.95), roughness=0.0, doubleSided=True, extensions=clear())
    blown = glb.material("blown glass", (0.55, 0.80, 0.98), roughness=0.02, doubleSided=True, extensions=clear())
    glb.node("glass ball", mesh=glb.mesh("glass ball", Shape().sphere((0, 0, 0), 0.17, 32, 20), solid), translation=[0.75, 0.95, 0.2])
    glb.node("vase", mesh=glb.mesh("vase", vase(), blown), translation=[1.6, 0.781, 0.3])
    # A free-standing pane in a dark frame.
    iron = glb.material("iron", (0.10, 0.10, 0.11), metallic=0.6, roughness=0.5)
    frame = Shape()
    for low, high in (((-0.65, 0, -0.02), (-0.61, 1.7, 0.02)), ((0.61, 0, -0.02), (0.65, 1.7, 0.02)),
                      ((-0.61, 0.10, -0.02), (0.61, 0.14, 0.02)), ((-0.61, 1.66, -0.02), (0.61, 1.70, 0.02)),
                      ((-0.70, 0, -0.2), (-0.56, 0.03, 0.2)), ((0.56, 0, -0.2), (0.70, 0.03, 0.2))):
        frame.box(low, high)
    spin = quaternion(*turned(65))
    glb.node("pane frame", mesh=glb.mesh("pane frame", frame, iron), translation=[3.6, 0, -0.7], rotation=spin)
    glb.node("pane", mesh=glb.mesh("pane", Shape().quad((-0.61, 0.14, 0), (1.22, 0, 0), (0, 1.52, 0)), thin), translation=[3.6, 0, -0.7], rotation=spin)


def build_lamps(glb):
    """Globes with a point light just below each: inside, its own globe would hide it."""
    warm = (1.0, 0.72, 0.42)
    glow = glb.material("lamp glass", (1, 1, 1), roughness=0.6, emissiveFactor=list(warm),
                        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 90.0}})
    iron = glb.material("lamp chain", (0.10, 0.09, 0.08), metallic=0.8, roughness=0.5)
    globe = glb.mesh("globe", Shape().sphere((0, 0.16, 0), 0.12, 28, 18), glow)
    chain = glb.mesh("chain", Shape().box((-0.012, 0.27, -0.012), (0.012, 5.3, 0.012)), iron)
    for name, x, y, z, moves in (("lamp west", -3.4, 2.9, 0.4, False), ("lamp table", 1.2, 2.2, 0.2, True), ("lamp east", 4.6, 2.9, -0.2, False)):
        members = {"extras": {"darm_dynamic": True}} if moves else {}
        glb.node(name, mesh=globe, translation=[x, y, z], extensions=glb.light(name, warm, 14.0), **members)
        if not moves:
            glb.node(name + " chain", mesh=chain, translation=[x, y, z], scale=[1, (7.95 - y) / 5.3, 1])


def turned(degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (c, 0, -s), (0, 1, 0), (s, 0, c)


def main():
    out = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "default.glb")
    glb = Glb()
    build_hall(glb)
    build_cloth(glb)
    build_furniture(glb)
    build_glass(glb)
    build_lamps(glb)
    glb.camera("hall", (-5.6, 1.75, -0.5), (2.0, 2.4, 0.4), 58)
    glb.camera("table", (2.6, 1.65, -2.2), (0.7, 0.95, 0.5), 48)
    glb.camera("mirror", (-2.2, 1.6, -0.9), (-6.0, 1.7, 0.25), 50)
    glb.camera("windows", (4.9, 1.9, 1.8), (-2.0, 1.7, -2.0), 58)
    glb.write(out)
    shown = sum(glb.doc["accessors"][glb.doc["meshes"][n["mesh"]]["primitives"][0]["indices"]]["count"] // 3
                for n in glb.doc["nodes"] if "mesh" in n)
    print("%s: %d triangles, %d bytes" % (out, shown, os.path.getsize(out)))


if __name__ == "__main__":
    main()
