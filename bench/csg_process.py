#!/usr/bin/env python3
"""Whole processes, from a .csg to a picture of 1024 x 1024: `strata csg` in pairs with `openscad`, its preview
and its render. Medians of wall time. A display is needed (xvfb-run does), and the programs openscad and strata.

usage: csg_process.py STRATA FOLDER... [--rounds N] [--render-limit SECONDS] [--csv FILE]
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


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("strata")
    parser.add_argument("folders", nargs="+")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--render-limit", type=float, default=20, help="seconds; 0: no render")
    parser.add_argument("--limit", type=float, default=10, help="seconds for strata and for a preview")
    parser.add_argument("--csv")
    options = parser.parse_args()
    if "DISPLAY" not in os.environ:
        sys.exit("csg_process: openscad needs a display: xvfb-run -s '-screen 0 1280x1024x24' " + sys.argv[0])

    scenes = sorted(path for folder in options.folders for path in pathlib.Path(folder).rglob("*.csg"))
    columns = ["scene", "strata ms", "preview ms", "render ms", "preview / strata", "render / strata"]
    rows, previews, renders = [], [], []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder:
        picture = os.path.join(folder, "a.png")
        openscad = ["openscad", "-o", picture, "--imgsize=1024,1024"]
        for scene in scenes:
            ours, theirs = [], []
            strata = [options.strata, "csg", str(scene), "-o", picture, "--size", "1024,1024"]
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
