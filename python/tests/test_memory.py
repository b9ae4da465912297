"""Memories: exact search from any number of threads, bulk appending, lifetimes, files."""
import concurrent.futures
import gc
import math
import pathlib
import shutil
import struct
import subprocess
import warnings
import zlib

import numpy
import pytest

import panonav
from conftest import command_json


@pytest.fixture(scope="module")
def arrays():
    random = numpy.random.default_rng(5)
    magnitudes = random.integers(0, 256, (3000, 8, 20), dtype=numpy.uint8)
    return magnitudes, random.integers(0, 256, magnitudes.shape, dtype=numpy.uint8)


@pytest.fixture(scope="module")
def memory(arrays):
    memory = panonav.VisualMemory((20, 8), 1.0)
    memory.extend(*arrays)
    return memory


def nearest(magnitudes, query, top=10):
    sums = numpy.abs(magnitudes.astype(int) - query.astype(int)).sum(axis=(1, 2))
    order = numpy.lexsort((numpy.arange(len(sums)), sums))[:top]
    return [(int(i), int(sums[i])) for i in order]


def test_search_is_a_full_scan_from_eight_threads(arrays, memory):
    random = numpy.random.default_rng(6)
    queries = [numpy.clip(arrays[0][i].astype(int) + random.integers(-9, 9, (8, 20)), 0, 255).astype(numpy.uint8)
               for i in random.integers(0, 3000, 64)]

    def ask(query):
        found = memory.search(panonav.PackedSignature(query, numpy.zeros_like(query)))
        return [(match.view, match.dissimilarity) for match in found.matches]

    with concurrent.futures.ThreadPoolExecutor(8) as threads:
        answers = list(threads.map(ask, queries))
    assert answers == [nearest(arrays[0], query) for query in queries]


def test_memory_may_grow_while_threads_ask(arrays):
    memory = panonav.VisualMemory((20, 8), 1.0)
    memory.extend(arrays[0][:100], arrays[1][:100])
    query = memory.packed(7)

    def ask(_):
        return memory.search(query, top=1).matches[0].view

    with concurrent.futures.ThreadPoolExecutor(8) as threads:
        futures = [threads.submit(ask, i) for i in range(200)]
        for i in range(100, 300, 50):
            memory.extend(arrays[0][i:i + 50], arrays[1][i:i + 50])
        assert {one.result() for one in futures} == {7}
    assert len(memory) == 300


def test_views_keep_poses_names_and_links(arrays):
    memory = panonav.VisualMemory((20, 8), 1.0, elevations=(-0.5, 0.5))
    memory.extend(arrays[0][:3], arrays[1][:3], names=["a", "b", "c"],
                  poses=[[0, 0, 1], [1, 2, numpy.nan], [numpy.nan] * 3])
    assert memory.info(1).to_dict() == {"name": "b", "pose": {"x_m": 1, "y_m": 2, "heading_rad": None}, "stamp_s": None}
    assert memory.info(2).pose is None and memory.find("c") == 2 and memory.find("d") is None
    assert numpy.array_equal(memory.poses()[:2], [[0, 0, 1], [1, 2, numpy.nan]], equal_nan=True)
    memory.link(0, 2, "closure")
    assert [link.to_dict() for link in memory.links] == [{"a": 0, "b": 2, "kind": "closure"}]
    memory.remove(0)
    assert memory.views == [1, 2] and memory.links == []
    assert memory.append(memory.packed(1), "d", pose=(3, 4)) == 3
    assert memory.elevations == (-0.5, 0.5)


@pytest.mark.parametrize("change", [
    lambda m, a: m.extend(a[0][:2].astype(float), a[1][:2]),
    lambda m, a: m.extend(a[0][:2, :4], a[1][:2, :4]),
    lambda m, a: m.extend(a[0][:2], a[1][:3]),
    lambda m, a: m.extend(a[0][:2], a[1][:2], names=["one"]),
    lambda m, a: m.extend(a[0][:2], a[1][:2], names=["same", "same"]),
    lambda m, a: m.extend(a[0][:2], a[1][:2], poses=[[0, 0]]),
    lambda m, a: m.extend(a[0][:2], a[1][:2], poses="nowhere"),
    lambda m, a: m.append(m.packed(0), "0"),
    lambda m, a: m.append(m.packed(0), ""),
    lambda m, a: m.info(99999),
    lambda m, a: m.search(panonav.PackedSignature(a[0][0, :4], a[1][0, :4])),
    lambda m, a: m.search(m.packed(0), top=0),
    lambda m, a: m.link(0, 0),
    lambda m, a: m.link(0, 1, "friendship"),
])
def test_wrong_values_are_refused_in_one_line(arrays, change):
    memory = panonav.VisualMemory((20, 8), 1.0)
    memory.extend(arrays[0][:2], arrays[1][:2])
    with pytest.raises(panonav.ContractError) as caught:
        change(memory, arrays)
    assert "\n" not in str(caught.value)


def test_results_outlive_their_memory(office):
    file = panonav.MemoryFile(office / "office.panonav")
    memory = file.load()
    size, header = len(memory), file.header
    found = memory.search(memory.packed(memory.views[3]))
    recogniser = panonav.PlaceRecogniser(file)
    place = recogniser.localise(office / "query_run" / panonav.Dataset(office / "query_run").entries[0].file)
    matches, position = place.matches, place.position
    copy = recogniser.memory
    del file, memory, recogniser, place
    gc.collect()
    assert found.matches[0].dissimilarity == 0 and found.matches[0].view == 4
    assert len(copy) == size and header.shape == (32, 15)
    assert matches[0].name.endswith(".png") and abs(position.x_m) < 100


def test_files(office, tmp_path):
    file = panonav.MemoryFile(office / "office.panonav")
    assert file.verify() == [] and file.info().views == len(file.names())
    assert file.find(file.names()[0]) == file.named(file.names()[0]) == file.named("1")
    assert file.thumbnail(1).startswith(b"\x89PNG")  # as small as the panorama, so exact
    with pytest.raises(panonav.FileError, match="has no view of the name"):
        file.named("nowhere")
    with pytest.raises(panonav.Error):
        file.rename(1, "other")  # opened for reading
    for wrong in ("missing.panonav", __file__):
        with pytest.raises(OSError) as caught:
            panonav.MemoryFile(wrong)
        assert str(wrong) in str(caught.value)
    with pytest.raises(panonav.FileError):
        panonav.Dataset(tmp_path / "missing")
    with pytest.raises(panonav.FileError, match="PictureSource"):
        panonav.Dataset(tmp_path)


def test_areas_around_a_position():
    assert panonav.areas_around(5.0, -5.0, 0.0) == [(0.0, -1.0)]
    assert len(panonav.areas_around(5.0, 5.0, 10.0)) == 9
    with pytest.raises(panonav.ContractError, match="radius_m"):
        panonav.areas_around(0.0, 0.0, -1.0)


def test_synchronise_memory(office, tmp_path):
    """As the command does it, with a server in a folder."""
    def memory_of(name):
        path = tmp_path / name
        shutil.copy(office / "office.panonav", path)
        return path
    file = memory_of("one.panonav")
    with pytest.raises(panonav.ContractError, match="address of a memory on a server"):
        panonav.synchronise_memory(file, str(tmp_path / "two.panonav"))
    server = pathlib.Path(__file__).parents[2] / "apps/panonav/panonav-postgresql"
    started = subprocess.run([server, tmp_path / "s", "start"], capture_output=True, text=True)
    if started.returncode:
        pytest.skip(started.stderr)
    try:
        address = f"postgresql://panonav@/panonav?host={tmp_path / 's'}&memory=office"
        try:
            report = panonav.synchronise_memory(file, address)
        except panonav.FileError as error:
            pytest.skip(str(error)) if "without PostgreSQL" in str(error) else pytest.fail(str(error))
        views = panonav.MemoryFile(file).names()
        assert report.uploaded == report.views == len(views) > 10 and report.downloaded == 0
        reported, = command_json("synchronise", tmp_path / "two.panonav", address)
        assert reported["downloaded"] == len(views)
        part = panonav.synchronise_memory(tmp_path / "part.panonav", address, panonav.areas_around(900.0, 0.0, 1.0))
        assert part.downloaded == part.views == 0
        again = panonav.synchronise_memory(memory_of("three.panonav"), address)
        assert again.adopted == len(views) and again.uploaded == 0 and not again.restored
    finally:
        subprocess.run([server, tmp_path / "s", "stop"], check=True)
    with pytest.raises(panonav.FileError, match="cannot be opened"):
        panonav.synchronise_memory(file, address)


def test_inputs_are_opened_as_by_the_command(office, tmp_path):
    run, source = office / "query_run", panonav.Dataset(office / "query_run").source
    with pytest.raises(panonav.OptionError, match="dataset.toml.*leave out 'source'"):
        panonav.Dataset(run, source)
    with pytest.raises(panonav.OptionError, match="leave out 'source'"):
        panonav.memorise(tmp_path / "new.panonav", panonav.Dataset(run), source)
    with pytest.raises(panonav.OptionError, match="has no topics; leave out the option imu_topic"):
        panonav.Dataset(run, imu_topic="/imu")
    photos = tmp_path / "photos"
    (photos / "within").mkdir(parents=True)
    for place in (photos, photos / "within"):
        shutil.copy(run / panonav.Dataset(run).entries[0].file, place / "view.png")
    (photos / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.warns(UserWarning) as warned:
        assert len(panonav.Dataset(photos, source)) == 1
    assert [str(each.message) for each in warned] == ["left out, no image: notes.txt",
                                                      "left out, folders within: within/"]
    with pytest.warns(UserWarning, match="notes.txt"):
        assert len(panonav.Dataset(photos, source, recursive=True)) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match="notes.txt"):
            panonav.Dataset(photos, source)
    # A memory knows how pictures lie that say nothing.
    memory = tmp_path / "office.panonav"
    shutil.copy(office / "office.panonav", memory)
    with pytest.warns(UserWarning):
        assert panonav.memorise(memory, photos).appended == 1


def with_pitch(png, degrees):
    """The same PNG with GPano data (XMP in a chunk iTXt behind the header)."""
    xmp = ('<rdf:Description xmlns:GPano="http://ns.google.com/photos/1.0/panorama/" '
           f'GPano:ProjectionType="equirectangular" GPano:PosePitchDegrees="{degrees}"/>')
    data = b"iTXtXML:com.adobe.xmp" + b"\0" * 5 + xmp.encode()
    chunk = struct.pack(">I", len(data) - 4) + data + struct.pack(">I", zlib.crc32(data))
    head = 8 + 25
    return png[:head] + chunk + png[head:]


def test_gpano_data_are_used_unless_they_are_ignored(office, tmp_path):
    run = panonav.Dataset(office / "query_run")
    photo = tmp_path / "photo.png"
    photo.write_bytes(with_pitch((office / "query_run" / run.entries[0].file).read_bytes(), 10))
    with pytest.warns(UserWarning, match="1 of 1 images are levelled.*ignore_gpano"):
        levelled = panonav.Dataset(photo, run.source)
    assert levelled.entries[0].tilt == pytest.approx((0, -math.radians(10)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert panonav.Dataset(photo, run.source, ignore_gpano=True).entries[0].tilt is None
    with pytest.raises(panonav.OptionError, match="leave out their options"):
        panonav.Dataset([photo], run.source, ignore_gpano=True)


def estimated(estimate):
    return estimate.name, estimate.state, estimate.pose, estimate.spread_m


def test_lists_of_images_are_recordings(office, tmp_path):
    run = panonav.Dataset(office / "query_run")
    paths = [office / "query_run" / entry.file for entry in run.entries]
    arrays = [panonav.read_image(path) for path in paths]
    recogniser = panonav.PlaceRecogniser(office / "office.panonav")
    expected = [recogniser.localise(path).to_dict() for path in paths]
    for images in (paths, [str(path) for path in paths], tuple(paths), [panonav.Observation(path) for path in paths]):
        assert [place.to_dict() for place in recogniser.localise_all(images)] == expected
    unnamed = recogniser.localise_all(arrays)
    assert [place.name for place in unnamed[:2]] == ["image_00000", "image_00001"]
    assert [place.to_dict() | {"name": ""} for place in unnamed] == [place | {"name": ""} for place in expected]
    assert recogniser.localise_all(arrays[0])[0].heading_rad == recogniser.localise(arrays[0]).heading_rad

    guide = panonav.HomingGuide(office / "office.panonav", "view_00003.png")
    assert [way.to_dict() for way in guide.home_all(paths)] == [guide.home(path).to_dict() for path in paths]
    two = [panonav.Dataset(images, run.source) for images in (paths, arrays)]
    assert [len(one) for one in two] == [len(run)] * 2 and two[0][1].name == run[1].name
    for number, images in enumerate((paths, arrays, [one for one in run])):
        memory = tmp_path / f"{number}.panonav"
        assert panonav.memorise(memory, images, run.source).appended == len(paths)
        assert panonav.memorise(memory, images).known_before == len(paths)
    assert panonav.MemoryFile(tmp_path / "0.panonav").names() == [path.name for path in paths]
    poses = panonav.MemoryFile(tmp_path / "2.panonav").load().poses()
    assert numpy.allclose(poses[:, 0], [entry.pose.x_m for entry in run.entries])
    drive = [one for one in panonav.Dataset(office / "drive")]
    ends = [panonav.Tracker(office / "office.panonav").track(images)[-1] for images in (drive, office / "drive")]
    assert estimated(ends[0]) == estimated(ends[1])
    for wrong in ([], [panonav.Panorama(numpy.zeros((4, 8), numpy.float32))], [None], arrays):
        with pytest.raises(panonav.ContractError):
            panonav.memorise(tmp_path / "new.panonav", wrong)
    assert not (tmp_path / "new.panonav").exists()


def test_a_tracker_reads_motion_from_images_without_odometry(office):
    bare = [panonav.Observation(one.picture, name=one.name) for one in panonav.Dataset(office / "drive")]
    steps, run = panonav.Tracker(office / "office.panonav"), panonav.Tracker(office / "office.panonav")
    one_by_one = [estimated(steps.observe(one)) for one in bare]
    assert one_by_one == [estimated(one) for one in run.track(bare)]
    still = panonav.Tracker(office / "office.panonav")
    assert still.length_unit == panonav.PlaceRecogniser(office / "office.panonav").length_unit == "m"
    with pytest.raises(panonav.FileError, match="is open for reading only"):
        panonav.MemoryFile(office / "office.panonav").remove([1])
    still.move_to((0, 0, 0))
    assert still.observe(bare[0])
    still.move_to((0, 0, 0))  # odometry, so the images tell no motion
    assert estimated(still.observe(bare[1])) != one_by_one[1]


def errors_of_every_kind(office, folder):
    """Calls that must fail, and the built-in class of their error."""
    (folder / "text.panonav").write_text("no memory")
    (folder / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    memory, image = office / "office.panonav", office / "query_run" / panonav.Dataset(office / "query_run").entries[0].file
    recogniser = panonav.PlaceRecogniser(memory)
    yield OSError, lambda: panonav.localise(folder / "none.panonav", image)
    yield OSError, lambda: panonav.localise(folder / "text.panonav", image)
    yield OSError, lambda: panonav.localise(folder, image)
    yield OSError, lambda: panonav.localise(memory, folder / "none.png")
    yield OSError, lambda: panonav.localise(memory, folder / "broken.png")
    yield OSError, lambda: panonav.memorise(folder / "new.panonav", folder / "no_run")
    yield OSError, lambda: panonav.memorise(folder / "no_folder" / "new.panonav", office / "query_run")
    yield OSError, lambda: panonav.Dataset(folder / ("n" * 300))
    yield OSError, lambda: panonav.MemoryFile(memory).remove([1])
    yield OSError, lambda: panonav.HomingGuide(memory, "nowhere")
    yield OSError, lambda: panonav.read_image(folder)
    yield OSError, lambda: panonav.read_camera(folder / "none.toml")
    yield ValueError, lambda: panonav.localise(memory, image, topp=3)
    yield ValueError, lambda: panonav.localise(memory, image, top=-3)
    yield ValueError, lambda: panonav.localise(image, memory)
    yield ValueError, lambda: panonav.memorise(office / "memory_run", memory)
    yield ValueError, lambda: panonav.HomingGuide("view_00003.png", memory)
    yield ValueError, lambda: panonav.localise(3, image)
    yield ValueError, lambda: panonav.Tracker(None)
    yield ValueError, lambda: recogniser.localise(3)
    yield ValueError, lambda: recogniser.localise(numpy.zeros((4, 8), numpy.uint8))
    yield ValueError, lambda: recogniser.localise(numpy.zeros((32, 128), numpy.float32))
    yield ValueError, lambda: recogniser.localise_all(3)
    yield ValueError, lambda: panonav.find_mirror(str(image))
    yield ValueError, lambda: panonav.PictureSource("panorma")
    yield ValueError, lambda: panonav.SimulatedWorld("offce")


def test_every_error_is_an_error_of_panonav_in_one_line(office, tmp_path):
    for number, (kind, call) in enumerate(errors_of_every_kind(office, tmp_path)):
        with pytest.raises(panonav.Error) as caught:
            call()
        line = str(caught.value)
        assert isinstance(caught.value, kind) and line and "\n" not in line, (number, line)
    with pytest.raises(panonav.OptionError, match="the memory comes first: 'a.panonav', 'run'"):
        panonav.make_map("run", "a.panonav")
    with pytest.raises(panonav.OptionError, match="the memory comes first: 'a.panonav', 'run'"):
        panonav.record_route("run", "a.panonav")
