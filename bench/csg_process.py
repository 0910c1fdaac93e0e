#!/usr/bin/env python3
"""Whole processes, from a .csg to a picture of 1024 x 1024: `strata csg` in pairs with `openscad`, its preview
and its render. Medians of wall time, and of processor time (user and system), which other jobs disturb less. A display
is needed (xvfb-run does), and the programs openscad and strata. The colour scheme is Cornfield in both; column `default
look` has what strata takes with its own lights and occlusion.
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
import typing

import tables


class Took(typing.NamedTuple):
    """Seconds of a command."""
    wall: float
    cpu: float  # user and system, of all its threads


LATE = Took(float("inf"), float("inf"))


def run(command, limit):
    """What a command takes; None when it fails, LATE when it takes longer than the limit."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    late = threading.Timer(limit, process.kill)  # wait(timeout) would look every 50 ms only
    late.start()
    _, status, usage = os.wait4(process.pid, 0)
    took = time.perf_counter() - start
    late.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    if took >= limit:
        return LATE
    return Took(took, usage.ru_utime + usage.ru_stime) if process.returncode == 0 else None


def median(runs):
    """Of each; None when one of them failed."""
    return None if None in runs else Took(*(statistics.median(one) for one in zip(*runs)))


def cells(took, limit):
    """Wall and processor time in milliseconds."""
    if took is None:
        return ["fails", "-"]
    return [f"> {limit * 1e3:.0f}", "-"] if took == LATE else [f"{seconds * 1e3:.0f}" for seconds in took]


def ratio_of(ours, theirs, limit, ratios):
    """The cell of a ratio of wall times, at most of the limit; appends it to the ratios."""
    if ours is None or theirs is None or ours == LATE:
        return "-"
    bound = min(theirs.wall, limit)
    ratios.append(bound / ours.wall)
    return f"{'> ' if theirs.wall != bound else ''}{ratios[-1]:.1f}"


def compare_meshes(options, scenes):
    """Rows of whole processes to STL, and the ratios of scenes of which both make one."""
    rows, ratios = [], []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder:
        mesh = os.path.join(folder, "a.stl")
        for scene in scenes:
            ours, theirs = [], []
            for _ in range(options.rounds + 1):
                ours.append(run([options.strata, "mesh", str(scene), "-o", mesh], options.limit))
                # One slow render is enough; it does not become faster than its limit.
                if not theirs or (theirs[-1] is not None and theirs[-1].wall < 5):
                    theirs.append(run(["openscad", "-o", mesh, str(scene)], options.render_limit))
            mine, other = median(ours[1:]), median(theirs[1:] or theirs)  # the first warms the disk
            rows.append([scene.stem, *cells(mine, options.limit), *cells(other, options.render_limit),
                         ratio_of(mine, other, options.render_limit, ratios)])
            print("| " + " | ".join(rows[-1]) + " |", flush=True)
    return rows, {"openscad": ratios}


def compare_pictures(options, scenes):
    """Rows of whole processes to PNG, and the ratios of scenes of which both make one."""
    rows, previews, renders = [], [], []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder:
        picture = os.path.join(folder, "a.png")
        openscad = ["openscad", "-o", picture, "--imgsize=1024,1024"]
        for scene in scenes:
            strata = [options.strata, "csg", str(scene), "-o", picture, "--size", "1024,1024"]
            ours, theirs, looks = [], [], []
            for _ in range(options.rounds + 1):
                ours.append(run([*strata, "--colorscheme", "Cornfield"], options.limit))
                looks.append(run(strata, options.limit))
                if LATE not in theirs:
                    theirs.append(run([*openscad, str(scene)], options.limit))
            mine, look = median(ours[1:]), median(looks[1:])  # the first warms the disk
            preview = LATE if LATE in theirs else median(theirs[1:])
            render, rendered = None, ["-", "-"]
            if options.render_limit > 0:
                render = run([*openscad, "--render=1", str(scene)], options.render_limit)
                rendered = cells(render, options.render_limit)
            rows.append([scene.stem, *cells(mine, options.limit), *cells(look, options.limit),
                         *cells(preview, options.limit), *rendered,
                         ratio_of(mine, preview, options.limit, previews),
                         ratio_of(mine, render, options.render_limit, renders)])
            print("| " + " | ".join(rows[-1]) + " |", flush=True)
    return rows, {"preview": previews, "render": renders}


def medians(columns, rows):
    """Of the columns of milliseconds, over the scenes that have a number there."""
    found = []
    for at, name in enumerate(columns):
        values = [float(row[at]) for row in rows if name.endswith(" ms") and row[at].isdigit()]
        if values:
            found.append(f"{name} {statistics.median(values):.0f}")
    return "medians: " + ", ".join(found)


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
        columns = ["scene", "strata ms", "strata CPU ms", "openscad ms", "openscad CPU ms", "openscad / strata"]
        rows, ratios = compare_meshes(options, scenes)
    else:
        if "DISPLAY" not in os.environ:
            sys.exit("csg_process: openscad needs a display: xvfb-run -s '-screen 0 1280x1024x24' " + sys.argv[0])
        columns = ["scene", "strata ms", "strata CPU ms", "default look ms", "default look CPU ms", "preview ms",
                   "preview CPU ms", "render ms", "render CPU ms", "preview / strata", "render / strata"]
        rows, ratios = compare_pictures(options, scenes)
    if options.csv:
        tables.save(options.csv, columns, rows)
    summary = [f"{len(rows)} scenes"]
    for name, values in ratios.items():
        if values:
            summary.append(f"{name} / strata of {len(values)} at least {min(values):.1f}, "
                           f"median {statistics.median(values):.1f}")
    print("; ".join(summary))
    print(medians(columns, rows))


if __name__ == "__main__":
    main()
