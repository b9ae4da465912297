#!/usr/bin/env python3
"""panonav sweep: alone, as several processes, under Open MPI where it is installed, and after a lost process.

Usage: test_sweep.py PANONAV
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

CONVERT = ["--", "convert", "../drive", "{out}/part.mcap", "--every", "{every}", "--config", "{config}", "--json"]


def files_of(folder: pathlib.Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name != ".panonav-jobs"}


def main() -> int:
    panonav = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([panonav, "simulate", "office", "drive", "--random", "6", "--kind", "panorama", "--rows", "8",
                        "--columns", "64", "-q"], cwd=folder, check=True)
        (folder / "parts.csv").write_text("every,config\n" + "".join(
            f"{i % 3 + 1},{'seventh' if i == 6 else 'plain'}.toml\n" for i in range(12)))

        def place(where: str) -> pathlib.Path:
            (folder / where).mkdir()
            for config in ("plain.toml", "seventh.toml"):
                (folder / where / config).touch()
            return folder / where

        def run(where: pathlib.Path, *words: str, code: int = 0, before: tuple = ()) -> str:
            result = subprocess.run([*before, panonav, "sweep", *words], cwd=where, capture_output=True, text=True,
                                    timeout=240)
            assert result.returncode == code, (words, result)
            return result.stderr if code == 2 else result.stdout

        alone = place("alone")
        told = run(alone, "--json", "../parts.csv", "out", *CONVERT)
        assert json.loads(told) == {"out": "out", "jobs": 12, "run_here": 12, "failed": 0}, told
        expected = files_of(alone)
        rows = list(csv.DictReader((alone / "out/jobs.csv").open()))
        assert [(row["job"], row["every"], row["exit_code"]) for row in rows[:2]] == [("1", "1", "0"), ("2", "2", "0")]
        results = [json.loads(line) for line in (alone / "out/results.jsonl").open()]
        assert [one["output"]["pictures"] * int(one["every"]) for one in results] == [6] * 12, results[0]

        # Processes of one run divide the jobs; its name is what mpirun gives each of them.
        several = place("several")
        processes = [subprocess.Popen([panonav, "sweep", "--json", "../parts.csv", "out", *CONVERT], cwd=several,
                                      stdout=subprocess.PIPE, text=True, env={**os.environ, "PMIX_NAMESPACE": "17"})
                     for _ in range(3)]
        told = [json.loads(process.communicate(timeout=240)[0]) for process in processes]
        assert all(process.returncode == 0 for process in processes)
        assert sum(one["run_here"] for one in told) == 12, told
        assert files_of(several) == expected
        if mpirun := shutil.which("mpirun"):
            parallel = place("parallel")
            run(parallel, "../parts.csv", "out", *CONVERT,
                before=(mpirun, "--allow-run-as-root", "--oversubscribe", "-n", "2"))
            assert files_of(parallel) == expected

        # Killed in the middle: its job ends with it, and another process goes on.
        killed = place("killed")
        (killed / "seventh.toml").unlink()
        os.mkfifo(killed / "seventh.toml")  # it waits there
        process = subprocess.Popen([panonav, "sweep", "-q", "../parts.csv", "out", *CONVERT], cwd=killed)
        while not (killed / "out/000007.out").exists() and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.wait()
        (killed / "seventh.toml").unlink()
        (killed / "seventh.toml").touch()
        assert not (killed / "out/jobs.csv").exists()
        assert "is not empty" in run(killed, "../parts.csv", "out", *CONVERT, code=2)
        told = json.loads(run(killed, "--continue", "--json", "../parts.csv", "out", *CONVERT))
        assert told["run_here"] == 6 and told["failed"] == 0, told
        assert files_of(killed) == expected

        # Jobs that fail are named, and they alone run again.
        failing = place("failing")
        (failing / "memories.csv").write_text("recording\nhere\nthere\n")
        shutil.copytree(folder / "drive", failing / "here")
        words = ["memories.csv", "out", "--", "convert", "{recording}", "{out}/drive.mcap"]
        run(failing, *words, code=1)
        assert [row["exit_code"] for row in csv.DictReader((failing / "out/jobs.csv").open())] == ["0", "2"]
        assert "there" in (failing / "out/000002.err").read_text()
        shutil.copytree(folder / "drive", failing / "there")
        told = json.loads(run(failing, "--continue", "--json", *words))
        assert told["run_here"] == 1 and told["failed"] == 0, told

        # What cannot be meant is refused in one line.
        refused = place("refused")
        (refused / "two.csv").write_text("a,b\n1,2\n")
        (refused / "none.csv").write_text("a\n")
        (refused / "out.csv").write_text("out\n1\n")
        (refused / "full").mkdir()
        (refused / "full/file").touch()
        for words, why in ((["two.csv", "out", "--", "info", "{a}"], "column b of two.csv stands nowhere"),
                           (["two.csv", "out", "--", "info", "{a}{b}{c}"], "there is no {c}; allowed: {job}, {out}, {a}, {b}"),
                           (["two.csv", "out", "--", "info", "{a}{b"], "has a '{' without '}'"),
                           (["two.csv", "out", "--", "sweep", "{a}{b}"], "cannot be swept"),
                           (["two.csv", "out", "--", "nothing", "{a}{b}"], "cannot be swept"),
                           (["two.csv", "full", "--", "info", "{a}{b}"], "is there and no sweep"),
                           (["two.csv", "new", "--continue", "--", "info", "{a}{b}"], "no sweep to continue"),
                           (["--threads", "2", "two.csv", "out", "--", "info", "{a}{b}"],
                            "--threads has no effect before --"),
                           (["none.csv", "out", "--", "info", "{a}"], "it has no rows"),
                           (["out.csv", "out", "--", "info", "{out}"], "a column is called out")):
            line = run(refused, *words, code=2)
            assert why in line and line.count("\n") == 1, line
        assert not (refused / "out").exists() and not (refused / "new").exists()
        assert sorted(path.name for path in (refused / "full").iterdir()) == ["file"]
        line = run(killed, "--continue", "../parts.csv", "out", *CONVERT[:-1], code=2)
        assert "tells of another sweep" in line, line
    print("sweep: the same bytes alone, as three processes" + (", by mpirun" if mpirun else "") + " and after a kill")
    return 0


if __name__ == "__main__":
    sys.exit(main())
