#!/usr/bin/env python3
"""Answers a second of `panonav serve`, beside those of the command over the same pictures in the same run.

Usage: serve_load.py PANONAV [SECONDS]    seconds for each number of clients; default 5

Makes a memory of the simulated office and 60 queries. The rival is `panonav localise` over all queries at once, without
the time until its first answer: what the library reaches without HTTP. Clients are Python threads over kept connections,
on the same machine, and take processor time, too.
"""
import http.client
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse


def main() -> None:
    panonav, seconds = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 5.0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def run(*words: str) -> list[str]:
            return subprocess.run([panonav, *words], cwd=folder, check=True, capture_output=True,
                                  text=True).stdout.splitlines()

        run("simulate", "office", "drive", "--grid", "0.5")
        run("simulate", "office", "queries", "--random", "60", "--seed", "7")
        run("memorise", "office.panonav", "drive")
        pictures = [path.read_bytes() for path in sorted((folder / "queries").glob("*.png"))]

        process = subprocess.Popen([panonav, "localise", "office.panonav", "queries", "--json"], cwd=folder,
                                   stdout=subprocess.PIPE)
        process.stdout.readline()
        start = time.perf_counter()
        answers = sum(1 for _ in process.stdout)
        print(f"localise, all at once: {answers / (time.perf_counter() - start):.0f} answers/s")
        process.wait()

        server = subprocess.Popen([panonav, "serve", "office.panonav", "--listen", "0", "--json"], cwd=folder,
                                  stdout=subprocess.PIPE, text=True)
        try:
            place = urllib.parse.urlsplit(json.loads(server.stdout.readline())["url"])
            for clients in (1, 2, 8, 32):
                durations_s: list[float] = []
                refused = [0]
                end = time.perf_counter() + seconds

                def ask(first: int) -> None:
                    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=60)
                    number = first
                    while (begin := time.perf_counter()) < end:
                        connection.request("POST", "/v1/memories/office/localise", pictures[number % len(pictures)])
                        response = connection.getresponse()
                        response.read()
                        number += 1
                        if response.status == 200:
                            durations_s.append(time.perf_counter() - begin)
                        else:
                            refused[0] += 1

                threads = [threading.Thread(target=ask, args=(7 * i,)) for i in range(clients)]
                begin = time.perf_counter()
                for thread in threads:
                    thread.start()
                for thread in threads:
                    thread.join()
                rate = len(durations_s) / (time.perf_counter() - begin)
                ms = [1e3 * one for one in sorted(durations_s)]
                print(f"{clients:2} clients: {rate:.0f} answers/s, median {statistics.median(ms):.1f} ms, "
                      f"95 % within {ms[int(0.95 * len(ms))]:.1f} ms, {refused[0]} refused")
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    main()
