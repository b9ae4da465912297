#!/usr/bin/env python3
"""Robots that work, synchronise and fail: whether anything is lost or doubled, and how long it takes.

Usage: synchronise_faults.py TEST_FLEET PANONAV PANONAV_POSTGRESQL [--robots 20] [--faults 200] [--seed 1] [--quick]

Each robot is a process with its own memory file; all share one memory on one PostgreSQL server, each over its own
proxy. Robots report each change before and after it. Faults come at random: kill -9 of robots and of the server, links
cut, delayed and silent, clocks wrong by years (libfaketime), full disks (file systems in RAM; needs root). Missing
tools are named, and other faults take their place. Then all robots synchronise without faults, and the memories are
compared with the reports. Exits with 1 when anything was lost, doubled,
brought back or different, and with 77 where there is no PostgreSQL. --quick leaves out the measurement of 200 views.
"""
import argparse
import asyncio
import collections
import glob
import json
import os
import pathlib
import random
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time

FAKETIME = sorted(glob.glob("/usr/lib/*/faketime/libfaketime.so.1"))


class Link:
    """A TCP port of this machine that leads to a server's socket, and what goes wrong on the way."""

    def __init__(self, target):
        self.target = target
        self.delay_s = 0.0
        self.silent = False
        self.refuses = False
        self.bytes_up = self.bytes_down = 0
        self.writers = set()
        self.port = 0

    async def open(self):
        listening = await asyncio.start_server(self.serve, "127.0.0.1", 0)
        self.port = listening.sockets[0].getsockname()[1]

    async def serve(self, reader, writer):
        if self.refuses:
            writer.transport.abort()
            return
        try:
            far_reader, far_writer = await asyncio.open_unix_connection(self.target)
        except OSError:
            writer.transport.abort()
            return
        self.writers |= {writer, far_writer}
        try:
            await asyncio.gather(self.pass_on(reader, far_writer, True), self.pass_on(far_reader, writer, False))
        except (OSError, asyncio.CancelledError):
            pass
        for end in (writer, far_writer):
            self.writers.discard(end)
            end.transport.abort()

    async def pass_on(self, reader, writer, up):
        """Each piece as much later as the link is long, whatever else is on its way."""
        waiting = asyncio.Queue()

        async def deliver():
            while True:
                due, data = await waiting.get()
                await asyncio.sleep(max(0.0, due - time.monotonic()))
                while self.silent:
                    await asyncio.sleep(0.05)
                if not data:
                    writer.close()
                    return
                writer.write(data)
                await writer.drain()

        delivering = asyncio.ensure_future(deliver())
        try:
            while True:
                data = await reader.read(65536)
                if up:
                    self.bytes_up += len(data)
                else:
                    self.bytes_down += len(data)
                await waiting.put((time.monotonic() + self.delay_s, data))
                if not data:
                    await delivering
                    return
        finally:
            delivering.cancel()

    def cut(self):
        for writer in list(self.writers):
            writer.transport.abort()


class Links:
    """The links, in a thread of their own."""

    def __init__(self, target, count):
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        self.links = [Link(target) for _ in range(count)]
        for link in self.links:
            asyncio.run_coroutine_threadsafe(link.open(), self.loop).result()

    def cut(self, link):
        self.loop.call_soon_threadsafe(link.cut)


class Server:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def start(self):
        # Where its disk is full or its last processes are not gone yet, it takes another time.
        for _ in range(60):
            done = subprocess.run([self.program, self.folder, "start"], capture_output=True, text=True)
            if done.returncode == 0:
                return
            time.sleep(0.5)
        raise RuntimeError(done.stderr)

    def kill(self):
        pid_file = self.folder / "data/postmaster.pid"
        if not pid_file.exists():
            return
        first = int(pid_file.read_text().split()[0])
        for pid in [first] + [int(pid) for pid in subprocess.run(["pgrep", "-P", str(first)], capture_output=True,
                                                                 text=True).stdout.split()]:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass

    def stop(self):
        subprocess.run([self.program, self.folder, "stop"], capture_output=True)

    def address(self, port=None):
        place = f"@127.0.0.1:{port}" if port else "@"
        host = "" if port else f"&host={self.folder}"
        return f"postgresql://panonav{place}/panonav?sslmode=disable{host}&memory=fleet"


class Ledger:
    """Changes that the robots reported."""

    def __init__(self):
        self.lock = threading.Lock()
        self.adding, self.added, self.removing, self.removed = set(), set(), set(), set()
        self.moves = collections.defaultdict(list)  # of each view: (robot, x, whether it was done)
        self.seconds, self.conflicts, self.refused = [], 0, collections.Counter()
        self.last_synchronised = {}

    def take(self, robot, line):
        words = line.split()
        if not words:
            return
        with self.lock:
            if words[0] == "adding":
                self.adding.add(words[1])
            elif words[0] == "added":
                self.added.add(words[1])
            elif words[0] == "removing":
                self.removing.add(words[1])
            elif words[0] == "removed":
                self.removed.add(words[1])
            elif words[0] == "moving":
                self.moves[words[1]].append((robot, float(words[2]), False))
            elif words[0] == "moved":
                self.moves[words[1]].append((robot, float(words[2]), True))
            elif words[0] == "synchronised":
                self.seconds.append(float(words[1]))
                self.conflicts += int(words[4])
                self.last_synchronised[robot] = time.monotonic()
            elif words[0] == "refused":
                what = re.sub(r"^\S+: ", "", " ".join(words[1:]))
                self.refused[re.sub(r":.*| \(.*|\d+", "", what)[:70]] += 1


class Robot:
    processes = []

    def __init__(self, number, folder, server, link, ledger, program, clock_folder):
        self.number, self.server, self.link, self.ledger, self.program = number, server, link, ledger, program
        self.file = folder / f"robot_{number}.panonav"
        self.clock = clock_folder / f"clock_{number}"
        self.clock.write_text("+0")
        self.process = None
        self.said = collections.deque(maxlen=6)

    def address(self):
        return self.server.address(self.link.port) + f"&robot=r{self.number}"

    def start(self, steps=0):
        wrong_clock = {"LD_PRELOAD": FAKETIME[-1], "FAKETIME_TIMESTAMP_FILE": str(self.clock), "FAKETIME_NO_CACHE": "1",
                       "DONT_FAKE_MONOTONIC": "1"} if FAKETIME else {}
        self.process = subprocess.Popen(
            [self.program, "--gtest_filter=SynchronisedMemory.ARobotWorks*"], stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
            env=os.environ | wrong_clock | {
                "PANONAV_TEST_ROBOT": str(self.file), "PANONAV_TEST_SERVER": self.address(),
                "PANONAV_TEST_NAME": str(self.number), "PANONAV_TEST_FIRST": str(100000 * (len(Robot.processes) + 1)),
                "PANONAV_TEST_STEPS": str(steps)})
        Robot.processes.append(self.process)
        self.listener = threading.Thread(target=self.listen, args=(self.process,), daemon=True)
        self.listener.start()

    def listen(self, process):
        for line in process.stdout:
            # A line that was cut was not told; the others are those of the test's own.
            if line.endswith("\n") and line[0].islower():
                self.said.append(line)
                self.ledger.take(self.number, line)

    def kill(self):
        self.process.kill()
        self.process.wait()


def own_disk(folder, megabytes):
    """A file system of this size in the folder; False where this user may make none."""
    folder.mkdir(parents=True, exist_ok=True)
    return os.geteuid() == 0 and subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m,mode=755", "tmpfs", folder],
        capture_output=True).returncode == 0


def fill(folder):
    ballast = folder / "ballast"
    with open(ballast, "wb") as file:
        try:
            while True:
                os.write(file.fileno(), bytes(1 << 20))
        except OSError:
            pass
    return ballast


def contents_of(program, memory):
    """Returns the contents of a memory: name, signature, position, stamp, what lies beside it and links of each view."""
    done = subprocess.run([program, "--gtest_filter=SynchronisedMemory.AMemoryIsTold"], capture_output=True, text=True,
                          env=os.environ | {"PANONAV_TEST_SERVER": "x", "PANONAV_TEST_TOLD": str(memory)})
    assert done.returncode == 0, done.stdout[-2000:]
    return sorted(line for line in done.stdout.splitlines() if line.startswith("view\t"))


def draw_faults(count, kinds, rng):
    """Draws `count` faults, each kind by its share."""
    faults = [kind for kind, share in kinds.items() for _ in range(max(1, round(count * share)))]
    rng.shuffle(faults)
    while len(faults) < count:
        faults.append("robot killed")
    return faults[:count]


def experiment(arguments, folder):
    rng = random.Random(arguments.seed)
    robots_folder = folder / "robots"
    server_disk = own_disk(folder / "server", 3000)
    robots_disk = own_disk(robots_folder, 3000)
    server = Server(arguments.server, folder / "server/postgresql")
    server.start()
    ledger = Ledger()
    links = Links(str(server.folder / ".s.PGSQL.5432"), arguments.robots)
    robots = [Robot(number, robots_folder, server, link, ledger, arguments.test_fleet, folder)
              for number, link in enumerate(links.links)]
    kinds = {"robot killed": 0.45, "server killed": 0.08, "link cut": 0.2, "link delayed": 0.1, "link silent": 0.05}
    for kind, possible in (("clock wrong", bool(FAKETIME)), ("server's disk full", server_disk),
                           ("robots' disk full", robots_disk)):
        if possible:
            kinds[kind] = 0.04
        else:
            print(f"left out here: {kind}")
    robots[0].start(steps=3)
    assert robots[0].process.wait(timeout=60) == 0
    for robot in robots:
        robot.start()
    done = collections.Counter()
    recoveries = collections.defaultdict(list)
    begin = time.monotonic()

    def recovered(kind, who):
        """Seconds from the end of a fault until all these robots have synchronised again."""
        end = time.monotonic()
        while time.monotonic() - end < 300:
            with ledger.lock:
                if all(ledger.last_synchronised.get(robot.number, 0) > end for robot in who):
                    recoveries[kind].append(time.monotonic() - end)
                    return
            time.sleep(0.02)
        for robot in who:
            if ledger.last_synchronised.get(robot.number, 0) <= end:
                print(f"robot {robot.number}, exit code {robot.process.poll()}, said", *robot.said)
        raise RuntimeError(f"no recovery after: {kind}")

    for kind in draw_faults(arguments.faults, kinds, rng):
        time.sleep(rng.uniform(0.0, 0.8))
        done[kind] += 1
        robot = rng.choice(robots)
        if kind == "robot killed":
            robot.kill()
            time.sleep(rng.uniform(0.0, 0.5))
            robot.start()
        elif kind == "server killed":
            server.kill()
            time.sleep(rng.uniform(0.0, 3.0))
            server.start()
            recovered(kind, robots)
        elif kind == "link cut":
            some = rng.sample(robots, rng.randint(1, len(robots)))
            for one in some:
                one.link.refuses = True
                links.cut(one.link)
            time.sleep(rng.uniform(0.0, 2.0))
            for one in some:
                one.link.refuses = False
        elif kind == "link delayed":
            for one in rng.sample(robots, max(1, len(robots) // 2)):
                one.link.delay_s = rng.choice([0.0, 0.02, 0.05, 0.2])
        elif kind == "link silent":
            robot.link.silent = True
            time.sleep(rng.uniform(1.0, 4.0))
            if rng.random() < 0.5:
                links.cut(robot.link)
            robot.link.silent = False
        elif kind == "clock wrong":
            robot.clock.write_text(rng.choice(["-20y", "+30y", "-3d", "+1h", "+0"]))
        else:
            ballast = fill(folder / "server" if kind.startswith("server") else robots_folder)
            time.sleep(rng.uniform(1.0, 3.0))
            ballast.unlink()
            if kind.startswith("server"):
                server.start()  # it may have given up
            recovered(kind, robots)
    for link in links.links:
        link.delay_s, link.silent, link.refuses = 0.0, False, False
    for robot in robots:
        robot.kill()
    time.sleep(0.5)  # the last lines are read
    print(f"{arguments.robots} robots, {sum(done.values())} faults in {time.monotonic() - begin:.0f} s: " +
          ", ".join(f"{count} x {kind}" for kind, count in sorted(done.items())))

    # No more faults: how long until all are the same?
    begin = time.monotonic()
    rounds = 0
    while True:
        rounds += 1
        new = 0
        for robot in robots:
            robot.start(steps=-1)
            robot.process.wait(timeout=300)
            robot.listener.join()
            words = robot.said[-1].split()
            assert words[0] == "synchronised", robot.said
            new += sum(int(word) for word in words[2:])
        if new == 0 or rounds == 6:
            break
    converging_s = time.monotonic() - begin
    expected = contents_of(arguments.test_fleet, server.address())
    different = [robot.number for robot in robots if contents_of(arguments.test_fleet, robot.file) != expected]

    there = collections.Counter(line.split("\t")[2] for line in expected)
    positions = {line.split("\t")[2]: float(line.split("\t")[3]) for line in expected}
    lost = [view for view in ledger.added if view not in ledger.removing and view not in there]
    doubled = [view for view, count in there.items() if count > 1]
    back = [view for view in ledger.removed if view in there]
    unknown = [view for view in there if view not in ledger.adding]
    # Views moved by one robot alone that still exist: its last move counts, or one that it had begun since.
    moved, unmoved = 0, []
    for view, moves in ledger.moves.items():
        if view not in positions or len({robot for robot, _, _ in moves}) > 1 or not any(done for _, _, done in moves):
            continue
        moved += 1
        last = max(i for i, (_, _, done) in enumerate(moves) if done)
        if positions[view] not in {x for _, x, _ in moves[last:]}:
            unmoved.append(view)
    years = {time.gmtime(float(line.split("\t")[4])).tm_year for line in expected}
    print(f"views added {len(ledger.added)}, removed {len(ledger.removed)}, there at the end {len(expected)}, stamped in "
          f"{len(years)} different years; views moved by one robot {moved}; changes that gave way {ledger.conflicts}")
    print(f"lost {len(lost)}, doubled {len(doubled)}, brought back {len(back)}, from nowhere {len(unknown)}, moves lost "
          f"{len(unmoved)}, converged {'yes' if not different and new == 0 else 'no: ' + str(different)}")
    if lost or doubled or back or unknown:
        print("these are", lost[:3], doubled[:3], back[:3], unknown[:3])
    times = sorted(ledger.seconds)
    print(f"{len(times)} synchronisations: median {statistics.median(times):.3f} s, 95 % within "
          f"{times[int(0.95 * len(times))]:.3f} s, slowest {times[-1]:.3f} s; {sum(ledger.refused.values())} refused: " +
          "; ".join(f"{count} x {what}" for what, count in ledger.refused.most_common(8)))
    for kind, seconds in sorted(recoveries.items()):
        print(f"until all robots had synchronised after '{kind}': median {statistics.median(seconds):.1f} s, longest "
              f"{max(seconds):.1f} s")
    print(f"all the same {converging_s:.1f} s after the last fault, one robot after the other, {rounds} rounds")
    server.stop()
    return not (lost or doubled or back or unknown or unmoved or different or new)


def measure(arguments, folder):
    """Time and bytes for 200 views of 80 x 15 with thumbnails and features."""
    panonav = arguments.panonav
    server = Server(arguments.server, folder / "measured/postgresql")
    (folder / "measured").mkdir()
    server.start()
    try:
        run = lambda *words: json.loads(subprocess.run([str(word) for word in words] + ["--json"], check=True,
                                                       capture_output=True, text=True).stdout.splitlines()[-1])
        run(panonav, "simulate", "office", folder / "drive", "--random", "200", "--seed", "5")
        run(panonav, "memorise", folder / "office.panonav", folder / "drive")
        info = run(panonav, "info", folder / "office.panonav")
        shape = 2 * info["signature"]["rows"] * info["signature"]["components"] if "signature" in info else 0
        bare = (shape * info["views"] + info.get("feature_bytes", 0)) / info["views"]
        print(f"{info['views']} views of the simulated office; signature and features {bare:.0f} bytes a view, thumbnails "
              "besides")
        for delay_ms in (0, 25):
            links = Links(str(server.folder / ".s.PGSQL.5432"), 1)
            link = links.links[0]
            link.delay_s = delay_ms / 1000
            address = server.address(link.port).replace("fleet", f"delay_{delay_ms}")
            copy, other = folder / f"a_{delay_ms}.panonav", folder / f"b_{delay_ms}.panonav"
            run(panonav, "copy", folder / "office.panonav", copy)
            link.delay_s = 0.0
            seed = folder / f"seed_{delay_ms}.panonav"
            run(panonav, "copy", copy, seed)
            run(panonav, "forget", seed, *[view["name"] for view in run(panonav, "list", seed)["views"][1:]])
            run(panonav, "synchronise", seed, address)  # makes the memory
            link.delay_s = delay_ms / 1000
            for what, file in (("upload", copy), ("download", other), ("nothing new", copy)):
                before = link.bytes_up, link.bytes_down
                said = run(panonav, "synchronise", file, address)
                up, down = link.bytes_up - before[0], link.bytes_down - before[1]
                print(f"{what}, {said['views']} views, {2 * delay_ms} ms there and back: {said['seconds']:.2f} s, "
                      f"{up} bytes up, {down} down, {(up + down) / said['views']:.0f} a view")
    finally:
        server.stop()


def main():
    parser = argparse.ArgumentParser()
    for name in ("test_fleet", "panonav", "server"):
        parser.add_argument(name)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--faults", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    if os.geteuid() == 0 and "PANONAV_OWN_MOUNTS" not in os.environ and shutil.which("unshare") and \
            subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode == 0:
        os.environ["PANONAV_OWN_MOUNTS"] = "1"
        os.execvp("unshare", ["unshare", "--mount", sys.executable, *sys.argv])
    sys.stdout.reconfigure(line_buffering=True)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        started = subprocess.run([arguments.server, folder / "probe", "start"], capture_output=True, text=True)
        if "the package postgresql has it" in started.stderr:
            print("skipped: no PostgreSQL server is installed")
            return 77
        assert started.returncode == 0, started.stderr
        subprocess.run([arguments.server, folder / "probe", "stop"])
        try:
            good = experiment(arguments, folder)
            if not arguments.quick:
                measure(arguments, folder)
        finally:
            for process in Robot.processes:
                process.kill()
            for mounted in (folder / "server", folder / "robots"):
                subprocess.run(["umount", "-l", mounted], capture_output=True)
    return 0 if good else 1


sys.exit(main())
