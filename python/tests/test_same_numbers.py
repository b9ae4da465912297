"""Every number of the command comes through Python to the bit."""
import math
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
    def plain_position(position):
        if position is None:
            return None
        known = position.to_dict()
        del known["covariance"]  # computed from the bounds
        return known

    def plain_match(match):
        one = {"file": match.name, "dissimilarity": match.dissimilarity, "column_difference": match.column_difference,
               "heading_rad": match.heading_rad}
        if match.verified_features is not None:
            one["verified_features"] = match.verified_features
        return one

    alternatives = [{"match": plain_match(other.match), "probability": other.probability, "floor": other.floor,
                     "position": plain_position(other.position), "heading_rad": other.heading_rad}
                    for other in place.alternatives]
    reported = {"file": place.name, "known": place.known, "known_probability": place.known_probability,
            "probability": place.probability, "alternatives": alternatives,
            "matches": [plain_match(match) for match in place.matches], "floor": place.floor,
            "position": plain_position(place.position),
            "heading_rad": place.heading_rad, "components": place.components, "bytes_read": place.bytes_read,
            "turned_rad": 0.0}
    if areas:
        reported["areas"] = [{"components": level.components, "candidates": len(level.candidates),
                          "area_m2": level.area_m2, "radius_m": level.region and level.region.radius_m,
                          "bytes_read": level.bytes_read} for level in place.areas]
    return reported


def test_localise_office(office):
    memory, run = office / "office.panonav", office / "query_run"
    places = panonav.PlaceRecogniser(memory, top=3, areas=True).localise_all(run)
    assert [plain(place, areas=True) for place in places] == command_json("localise", memory, run, "--top", 3, "--areas")
    picture = run / places[0].name
    assert plain(panonav.localise(memory, picture)) == command_json("localise", memory, picture)[0]
    assert plain(panonav.localise(memory, panonav.read_image(picture))) == {**plain(panonav.localise(memory, picture)),
                                                                            "file": ""}


def estimate_as_printed(estimate):
    reported = estimate.to_dict()
    reported["file"] = reported.pop("name")
    for mode in reported["modes"]:
        mode["covariance"] = list(mode["covariance"].ravel())
    return reported


def same_estimates(printed, ours):
    printed = [line for line in printed if "file" in line]
    assert len(printed) == len(ours) > 5
    for one, other in zip(printed, ours):
        reported = estimate_as_printed(other)
        for key, value in one.items():
            if key == "pose" and one["state"] == "position_known":
                value = None  # a pose of Python has a heading
            if key not in ("modes", "stamp_s", "ground_truth"):
                assert reported[key] == value, key
        modes = [{**mode.pop("mean"), **mode} for mode in reported["modes"]]
        for mode, known in zip(modes, one["modes"]):
            if known["heading_rad"] is None:  # a mode of Python has the mean of its headings
                mode["heading_rad"] = None
        assert one["modes"] == modes


def test_track_office(office):
    memory, run = office / "office.panonav", office / "drive"
    printed = command_json("track", memory, run)
    tracker = panonav.Tracker(memory)
    same_estimates(printed, [tracker.observe(entry.observation()) for entry in panonav.Dataset(run).entries])
    same_estimates(printed, panonav.Tracker(memory).track(run))
    assert tracker.particles().shape[1] == 4


def test_a_run_teaches_the_same(office, tmp_path):
    """Views, history and what the memory answers afterwards; what a updater is refused changes nothing."""
    ours, printed, run = tmp_path / "ours.panonav", tmp_path / "printed.panonav", tmp_path / "run"
    shutil.copy(office / "office.panonav", ours)
    shutil.copy(office / "office.panonav", printed)
    run_command("simulate", "office", run, "--path", "walk", "--poses", 40, "--spacing-m", 0.2, "--seed", 5, "--kind",
                "panorama", "--rows", 32, "--columns", 128, "--light", 0.7, "--moved-objects", 0.5, "--quiet")
    run_command("localise", printed, run, "--update", "--quiet")
    recogniser, updater = panonav.PlaceRecogniser(ours), panonav.MemoryUpdater(ours)
    with pytest.raises(ValueError, match="appearances"):
        panonav.MemoryUpdater(ours, appearances=0)
    for entry in panonav.Dataset(run).entries:
        seen = entry.observation()
        updater.observe(seen, recogniser.panorama(seen), recogniser.localise(seen))
    changes = updater.finish(f"update from {run}")
    assert changes.observations == 40 and changes.certain > 0 and changes.added + changes.reinforced > 0
    with pytest.raises(ValueError, match="finished"):
        updater.finish("again")
    one, other = panonav.MemoryFile(ours), panonav.MemoryFile(printed)
    assert one.names() == other.names() and len(one.names()) == changes.views
    assert [change.what for change in one.history()] == [change.what for change in other.history()]
    picture = office / "query_run" / panonav.Dataset(office / "query_run").entries[0].file
    assert panonav.localise(ours, picture).to_dict() == panonav.localise(printed, picture).to_dict()


def test_memorise_makes_the_same_views(office, tmp_path):
    ours = tmp_path / "ours.panonav"
    counts = panonav.memorise(ours, office / "memory_run")
    assert counts.known_before == 0
    one, other = panonav.MemoryFile(ours), panonav.MemoryFile(office / "office.panonav")
    assert one.names() == other.names() and counts.appended == len(one.names())
    a, b = one.load(), other.load()
    assert all(a.packed(view) == b.packed(view) for view in a.views)
    assert panonav.memorise(ours, office / "memory_run").known_before == counts.appended


def test_trajectory_errors(office):
    truth = numpy.array([[i, i * 0.5, 0.1 * i, 0.2] for i in range(20)])
    assert panonav.trajectory_error(truth, truth, align="none").position_m.rms == 0
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
    memory = tmp_path / "long.panonav"

    def count():
        try:
            return len(panonav.MemoryFile(memory).names())
        except (OSError, panonav.Error):
            return 0  # not yet there

    def interrupt():
        end = time.monotonic() + 60
        while count() == 0 and time.monotonic() < end:
            time.sleep(0.005)
        os.kill(os.getpid(), signal.SIGINT)

    asking = threading.Thread(target=interrupt)
    asking.start()
    with pytest.raises(KeyboardInterrupt):
        panonav.memorise(memory, run)
    asking.join()
    assert 0 < count() < len(many) - 1
    assert panonav.MemoryFile(memory).verify() == []


def test_results_read_well(office):
    place = panonav.localise(office / "office.panonav", office / "query_run" / "view_00000.png")
    assert repr(place).startswith("Place(name='view_00000.png', known=")
    assert set(place.to_dict()["matches"][0]) >= {"name", "dissimilarity", "heading_rad"}
    assert "top: int = 10" in panonav.localise.__doc__ and ">= 1" in panonav.localise.__doc__
    assert panonav.PlaceRecogniser.__module__ == "panonav" and COMMAND.exists()


def test_pandas_makes_tables(office):
    pandas = pytest.importorskip("pandas")
    places = panonav.PlaceRecogniser(office / "office.panonav").localise_all(office / "query_run")
    table = pandas.json_normalize([place.to_dict() for place in places])
    assert list(table["position.x_m"]) == [place.position.x_m for place in places] and table["known"].all()


def way_as_printed(goal, way):
    evidence = way.evidence
    printed = {"goal": goal, "current": way.name, "known": way.known, "direction_rad": way.direction_rad}
    keys = ["length", "xi", "eta", "heading_rad", "correlation", "residual", "frequencies"]
    stated = ["probability", "direction_deviation_rad", "heading_deviation_rad", "covariance", "second"]
    if not evidence:
        return printed | dict.fromkeys(keys + stated)
    second = evidence.second
    return printed | {key: getattr(evidence.vector, key) for key in keys} | {
        "probability": evidence.probability, "direction_deviation_rad": evidence.direction_deviation_rad,
        "heading_deviation_rad": evidence.turn_deviation_rad, "covariance": evidence.vector.covariance,
        "second": {"heading_rad": second.heading_rad, "residual": second.residual} if second else None}


def same_ways_home(memory, goal, run, every=1):
    ways = panonav.HomingGuide(memory, goal).home_all(panonav.Dataset(run).select(every))
    assert [way_as_printed(goal, way) for way in ways] == command_json("home", goal, run, "--memory", memory,
                                                                       "--every", every)


def test_home_office(office):
    same_ways_home(office / "office.panonav", "view_00003.png", office / "query_run")
    run = panonav.Dataset(office / "query_run")
    guide = panonav.HomingGuide(run[0], source=run.source, components=8)
    way = guide.home(run[0])
    assert way.direction_rad is None and way.evidence.vector.length < 1e-6 and way.evidence.vector.correlation > 0.999
    with pytest.raises(panonav.ContractError, match="source"):
        panonav.HomingGuide(run[0])
    with pytest.raises(panonav.FileError):
        panonav.HomingGuide(office / "office.panonav", "nowhere")


def mapped_as_printed(run):
    sizes = [0] * (1 + max(node.component for node in run.map.nodes))
    for node in run.map.nodes:
        sizes[node.component] += 1
    return {"nodes": len(run.map.nodes), "skipped": run.skipped, "connected_components": sizes,
            "closures": sum(edge.kind == "closure" for edge in run.map.edges), "scale_m": run.scale_m,
            "unit": run.unit.replace(" ", "_"), "wheels": run.wheels}


def same_map(recording, folder):
    run = panonav.make_map(folder / "ours.panonav", recording, capture_difference=0.05, graph_max_iterations=15)
    printed = command_json("map", folder / "theirs.panonav", recording, "--capture-difference", 0.05,
                           "--graph-max-iterations", 15, "--tum", folder / "theirs.csv")[0]
    reported = mapped_as_printed(run)
    assert reported == {key: printed[key] for key in reported}
    one, other = (panonav.MemoryFile(folder / f"{whose}.panonav") for whose in ("ours", "theirs"))
    assert panonav.read_map(one, "map").to_dict() == panonav.read_map(other, "map").to_dict() == run.map.to_dict()
    assert numpy.array_equal(run.map.poses(), panonav.read_map(other).poses())
    assert panonav.read_map(one, "nothing") is None


def test_map_office(office, tmp_path):
    same_map(office / "drive", tmp_path)


def same_arrangement(memory, **odometry):
    lattice = panonav.arrange(memory, neighbours=8, save=False, **odometry)
    flags = ["--odometry", odometry["odometry"]] if odometry else []
    printed = command_json("arrange", memory, "--no-save", "--neighbours", 8, *flags)[0]
    assert [(node["view"], node["connected_component"], node["x"], node["y"], node["heading_rad"])
            for node in printed["nodes"]] == [(node.view, node.component, *node.pose) for node in lattice.nodes]
    for key in ("candidates", "metric", "iterations", "energy"):
        assert printed[key] == getattr(lattice, key)
    assert (printed["springs"], printed["crossings"]) == (len(lattice.springs), len(lattice.crossings))
    assert printed["joined_pieces"] == [{"views": join.views, "pairs": join.pairs} for join in lattice.joins]
    return lattice


def test_merge_office(office, tmp_path):
    copy = tmp_path / "copy.panonav"
    shutil.copy(office / "office.panonav", copy)
    reported, = command_json("merge", office / "office.panonav", copy, "-o", tmp_path / "by_command.panonav")
    merged = panonav.merge_memories(office / "office.panonav", copy, tmp_path / "by_python.panonav")
    assert merged.shared == reported["shared"] == merged.views == reported["views"] > 10
    assert merged.alignment.places == reported["alignment"]["places"]
    assert tuple(merged.alignment.first_from_second) == tuple(
        reported["alignment"][key] for key in ("x_m", "y_m", "heading_rad"))
    views = [panonav.MemoryFile(tmp_path / f"by_{who}.panonav").load() for who in ("command", "python")]
    assert numpy.array_equal(views[0].poses(), views[1].poses())
    with pytest.raises(ValueError, match="min_confirmed"):
        panonav.merge_memories(copy, copy, tmp_path / "never.panonav", min_confirmed=2)
    with pytest.raises(OSError, match="already exists"):
        panonav.merge_memories(copy, copy, copy)


def test_arrange_office(office, tmp_path):
    memory = tmp_path / "copy.panonav"
    panonav.memorise(memory, office / "drive")
    lattice = same_arrangement(memory)
    assert same_arrangement(memory, odometry=office / "drive").metric
    panonav.arrange(memory, neighbours=8)
    stored = panonav.read_map(panonav.MemoryFile(memory), "lattice")
    assert numpy.array_equal(stored.poses(), lattice.poses())


def test_arrange_in_pieces(tmp_path):
    memory = tmp_path / "corridor.panonav"
    world = panonav.SimulatedWorld("corridor", kind="panorama", rays_per_axis=1)
    panonav.memorise(memory, world.record(tmp_path / "corridor", spacing_m=0.6))
    lattice = same_arrangement(memory)
    assert len(lattice.components) > 1 and lattice.crossings
    component = [node.component for node in lattice.nodes]
    for crossing in lattice.crossings:
        assert crossing.a < crossing.b and component[crossing.a] != component[crossing.b]
        assert crossing.phases.has_direction and 0.0 < crossing.probability <= 1.0
    panonav.arrange(memory, neighbours=8)
    edges = panonav.read_map(panonav.MemoryFile(memory), "lattice").edges
    assert [(edge.a, edge.b, edge.weight) for edge in edges[len(lattice.springs):]] == [
        (lattice.nodes[crossing.a].view, lattice.nodes[crossing.b].view, crossing.probability)
        for crossing in lattice.crossings]


def same_catchment(recording, flags, **options):
    survey = panonav.survey_catchment(recording, **options)
    printed = command_json("catchment", recording, *flags)[0]
    for key in ("spacing_m", "typical_distance_m", "pairs", "homeward_component", "orientation_error_rad"):
        assert getattr(survey, key) == printed[key], key
    assert [one.to_dict() for one in survey.bins] == printed["bins"]
    assert [(area["accepted_m"], area["places"]) for area in printed["catchment_areas"]] == list(
        zip(survey.accepted_m, survey.areas))
    assert [(view["file"], view["places"]) for view in printed["views"]] == [
        (name, survey.places_within(i, survey.spacing_m)) for i, name in enumerate(survey.goal_names)]
    assert survey.end_m.shape == survey.homeward.shape == survey.next.shape == (printed["goals"], printed["places"])
    assert survey.places.shape == (printed["places"], 3)
    return survey


def test_check_orientation(office):
    run = office / "drive"
    right = panonav.check_orientation(run)
    printed = command_json("calibrate", "--orientation", run, "-o", office / "unused.toml")[0]
    assert printed["orientation_fault"] is None and right.corrected is None
    assert [right.columns_right, right.forward_right] == [printed["columns_right"], printed["forward_right"]]
    assert right.columns_right and right.forward_right and "columns run clockwise" in right.explanation
    assert right.to_dict()["forward_turn_rad"] == 0.0


def test_catchment_office(office):
    run = office / "memory_run"
    plainly = same_catchment(run, [])
    assert numpy.array_equal(plainly.next[numpy.isnan(plainly.homeward)], numpy.arange(len(plainly.goals)))
    same_catchment(run, ["--turn-randomly", 1, "--published", 5, "--iterations", 2, "--up-to-m", 1.5, "--horizon",
                         "--stages", "2,5", "--max-steps", 4, "--max-step-m", 1.5],
                   turn_seed=1, published=5, iterations=2, up_to_m=1.5, horizon=True, stages=[2, 5], max_steps=4,
                   max_step_m=1.5)
    same_catchment(run, ["--current", office / "query_run", "--highest", 6], current=office / "query_run", highest=6)
    with pytest.raises(panonav.ContractError, match="published is 3"):
        panonav.survey_catchment(run, published=3, highest=4)
    with pytest.raises(panonav.ContractError, match="goal"):
        plainly.places_within(len(plainly.goals), 1.0)


def step_as_printed(step):
    reported = step.to_dict()
    reported["file"] = reported.pop("name")
    del reported["line"]
    reported["columns"] = reported["columns"] or 0
    if step.on_route:
        reported["covariance"] = list(reported["covariance"].ravel())
    return reported


def same_route(recording, folder, every_m):
    memory = folder / "route.panonav"
    ours = panonav.record_route(memory, recording, every_m=every_m)
    printed = command_json("route", "record", folder / "theirs.panonav", recording, "--every-m", every_m)[0]
    assert (len(ours.route), ours.appended, ours.bytes, ours.bytes_per_km, ours.route.length_m) == tuple(
        printed[key] for key in ("lines", "appended", "bytes", "bytes_per_km", "length_m"))
    assert (ours.length_estimated, ours.left_out) == (printed["length_estimated"], printed["left_out"])
    assert numpy.array_equal(panonav.read_route(panonav.MemoryFile(folder / "theirs.panonav")).lines(),
                             ours.route.lines())
    steps = panonav.follow_route(memory, recording)
    followed = command_json("route", "follow", memory, recording)
    assert [step_as_printed(step) for step in steps] == [
        {key: value for key, value in line.items() if key not in ("stamp_s", "ground_truth")} for line in followed]
    assert any(step.on_route for step in steps)


def test_chains(tmp_path):
    drive = tmp_path / "drive"
    panonav.simulate("loop", drive, path="tour", spacing_m=0.25, kind="panorama", heading="path",
                     rows=24, columns=128, rays_per_axis=1)
    memory = tmp_path / "chain.panonav"
    ours = panonav.record_chain(memory, drive, bytes_per_100_m=2000)
    printed = command_json("route", "record", tmp_path / "theirs.panonav", drive, "--method", "chain",
                           "--bytes-per-100-m", 2000)[0]
    assert all(printed[key] == value for key, value in ours.to_dict().items())
    for back in (False, True):
        followed = command_json("route", "follow", memory, drive, *(["--back"] if back else []))
        steps = [step.to_dict() for step in panonav.follow_chain(memory, drive, back=back)]
        for line in followed:
            line["name"] = line.pop("file")
            del line["stamp_s"]
        assert steps == followed
        # A live robot gets the same motions, one observation at a time.
        entries = panonav.Dataset(drive)
        guide = panonav.ChainGuide(memory, source=entries.source, back=back)
        assert [guide.step(entry).to_dict() for entry in entries][: len(steps)] == followed
    with pytest.raises(panonav.FileError, match="is a chain of snapshots"):
        panonav.follow_route(memory, drive)


def test_homes(tmp_path):
    walk = tmp_path / "walk"
    panonav.simulate("loop", walk, path="tour", spacing_m=0.25, kind="panorama", heading="path",
                     rows=24, columns=128, rays_per_axis=1)
    memory = tmp_path / "home.panonav"
    area = panonav.learn_home(memory, walk, max_bytes=600)
    printed = command_json("home", "learn", tmp_path / "theirs.panonav", walk, "--max-bytes", 600)[0]
    assert all(printed[key] == getattr(area, key) for key in ("snapshots", "bytes", "returns", "homeward_component"))
    assert area.bytes <= 600
    assert area.field.shape == (printed["held_out"], 4)
    entries = panonav.Dataset(walk)
    guide = panonav.HomeAreaGuide(memory, source=entries.source)
    steps = [guide.step(entry, back=index + 1 >= 20) for index, entry in enumerate(entries)]
    found = command_json("home", "home", walk, "--memory", memory, "--area", "--back-from", 20)
    for step, line in zip(steps, found):
        assert step.state == line["state"]
        assert (step.turn_rad, step.distance_m, step.deviation_m) == (
            line["turn_rad"], line["distance_m"], line["deviation_m"])
    assert steps[0].state == "away" and steps[0].turn_rad is None


def test_scale_by_camera_height(tmp_path):
    drive = panonav.simulate("office", tmp_path / "drive", path="tour", spacing_m=0.3, kind="panorama", heading="path")
    (tmp_path / "walk").mkdir()
    for entry in drive:
        shutil.copy(tmp_path / "drive" / entry.name, tmp_path / "walk")
    band = math.radians(-30), math.radians(40)
    panonav.memorise(tmp_path / "a.panonav", tmp_path / "walk", panonav.PictureSource("panorama", elevations=band))
    shutil.copy(tmp_path / "a.panonav", tmp_path / "b.panonav")
    ours = panonav.MemoryFile(tmp_path / "a.panonav", write=True)
    scale = ours.scale_by_camera_height(0.6)
    printed = command_json("scale", tmp_path / "b.panonav", "--camera-height-m", 0.6)[0]
    assert scale.unit_m == printed["factor"] and abs(scale.unit_m - 0.3) < 0.02
    assert {key: value for key, value in scale.to_dict().items() if key != "unit_m"} == printed["ground"]
    assert ours.length_unit == "m"
    with pytest.raises(panonav.Error, match="allowed: > 0"):
        ours.scale_by_camera_height(0)


def test_route_office(office, tmp_path):
    same_route(office / "drive", tmp_path, 0.3)


@pytest.mark.parametrize("name, every", [("gantry_plants", 2), ("sussex_route", 4)])
def test_real_recordings(data, tmp_path, name, every):
    """Pictures in memory are others than those that are asked."""
    recording, memory = data / name, tmp_path / "real.panonav"
    whole = panonav.Dataset(recording)
    panonav.memorise(memory, whole.select(every))
    places = panonav.PlaceRecogniser(memory).localise_all(whole.select(3), exclude_same_file=True)
    assert [plain(place) for place in places] == command_json("localise", memory, recording, "--every", 3,
                                                              "--exclude-same-file")
    same_ways_home(memory, panonav.MemoryFile(memory).names()[7], recording, 20)
    same_arrangement(memory)
    if name == "sussex_route":
        same_route(recording, tmp_path, 0.1)
        same_map(recording, tmp_path)
        tracker = panonav.Tracker(memory)
        same_estimates(command_json("track", memory, recording, "--every", 9), tracker.track(recording, every=9))
