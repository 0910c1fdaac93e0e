#!/usr/bin/env python3
"""Whole processes, from a file to a file: `strata voxelize` against a program that does the same with
OpenVDB and Strata's reader, and PNG slices. Interleaved rounds; medians of wall time, CPU time (user and
system, all threads) and peak memory."""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import tables


def measure(command, log):
    """Runs a command; returns wall and CPU seconds and peak MiB."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=log, stderr=log)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        log.seek(0)
        sys.exit(f"whole_process: {' '.join(command)} ended with {process.returncode}\n{log.read()[-2000:]}")
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def remove(path):
    if os.path.isdir(path):
        shutil.rmtree(path)
    elif os.path.exists(path):
        os.remove(path)


def size_of(path):
    if os.path.isdir(path):
        return sum(os.path.getsize(os.path.join(path, name)) for name in os.listdir(path))
    return os.path.getsize(path)


class Job:
    def __init__(self, mesh, side, task, program, command, output, budget):
        self.key = (mesh, side, task)
        self.program, self.command, self.output, self.budget = program, command, output, budget
        self.samples, self.bytes, self.layers = [], 0, 0

    def run(self, log):
        if self.samples and sum(wall for wall, _, _ in self.samples) > self.budget:
            return
        self.samples.append(measure(self.command, log))
        if self.output is not None:
            self.bytes = size_of(self.output)
            self.layers = len(os.listdir(self.output)) if os.path.isdir(self.output) else 0
            remove(self.output)  # outputs that exist may be refused

    def median(self):
        return [statistics.median(values) for values in zip(*self.samples)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bin", help="folder of the executables")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--budget", type=float, default=15, help="seconds a program may use for each task")
    parser.add_argument("--model", action="append", default=[], help="a mesh, beside the generated ones")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--csv")
    options = parser.parse_args()
    if options.quick:
        options.rounds, options.budget, options.model = 3, 3, []

    strata = os.path.join(options.bin, "strata")
    openvdb = os.path.join(options.bin, "bench_openvdb_convert")
    maker = os.path.join(options.bin, "bench_voxelizers")
    jobs = []
    with tempfile.TemporaryDirectory(prefix="strata_bench_") as folder, \
            tempfile.TemporaryFile("w+") as log:
        def output(name):
            return os.path.join(folder, name)

        files = []
        for name in ["bumps-82k"] if options.quick else ["bumps-82k", "bumps-328k", *options.model]:
            path = os.path.join(folder, os.path.splitext(os.path.basename(name))[0] + ".obj")
            subprocess.run([maker, "--mesh", name, "--write", path], check=True)
            files.append(path)

        jobs.append(Job("-", "-", "--version", "strata", [strata, "--version"], None, options.budget))
        for path in files:
            mesh = os.path.splitext(os.path.basename(path))[0]
            jobs.append(Job(mesh, 64, "OBJ to .npy", "strata",
                            [strata, "voxelize", path, "-r", "64", "-o", output("a.npy")],
                            output("a.npy"), options.budget))
            jobs.append(Job(mesh, 1024, "OBJ to .vdb mask", "strata",
                            [strata, "voxelize", path, "-r", "1024", "--mask", "-o", output("a.vdb")],
                            output("a.vdb"), options.budget))
            if os.path.exists(openvdb):
                jobs.append(Job(mesh, 1024, "OBJ to .vdb mask", "OpenVDB",
                                [openvdb, path, "-r", "1024", "-o", output("b.vdb")],
                                output("b.vdb"), options.budget))
            jobs.append(Job(mesh, 1024, "OBJ to .vdb level set", "strata",
                            [strata, "voxelize", path, "-r", "1024", "--sdf", "-o", output("c.vdb")],
                            output("c.vdb"), options.budget))
            if os.path.exists(openvdb):
                jobs.append(Job(mesh, 1024, "OBJ to .vdb level set", "OpenVDB",
                                [openvdb, path, "-r", "1024", "--sdf", "-o", output("d.vdb")],
                                output("d.vdb"), options.budget))
            jobs.append(Job(mesh, 1024, "OBJ to .sl1, 64 rays a pixel", "strata",
                            [strata, "voxelize", path, "-r", "1024", "--coverage=8", "-o", output("e.sl1")],
                            output("e.sl1"), options.budget))
            jobs.append(Job(mesh, 1024, "OBJ to 1024 PNG slices of 1024 x 1024", "strata",
                            [strata, "voxelize", path, "--grid", "1024,1024,1024", "--format", "png",
                             "-o", output("slices")],
                            output("slices"), options.budget))
            jobs.append(Job(mesh, 1024, "OBJ to nothing, --stats", "strata",
                            [strata, "voxelize", path, "-r", "1024", "--stats"],
                            None, options.budget))
        subprocess.run([sys.executable, os.path.join(os.path.dirname(os.path.abspath(__file__)), "textured_knot.py"),
                        folder], check=True)
        for format_ in ("vox", "vdb"):
            made = output("f." + format_)
            jobs.append(Job("textured knot-100k", 1024, f"OBJ and PNG of 2048 x 2048 to .{format_} of the surface",
                            "strata", [strata, "voxelize", output("knot.obj"), "-r", "1024", "--surface", "--colours",
                                       "-o", made], made, options.budget))
        for _ in range(options.rounds):
            for job in jobs:
                job.run(log)

    columns = ["mesh", "side", "task", "program", "wall ms", "cpu ms", "peak MiB", "output MiB",
               "layers / s", "wall / strata", "cpu / strata", "peak / strata", "rounds"]
    rows = []
    for job in jobs:
        wall, cpu, peak = job.median()
        base = next(other for other in jobs if other.key == job.key).median()
        rows.append([*job.key, job.program, f"{wall * 1e3:.1f}", f"{cpu * 1e3:.1f}", f"{peak:.1f}",
                     f"{job.bytes / 2**20:.2f}", f"{job.layers / wall:.0f}" if job.layers else "-",
                     f"{wall / base[0]:.1f}", f"{cpu / base[1]:.1f}", f"{peak / base[2]:.1f}",
                     len(job.samples)])
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    if options.csv:
        tables.save(options.csv, columns, rows)


if __name__ == "__main__":
    main()
