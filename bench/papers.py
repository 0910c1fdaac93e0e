#!/usr/bin/env python3
"""The tables, the plots and the pictures of docs/papers.md.

  papers.py BIN [--quick] [--update-docs]

BIN holds strata, bench_papers, bench_transparency and bench_transparency_quality. CSV files, papers.png (plots) and techniques.png (a picture of
each technique) go to build/bench/papers; --update-docs puts the tables and both pictures into docs/.
"""

import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OUT = os.path.join(ROOT, "build", "bench", "papers")


def run(*command):
    print("$", *command, file=sys.stderr)
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def load(name):
    path = os.path.join(OUT, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def markdown(rows):
    if not rows:
        return "not measured\n"
    columns = list(rows[0])
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(row[key] for key in columns) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def scene(path, rings=6, sides=40):
    """An OBJ file: see-through rings through each other around an opaque bar, so that every class of mistake shows."""
    points, lines, materials = [], [], []

    def rotated(p, a, b):
        x, y, z = p
        y, z = y * math.cos(a) - z * math.sin(a), y * math.sin(a) + z * math.cos(a)
        return (x * math.cos(b) + z * math.sin(b), y, z * math.cos(b) - x * math.sin(b))

    for i in range(rings):
        hue = i / (rings - 1)
        materials.append(f"newmtl ring{i}\nKd {hue:.2f} {1 - hue:.2f} {0.3 + 0.5 * (i % 2):.2f}\nd 0.4\n")
        lines.append(f"usemtl ring{i}")
        first = len(points) + 1
        for k in range(sides):
            turn = 2 * math.pi * k / sides
            for radius, z in ((10, -1.5), (10, 1.5), (8, 1.5), (8, -1.5)):
                points.append(rotated((radius * math.cos(turn), radius * math.sin(turn), z), i * 0.65, i * 0.93))
        for k in range(sides):
            at, after = first + 4 * k, first + 4 * ((k + 1) % sides)
            for j in range(4):
                lines.append(f"f {at + j} {after + j} {after + (j + 1) % 4} {at + (j + 1) % 4}")
    materials.append("newmtl bar\nKd 0.25 0.25 0.3\nd 1\n")
    lines.append("usemtl bar")
    first = len(points) + 1
    points += [rotated((x, y, z), 0.4, 1.1) for x in (-2, 2) for y in (-2, 2) for z in (-14, 14)]
    for face in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        lines.append("f " + " ".join(str(first + corner) for corner in face))
    name = os.path.basename(path)[:-4]
    with open(path, "w") as file:
        file.write(f"mtllib {name}.mtl\n" + "".join("v %.6f %.6f %.6f\n" % p for p in points) + "\n".join(lines) + "\n")
    with open(path[:-4] + ".mtl", "w") as file:
        file.write("".join(materials))


def techniques(tool, quick):
    """Rows of the table of techniques, and the pictures."""
    pictures = os.path.join(OUT, "pictures")
    os.makedirs(pictures, exist_ok=True)
    source = os.path.join(OUT, "rings.obj")
    scene(source)
    side = "200,200" if quick else "320,320"
    report = json.loads(run(tool, "oit", source, "--technique", "all", "--size", side, "--json",
                            "-o", os.path.join(pictures, "oit.png")))
    rows = []
    for entry in report["techniques"]:
        if entry.get("left_out"):
            rows.append((entry, None))
            continue
        rows.append((entry, entry["path"]))
    return rows


def technique_table(rows):
    lines = ["| technique | what | paper | class | passes | memory | where it fails | dB |", "|" + "---|" * 8]
    for entry, path in rows:
        costs = entry.get("costs", {})
        psnr = entry.get("difference", {}).get("psnr")
        quality = "" if path is None else "same" if psnr is None else f"{psnr:.0f}"
        lines.append("| `{}` | {} | {} | {} | {} | {} | {} | {} |".format(
            entry["name"], entry["title"], entry["paper"], entry["accuracy"],
            costs.get("geometry_passes", ""), entry["memory"] or "", entry["fails"] or "", quality))
    return "\n".join(lines) + "\n"


def montage(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    shown = [(entry, picture) for entry, picture in rows if picture]
    columns = 6
    lines = (len(shown) + columns - 1) // columns
    figure, axes = plt.subplots(lines, columns, figsize=(12, 2.25 * lines))
    for axis in axes.flat:
        axis.axis("off")
    for axis, (entry, picture) in zip(axes.flat, shown):
        pixels = plt.imread(picture)
        margin = pixels.shape[0] // 6
        axis.imshow(pixels[margin:-margin, margin:-margin])
        psnr = entry["difference"]["psnr"]
        axis.set_title(entry["name"] + ("" if psnr is None else f"  {psnr:.0f} dB"), fontsize=8)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=72)


def plots(path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, 2, figsize=(10, 7))

    def number(text):
        return float(text) if text else float("nan")

    axis = axes[0][0]
    rows = load("bunny")
    for name in dict.fromkeys(row["technique"] for row in rows):
        points = [row for row in rows if row["technique"] == name]
        line, = axis.plot([int(p["side"]) for p in points], [number(p["count-scan over it"]) for p in points],
                          "o-", label=name)
        if points[0]["published"]:
            axis.plot([int(p["side"]) for p in points], [number(p["published"]) for p in points], "x:",
                      color=line.get_color())
    axis.set(title="Bunny: speed, count/scan = 1 (dotted: published)", xlabel="side of the picture, pixels",
             ylabel="times count/scan")
    axis.legend(fontsize=7)

    axis = axes[0][1]
    rows = load("stacked")
    axis.plot([int(row["most layers"]) for row in rows], [number(row["ha64 ms"]) for row in rows], "o-", label="ha64")
    axis.plot([int(row["most layers"]) for row in rows], [number(row["culled ms"]) for row in rows], "o-",
              label="ha64-culled")
    axis.set(title="64 quads that stack: one million fragments", xlabel="layers of the deepest pixel", ylabel="ms")
    axis.legend(fontsize=7)

    axis = axes[1][0]
    rows = load("loads")
    for name in dict.fromkeys(row["technique"].split()[0] for row in rows):
        points = [row for row in rows if row["technique"].split()[0] == name]
        axis.plot([number(p["technique"].split()[1]) for p in points],
                  [number(p["of cpu time"]) for p in points], "o-", label=name)
    axis.set(title="HA-buffer over the load of its table", xlabel="load", ylabel="million fragments a second of CPU time")
    axis.legend(fontsize=7)

    axis = axes[1][1]
    rows = load("layers")
    if rows:
        counts = [int(row["layers"]) for row in rows]
        axis.plot(counts, [number(row["of 2 layers"]) for row in rows], "o-", label="measured")
        axis.plot(counts, [number(row["published"]) for row in rows], "x:", label="published")
    axis.set(title="Full-screen layers in linked lists: time, 2 layers = 1", xlabel="layers", ylabel="times")
    axis.legend(fontsize=7)
    for axis in axes.flat:
        axis.grid(True, linewidth=0.4, alpha=0.5)
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def into(path, sections):
    with open(path) as file:
        text = file.read()
    for name, body in sections.items():
        pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.S)
        if not pattern.search(text):
            raise SystemExit(f"{path}: no section {name}")
        text = pattern.sub(lambda match, body=body: match[1] + body + match[2], text)
    with open(path, "w") as file:
        file.write(text)


def machine():
    with open("/proc/cpuinfo") as file:
        model = next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    with open("/proc/loadavg") as file:
        load_before = file.read().split()[0]
    return f"{model}, {os.cpu_count()} processors; load before the run {load_before}.\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--update-docs", action="store_true")
    arguments = parser.parse_args()
    os.makedirs(OUT, exist_ok=True)
    quick = ["--quick"] if arguments.quick else []
    sections = {"machine": machine()}
    run(os.path.join(arguments.bin, "bench_papers"), OUT, *quick)
    run(os.path.join(arguments.bin, "bench_transparency"), "--tables", "loads", "--csv", os.path.join(OUT, "loads.csv"),
        *(["--rounds", "3"] if arguments.quick else []))
    run(os.path.join(arguments.bin, "bench_transparency_quality"), "--csv", os.path.join(OUT, "hair_quality.csv"),
        *(["--rounds", "1"] if arguments.quick else []))
    rows = techniques(os.path.join(arguments.bin, "strata"), arguments.quick)
    sections["techniques"] = technique_table(rows)
    for name in ("culling", "stacked", "speed", "scenes", "quads", "bunny", "walkthrough", "layers", "model",
                 "mlab_memory", "hair_quality", "artefacts", "loads"):
        sections[name] = markdown(load(name))
    folder = os.path.join(ROOT, "docs") if arguments.update_docs else OUT
    montage(rows, os.path.join(folder, "techniques.png"))
    plots(os.path.join(folder, "papers.png"))
    if arguments.update_docs:
        into(os.path.join(ROOT, "docs", "papers.md"), sections)
    else:
        print("\n".join(f"## {name}\n\n{body}" for name, body in sections.items()))


if __name__ == "__main__":
    main()
