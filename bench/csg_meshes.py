#!/usr/bin/python3
"""Makes a mesh of each scene of OpenSCAD's corpus, and compares its volume with that of voxels; puts the result between
the marks `meshes` of docs/csg_conformance.md.

usage: csg_meshes.py STRATA [--into docs/csg_conformance.md] [FOLDER...]

FOLDER... hold .scad and .csg files; without one they are those of Debian's packages openscad and openscad-testing-data.
`strata mesh` writes no file that has not passed its checks. Two volumes are expected to differ by less than the area
times a voxel's side: voxels are 256 along the longest side. Scenes that are empty for `strata mesh` must be empty for
`strata voxelize`. Needs python3-numpy.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

OPENSCAD = pathlib.Path("/usr/share/openscad")

REASONS = {
    "issue964": "The polyhedron is open. The mesh has caps; voxels are decided by the vote of three axes.",
    "nonmanifold-polyhedron": "The same polyhedron.",
}


def volume_and_area(path):
    """Of a binary STL."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    kind = np.dtype([("normal", "<3f4"), ("corners", "<9f4"), ("attribute", "<u2")])
    corners = np.frombuffer(data, dtype=kind, count=count, offset=84)["corners"].astype(float).reshape(-1, 3, 3)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6, area


def run(strata, *words):
    return subprocess.run([strata, *words, "-j", "1"], capture_output=True, text=True, timeout=900)


def says_empty(process):
    return process.returncode == 5 and " empty" in process.stderr


def last_line(process):
    return (process.stderr.strip().splitlines() or [f"exit code {process.returncode}"])[-1].removeprefix("strata: error: ")


def check(strata, scene):
    """(name, kind, text): kind is 'same', 'empty', 'unread', 'differs' or 'fails'."""
    name = scene.stem
    with tempfile.TemporaryDirectory() as folder:
        mesh = pathlib.Path(folder) / "a.stl"
        made = run(strata, "mesh", str(scene), "-o", str(mesh), "--quiet")
        voxels = run(strata, "voxelize", str(scene), "-r", "256", "--stats", "--json", "--quiet")
        if says_empty(made):
            nothing = says_empty(voxels) or '"solid": 0,' in voxels.stdout  # a sheet fills no voxel
            return name, "empty" if nothing else "fails", "`strata voxelize` does not say that it is empty"
        if made.returncode == 3 and voxels.returncode == 3:
            return name, "unread", last_line(made)
        if made.returncode != 0:
            return name, "fails", last_line(made).replace(str(scene), scene.name)
        volume, area = volume_and_area(mesh)
    if voxels.returncode != 0:
        return name, "fails", last_line(voxels)
    report = json.loads(voxels.stdout)
    bound = area * max(report["grid"]["voxel_size"])
    difference = abs(volume - report["voxels"]["volume"])
    if difference <= bound:
        return name, "same", ""
    text = f"mesh {volume:.6g}, voxels {report['voxels']['volume']:.6g}, bound {bound:.3g}"
    return name, "differs", text


def section(rows):
    kinds = {kind: [row for row in rows if row[1] == kind] for kind in ("same", "empty", "unread", "differs", "fails")}
    solid = len(kinds["same"]) + len(kinds["differs"]) + len(kinds["fails"])
    lines = [
        f"- {len(rows)} scenes; {len(kinds['empty'])} are empty, {len(kinds['unread'])} are refused by openscad or the reader",
        f"- {solid - len(kinds['fails'])} of the other {solid} give a mesh that passes all checks; "
        f"the volume of {len(kinds['same'])} is that of the voxels within the bound", "",
    ]
    odd = kinds["differs"] + kinds["fails"]
    if odd:
        lines += ["| scene | what | why |", "|---|---|---|"]
        lines += [f"| {name} | {text} | {REASONS.get(name, 'Not examined yet.')} |" for name, _, text in sorted(odd)]
    return "\n".join(lines).strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strata")
    parser.add_argument("folders", nargs="*", default=[str(OPENSCAD / "examples"), str(OPENSCAD / "testdata")])
    parser.add_argument("--into")
    options = parser.parse_args()
    scenes = sorted(path for folder in options.folders for path in pathlib.Path(folder).rglob("*")
                    if path.suffix in (".scad", ".csg"))
    if not scenes:
        sys.exit("csg_meshes: no scenes; Debian's packages openscad and openscad-testing-data have some")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(lambda scene: check(options.strata, scene), scenes))
    text = section(rows)
    print(text)
    if options.into:
        path = pathlib.Path(options.into)
        begin, end = "<!-- begin meshes -->", "<!-- end meshes -->"
        path.write_text(re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: f"{begin}\n{text}\n{end}",
                               path.read_text(), flags=re.S))


if __name__ == "__main__":
    main()
