"""Every number of the command comes through Python to the bit."""
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy
import pytest

import panonav
from conftest import COMMAND, command_json, run_command


def plain(place, areas=False):
    """A place as `panonav localise --json` prints it, less what the command alone knows."""
    matches = []
    for match in place.matches:
        one = {"file": match.name, "dissimilarity": match.dissimilarity, "column_difference": match.column_difference,
               "heading_rad": match.heading_rad}
        if match.verified_features is not None:
            one["verified_features"] = match.verified_features
        matches.append(one)
    told = {"file": place.name, "known": place.known, "known_probability": place.known_probability,
            "matches": matches, "position": place.position and place.position.to_dict(),
            "heading_rad": place.heading_rad, "components": place.components, "bytes_read": place.bytes_read,
            "turned_rad": 0.0}
    if areas:
        told["areas"] = [{"components": level.components, "candidates": len(level.candidates),
                          "area_m2": level.area_m2, "radius_m": level.region and level.region.radius_m,
                          "bytes_read": level.bytes_read} for level in place.areas]
    return told


def test_localise_office(office):
    memory, run = office / "office.panonav", office / "query_run"
    places = panonav.PlaceRecogniser(memory, top=3, areas=True).localise_all(run)
    assert [plain(place, areas=True) for place in places] == command_json("localise", memory, run, "--top", 3, "--areas")
    picture = run / places[0].name
    assert plain(panonav.localise(memory, picture)) == command_json("localise", memory, picture)[0]
    assert plain(panonav.localise(memory, panonav.read_image(picture))) == {**plain(panonav.localise(memory, picture)),
                                                                            "file": ""}


def estimate_as_printed(estimate):
    told = estimate.to_dict()
    told["file"] = told.pop("name")
    for mode in told["modes"]:
        mode["covariance"] = list(mode["covariance"].ravel())
    return told


def tracked(memory, run):
    tracker = panonav.Tracker(memory)
    return [tracker.observe(entry.observation()) for entry in panonav.Dataset(run).entries]


def test_track_office(office):
    memory, run = office / "office.panonav", office / "drive"
    printed = [line for line in command_json("track", memory, run) if "file" in line]
    ours = tracked(memory, run)
    assert len(printed) == len(ours) > 5
    for one, other in zip(printed, ours):
        told = estimate_as_printed(other)
        for key, value in one.items():
            if key not in ("modes", "pose", "stamp_s", "ground_truth"):
                assert told[key] == value, key
        assert (one["pose"] is None) == (told["pose"] is None)
        if one["pose"]:
            assert all(told["pose"][key] == value for key, value in one["pose"].items())
        assert [mode["weight"] for mode in one["modes"]] == [mode["weight"] for mode in told["modes"]]


def test_memorise_makes_the_same_views(office, tmp_path):
    ours = tmp_path / "ours.panonav"
    counts = panonav.memorise(office / "memory_run", ours)
    assert counts.known_before == 0
    one, other = panonav.MemoryFile(ours), panonav.MemoryFile(office / "office.panonav")
    assert one.names() == other.names() and counts.appended == len(one.names())
    a, b = one.load(), other.load()
    assert all(a.packed(view) == b.packed(view) for view in a.views)
    assert panonav.memorise(office / "memory_run", ours).known_before == counts.appended


@pytest.mark.parametrize("name", ["gantry_plants", "sussex_route"])
def test_localise_real_recordings(data, tmp_path, name):
    memory = tmp_path / "real.panonav"
    panonav.memorise(data / name, memory)
    places = panonav.PlaceRecogniser(memory).localise_all(data / name, exclude_same_file=True)
    assert [plain(place) for place in places] == command_json("localise", memory, data / name, "--exclude-same-file")


def test_trajectory_errors(office):
    truth = numpy.array([[i, i * 0.5, 0.1 * i, 0.2] for i in range(20)])
    assert panonav.trajectory_error(truth, truth, align=False).position_m.rms == 0
    moved = truth + [0, 3, -1, 0]
    error = panonav.trajectory_error(moved, truth)
    assert error.position_m.rms == pytest.approx(0, abs=1e-9) and error.pairs == 20
    assert panonav.trajectory_error(truth[:1], truth) is None
    assert panonav.shape_difference(moved[:, 1:3], 2 * truth[:, 1:3]).value == pytest.approx(0, abs=1e-9)
    assert panonav.align(truth[:, 1:3], moved[:, 1:3]).translation == pytest.approx((3, -1))
    with pytest.raises(ValueError, match="relative_distance_m"):
        panonav.trajectory_error(truth, truth, relative_distance_m=-1)


def test_the_command_is_a_module(office):
    ran = subprocess.run([sys.executable, "-m", "panonav", "info", office / "office.panonav", "--json"],
                         capture_output=True, text=True, check=True)
    assert ran.stdout == run_command("info", office / "office.panonav", "--json")
    wrong = subprocess.run([sys.executable, "-m", "panonav", "nonsense"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2 and "nonsense" in wrong.stderr


def test_an_interrupt_ends_long_work(office, tmp_path):
    """And what was stored until then is whole."""
    run = tmp_path / "long"
    shutil.copytree(office / "memory_run", run)
    header, *lines = (run / "poses.csv").read_text().splitlines()
    many = [header]
    for copy in range(40):
        for line in lines:
            name, rest = line.split(",", 1)
            if copy:
                os.link(run / name, run / f"c{copy}_{name}")
            many.append((f"c{copy}_" if copy else "") + line)
    stamped = "stamp_s" in header
    if stamped:
        column = header.split(",").index("stamp_s")
        rows = [line.split(",") for line in many[1:]]
        for i, row in enumerate(rows):
            row[column] = str(i)
        many[1:] = [",".join(row) for row in rows]
    (run / "poses.csv").write_text("\n".join(many) + "\n")
    interrupted = []

    def interrupt():
        time.sleep(0.5)
        interrupted.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        panonav.memorise(run, tmp_path / "long.panonav")
    assert time.monotonic() - interrupted[0] < 0.2
    assert panonav.MemoryFile(tmp_path / "long.panonav").verify() == []


def test_results_read_well(office):
    place = panonav.localise(office / "office.panonav", office / "query_run" / "view_00000.png")
    assert repr(place).startswith("Place(name='view_00000.png', known=")
    assert set(place.to_dict()["matches"][0]) >= {"name", "dissimilarity", "heading_rad"}
    assert "top: int = 10" in panonav.localise.__doc__ and ">= 1" in panonav.localise.__doc__
    assert panonav.PlaceRecogniser.__module__ == "panonav" and COMMAND.exists()
