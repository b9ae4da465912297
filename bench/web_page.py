#!/usr/bin/env python3
"""Measures the page of `panonav export --web` in Chromium, and the library in WebAssembly against the native one.

    PYTHONPATH=build/release/python bench/web_page.py build/release/bin/panonav [--views 1000] [--slower 4]

Makes a memory of about --views simulated views. Prints the median processor time of a picture, decoded before, on one
core: in WebAssembly (node) and natively (the Python package), in turns; the bytes that a page loads without the memory;
and, in a browser that is slowed down by --slower: the time from opening the page until it is ready, from choosing a
picture until its answer is shown, and the answers a second with a camera. Chromium's own throttling concerns only the
main thread of a page, and the library works in another: this program stops the whole process of the page for the
respective share of each 40 ms instead.
"""
import argparse
import functools
import gzip
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "web"), str(ROOT / "tests" / "viewer")]
from test_page import SCREENS, Page, serve  # noqa: E402

PERIOD_S = 0.04
ROUNDS = 3


class Brake:
    """Lets a process run only 1 / `factor` of the time."""

    def __init__(self, process: int, factor: float):
        self.process, self.factor, self.ended = process, factor, threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        if factor > 1:
            self.thread.start()

    def run(self) -> None:
        while not self.ended.is_set():
            os.kill(self.process, signal.SIGSTOP)
            time.sleep(PERIOD_S * (1 - 1 / self.factor))
            os.kill(self.process, signal.SIGCONT)
            time.sleep(PERIOD_S / self.factor)

    def end(self) -> None:
        self.ended.set()
        if self.factor > 1:
            self.thread.join()
            os.kill(self.process, signal.SIGCONT)


def measure_native(memory: pathlib.Path, pictures: list[pathlib.Path]) -> float:
    """Milliseconds of a picture."""
    import panonav
    recogniser = panonav.PlaceRecogniser(str(memory))
    times = []
    for path in pictures:
        picture = panonav.read_image(str(path))
        recogniser.localise(picture)
        for _ in range(9):
            begin = time.thread_time()
            recogniser.localise(picture)
            times.append(1000 * (time.thread_time() - begin))
    return statistics.median(times)


def measure_web(module: pathlib.Path, memory: pathlib.Path, pictures: list[pathlib.Path]) -> float:
    done = subprocess.run(["node", ROOT / "tests/web/localise.mjs", module, memory, "0", *pictures], check=True,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    return float(done.stderr)


def find_renderer(page: Page) -> int:
    """Process that shows the page: the browser's only one with a page's time of processor."""
    session, page.session = page.session, None
    processes = page.call("SystemInfo.getProcessInfo")["processInfo"]
    page.session = session
    return max((one for one in processes if one["type"] == "renderer"), key=lambda one: one["cpuTime"])["id"]


def measure_page(folder: pathlib.Path, address: str, picture: pathlib.Path, video: pathlib.Path, slower: float) -> None:
    page = Page(folder, None, "--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream",
                f"--use-file-for-fake-video-capture={video}")
    try:
        page.show(SCREENS["phone"])
        page.open(address + "index.html#new")  # starts the process, and fills the cache of compiled code as any visit does
        brake = Brake(find_renderer(page), slower)
        begin = time.monotonic()
        page.open(address)
        ready = time.monotonic()
        page.choose("query", picture)
        page.wait("!document.querySelector('#answer').hidden")
        first = time.monotonic()
        page.wait_until_idle()
        title = page.text("#answer-title")
        page.click("input[value=camera]")
        page.wait("!document.querySelector('#camera').hidden && document.querySelector('#video').videoWidth > 0")
        page.wait_until_idle()
        page.click("#live")
        page.click("#where")
        page.wait("document.querySelector('#ask-hint').dataset.rate")
        time.sleep(8)
        rate, live = page.ask("document.querySelector('#ask-hint').dataset.rate"), page.text("#answer-title")
        brake.end()
    finally:
        page.end()
    print(f"slowed down {slower:g} times: ready after {ready - begin:.2f} s, answer {first - ready:.2f} s after the choice "
          f"({title}), together {first - begin:.2f} s; {rate} live answers a second ({live})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("panonav", type=pathlib.Path)
    parser.add_argument("--views", type=int, default=1000)
    parser.add_argument("--slower", type=float, default=4)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run = functools.partial(subprocess.run, check=True, stdout=subprocess.DEVNULL)
        panonav, memory = arguments.panonav.resolve(), folder / "office.panonav"
        walk = ["--path", "walk", "--spacing-m", "0.15", "--kind", "panorama"]
        run([panonav, "simulate", "office", folder / "walk", "--poses", str(arguments.views), *walk, "--seed", "3", "-q"])
        run([panonav, "simulate", "office", folder / "queries", "--random", "10", "--kind", "panorama", "--seed", "7", "-q"])
        run([panonav, "memorise", memory, folder / "walk", "-q"])
        run([panonav, "export", memory, "--web", folder / "page", "-q"])
        pictures = sorted((folder / "queries").glob("*.png"))
        files = [file for file in (folder / "page").iterdir() if file.is_file() and file != folder / "page/memory.panonav"]
        loaded = sum(len(gzip.compress(file.read_bytes(), 9)) for file in files)
        print(f"{loaded} bytes to load (gzip) without the memory, which has {memory.stat().st_size} bytes")
        pairs = [(measure_web(folder / "page", memory, pictures), measure_native(memory, pictures)) for _ in range(ROUNDS)]
        web, native = (statistics.median(times) for times in zip(*pairs))
        print(f"a picture: {web:.2f} ms in WebAssembly, {native:.2f} ms natively, {web / native:.2f} times")
        run(["ffmpeg", "-v", "error", "-framerate", "30", "-i", folder / "walk" / "view_%05d.png", "-frames:v", "300",
             "-vf", "format=yuv420p", folder / "walk.y4m"])
        server = serve(folder / "page")
        measure_page(folder / "profile", f"http://127.0.0.1:{server.server_port}/", pictures[0], folder / "walk.y4m",
                     arguments.slower)
        server.shutdown()


if __name__ == "__main__":
    main()
