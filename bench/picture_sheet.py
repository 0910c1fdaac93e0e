#!/usr/bin/env python3
"""Draws models by strata, f3d and OpenSCAD, each as it does by itself and from the same side, and puts the pictures on
one sheet in random order, so that somebody can say which is best without knowing whose it is.

usage: picture_sheet.py STRATA OUTPUT.png MODEL... [--y-up NAME...] [--seed N] [--side PIXELS] [--only strata,...]

Models are .csg scenes and .obj, .stl meshes; --y-up names meshes whose y axis points up. OUTPUT.key.json says whose
picture is at which place. --choose ABCAB... counts, from the key, whose pictures these letters chose, one a row.
Needs f3d, openscad, xvfb-run, python3-pil.
"""

import argparse
import collections
import json
import math
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

TOOLS = ("strata", "f3d", "openscad")
# OpenSCAD's direction: turned 25 degrees about z, 35 degrees above the horizon.
AZIMUTH, ELEVATION = 25, 35


def read_obj(path, y_up):
    """Triangles of an .obj, as three points each."""
    points, faces = [], []
    for line in path.read_text(errors="replace").splitlines():
        words = line.split()
        if len(words) > 3 and words[0] == "v":
            x, y, z = map(float, words[1:4])
            points.append((x, -z, y) if y_up else (x, y, z))
        elif len(words) > 3 and words[0] == "f":
            corners = [int(word.split("/")[0]) for word in words[1:]]
            corners = [c - 1 if c > 0 else len(points) + c for c in corners]
            faces += [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    return points, faces


def write_meshes(points, faces, stem):
    """The same mesh as .obj, for f3d and strata, and as .stl, for OpenSCAD."""
    with open(f"{stem}.obj", "w") as out:
        out.writelines(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points)
        out.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    with open(f"{stem}.stl", "wb") as out:
        out.write(b"\0" * 80 + struct.pack("<I", len(faces)))
        for face in faces:
            out.write(struct.pack("<3f", 0, 0, 0) + b"".join(struct.pack("<3f", *points[i]) for i in face) + b"\0\0")


def camera_of_f3d(points, y_up):
    """f3d's own camera looks along a coordinate axis: a place on OpenSCAD's side, at f3d's own distance."""
    low = [min(p[k] for p in points) for k in range(3)]
    high = [max(p[k] for p in points) for k in range(3)]
    middle = [(a + b) / 2 for a, b in zip(low, high)]
    away = (math.sin(math.radians(AZIMUTH)) * math.cos(math.radians(ELEVATION)),
            -math.cos(math.radians(AZIMUTH)) * math.cos(math.radians(ELEVATION)), math.sin(math.radians(ELEVATION)))
    radius = math.dist(low, high) / 2
    distance = radius / math.sin(math.radians(15))  # the ball fits f3d's angle of 30 degrees
    eye = [m + distance * a for m, a in zip(middle, away)]

    def numbers(x, y, z):
        return ",".join(f"{v:.6g}" for v in ((x, z, -y) if y_up else (x, y, z)))

    return ["--up", "+Y" if y_up else "+Z", "--camera-position", numbers(*eye), "--camera-focal-point",
            numbers(*middle), "--camera-view-up", numbers(0, 0, 1)]


def run(command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip() or done.returncode}")


def draw(options, model, folder):
    """A picture by each tool; their paths by its name."""
    stem = folder / model.stem
    side = options.side
    scene = model.suffix == ".csg"
    if scene:
        run([options.strata, "mesh", model, "-o", f"{stem}.obj", "-q"])
    y_up = not scene and model.name in options.y_up
    points, faces = read_obj(folder / f"{model.stem}.obj" if scene else model, y_up)
    write_meshes(points, faces, stem)
    for_strata, for_openscad = (model, model) if scene else (f"{stem}.obj", f"{stem}.scad")
    if not scene:
        pathlib.Path(for_openscad).write_text(f'import("{stem}.stl");\n')
    pictures = {tool: f"{stem}.{tool}.png" for tool in TOOLS}
    run([options.strata, "csg", for_strata, "-o", pictures["strata"], "--size", f"{side},{side}", "-q", *options.extra.split()])
    run(["xvfb-run", "-a", "f3d", "--output", pictures["f3d"], "--resolution", f"{side},{side}", "--quiet", "--dry-run",
         *camera_of_f3d(points, y_up), f"{stem}.obj" if scene else model])
    run(["xvfb-run", "-a", "openscad", "-o", pictures["openscad"], "--imgsize", f"{side},{side}", "--viewall",
         "--autocenter", for_openscad])
    return pictures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strata")
    parser.add_argument("output")
    parser.add_argument("models", nargs="*", type=pathlib.Path)
    parser.add_argument("--y-up", nargs="*", default=[], metavar="NAME")
    parser.add_argument("--seed", type=int, help="of the order (default: another each time)")
    parser.add_argument("--side", type=int, default=512)
    parser.add_argument("--rows", type=int, default=5, help="models a sheet; more become OUTPUT-2.png, ...")
    parser.add_argument("--extra", default="", help="more options of strata csg, such as '--quality high'")
    parser.add_argument("--keep", help="folder for the pictures, which are not drawn again if they are there")
    parser.add_argument("--choose", help="letters, one a row: count whose they are, from the key")
    options = parser.parse_args()
    output = pathlib.Path(options.output)
    key_file = output.with_suffix(".key.json")
    if options.choose:
        key = json.loads(key_file.read_text())
        if len(options.choose) != len(key):
            sys.exit(f"--choose must have {len(key)} letters, got {len(options.choose)}")
        chosen = [row["order"]["ABC".index(letter)] for letter, row in zip(options.choose, key)]
        for row, tool in zip(key, chosen):
            print(f"{row['model']:24} {tool}")
        print(dict(collections.Counter(chosen)))
        return
    from PIL import Image, ImageDraw
    order = random.Random(options.seed)
    key, rows = [], []
    with tempfile.TemporaryDirectory(prefix="strata_sheet_") as scratch:
        folder = pathlib.Path(options.keep or scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for model in options.models:
            pictures = {tool: f"{folder / model.stem}.{tool}.png" for tool in TOOLS}
            if not all(pathlib.Path(path).exists() for path in pictures.values()):
                pictures = draw(options, model, folder)
            tools = list(TOOLS)
            order.shuffle(tools)
            key.append({"model": model.name, "order": tools})
            rows.append([Image.open(pictures[tool]).convert("RGB") for tool in tools])
    side = options.side
    for first in range(0, len(rows), options.rows):
        some = rows[first:first + options.rows]
        sheet = Image.new("RGB", (3 * side + 40, len(some) * (side + 20)), "white")
        pen = ImageDraw.Draw(sheet)
        for i, row in enumerate(some):
            pen.text((4, i * (side + 20) + side // 2), str(first + i + 1), fill="black")
            for column, picture in enumerate(row):
                at = (24 + column * (side + 5), i * (side + 20) + 16)
                pen.text((at[0], at[1] - 13), "ABC"[column], fill="black")
                sheet.paste(picture, at)
        number = first // options.rows
        sheet.save(output if number == 0 else output.with_name(f"{output.stem}-{number + 1}{output.suffix}"))
    key_file.write_text(json.dumps(key, indent=1))


if __name__ == "__main__":
    main()
