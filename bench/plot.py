#!/usr/bin/env python3
"""plot.py RESULTS OUT.png: time and peak memory of the voxelizers over the side of the grid, and growth."""

import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

STYLES = {  # contender: (colour, line, label)
    "OpenVDB": ("#b3446c", "-", "OpenVDB"),
    "Embree": ("#e68a00", "-", "Embree, a ray a column"),
    "bit grid XOR": ("#6d6d6d", "--", "bit grid, XOR"),
    "bit grid XOR, slabs": ("#6d6d6d", "-", "bit grid, XOR in slabs"),
    "strata scan": ("#2a6fbb", "--", "Strata, count/scan"),
    "strata ha": ("#2a6fbb", "-", "Strata, HA-buffer"),
}


def load(folder, name):
    with open(os.path.join(folder, name + ".csv"), newline="") as file:
        return list(csv.DictReader(file))


def values(text):
    try:
        return float(text)
    except ValueError:
        return None


def curves(axes, rows, key, threads):
    for name, (colour, line, label) in STYLES.items():
        points = [(int(row["side"]), values(row[key])) for row in rows if row["contender"] == name
                  and row["threads"] == ("1" if name.startswith("bit") else threads)]
        points = sorted(point for point in points if point[1])
        if points:
            axes.plot(*zip(*points), line, color=colour, marker="o", markersize=3, linewidth=1.5, label=label)


def decorate(axes, title, unit, sides):
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xticks(sides, [str(side) for side in sides])
    axes.minorticks_off()
    axes.set_xlabel("voxels along the longest side")
    axes.set_ylabel(unit)
    axes.set_title(title, fontsize=10)
    axes.grid(True, linewidth=0.4, alpha=0.5)


def main():
    folder, out = sys.argv[1:3]
    rows = load(folder, "voxelizers")
    mesh = rows[0]["mesh"]
    rows = [row for row in rows if row["mesh"] == mesh]
    sides = sorted({int(row["side"]) for row in rows})
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.8))
    curves(left, rows, "wall ms", "2")
    decorate(left, f"mesh in memory to voxels, {int(rows[0]['triangles']):,} triangles", "ms, 2 threads (bit grid: 1)",
             sides)
    left.set_ylim(top=left.get_ylim()[1] * 100)  # room for the legend above the lines
    left.legend(fontsize=7, loc="upper left")
    curves(middle, rows, "peak MiB", "2")
    decorate(middle, "peak memory beyond the mesh", "MiB", sides)
    growth = [row for row in load(folder, "growth") if row["mesh"] == mesh]
    for threads, line in (("1", "--"), ("2", "-")):
        points = [(int(row["side"]), float(row["wall ms"])) for row in growth if row["threads"] == threads]
        right.plot(*zip(*points), line, color="#2a6fbb", marker="o", markersize=3, linewidth=1.5,
                   label=f"Strata, {threads} thread{'s' if threads != '1' else ''}")
        if threads == "1":
            first = points[0]
            square = [(side, first[1] * (side / first[0]) ** 2) for side, _ in points]
            right.plot(*zip(*square), ":", color="#6d6d6d", linewidth=1, label="grows with the surface, $N^2$")
    decorate(right, "growth (16384: statistics only)", "ms", [int(row["side"]) for row in growth
                                                             if row["threads"] == "1"])
    right.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    main()
