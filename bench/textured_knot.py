#!/usr/bin/env python3
"""Writes a textured model for the benchmark of --colours: a torus knot as OBJ with uv, its .mtl and a PNG.

usage: textured_knot.py FOLDER [SEGMENTS SIDES TEXTURE]   (default 1000 50 2048: 100 000 triangles)

The texture has large patches, fine stripes and noise, so that neither the PNG nor the palette is easy.
"""
import math
import os
import random
import struct
import sys
import zlib


def knot(segments, sides, tube=0.5, p=2, q=3):
    def centre(t):
        r = 2 + math.cos(q * t)
        return (r * math.cos(p * t), r * math.sin(p * t), -math.sin(q * t))

    def minus(a, b):
        return tuple(x - y for x, y in zip(a, b))

    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    def unit(a):
        length = math.sqrt(sum(x * x for x in a))
        return tuple(x / length for x in a)

    rows = []
    for i in range(segments):
        t = 2 * math.pi * i / segments
        at = centre(t)
        along = unit(minus(centre(t + 1e-4), centre(t - 1e-4)))
        side = unit(cross(along, (at[0], at[1], 0.3)))
        up = cross(side, along)
        for j in range(sides):
            angle = 2 * math.pi * j / sides
            rows.append(tuple(at[k] + tube * (math.cos(angle) * side[k] + math.sin(angle) * up[k]) for k in range(3)))
    return rows


def write_png(path, size):
    random.seed(7)
    noise = bytes(random.getrandbits(2) for _ in range(1 << 16))
    rows = bytearray()
    xs = [int(100 + 90 * math.sin(x * 0.011) + 40 * math.sin(x * 0.4)) for x in range(size)]
    for y in range(size):
        shade = int(60 * math.sin(y * 0.017))
        rows.append(0)
        start = (y * 7919) & 0x7FFF
        row = bytearray(3 * size)
        row[0::3] = bytes(max(0, min(255, x + noise[start + i])) for i, x in enumerate(xs))
        row[1::3] = bytes(max(0, min(255, 128 + shade + (x >> 2))) for x in xs)
        row[2::3] = bytes((255 - x if (y // 64 + i // 64) % 2 else x) & 255 for i, x in enumerate(xs)) if y % 4 else row[0::3]
        rows += row
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)) +
                  chunk(b"IDAT", zlib.compress(bytes(rows), 6)) + chunk(b"IEND", b""))


def main():
    folder = sys.argv[1]
    segments, sides, size = (int(word) for word in (sys.argv[2:5] or ["1000", "50", "2048"]))
    os.makedirs(folder, exist_ok=True)
    write_png(os.path.join(folder, "knot.png"), size)
    with open(os.path.join(folder, "knot.mtl"), "w") as out:
        out.write("newmtl skin\nKd 1 1 1\nmap_Kd knot.png\n")
    with open(os.path.join(folder, "knot.obj"), "w") as out:
        out.write("mtllib knot.mtl\nusemtl skin\n")
        for p in knot(segments, sides):
            out.write("v %.6f %.6f %.6f\n" % p)
        for i in range(segments + 1):
            for j in range(sides + 1):
                out.write("vt %.6f %.6f\n" % (8 * i / segments, j / sides))
        for i in range(segments):
            for j in range(sides):
                k, l = (i + 1) % segments, (j + 1) % sides
                v = [i * sides + j + 1, k * sides + j + 1, k * sides + l + 1, i * sides + l + 1]
                t = [i * (sides + 1) + j + 1, (i + 1) * (sides + 1) + j + 1, (i + 1) * (sides + 1) + j + 2,
                     i * (sides + 1) + j + 2]
                out.write("f %d/%d %d/%d %d/%d\n" % (v[0], t[0], v[1], t[1], v[2], t[2]))
                out.write("f %d/%d %d/%d %d/%d\n" % (v[0], t[0], v[2], t[2], v[3], t[3]))


main()
