#!/usr/bin/python3
"""Compares our pictures with the ones that OpenSCAD's own tests expect; writes docs/csg_conformance.md.

usage: csg_conformance.py STRATA OUTPUT.md [--sheet SHEET.png]

The programs and pictures are those of OpenSCAD 2021.01: Debian's openscad-testing-data and the examples of its
package openscad, which must be installed. Two measures for each scene that has an expected picture: the intersection over union of the silhouettes,
and OpenSCAD's own rule (tests/image_compare.py): a picture fails if in some 3 x 3 block all nine pixels
differ by 8 levels or more, with the same sign, in one channel. Needs python3-pil and python3-numpy.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw

OPENSCAD = pathlib.Path("/usr/share/openscad")
BACKGROUND = np.array([255, 255, 229])

THIN = "The scene is flat and a few pixels wide, and OpenSCAD's red outlines are off by up to a pixel."
FONT = "openscad refuses the program: Debian leaves out the font file that it names."

# Scenes below 0.97, and why.
REASONS = {
    "issue1137": "The polyhedron is not closed. OpenSCAD shows nothing; Strata decides by parity what is inside.",
    "nef3_cube": "Nef polyhedra are not read.",
    "intersection-tests": "A flat circle beside solids is left out of the result; OpenSCAD shows it as a slab.",
    "preview_variable": "The program asks whether it runs as a preview, which is true while openscad writes the .csg.",
    "polyhedron-tests": "A corner that names no point is left out of its face. A polyhedron with an infinite point is left out.",
    "issue2220": "The expected picture shows this flat scene from the camera for solids; Strata shows flat scenes from above.",
    "minkowski2-tests": "The expected picture treats a sum with an empty operand as empty; Strata ignores that operand.",
    "text-font-symbol": "The font is not installed.",
    "logo_and_text": "The font is not installed.",
    "text-font-alignment-tests": FONT,
    "text-font-composition": FONT,
    "text-font-direction-tests": FONT,
    "text-font-simple-tests": FONT,
    "text-font-spacing-tests": FONT,
    "issue666": "Both pictures are empty, but the expected one has another background colour.",
    "spec-paths-arcs02": "Strata draws the group that `use` refers to, filled. OpenSCAD draws the four arcs alone.",
    "issue591": "The solids look alike, but the expected picture is drawn from farther away.",
    "spec-paths-cubic02": "The lines are thinner than a pixel. OpenSCAD draws red outlines a pixel wide, Strata only the pixel centres they cover.",
    "spec-shapes-line01": THIN,
    "spec-shapes-polyline01": THIN,
    "text-font-tests": THIN,
    "issue1529": "openscad leaves a `%` of the program out of the .csg that it writes, so the cylinder is subtracted.",
    "children_indexed": "Letters and solids are a few pixels wide. Both pictures have the same extent, to a pixel.",
}


def reason(row):
    return REASONS.get(row[0], THIN if row[3] and row[1] > 0.75 else "Not examined yet.")


def load(path):
    picture = Image.open(path).convert("RGBA")
    ground = Image.new("RGBA", picture.size, (*BACKGROUND, 255))
    ground.alpha_composite(picture)
    return np.asarray(ground.convert("RGB")).astype(int)


def passes_openscad_rule(ours, expected):
    difference = ours - expected
    for channel in range(3):
        for sign in (1, -1):
            over = (difference[:, :, channel] * sign >= 8).astype(int)
            rows, columns = over.shape[0] - 2, over.shape[1] - 2
            count = sum(over[i:i + rows, j:j + columns] for i in range(3) for j in range(3))
            if (count == 9).any():
                return False
    return True


def compare(strata, scene, expected, output):
    run = subprocess.run([strata, "csg", scene, "-o", output, "--size", "512,512", "-j", "1", "--render", "--viewall",
                          "--autocenter", "--quality", "draft", "--colorscheme", "Cornfield"],
                         capture_output=True, text=True, timeout=600)
    target = load(expected)
    ours = load(output) if run.returncode == 0 else np.broadcast_to(BACKGROUND, target.shape)
    mine = np.abs(ours - BACKGROUND).max(axis=2) > 3
    theirs = np.abs(target - BACKGROUND).max(axis=2) > 3
    either = (mine | theirs).sum()
    overlap = 1.0 if either == 0 else float((mine & theirs).sum() / either)
    flat = bool((np.abs(target - np.array([255, 0, 0])).max(axis=2) < 12).sum() > 20)  # has red outlines
    return overlap, passes_openscad_rule(ours, target), flat


def write_sheet(path, rows, folder, expected_folder):
    side, columns = 128, 12
    lines = (len(rows) + columns - 1) // columns
    sheet = Image.new("RGB", (columns * (2 * side + 8), lines * (side + 14)), "white")
    draw = ImageDraw.Draw(sheet)
    for i, row in enumerate(rows):
        x, y = i % columns * (2 * side + 8), i // columns * (side + 14)
        for k, picture in enumerate((expected_folder / f"{row[0]}-expected.png", folder / f"{row[0]}.png")):
            if picture.exists():
                sheet.paste(Image.open(picture).convert("RGB").resize((side, side)), (x + k * side, y + 12))
        draw.text((x, y), f"{row[1]:.3f} {row[0]}".encode("ascii", "replace").decode()[:38], fill="black" if row[1] >= 0.97 else "red")
    sheet.save(path)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("strata"), parser.add_argument("output")
    parser.add_argument("--sheet")
    arguments = parser.parse_args()
    scenes = {path.stem: path for folder in ("examples", "testdata") for path in (OPENSCAD / folder).rglob("*.scad")}
    expected_folder = OPENSCAD / "regression" / "cgalpngtest"
    names = sorted(path.name.removesuffix("-expected.png") for path in expected_folder.glob("*.png")
                   if path.stat().st_size > 0)
    without_scene = [name for name in names if name not in scenes]
    names = [name for name in names if name in scenes]
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)

        def one(name):
            return (name, *compare(arguments.strata, scenes[name], expected_folder / f"{name}-expected.png",
                                   folder / f"{name}.png"))

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            rows = list(pool.map(one, names))
        rows.sort(key=lambda row: (row[1], row[0]))
        if arguments.sheet:
            write_sheet(arguments.sheet, rows, folder, expected_folder)

    overlaps = [row[1] for row in rows]
    low = [row for row in rows if row[1] < 0.97]
    lines = [
        "# Strata's pictures compared with OpenSCAD's", "",
        "`bench/csg_conformance.py` makes this page with `strata csg --render` at 512 x 512. It compares the pictures with those that",
        "the tests and examples of OpenSCAD 2021.01 expect: Debian's packages openscad and openscad-testing-data hold both.", "",
        "- IoU is the intersection of the two silhouettes over their union: 1 when they are equal.",
        "- Rule is OpenSCAD's own comparison of pictures, which also looks at colours.", "",
        "## Result", "",
        f"- {len(rows)} scenes with an expected picture; median IoU {np.median(overlaps):.5f}",
        f"- {sum(row[2] for row in rows)} pass OpenSCAD's rule",
        f"- {len(low)} have an IoU below 0.97; the next table gives the reasons", "",
        "## Below 0.97", "", "| scene | IoU | why |", "|---|---|---|"]
    lines += [f"| {row[0]} | {row[1]:.4f} | {reason(row)} |" for row in low]
    lines += ["", "## All others", "", "| scene | IoU | rule |", "|---|---|---|"]
    lines += [f"| {row[0]} | {row[1]:.4f} | {'passes' if row[2] else 'differs'} |" for row in rows if row[1] >= 0.97]
    old = pathlib.Path(arguments.output)  # bench/csg_meshes.py makes the section of meshes
    meshes = re.search("## Meshes.*?<!-- end meshes -->", old.read_text() if old.exists() else "", flags=re.S)
    if meshes:
        at = lines.index("## Below 0.97")
        lines[at:at] = [meshes[0], ""]
    if without_scene:
        lines += ["", f"The packages have no program for: {', '.join(without_scene)}."]
    pathlib.Path(arguments.output).write_text("\n".join(lines) + "\n")
    print("\n".join(lines[10:13]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
