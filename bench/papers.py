#!/usr/bin/env python3
"""The tables, the plots and the pictures of docs/papers.md.

  papers.py BIN [--quick] [--update-docs]

BIN holds strata, bench_papers, bench_transparency and bench_transparency_quality. CSV files, papers.png (plots) and techniques.png (a picture of
each technique) go to build/bench/papers; --update-docs puts the tables and both pictures into docs/.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OUT = os.path.join(ROOT, "build", "bench", "papers")
WORDS = {"exact": "exact", "bounded": "bounded", "random": "random"}


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


def scene(path, turns=9):
    """Rings through each other, see-through, with an opaque bar: every class of mistake shows."""
    with open(path, "w") as file:
        for i in range(turns):
            hue = i / turns
            file.write(f"color([{hue:.2f}, {1 - hue:.2f}, {0.3 + 0.5 * (i % 2):.2f}, 0.45]) rotate([{i * 37}, {i * 53}, 0]) "
                       f"difference() {{ cylinder(h = 6, r = 10, center = true, $fn = 48); "
                       f"cylinder(h = 7, r = 7, center = true, $fn = 48); }}\n")
        file.write("color([0.2, 0.2, 0.25]) rotate([20, 70, 0]) cube([4, 4, 30], center = true);\n")


def techniques(tool, quick):
    """Rows of the table of techniques, and the pictures."""
    pictures = os.path.join(OUT, "pictures")
    os.makedirs(pictures, exist_ok=True)
    source, compiled = os.path.join(OUT, "rings.scad"), os.path.join(OUT, "rings.csg")
    scene(source)
    run("openscad", "-o", compiled, source)
    side = "200,200" if quick else "320,320"
    report = json.loads(run(tool, "oit", compiled, "--technique", "all", "--size", side, "--json",
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
            entry["name"], entry["title"], entry["paper"], WORDS[entry["accuracy"]],
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
        axis.imshow(plt.imread(picture))
        psnr = entry["difference"]["psnr"]
        axis.set_title(entry["name"] + ("" if psnr is None else f"  {psnr:.0f} dB"), fontsize=8)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=100)


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
    if rows:
        keys = list(rows[0])
        for name in dict.fromkeys(row[keys[0]] for row in rows):
            points = [row for row in rows if row[keys[0]] == name]
            try:
                axis.plot([number(p["load"]) for p in points], [number(p["Mfragments/s"]) for p in points], "o-",
                          label=name)
            except (KeyError, ValueError):
                pass
    axis.set(title="HA-buffer over the load of its table", xlabel="load", ylabel="million fragments a second")
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
