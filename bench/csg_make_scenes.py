#!/usr/bin/env python3
"""Makes the scenes and meshes of the benchmarks in a folder, the same bytes on any machine.

usage: csg_make_scenes.py FOLDER [--examples]

FOLDER/*.csg      Boolean trees, computed here
FOLDER/*.off      scans of Debian's package libcgal-demo: bunny00 and armadillo are closed, lion-head is open
FOLDER/examples/  with --examples: OpenSCAD's own examples, flattened by the openscad of this machine
"""

import argparse
import math
import pathlib
import random
import shutil
import subprocess
import sys
import tarfile

CGAL_DATA = "/usr/share/doc/libcgal-dev/data.tar.gz"
SCANS = ("bunny00.off", "armadillo.off", "lion-head.off")
EXAMPLES = pathlib.Path("/usr/share/openscad/examples")


def cube(*size, center=True):
    return f"cube(size = [{', '.join(map(repr, size))}], center = {str(center).lower()});"


def sphere(radius, segments=32):
    return f"sphere($fn = {segments}, $fa = 12, $fs = 2, r = {radius!r});"


def cylinder(radius, height, segments):
    return (f"cylinder($fn = {segments}, $fa = 12, $fs = 2, h = {height!r}, r1 = {radius!r}, r2 = {radius!r}, "
            "center = true);")


def block(operation, children):
    return operation + "() {\n" + "\n".join(children) + "\n}"


def placed(child, at, turn=((1, 0, 0), (0, 1, 0), (0, 0, 1))):
    rows = [[*map(float, row), float(x)] for row, x in zip(turn, at)] + [[0, 0, 0, 1]]
    return f"multmatrix({rows}) {{ {child} }}"


def drill():
    """A ball minus three cylinders along the axes."""
    hole = cylinder(5, 30, 64)
    along_x, along_y = ((0, 0, 1), (0, 1, 0), (-1, 0, 0)), ((1, 0, 0), (0, 0, -1), (0, 1, 0))
    return block("difference", [sphere(10, 64), hole, placed(hole, (0, 0, 0), along_x), placed(hole, (0, 0, 0), along_y)])


def plate(holes):
    """A plate minus cylinders in a square pattern."""
    side = math.isqrt(holes - 1) + 1
    pitch = 100 / side
    places = [((i % side + 0.5) * pitch - 50, (i // side + 0.5) * pitch - 50, 0) for i in range(holes)]
    return block("difference", [cube(100, 100, 5)] + [placed(cylinder(0.35 * pitch, 10, 32), at) for at in places])


def menger(levels):
    """A cube of 50 minus square bars along the axes: the Menger sponge."""
    bars = []
    for level in range(levels):
        cells, pitch = 3**level, 50 / 3**level
        for i in range(cells):
            for j in range(cells):
                # What a coarser bar has taken is not taken again.
                if any(i // 3**k % 3 == 1 and j // 3**k % 3 == 1 for k in range(level)):
                    continue
                u, v = ((n + 0.5) * pitch - 25 for n in (i, j))
                bars.append(placed(cube(pitch / 3, pitch / 3, 100), (u, v, 0)))
                bars.append(placed(cube(pitch / 3, 100, pitch / 3), (u, 0, v)))
                bars.append(placed(cube(100, pitch / 3, pitch / 3), (0, u, v)))
    return block("difference", [cube(50, 50, 50)] + bars)


def dhole(holes):
    """A plate minus double-D holes, each a cylinder and a cube: (N + 1) 2^N terms for previews that expand."""
    hole = block("intersection", [cylinder(6, 10, 64), cube(20, 9, 11)])
    plate_of_holes = placed(cube(20 * holes + 10, 20, 3, center=False), (-5, -10, -1))
    return block("difference", [plate_of_holes] + [placed(hole, (8 + 20 * i, 0, 0)) for i in range(holes)])


def some_turn(numbers):
    """A rotation, all alike probable: from a quaternion of four normal numbers (sums of 12: no logarithm, same bits)."""
    w, x, y, z = (sum(numbers.random() for _ in range(12)) - 6 for _ in range(4))
    s = 2 / (w * w + x * x + y * y + z * z)
    return ((1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
            (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
            (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)))


def somewhere(solids, half, seed):
    numbers = random.Random(seed)
    return [placed(solid, [half * (2 * numbers.random() - 1) for _ in range(3)], some_turn(numbers)) for solid in solids]


def cubes(count, scale, seed):
    side = scale * 110 / count ** (1 / 3)
    return somewhere([cube(side, side, side)] * count, 50, seed)


def mixed(count, scale, seed):
    """Balls and cubes, half of each, that together fill about the same for any count."""
    side = scale * 110 / count ** (1 / 3)
    return somewhere([sphere(0.6 * side), cube(side, side, side)] * (count // 2), 50, seed)


def scenes():
    yield "empty", cube(1, 1, 1, center=False)
    yield "coincident", block("difference", [cube(20, 20, 20), cylinder(6, 20, 64)])
    yield "drill", drill()
    for holes in (10, 50, 100, 200, 400):
        yield f"plate{holes}", plate(holes)
    yield "menger3", menger(3)
    for holes in (4, 6, 8, 9, 10, 11, 12, 14, 16, 18):
        yield f"dhole{holes}", dhole(holes)
    yield "union_cubes50", block("union", cubes(50, 1, 1))
    yield "union_mixed200", block("union", mixed(200, 1, 1))
    for count in (20, 50):
        yield f"inter_spheres{count}", block("intersection", somewhere([sphere(10)] * count, 2, 1))
    for count in (30, 50):
        yield (f"diff_u{count}_u{count}",
               block("difference", [block("union", mixed(count, 1, 1)), block("union", mixed(count, 80 / 110, 2))]))


def flatten_examples(out):
    """OpenSCAD's examples as .csg, beside the files that they import."""
    for source in sorted(EXAMPLES.rglob("*.scad")):
        folder = out / source.parent.name
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(["openscad", "-o", folder / (source.stem + ".csg"), source], capture_output=True)
        if done.returncode:
            print(f"csg_make_scenes: openscad refuses {source}", file=sys.stderr)
    for asset in EXAMPLES.rglob("*"):
        if asset.suffix in (".dxf", ".stl", ".dat", ".png") and (out / asset.parent.name).is_dir():
            shutil.copyfile(asset, out / asset.parent.name / asset.name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--examples", action="store_true", help="OpenSCAD's examples as well")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for name, text in scenes():
        (options.folder / f"{name}.csg").write_text(text + "\n")
    try:
        with tarfile.open(CGAL_DATA) as data:
            for name in SCANS:
                (options.folder / name).write_bytes(data.extractfile("data/meshes/" + name).read())
    except OSError as error:
        print(f"csg_make_scenes: without {', '.join(SCANS)}; libcgal-demo is missing: {error}", file=sys.stderr)
    if options.examples:
        flatten_examples(options.folder / "examples")


if __name__ == "__main__":
    main()
