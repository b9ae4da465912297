#!/usr/bin/env python3
"""What `localise --view` costs a robot: live_view.py PANONAV [SECONDS] [--long]

JPEG pictures of 1280 x 640 at 20 a second into `localise`, watched by nobody and by viewers who fetch every picture. Prints
the processor time of `localise`, the pictures answered, and the time until a viewer has its first picture. --long: only the
three viewers of whom one is stopped (it asks for the events and never reads), with the pictures given and answered, the
resident memory and the processor time of `localise` every tenth of the time, and the load of the machine.
"""
import http.client
import json
import os
import pathlib
import re
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

PANONAV, RATE = pathlib.Path(sys.argv[1]).resolve(), 20
LONG = "--long" in sys.argv
SECONDS = next((float(word) for word in sys.argv[2:] if word != "--long"), 600.0 if LONG else 10.0)
SPHERE = ["--kind", "panorama", "--elevation-low-deg", "-90", "--elevation-high-deg", "90", "--quiet"]


def viewer(port, root, stopped, first, seen):
    if stopped:  # with a small buffer, so that soon nothing more fits on the way to it
        silent = socket.socket()
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        silent.connect(("127.0.0.1", port))
        silent.sendall(f"GET {root}events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        threading.Event().wait()
    began = time.monotonic()
    events, pictures = (http.client.HTTPConnection("127.0.0.1", port, timeout=30) for _ in range(2))
    events.request("GET", root + "events")
    answer = events.getresponse()
    for line in answer:
        if line.startswith(b'data: {"n"'):
            moment = json.loads(line[6:])
            seen.append(moment["n"])
            for which in moment.get("pictures", []):
                pictures.request("GET", f"{root}picture/{moment['n']}/{which}")
                if pictures.getresponse().read() and not first:
                    first.append(time.monotonic() - began)


def memory_mb(process):
    return int(pathlib.Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


def seconds_used(process):
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(folder, jpegs, viewers, stopped=0, view=True):
    run = subprocess.Popen([PANONAV, "localise", folder / "references.panonav", "-", "--quiet", "--threads", "1",
                            "--kind", "equirectangular", *(["--view", "0"] if view else [])],
                           stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=False)
    lines, seen = [], [[] for _ in range(viewers)]
    threading.Thread(target=lambda: lines.extend(run.stdout), daemon=True).start()
    first = []
    if view:
        said = next(line for line in run.stderr if b"http://" in line).decode()
        found = re.search(r"http://[\d.]+:(\d+)(/\w+/)", said)
        for i in range(viewers):
            threading.Thread(target=viewer, args=(int(found[1]), found[2], i < stopped, first, seen[i]), daemon=True).start()
    threading.Thread(target=run.stderr.read, daemon=True).start()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    due = began = time.monotonic()
    count = int(SECONDS * RATE)
    for i in range(count):
        due += 1 / RATE
        time.sleep(max(0.0, due - time.monotonic()))
        if LONG and i * 10 // count != (i - 1) * 10 // count:
            print(f"{time.monotonic() - began:6.1f} s  {i:6} given  {len(lines):6} answered  viewers have had "
                  f"{[len(numbers) for numbers in seen]}  {memory_mb(run.pid):6.1f} MB  {seconds_used(run.pid):7.2f} s of "
                  f"processor time  load {os.getloadavg()[0]:.1f}", flush=True)
        run.stdin.write(jpegs[i % len(jpegs)])
        run.stdin.flush()
    run.stdin.close()
    run.wait()
    ended = time.monotonic()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime
    name = f"{viewers} viewers" + f", {stopped} of them stopped" * bool(stopped) if view else "no --view"
    print(f"{name:32} {100 * seconds / SECONDS:6.2f} % of a core  {len(lines)} of {count} answered in {ended - began:.1f} s"
          + (f"  first picture {1000 * first[0]:.0f} ms" if first else ""), flush=True)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        panonav = lambda *words: subprocess.run([PANONAV, *words, "--quiet"], check=True, cwd=folder, capture_output=True)
        panonav("simulate", "hall", "references", "--grid", "0.5", "--rows", "128", "--columns", "256", *SPHERE[:-1])
        toml = folder / "references" / "dataset.toml"
        text = toml.read_text().replace('"panorama"', '"equirectangular"')
        toml.write_text("".join(line for line in text.splitlines(True) if "elevation_deg" not in line))
        panonav("memorise", "references.panonav", "references")
        panonav("simulate", "hall", "walk", "--path", "walk", "--poses", "20", "--rows", "640", "--columns", "1280",
                *SPHERE[:-1])
        subprocess.run(["ffmpeg", "-v", "error", "-i", "walk/view_%05d.png", "-q:v", "3", "%05d.jpg"], check=True,
                       cwd=folder)
        jpegs = [file.read_bytes() for file in sorted(folder.glob("*.jpg"))]
        if LONG:
            measure(folder, jpegs, 3, 1)
            return
        measure(folder, jpegs, 0, view=False)
        for viewers, stopped in ((0, 0), (1, 0), (3, 0), (3, 1)):
            measure(folder, jpegs, viewers, stopped)


main()
