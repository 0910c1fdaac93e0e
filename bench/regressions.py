#!/usr/bin/env python3
"""Compares a run of the benchmarks with the last one on the same machine, and keeps it as the last one.

usage: bench/regressions.py RESULTS LAST

RESULTS and LAST are folders of csv files of bench/run. A row of Strata's is named that takes over 10 % more processor
time than in LAST. The programs that Strata is compared with have not changed: if they too take longer, the machine is
slower, and their median change is taken off. Nothing is compared with a run on another machine. At the end LAST is
replaced by RESULTS.
"""
import csv
import os
import shutil
import statistics
import sys

BOUND = 1.10
KEYS = ("mesh", "side", "result", "contender", "threads", "file", "reader", "task", "program", "scene", "what", "against",
        "stream", "technique")
PROGRAMS = ("contender", "reader", "program")
TIMES = ("cpu ms", "ms", "wall ms")  # the first that the table has


def machine(folder):
    """The kind of machine, without its load and the commit."""
    try:
        with open(os.path.join(folder, "machine.md")) as file:
            return file.read().split(";")[0]
    except OSError:
        return None


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return None


def times(path):
    """{(key, is a peer's): ms} of a table."""
    found = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            key = tuple(row[name] for name in KEYS if name in row)
            peer = any(not row[name].startswith("strata") for name in PROGRAMS if name in row)
            own = next((name for name in TIMES if name in row), None)
            for name in row:
                if name == own:
                    found[key, peer] = number(row[name])
                elif own is not None and name.endswith(" " + own):  # "OpenCSG cpu ms", in the row of Strata
                    found[key + (name,), True] = number(row[name])
    return {key: value for key, value in found.items() if value}


def changes(results, last):
    """The changes of Strata's rows and those of peers, as lists of (text, before, after)."""
    ours, peers = [], []
    for name in sorted(os.listdir(results)):
        before = os.path.join(last, name)
        if not name.endswith(".csv") or not os.path.exists(before):
            continue
        old = times(before)
        for (key, peer), after in times(os.path.join(results, name)).items():
            if (key, peer) in old:
                text = f"{name[:-4]}: " + ", ".join(part for part in key if part not in ("", "-"))
                (peers if peer else ours).append((text, old[key, peer], after))
    return ours, peers


def compare(results, last):
    if machine(last) is None:
        return ["no earlier run to compare with"]
    if machine(last) != machine(results):
        return [f"the last run was on another machine ({machine(last)}), and is not compared"]
    ours, peers = changes(results, last)
    drift = statistics.median(after / before for _, before, after in peers) if peers else 1.0
    slower = sorted(((after / before / drift, text, before, after) for text, before, after in ours
                     if after / before / drift > BOUND), reverse=True)
    lines = [f"{len(ours)} times are compared with the last run on this machine; other programs take {drift:.2f} times as "
             f"long as then"]
    lines += [f"slower by {100 * (ratio - 1):.0f} %: {text}: {before:g} ms before, {after:g} ms now"
              for ratio, text, before, after in slower]
    if ours and not slower:
        lines.append("nothing is slower by more than 10 %")
    return lines


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    results, last = sys.argv[1:]
    print("\n".join(compare(results, last)))
    shutil.rmtree(last, ignore_errors=True)
    os.makedirs(last)
    for name in os.listdir(results):
        if name.endswith((".csv", ".md")):
            shutil.copy(os.path.join(results, name), last)


if __name__ == "__main__":
    main()
