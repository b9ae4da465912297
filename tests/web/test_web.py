#!/usr/bin/env python3
"""Builds the library for pages (preset `web`), and compares its answers with the command's.

test_web.py PANONAV SOURCE FOLDER: views, dissimilarities and decisions must be the same; positions, headings and
probabilities may differ by the last digits of the C libraries' functions. Prints these differences, the sizes of what
a page loads and the time of a picture; fails beyond 700 kB. Exits with 77, skipped, without the tools."""
import collections.abc
import gzip
import json
import os
import pathlib
import shutil
import subprocess
import sys

MAX_BYTES = 700_000
MAX_DIFFERENCE = 1e-11  # of numbers near 1
MAX_NARROW_DIFFERENCE = 1e-7  # directions of features have 24 bits
PHOTO_DEG = 70
PROGRAMS = {"em++": "emscripten", "node": "nodejs"}


def is_same(one: object, other: object, differences: list[float], max_difference: float) -> bool:
    """Collects the differences of numbers that may differ."""
    if isinstance(one, float) and isinstance(other, float) and one != other:
        differences.append(abs(one - other) / max(1.0, abs(one)))
        return differences[-1] <= max_difference
    if isinstance(one, dict) and isinstance(other, dict):
        return list(one) == list(other) and all(is_same(one[key], other[key], differences, max_difference) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(is_same(*pair, differences, max_difference) for pair in zip(one, other))
    return one == other


def take_photos(run: collections.abc.Callable[..., str], folder: pathlib.Path) -> None:
    """Cuts pictures such as a phone's out of spherical ones."""
    run("simulate", "office", folder / "spheres", "--kind", "equirectangular", "--random", "6", "--seed", "9")
    (folder / "photos").mkdir()
    for sphere in sorted((folder / "spheres").glob("*.jpg")):
        subprocess.run(["ffmpeg", "-v", "error", "-i", sphere, "-vf", f"v360=e:flat:h_fov={PHOTO_DEG}:v_fov=55.4:w=640:h=480",
                        "-pix_fmt", "rgb24", folder / "photos" / f"{sphere.stem}.png"], check=True)


def main() -> int:
    panonav, source, folder = map(pathlib.Path, sys.argv[1:])
    for program, package in PROGRAMS.items():
        if shutil.which(program) is None:
            print(f"skipped: there is no {program} (Debian: {package})")
            return 77
    if not (source / "build/sqlite/sqlite3.c").exists():
        print("skipped: there is no build/sqlite/sqlite3.c (tools/get_sqlite)")
        return 77
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    # Emscripten calls the compiler, and so it calls the cache.
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_COMPILER_LAUNCHER")}
    if shutil.which("ccache"):
        environment["EM_COMPILER_WRAPPER"] = "ccache"
    for arguments in (["cmake", "--preset", "web"], ["cmake", "--build", "--preset", "web"]):
        subprocess.run(arguments, cwd=source, env=environment, check=True, stdout=subprocess.DEVNULL)
    module = source / "build/web/bin"
    sizes = {name: len(gzip.compress((module / name).read_bytes(), 9))
             for name in ("panonav_web.wasm", "panonav_web.mjs", "panonav.js")}

    def run(*arguments: object) -> str:
        return subprocess.run([panonav, *arguments, "-q"], check=True, capture_output=True, text=True).stdout

    memory = folder / "office.panonav"
    run("simulate", "office", folder / "views", "--kind", "panorama", "--grid", "0.5")
    run("simulate", "office", folder / "queries", "--kind", "panorama", "--random", "20", "--seed", "7")
    run("memorise", memory, folder / "views", "--narrow")
    print(f"{sum(sizes.values())} bytes to load (gzip): {sizes}")
    questions = [(folder / "queries", 0)]
    if shutil.which("ffmpeg") is None:
        print("skipped: narrow pictures, for which there is no ffmpeg")
    else:
        take_photos(run, folder)
        questions.append((folder / "photos", PHOTO_DEG))
    for pictures, degrees in questions:
        here = run("localise", memory, pictures, "--json", *(["--field-of-view", str(degrees)] if degrees else []))
        files = sorted(pictures.glob("*.png"))
        page = subprocess.run(["node", source / "tests/web/localise.mjs", module, memory, str(degrees), *files], check=True,
                              capture_output=True, text=True)
        differences: list[float] = []
        answers = [[json.loads(line) for line in lines.splitlines()] for lines in (here, page.stdout)]
        if not is_same(*answers, differences, MAX_NARROW_DIFFERENCE if degrees else MAX_DIFFERENCE):
            print("the command answers", here, "the page answers", page.stdout, sep="\n")
            return 1
        print(f"{pictures.name}: {float(page.stderr):.1f} ms each; {sum(answer['known'] for answer in answers[0])} of {len(files)} known; "
              f"{len(differences)} numbers differ, by at most {max(differences, default=0.0):.1e}")
    return 0 if sum(sizes.values()) <= MAX_BYTES else 1


if __name__ == "__main__":
    sys.exit(main())
