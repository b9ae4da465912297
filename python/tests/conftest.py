"""Shared by the tests: a simulated office, its memory, and the command."""
import json
import os
import pathlib
import subprocess

import pytest

import panonav

COMMAND = pathlib.Path(panonav.__file__).with_name("panonav")


def run_command(*arguments, code=0):
    """Returns the JSON that the command prints."""
    ended = subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert ended.returncode == code, ended.stderr
    return ended.stdout


def command_json(*arguments, code=0):
    """The objects that the command prints, a line each."""
    return [json.loads(line) for line in run_command(*arguments, "--json", code=code).splitlines()]


@pytest.fixture(scope="session")
def office(tmp_path_factory):
    """A folder with an office: the recordings `memory_run`, `query_run` and `drive`, and `office.panonav`."""
    folder = tmp_path_factory.mktemp("office")
    small = ["--kind", "panorama", "--rows", 32, "--columns", 128, "--quiet"]
    run_command("simulate", "office", folder / "memory_run", "--grid", 0.5, *small)
    run_command("simulate", "office", folder / "query_run", "--random", 6, "--seed", 7, *small)
    run_command("simulate", "office", folder / "drive", "--path", "tour", "--spacing-m", 0.3, "--seed", 3, *small)
    run_command("memorise", folder / "office.panonav", folder / "memory_run", "--quiet")
    return folder


@pytest.fixture(scope="session")
def data():
    """The folder of real recordings."""
    folder = os.environ.get("PANONAV_DATA")
    if not folder:
        pytest.skip("PANONAV_DATA is not set")
    return pathlib.Path(folder)
