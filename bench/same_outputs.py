#!/usr/bin/env python3
"""Compares what two builds of strata write, byte by byte: before and after code was moved.

usage: bench/same_outputs.py [--files] OLD_TOOL NEW_TOOL FOLDER...

Every mesh and every .csg scene below the folders is voxelized in several formats, made into depth lists, described,
and drawn. Files, messages, reports and exit codes must be equal; times and memory in a report do not count. With --files
messages and reports do not count either: after words were changed.
"""
import concurrent.futures
import hashlib
import os
import re
import subprocess
import sys
import tempfile

MESH_RUNS = [
    ["voxelize", "@", "-r", "96", "-o", "out.vdb", "--json", "--rule", "winding"],
    ["voxelize", "@", "-r", "64", "-o", "out.npy"],
    ["voxelize", "@", "-r", "48", "--surface", "-o", "out.nrrd"],
    ["voxelize", "@", "-r", "40", "-o", "out.vti"],
    ["ldi", "@", "-r", "64", "-o", "out.npz"],
    ["ldi", "@", "-r", "64", "-o", "out.exr"],
    ["ldi", "@", "-r", "64", "-o", "out.png"],
    ["info", "@", "--json"],
    ["csg", "@", "--size", "160,120", "--samples", "4", "-o", "out.png"],
]
SCENE_RUNS = [
    ["csg", "@", "--size", "200,150", "--samples", "4", "--edges", "-o", "out.png"],
    ["csg", "@", "--json", "--measure", "64"],
    ["voxelize", "@", "-r", "48", "-o", "out.binvox"],
    ["voxelize", "@", "-r", "40", "--ids", "-o", "out.vdb", "--json"],
    ["voxelize", "@", "-r", "32", "-o", "out.zarr"],
]
CHANGING = re.compile(rb'"(?:timings_ms|memory)": \{[^}]*\}|"[a-z_]*_ms": [0-9.e+-]*')


def digest_of(folder):
    digest = hashlib.sha256()
    for base, folders, files in os.walk(folder):
        folders.sort()
        for name in sorted(files):
            path = os.path.join(base, name)
            digest.update(os.path.relpath(path, folder).encode() + b"\0")
            with open(path, "rb") as file:
                digest.update(file.read())
    return digest.hexdigest()


def run(tool, arguments, files_only):
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run([tool, *arguments, "-j", "1"], cwd=folder, capture_output=True, timeout=60)
            said = (done.returncode,)
            if not files_only:
                said += (CHANGING.sub(b"", done.stdout), done.stderr)
        except subprocess.TimeoutExpired:
            return "over 60 seconds"
        return said, digest_of(folder)


def main():
    files_only = "--files" in sys.argv
    words = [word for word in sys.argv[1:] if word != "--files"]
    old, new = (os.path.abspath(tool) for tool in words[:2])
    jobs = []
    for top in words[2:]:
        for base, folders, files in os.walk(os.path.abspath(top)):
            folders.sort()
            for name in sorted(files):
                path = os.path.join(base, name)
                ending = name.rsplit(".", 1)[-1].lower()
                runs = SCENE_RUNS if ending == "csg" else MESH_RUNS if ending in ("obj", "stl", "ply", "off") else []
                jobs += [[path if word == "@" else word for word in words] for words in runs]
    differ = late = failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = [pool.map(lambda job, tool=tool: run(tool, job, files_only), jobs) for tool in (old, new)]
        for job, before, after in zip(jobs, *results):
            if isinstance(before, str) or isinstance(after, str):
                late += 1
            elif before != after:
                differ += 1
                print("differs:", " ".join(job))
            elif before[0][0] != 0:
                failed += 1
    print(f"{len(jobs)} runs, {differ} differ; {failed} end in the same error, {late} took over 60 seconds")
    return 1 if differ or not jobs else 0


sys.exit(main())
