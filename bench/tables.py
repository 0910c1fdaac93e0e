#!/usr/bin/env python3
"""Markdown tables from the files of bench/run, and what of the goals they reach.

  tables.py RESULTS                    prints all sections
  tables.py RESULTS --into FILE.md     puts each between its lines <!-- begin NAME --> and <!-- end NAME -->
"""

import argparse
import csv
import os
import re
import statistics


def load(folder, name):
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def save(path, columns, rows):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def table(rows, columns):
    """columns: {heading: key of the row, or a function of it}"""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for row in rows:
        cells = [str(key(row) if callable(key) else row[key]) for key in columns.values()]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def number(text):
    try:
        return float(text)
    except ValueError:
        return float("nan")


def median(values):
    """What is no number, since a program failed or took too long, counts as the longest."""
    return statistics.median(float("inf") if value != value else value for value in values)


def short(value):
    if value != value:
        return "-"
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def pick(rows, **wanted):
    return [row for row in rows if all(row[key.replace("_", " ")] == str(value) for key, value in wanted.items())]


def voxelizers_section(rows):
    parts = []
    for mesh, triangles in dict.fromkeys((row["mesh"], row["triangles"]) for row in rows):
        parts.append(f"**{mesh}**, {int(triangles):,} triangles\n\n" + table(
            pick(rows, mesh=mesh),
            {"side": "side", "voxelizer": "contender", "threads": "threads", "wall ms": "wall ms",
             "CPU ms": "cpu ms", "wall / strata": "wall / strata", "CPU / strata": "cpu / strata",
             "first run ms": "first run ms", "peak MiB": "peak MiB", "peak / strata": "peak / strata",
             "voxels": lambda row: f"{int(row['voxels']):,}",
             "difference": lambda row: f"{int(number(row['voxels - strata'])):+,}"
             if row["voxels - strata"] not in ("-", "0") else "0"}))
    return "\n\n".join(parts)


def all_columns(rows):
    return table(rows, {key: key for key in rows[0]}) if rows else ""


class Goals:
    """Each goal of the project's table: by wall time and by CPU time. For goals over several meshes the
    worst mesh counts."""

    def __init__(self, folder):
        self.voxelizers = load(folder, "voxelizers")
        self.growth = load(folder, "growth")
        self.reading = load(folder, "reading")
        self.processes = load(folder, "whole_process")
        self.distances = load(folder, "signed_distances")
        self.frames = load(folder, "csg_frames")
        self.scenes = load(folder, "csg_process")
        self.rows = []

    def add(self, what, bound, wall, cpu, at_most=False):
        """wall, cpu: lists of values, the worst counts; cpu may be None."""
        def worst(values):
            return (max(values) if at_most else min(values)) if values else float("nan")

        value = worst(wall)
        reached = value <= bound if at_most else value >= bound
        self.rows.append({
            "what": what, "goal": ("at most " if at_most else "at least ") + f"{bound:g}",
            "by wall time": short(value), "by CPU time": short(worst(cpu)) if cpu is not None else "",
            "reached": "-" if value != value else "yes" if reached else "**no**"})

    def ratio(self, contender, side, threads, key, mesh="bumps"):
        """Values of a ratio column, over the generated meshes, or one of them."""
        return [number(row[key]) for row in pick(self.voxelizers, contender=contender, side=side, threads=threads)
                if row["mesh"].startswith(mesh)]

    def collect(self):
        for side, bound in ((1024, 100), (2048, 150)):
            self.add(f"OpenVDB / Strata, {side} a side, 2 threads", bound,
                     self.ratio("OpenVDB", side, 2, "wall / strata"), self.ratio("OpenVDB", side, 2, "cpu / strata"))
        self.add("OpenVDB / Strata, peak memory, 1024 a side", 10,
                 self.ratio("OpenVDB", 1024, 2, "peak / strata"), None)
        for contender, side, mesh, bound in (
                ("Embree", 1024, "bumps-82k", 17), ("Embree", 1024, "bumps-328k", 12),
                ("bit grid XOR, slabs", 1024, "bumps-82k", 7), ("bit grid XOR, slabs", 1024, "bumps-328k", 6),
                ("bit grid XOR, slabs", 2048, "bumps-82k", 25), ("bit grid XOR, slabs", 2048, "bumps-328k", 25)):
            self.add(f"{contender} / Strata, {mesh}, {side} a side, 1 thread", bound,
                     self.ratio(contender, side, 1, "wall / strata", mesh),
                     self.ratio(contender, side, 1, "cpu / strata", mesh))
        self.add("first call of a process / a later one, 1024 a side, 1 thread", 2,
                 [number(row["first run ms"]) / number(row["wall ms"])
                  for row in pick(self.voxelizers, contender="strata", side=1024, threads=1)
                  if row["mesh"].startswith("bumps")], None, True)
        store = {key: [a / b for a, b in zip(
            (number(row[key]) for row in pick(self.voxelizers, contender="strata ha", threads=1)),
            (number(row[key]) for row in pick(self.voxelizers, contender="strata scan", threads=1)))]
            for key in ("wall ms", "cpu ms")}
        self.add("HA-buffer / count/scan, end to end, all rows", 1.25, store["wall ms"], store["cpu ms"], True)
        self.add("signed distances, band 3, 1024 a side, OpenVDB / Strata", 25,
                 [number(row["ratio"]) for row in self.distances],
                 [number(row["cpu ratio"]) for row in self.distances])
        self.process_goals()
        self.reading_goals()
        self.growth_goals()
        self.frame_goals()
        return table(self.rows, {key: key for key in self.rows[0]})

    def process_goals(self):
        for task, bound in (("OBJ to .vdb mask", 25), ("OBJ to .vdb level set", 10)):
            rows = pick(self.processes, program="OpenVDB", task=task)
            self.add(f"whole process, {task}, 1024 a side, OpenVDB / Strata", bound,
                     [number(row["wall / strata"]) for row in rows], [number(row["cpu / strata"]) for row in rows])
        rows = pick(self.processes, mesh="bumps-82k", task="OBJ to .vdb mask", program="strata")
        self.add("whole process, OBJ of 82k triangles to .vdb mask, 1024 a side, ms", 30,
                 [number(row["wall ms"]) for row in rows], [number(row["cpu ms"]) for row in rows], True)
        if self.scenes:
            for look, column in (("Cornfield", "strata"), ("the default look", "default look")):
                wall, cpu = ([median(number(row[f"{column} {key}"]) for row in self.scenes)]
                             for key in ("ms", "CPU ms"))
                self.add(f"whole process, .csg to PNG of 1024 x 1024, {look}, median of the scenes, ms", 35, wall, cpu, True)
        rows = [row for row in self.processes if row["mesh"].startswith("textured")]
        self.add("whole process, colours of 100k triangles with a texture, 1024 a side, ms", 200,
                 [number(row["wall ms"]) for row in rows], None, True)
        layers = [row for row in self.processes if row["layers / s"] != "-"]
        self.add("PNG slices a second, whole process", 1000, [number(row["layers / s"]) for row in layers], None)

    def reading_goals(self):
        for file in ("OBJ", "binary STL"):
            rows = pick(self.reading, file=file, reader="OpenMesh")
            self.add(f"reading {file}, OpenMesh / Strata", 10,
                     [number(row["wall / strata with 2 threads"]) for row in rows],
                     [number(row["cpu / strata with 1 thread"]) for row in rows])
        for reader, bound in (("strata, 1 thread", 763), ("strata, 2 threads", 1430)):
            self.add(f"reading OBJ, {reader}, MiB a second", bound,
                     [number(row["MiB / s"]) for row in pick(self.reading, file="OBJ", reader=reader)], None)
        rows = [row for row in pick(self.reading, file="binary STL") if row["reader"].startswith("strata")]
        if rows:
            self.add("reading binary STL, the faster of 1 and 2 threads, ms", 40,
                     [min(number(row["wall ms"]) for row in rows)], [min(number(row["cpu ms"]) for row in rows)], True)

    def growth_goals(self):
        def times(side, threads, key):
            return {row["mesh"]: number(row[key]) for row in pick(self.growth, side=side, threads=threads)}

        for threads in (1, 2):
            values = {}
            for key in ("wall ms", "cpu ms"):
                low, high = times(1024, threads, key), times(4096, threads, key)
                values[key] = [high[mesh] / low[mesh] for mesh in high if mesh in low]
            self.add(f"time(4096) / time(1024), {threads} thread{'s' if threads > 1 else ''}", 20,
                     values["wall ms"], values["cpu ms"], True)
        for side in (1024, 2048):
            self.add(f"speed-up from 1 to 2 threads at {side}", 1.8,
                     [number(row["speed-up"]) for row in pick(self.growth, side=side, threads=2)], None)
        for key, bound in (("wall ms", 1000), ("peak MiB", 200)):
            self.add(f"statistics at 16384 a side, 2 threads, {key}", bound,
                     [number(row[key]) for row in pick(self.growth, side=16384, threads=2)], None, True)

    def frame_goals(self):
        for what, bound, rows in (
                ("geometric mean", 13, pick(self.frames, scene="geometric mean")),
                ("the least", 2.5, [row for row in self.frames if row["scene"] != "geometric mean"])):
            self.add(f"frames of trees, OpenCSG / Strata, {what}", bound,
                     [number(row["ratio"]) for row in rows], [number(row["cpu ratio"]) for row in rows])


def sections(folder):
    result = {}
    for name in ("machine", "stores", "boundary_machine"):
        path = os.path.join(folder, name + ".md")
        if os.path.exists(path):
            with open(path) as file:
                result[name] = re.sub("^## ", "### ", file.read().strip(), flags=re.M)
    for name in ("contouring", "voxel_pictures", "media"):
        path = os.path.join(folder, name + ".txt")
        if os.path.exists(path):
            with open(path) as file:
                result[name] = f"```text\n{file.read().rstrip()}\n```"
    voxelizers = load(folder, "voxelizers")
    if voxelizers:
        result["goals"] = Goals(folder).collect()
        result["voxelizers"] = voxelizers_section(voxelizers)
    for name in ("signed_distances", "growth", "reading", "whole_process", "csg_frames", "csg_laws", "csg_process", "boundary", "boundary_laws",
                 "boundary_process"):
        rows = load(folder, name)
        if rows:
            result[name] = all_columns(rows)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", help="folder of the csv files")
    parser.add_argument("--into", help="a document with the lines that mark the sections")
    options = parser.parse_args()
    found = sections(options.results)
    if not options.into:
        for name, text in found.items():
            print(f"## {name}\n\n{text}\n")
        return
    with open(options.into) as file:
        document = file.read()
    for name, text in found.items():
        begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
        document = re.sub(re.escape(begin) + ".*?" + re.escape(end),
                          lambda _, text=text: f"{begin}\n{text}\n{end}", document, flags=re.S)
    with open(options.into, "w") as file:
        file.write(document)


if __name__ == "__main__":
    main()
