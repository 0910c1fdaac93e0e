#!/usr/bin/env python3
"""Draws docs/hash_buffer.svg: how the probe order of a hash table becomes a sorted list.

The table of the figure is computed, by the insertion that strata/hashbuffer/table_law.h states. The script also
checks that the lists are sorted and that 1,000 other orders of arrival give the same table.

usage: make_hash_figure.py FILE           writes the figure
       make_hash_figure.py --check FILE   fails if FILE is not what this script writes
"""
import random
import sys

CELLS = 12
OFFSETS = [None, 2, 10, 9, 7]  # by age; ages begin at 1
# Pixel and depth, in the order of arrival. The last one is followed step by step.
ARRIVALS = [(4, 20), (5, 10), (3, 60), (0, 70), (1, 30), (1, 80), (4, 90), (3, 40), (1, 50)]
FOLLOWED = 1  # the pixel whose list is read

COLOURS = {0: "#f3d9a4", 1: "#9cc9f0", 3: "#c6e2b3", 4: "#f0b7b0", 5: "#d8c8ea"}


# --- the table -------------------------------------------------------------------------------------------------------

def cell_of(pixel, age):
    return (pixel + OFFSETS[age]) % CELLS


def is_larger(record, held):
    """Older first, then nearer: a record is (age, pixel, depth)."""
    return (record[0], -record[2]) > (held[0], -held[2])


def insert(table, pixel, depth):
    """Inserts a fragment. Returns each step: the record in flight, its cell, and what the cell held."""
    steps, record = [], (1, pixel, depth)
    while True:
        age, pixel, depth = record
        cell = cell_of(pixel, age)
        held = table[cell]
        steps.append((record, cell, held))
        if held is None or is_larger(record, held):
            table[cell] = record
            if held is None:
                return steps
            record = held
        record = (record[0] + 1, record[1], record[2])  # the loser goes on at its own next age


def build(arrivals):
    table = [None] * CELLS
    steps = [insert(table, pixel, depth) for pixel, depth in arrivals]
    return table, steps


def read(table, pixel):
    """The cells that reading a pixel visits: (age, cell, record), the last one not of its list."""
    visited = []
    for age in range(1, len(OFFSETS)):
        cell = cell_of(pixel, age)
        visited.append((age, cell, table[cell]))
        if table[cell] is None or table[cell][0] < age:
            return visited
    raise AssertionError("the list does not end within the ages of the figure")


def check(table):
    shuffler = random.Random(1)
    for _ in range(1000):
        assert build(shuffler.sample(ARRIVALS, len(ARRIVALS)))[0] == table, "the order of arrival matters"
    for pixel in {p for p, _ in ARRIVALS}:
        depths = [record[2] for age, _, record in read(table, pixel) if record and record[0] == age]
        assert depths == sorted(d for p, d in ARRIVALS if p == pixel), f"the list of pixel {pixel} is not sorted"


# --- the drawing -----------------------------------------------------------------------------------------------------

WIDTH, MARGIN = 940, 30


class Svg:
    def __init__(self):
        self.parts = []

    def text(self, x, y, what, size=15, anchor="start", weight="normal", colour="#222"):
        what = what.replace("&", "&amp;").replace("<", "&lt;")
        self.parts.append(f'<text x="{x}" y="{y}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}" '
                          f'fill="{colour}">{what}</text>')

    def box(self, x, y, width, height, fill, line="#444", stroke=1.2):
        self.parts.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="4" fill="{fill}" stroke="{line}" '
                          f'stroke-width="{stroke}"/>')

    def arrow(self, points, colour="#1565a8", stroke=1.8, dash=""):
        path = " ".join(("M" if i == 0 else "L") + f"{x} {y}" for i, (x, y) in enumerate(points))
        self.parts.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{stroke}" marker-end="url(#head)"'
                          + (f' stroke-dasharray="{dash}"' if dash else "") + "/>")

    def fragment(self, x, y, pixel, depth, width=70):
        """A fragment: its pixel above its depth."""
        self.box(x, y, width, 46, COLOURS[pixel])
        self.text(x + width / 2, y + 17, f"pixel {pixel}", 12, "middle", colour="#333")
        self.text(x + width / 2, y + 38, f"{depth}", 18, "middle", "bold")

    def record(self, x, y, record, width=70):
        """A record in a cell: its age and pixel above its depth."""
        if record is None:
            self.box(x, y, width, 62, "#ffffff", "#999")
            return
        age, pixel, depth = record
        self.box(x, y, width, 62, COLOURS[pixel])
        self.text(x + width / 2, y + 16, f"age {age}", 12, "middle", "bold", "#333")
        self.text(x + width / 2, y + 36, f"{depth}", 18, "middle", "bold")
        self.text(x + width / 2, y + 54, f"pixel {pixel}", 12, "middle", colour="#333")

    def heading(self, y, number, what):
        self.parts.append(f'<circle cx="{MARGIN + 12}" cy="{y - 6}" r="13" fill="#1565a8"/>')
        self.text(MARGIN + 12, y - 1, number, 15, "middle", "bold", "#ffffff")
        self.text(MARGIN + 36, y, what, 17, weight="bold")

    def document(self, height):
        return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" '
                'font-family="Helvetica, Arial, DejaVu Sans, sans-serif">\n'
                '<!-- made by docs/make_hash_figure.py -->\n'
                '<title>How the probe order of a hash table becomes a sorted list</title>\n'
                '<defs><marker id="head" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto">'
                '<path d="M0 0L10 5L0 10z" fill="#1565a8"/></marker></defs>\n'
                f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>\n' + "\n".join(self.parts) + "\n</svg>\n")


def name(record):
    return f"pixel {record[1]}, depth {record[2]}"


def said_of(record, held):
    """What happens in a cell, and what goes on."""
    if held is None:
        return "The cell is empty. The record stays, and the insertion ends."
    if not is_larger(record, held):
        return f"The cell holds the nearer {held[2]} at the same age. The record goes on at age {record[0] + 1}."
    why = "nearer" if held[0] == record[0] else "older"
    return f"The record is {why} than {held[2]} of pixel {held[1]} and takes the cell. {held[2]} goes on at age {held[0] + 1}."


def draw(table, steps):
    svg = Svg()
    svg.text(MARGIN, 34, "From a hash table's probe order to a sorted list", 21, weight="bold")
    offsets = ", ".join(str(offset) for offset in OFFSETS[1:])
    svg.text(MARGIN, 59, f"A record's age counts its probes. At age a, pixel p probes cell (p + offset[a]) mod {CELLS}; the offsets "
             f"are {offsets}.", 14, colour="#444")
    svg.text(MARGIN, 78, "A cell keeps the older of two records; at the same age, the nearer one. The loser goes on to the cell of "
             "its next age.", 14, colour="#444")

    y = 118
    svg.heading(y, "1", "Fragments arrive in any order: here from left to right")
    for i, (pixel, depth) in enumerate(ARRIVALS):
        svg.fragment(MARGIN + i * 82, y + 14, pixel, depth)
    svg.text(MARGIN + len(ARRIVALS) * 82 + 4, y + 34, "large number:", 13, colour="#444")
    svg.text(MARGIN + len(ARRIVALS) * 82 + 4, y + 52, "depth", 13, colour="#444")

    y = 224
    svg.heading(y, "2", f"The last one, {name((1,) + ARRIVALS[-1])}, finds its place")
    for i, (record, cell, held) in enumerate(steps):
        line = y + 16 + i * 34
        svg.box(MARGIN, line, 150, 26, COLOURS[record[1]])
        svg.text(MARGIN + 75, line + 18, f"age {record[0]}: {record[2]} of pixel {record[1]}", 14, "middle")
        svg.arrow([(MARGIN + 154, line + 13), (MARGIN + 190, line + 13)])
        svg.text(MARGIN + 198, line + 18, f"cell {cell}", 14, weight="bold")
        svg.text(MARGIN + 258, line + 18, said_of(record, held), 14)

    y = 416
    pitch = (WIDTH - 2 * MARGIN) / CELLS
    left = lambda cell: round(MARGIN + cell * pitch + 2, 1)
    middle = lambda cell: round(MARGIN + (cell + 0.5) * pitch, 1)
    visited = read(table, FOLLOWED)
    svg.heading(y, "3", "The finished table. It is the same for every order of arrival")
    top = y + 88
    for cell, record in enumerate(table):
        svg.record(left(cell), top, record, round(pitch - 4, 1))
        svg.text(middle(cell), top + 80, f"cell {cell}", 12, "middle", colour="#444")
    bus = y + 34
    svg.text(MARGIN, bus + 5, f"read pixel {FOLLOWED}", 14, weight="bold", colour="#1565a8")
    for age, cell, record in visited:
        belongs = record is not None and record[0] == age
        lift = bus - 10 + 12 * (len(visited) - age)
        svg.arrow([(MARGIN + 92, lift if age else bus), (middle(cell), lift), (middle(cell), top - 3)],
                  dash="" if belongs else "5 4")
        svg.text(middle(cell) + 6, top - 12, f"age {age}", 13, weight="bold", colour="#1565a8")

    y = 626
    svg.heading(y, "4", f"Reading the cells of pixel {FOLLOWED} at ages 1, 2, 3, ... gives its list, near to far")
    x = MARGIN
    for age, cell, record in visited:
        if record is not None and record[0] == age:
            svg.fragment(x, y + 14, record[1], record[2])
            svg.text(x + 35, y + 76, f"cell {cell}", 12, "middle", colour="#444")
            svg.arrow([(x + 74, y + 37), (x + 100, y + 37)])
            x += 106
        else:
            what = "is empty" if record is None else f"holds a record of age {record[0]}, younger than {age}"
            svg.text(x, y + 34, f"cell {cell} {what}: the list ends.", 14)
            svg.text(x, y + 54, f"A further fragment of pixel {FOLLOWED} would have taken this cell.", 14)
    return svg.document(y + 96)


def main(arguments):
    if len(arguments) not in (1, 2) or (len(arguments) == 2 and arguments[0] != "--check"):
        print(__doc__, file=sys.stderr)
        return 2
    table, steps = build(ARRIVALS)
    check(table)
    figure = draw(table, steps[-1])
    if len(arguments) == 1:
        with open(arguments[0], "w", encoding="utf-8") as out:
            out.write(figure)
        return 0
    with open(arguments[1], encoding="utf-8") as committed:
        if committed.read() == figure:
            return 0
    print(f"{arguments[1]} is not what the script draws; run docs/make_hash_figure.py {arguments[1]}")
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
