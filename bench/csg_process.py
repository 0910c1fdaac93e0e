#!/usr/bin/env python3
"""Whole processes, from a .csg to a picture of 1024 x 1024: `strata csg` in pairs with `openscad`, its preview
and its render. Medians of wall time. A display is needed (xvfb-run does), and the programs openscad and strata.
With --stl to a mesh instead: `strata mesh` against `openscad -o x.stl`, without a display.

usage: csg_process.py STRATA FOLDER... [--stl] [--rounds N] [--render-limit SECONDS] [--csv FILE]
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import tables


def seconds(command, limit):
    """Wall seconds of a command; None when it fails, infinity when it takes longer than the limit."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    late = threading.Timer(limit, process.kill)  # wait(timeout) would look every 50 ms only
    late.start()
    code = process.wait()
    took = time.perf_counter() - start
    late.cancel()
    if took >= limit:
        return float("inf")
    return took if code == 0 else None


def cell(value, limit):
    return "fails" if value is None else f"> {limit * 1e3:.0f}" if value == float("inf") else f"{value * 1e3:.0f}"


def stl_rows(options, scenes):
    """Rows of whole processes to STL, and the ratios of scenes of which both make one."""
    rows, ratios = [], []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder:
        mesh = os.path.join(folder, "a.stl")
        for scene in scenes:
            ours, theirs = [], []
            for _ in range(options.rounds + 1):
                ours.append(seconds([options.strata, "mesh", str(scene), "-o", mesh], options.limit))
                # One slow render is enough; it does not become faster than its limit.
                if not theirs or (theirs[-1] is not None and theirs[-1] < 5):
                    theirs.append(seconds(["openscad", "-o", mesh, str(scene)], options.render_limit))
            mine = None if None in ours else statistics.median(ours[1:])  # the first warms the disk
            other = None if None in theirs else statistics.median(theirs[1:] or theirs)
            ratio = "-"
            if None not in (mine, other) and mine != float("inf"):
                bound = min(other, options.render_limit)
                ratios.append(bound / mine)
                ratio = f"{'> ' if other != bound else ''}{bound / mine:.1f}"
            rows.append([scene.stem, cell(mine, options.limit), cell(other, options.render_limit), ratio])
            print("| " + " | ".join(rows[-1]) + " |", flush=True)
    return rows, ratios


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("strata")
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--render-limit", type=float, default=20, help="seconds; 0: no render")
    parser.add_argument("--limit", type=float, default=10, help="seconds for strata and for a preview")
    parser.add_argument("--stl", action="store_true", help="meshes instead of pictures")
    parser.add_argument("--csv")
    options = parser.parse_args()
    scenes = sorted(path for folder in options.folders for path in pathlib.Path(folder).rglob("*.csg"))
    if options.stl:
        rows, ratios = stl_rows(options, scenes)
        if options.csv:
            tables.save(options.csv, ["scene", "strata ms", "openscad ms", "openscad / strata"], rows)
        if ratios:
            print(f"{len(rows)} scenes, {len(ratios)} by both; openscad / strata at least {min(ratios):.1f}, "
                  f"median {statistics.median(ratios):.1f}")
        return
    if "DISPLAY" not in os.environ:
        sys.exit("csg_process: openscad needs a display: xvfb-run -s '-screen 0 1280x1024x24' " + sys.argv[0])

    columns = ["scene", "strata ms", "preview ms", "render ms", "preview / strata", "render / strata"]
    rows, previews, renders = [], [], []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder:
        picture = os.path.join(folder, "a.png")
        openscad = ["openscad", "-o", picture, "--imgsize=1024,1024"]
        for scene in scenes:
            ours, theirs = [], []
            strata = [options.strata, "csg", str(scene), "-o", picture, "--size", "1024,1024", "--colorscheme", "Cornfield"]
            for i in range(options.rounds + 1):
                ours.append(seconds(strata, options.limit))
                if float("inf") not in theirs:
                    theirs.append(seconds([*openscad, str(scene)], options.limit))
            ours = ours[1:]  # the first warms the disk
            theirs = theirs[1:] if float("inf") not in theirs else [float("inf")]
            render = None
            if options.render_limit > 0:
                render = seconds([*openscad, "--render=1", str(scene)], options.render_limit)
            if None in ours:
                mine = None
            else:
                mine = statistics.median(ours)
            preview = None if None in theirs else statistics.median(theirs)
            ratio = "-"
            bound = None if preview is None else min(preview, options.limit)
            if None not in (mine, preview):
                previews.append(bound / mine)
                ratio = f"{'> ' if preview != bound else ''}{bound / mine:.1f}"
            least = "-"
            if None not in (mine, render) and options.render_limit > 0:
                bound = min(render, options.render_limit)
                renders.append(bound / mine)
                least = f"{'> ' if render != bound else ''}{bound / mine:.0f}"
            rendered = cell(render, options.render_limit) if options.render_limit > 0 else "-"
            rows.append([scene.stem, cell(mine, options.limit), cell(preview, options.limit), rendered, ratio, least])
            print("| " + " | ".join(rows[-1]) + " |", flush=True)
    if options.csv:
        tables.save(options.csv, columns, rows)
    summary = [f"{len(rows)} scenes"]
    for name, ratios in [("preview", previews), ("render", renders)]:
        if ratios:
            summary.append(f"{name} / strata at least {min(ratios):.1f}, median {statistics.median(ratios):.1f}")
    print("; ".join(summary))


if __name__ == "__main__":
    main()
