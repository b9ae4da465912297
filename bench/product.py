#!/usr/bin/env python3
"""Runs the verbs of panonav on memories and recordings of growing size and prints what they cost.

    bench/product.py PANONAV [--sizes 100,400,1600]                             # walks in one room, and their memories
    bench/product.py PANONAV --maker build/bench/bin/make_memory --sizes 1000,10000,100000     # large memories alone
    bench/product.py PANONAV --check

Costs are seconds of processor time of one thread, or milliseconds an image. The growth is the exponent of the cost
between the last two sizes: 1 is linear. --check counts instructions of two small sizes under callgrind instead, and
ends with exit code 1 if the larger one, or the start of the program, is above its bound.
"""
import argparse
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

QUERIES = 8  # images of each kind that are localised after the first one
WALK = "--path walk --spacing-m 0.25 --heading path --kind panorama --rows 40 --columns 256 --seed 3"
VIEWS = "--kind panorama --rows 40 --columns 256 --seed 5"
CHECKED = (60, 180)  # sizes of --check

# Name, arguments, and the row whose cost is subtracted, so that what remains is the cost of QUERIES images. {m} is the
# memory, {copy} a copy, {walk} the recording, {route} a memory with its route, {out} a name for what is new.
ROWS = [
    ("memorise", "memorise {out}.panonav {walk}", None),
    ("memorise, one image more", "memorise {copy} {first_unknown}", None),
    ("localise, first answer", "localise {m} {first}", None),
    ("localise, an image", "localise {m} {known}", "localise, first answer"),
    ("localise, first answer, unknown", "localise {m} {first_unknown}", None),
    ("localise, an unknown image", "localise {m} {unknown}", "localise, first answer, unknown"),
    ("track, first answer", "track {m} {first}", None),
    ("track, an image", "track {m} {known}", "track, first answer"),
    ("track, first answer, unknown", "track {m} {first_unknown}", None),
    ("track, an unknown image", "track {m} {unknown}", "track, first answer, unknown"),
    ("list", "list {m}", None),
    ("show", "show {m} 7", None),
    ("info", "info {m}", None),
    ("verify", "verify {m}", None),
    ("history", "history {m}", None),
    ("gallery", "gallery {m} -o {out}", None),
    ("export", "export {m} -o {out}", None),
    ("copy", "copy {m} {out}.panonav", None),
    ("rename", "rename {copy} 5 door", None),
    ("forget", "forget {copy} 5", None),
    ("prune", "prune {copy}", None),
    ("merge", "merge {m} {other} -o {out}.panonav", None),
    ("map", "map {out}.panonav {walk}", None),
    ("arrange", "arrange {copy}", None),
    ("route record", "route record {copy} {walk}", None),
    ("route follow, first answer", "route follow {route} {first}", None),
    ("route follow, an image", "route follow {route} {known}", "route follow, first answer"),
    ("route follow, first answer, unknown", "route follow {route} {first_unknown}", None),
    ("route follow, an unknown image", "route follow {route} {unknown}", "route follow, first answer, unknown"),
    ("unwrap", "unwrap {walk} -o {out}", None),
    ("convert", "convert {walk} {out}.mcap", None),
]
# Large memories do not have these, or they take hours there, or need more bytes for undo than are allowed (prune).
OF_WALKS = ("{walk}", "{route}", "{other}", "arrange", "prune")


def count_cost(words, instructions=False):
    """Runs a command; returns its seconds, or instructions, and its peak memory in MB."""
    counter = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={os.devnull}"] if instructions else []
    environment = dict(os.environ, PANONAV_INSTRUCTIONS="avx2") if instructions else None
    with tempfile.TemporaryFile() as messages:
        child = subprocess.Popen([*counter, *map(str, words)], stdout=subprocess.DEVNULL, stderr=messages,
                                 env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        messages.seek(0)
        text = messages.read().decode(errors="replace")
    if child.returncode not in (0, 1):  # 1: no answer, as for unknown places
        raise SystemExit(f"{' '.join(map(str, words))} ended with {child.returncode}: {text[-2000:]}")
    if instructions:
        return int(re.search(r"Collected : (\d+)", text).group(1)), usage.ru_maxrss / 1024
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


class Data:
    """Recordings and memories in a folder, each made when it is first needed."""

    def __init__(self, panonav, folder, maker, largest):
        self.panonav, self.folder, self.maker, self.largest = panonav, folder, maker, largest
        self.number = 0

    def run(self, *words):
        subprocess.run([self.panonav, *map(str, words), "--quiet"], check=True, stdout=subprocess.DEVNULL)

    def walk(self, size, scene="garden", seed="3"):
        """A recording of the first images of a walk."""
        whole, part = self.folder / f"{scene}_{seed}", self.folder / f"{scene}_{seed}_{size}"
        if not whole.exists():
            self.run("simulate", scene, whole, *WALK.split()[:-1], seed, "--poses", self.largest)
        if not part.exists():
            part.mkdir()
            rows = (whole / "poses.csv").read_text().splitlines(keepends=True)[:size + 1]
            (part / "poses.csv").write_text("".join(rows))
            shutil.copy(whole / "dataset.toml", part)
            for row in rows[1:]:
                os.link(whole / row.split(",")[0], part / row.split(",")[0])
        return part

    def memory(self, size):
        path = self.folder / f"memory_{size}.panonav"
        if not path.exists() and self.maker:
            subprocess.run([self.maker, str(size), path, self.folder / f"images_{size}", str(QUERIES + 1)], check=True,
                           stdout=subprocess.DEVNULL)
        elif not path.exists():
            self.run("memorise", path, self.walk(size))
        return path

    def other(self, size):
        path = self.folder / f"other_{size}.panonav"
        if not path.exists():
            self.run("memorise", path, self.walk(size, seed="4"))
        return path

    def route(self, size):
        path = self.folder / f"route_{size}.panonav"
        if not path.exists():
            shutil.copy(self.memory(size), path)
            self.run("route", "record", path, self.walk(size))
        return path

    def copy(self, size):
        path = self.new()
        shutil.copy(self.memory(size), path.with_suffix(".panonav"))
        return path.with_suffix(".panonav")

    def new(self):
        self.number += 1
        return self.folder / f"new_{self.number}"

    def images(self, size, kind, count):
        """A folder with the first `count` images of known or unknown places."""
        path = self.folder / f"{kind}_{size}_{count}"
        if not path.exists():
            if self.maker:
                whole = sorted((self.folder / f"images_{size}").glob(f"{kind}_*.png"))
            else:
                scene = {"known": "garden", "unknown": "lab"}[kind]
                made = self.folder / f"{kind}_views"
                if not made.exists() and kind == "unknown":
                    self.run("simulate", scene, made, "--random", QUERIES + 1, *VIEWS.split())
                # Images of known places are those of the walk itself: all its sizes have them.
                whole = sorted((made if kind == "unknown" else self.walk(size)).glob("view_*.png"))
                if kind == "known":
                    whole = whole[::max(1, len(whole) // (QUERIES + 1))]
            path.mkdir()
            band = [-40, 40] if self.maker else [-30, 40]
            (path / "dataset.toml").write_text(f'[images]\nkind = "panorama"\nelevation_deg = {band}\n'
                                               '[list]\nfile = "images.csv"\n')
            names = {f"{kind}_{image.name}": image for image in whole[:count]}
            (path / "images.csv").write_text("\n".join(["file", *names, ""]))
            for name, image in names.items():
                shutil.copy(image, path / name)
        return path

    def arguments(self, template, size):
        words = []
        for word in template.split():
            key = re.search(r"\{(\w+)\}", word)
            if not key:
                words.append(word)
                continue
            value = {"m": self.memory, "copy": self.copy, "walk": self.walk, "other": self.other, "route": self.route,
                     "out": lambda _: self.new(), "first": lambda n: self.images(n, "known", 1),
                     "known": lambda n: self.images(n, "known", QUERIES + 1),
                     "first_unknown": lambda n: self.images(n, "unknown", 1),
                     "unknown": lambda n: self.images(n, "unknown", QUERIES + 1)}[key.group(1)](size)
            words.append(word.replace(key.group(0), str(value)))
        return words


def measure(data, rows, sizes, instructions=False):
    """Returns costs and peak memory of each row, by size."""
    costs, peaks = {}, {}
    for name, template, base in rows:
        for size in sizes:
            words = data.arguments(template, size)
            threads = [] if words[0] in ("rename", "history", "copy", "info", "list", "show") else ["--threads", "1"]
            cost, peak = count_cost([data.panonav, *words, "--quiet", *threads], instructions)
            if base:
                cost = max(0.0, (cost - costs[base][size]) / QUERIES)
            costs.setdefault(name, {})[size] = cost
            peaks.setdefault(name, {})[size] = peak
            for left in data.folder.glob("new_*"):
                shutil.rmtree(left) if left.is_dir() else left.unlink()
        yield name, base, costs[name], peaks[name]


def growth(costs, sizes):
    before, last = costs[sizes[-2]], costs[sizes[-1]]
    return math.log(last / before) / math.log(sizes[-1] / sizes[-2]) if before > 0.0 and last > 0.0 else None


def print_table(data, rows, sizes):
    print(f"{'':38}" + "".join(f"{size:>12,}" for size in sizes) + "   growth   peak MB")
    for name, base, costs, peaks in measure(data, rows, sizes):
        unit, factor = ("ms", 1000.0) if base else ("s", 1.0)
        slope = growth(costs, sizes)
        print(f"{name:38}" + "".join(f"{factor * costs[size]:>9.3g} {unit:2}" for size in sizes) +
              (f"{slope:>9.2f}" if slope is not None else f"{'-':>9}") + f"{peaks[sizes[-1]]:>10.0f}", flush=True)
    for size in sizes:
        print(f"a memory of {size:,} views: {data.memory(size).stat().st_size / size / 1000:.2f} kB a view")


# Millions of instructions that load the program, and those at the larger size of --check without them: as measured
# (GCC 12, AVX2, glibc 2.36) and 10 % more. A change that makes a verb cheaper lowers its bound.
START_BOUND = 5.4
BOUNDS = {
    "localise, first answer": 19,
    "localise, first answer, unknown": 40,
    "track, first answer": 828,
    "route follow, first answer": 184,
    "route follow, first answer, unknown": 168,
}


def check(data):
    """Prints the rows above their bounds; returns how many there are."""
    start, _ = count_cost([data.panonav, "--version"], instructions=True)
    faults = int(start / 1e6 > START_BOUND)
    print(f"{'--version':48}{start / 1e6:>10.1f} of at most {START_BOUND:.1f} million instructions" +
          (": too many" if faults else ""), flush=True)
    rows = [row for row in ROWS if row[0] in BOUNDS]
    for name, _, costs, _ in measure(data, rows, CHECKED, instructions=True):
        millions = [(costs[size] - start) / 1e6 for size in CHECKED]
        too_many = millions[1] > BOUNDS[name]
        faults += too_many
        print(f"{name:38}{millions[0]:>10.1f}{millions[1]:>10.1f} of at most {BOUNDS[name]:.1f} million instructions" +
              (": too many" if too_many else ""), flush=True)
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("panonav", type=pathlib.Path, help="the command")
    parser.add_argument("--sizes", default="100,400,1600", help="numbers of views")
    parser.add_argument("--maker", type=pathlib.Path, help="program make_memory of the benchmarks")
    parser.add_argument("--rows", default="", help="only rows whose names contain this")
    parser.add_argument("--check", action="store_true", help="compare instructions with their bounds")
    options = parser.parse_args()
    sizes = list(CHECKED) if options.check else [int(size) for size in options.sizes.split(",")]
    if len(sizes) < 2:
        parser.error("--sizes needs two sizes or more, as a growth is computed")
    with tempfile.TemporaryDirectory() as name:
        data = Data(options.panonav.resolve(), pathlib.Path(name), options.maker, max(sizes))
        if options.check:
            sys.exit(1 if check(data) else 0)
        rows = [row for row in ROWS if options.rows in row[0] or any(options.rows in r[0] and r[2] == row[0] for r in ROWS)]
        if options.maker:
            rows = [row for row in rows if not any(part in row[1] for part in OF_WALKS)]
        print_table(data, rows, sizes)


if __name__ == "__main__":
    main()
