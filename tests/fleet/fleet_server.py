"""Runs programs and a PostgreSQL server for tests; the script is called with PANONAV_POSTGRESQL TEST_FLEET [PANONAV]."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

SERVER, TEST_FLEET = sys.argv[1:3]
PANONAV = sys.argv[3] if len(sys.argv) > 3 else None


def run(*words, code=0, timeout=120, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=timeout, **more)
    assert done.returncode == code, (words, done.returncode, done.stdout, done.stderr)
    return done.stdout


def refused(*words, saying):
    """One line that says so, without a password."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120)
    assert done.returncode == 2, (words, done.returncode, done.stdout, done.stderr)
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1 and re.search(saying, lines[0]), (words, saying, done.stderr)
    assert "geheim" not in done.stdout + done.stderr, done.stderr


class Server:
    def __init__(self, folder):
        self.folder = folder

    def start(self, *settings):
        run(SERVER, self.folder, "start", *settings)

    def stop(self):
        run(SERVER, self.folder, "stop")

    def kill(self):
        """Kills all processes at once, like a loss of power."""
        first = int((self.folder / "data/postmaster.pid").read_text().split()[0])
        pids = [first] + [int(pid) for pid in subprocess.run(
            ["pgrep", "-P", str(first)], capture_output=True, text=True).stdout.split()]
        for pid in pids:
            os.kill(pid, signal.SIGKILL)
        for _ in range(200):
            if not any(pathlib.Path(f"/proc/{pid}/cmdline").exists() and
                       pathlib.Path(f"/proc/{pid}/cmdline").read_bytes() for pid in pids):
                return
            time.sleep(0.05)
        raise AssertionError("the server is still there")

    def memory(self, name, user="panonav", more=""):
        return f"postgresql://{user}@/panonav?host={self.folder}&memory={name}{more}"

    def sql(self, text):
        return run("psql", "-X", "-q", "-t", "-A", "-v", "ON_ERROR_STOP=1", "-h", self.folder, "-U", "panonav",
                   "-d", "panonav", "-c", text).strip()
