"""Arrays of any layout are read right or refused; what is handed out looks at the object itself."""
import ast
import gc
import pathlib
import re
import subprocess

import numpy
import pytest

import panonav

VALUES = numpy.random.default_rng(1).random((16, 64), dtype=numpy.float32)


def test_panorama_takes_any_strides_and_never_misreads():
    whole = panonav.Panorama(VALUES)
    assert numpy.array_equal(whole.values, VALUES)
    for array in (VALUES.T.copy().T, numpy.asfortranarray(VALUES), VALUES[::-1][::-1]):
        assert panonav.Panorama(array) == whole
    assert numpy.array_equal(panonav.Panorama(VALUES[1::3, ::2]).values, VALUES[1::3, ::2])
    assert numpy.array_equal(panonav.Panorama(VALUES[:, ::-1]).values, VALUES[:, ::-1])
    locked = VALUES.copy()
    locked.flags.writeable = False
    assert panonav.Panorama(locked) == whole


def test_panorama_of_bytes_is_zero_to_one():
    pixels = numpy.arange(64, dtype=numpy.uint8).reshape(4, 16) * 4
    assert numpy.array_equal(panonav.Panorama(pixels).values, pixels.astype(numpy.float32) / numpy.float32(255))


@pytest.mark.parametrize("array, line", [
    (VALUES.astype(numpy.float64), "dtype of values is float64; allowed: float32, or uint8 for 0 to 1"),
    (VALUES.astype(">f4"), "dtype of values"),
    (VALUES.astype(numpy.int32), "dtype of values"),
    (VALUES[0], "shape of values is (64,); allowed: (rows, columns)"),
    (VALUES[None], "shape of values"),
    (numpy.zeros((0, 8), numpy.float32), "rows"),
    (numpy.zeros((8, 0), numpy.float32), "columns"),
    (numpy.full((4, 8), numpy.nan, numpy.float32), "finite"),
    ([[1, 2], [3, 4]], "values is list; allowed: a numpy array"),
    (None, "allowed: a numpy array"),
])
def test_panorama_refuses(array, line):
    with pytest.raises(panonav.ContractError) as caught:
        panonav.Panorama(array)
    assert isinstance(caught.value, ValueError)
    assert line in str(caught.value) and "\n" not in str(caught.value)


def test_pictures_of_any_layout_are_the_same():
    pixels = numpy.random.default_rng(2).integers(0, 255, (32, 64, 3), dtype=numpy.uint8)
    reader = panonav.PanoramaReader(panonav.PictureSource("panorama"), (16, 64))
    right = reader.convert(pixels)
    padded = numpy.zeros((32, 80, 3), numpy.uint8)
    padded[:, 8:72] = pixels
    planes = numpy.ascontiguousarray(numpy.moveaxis(pixels, 2, 0))
    upside_down = numpy.ascontiguousarray(pixels[::-1])
    for same in (padded[:, 8:72], numpy.moveaxis(planes, 0, 2), upside_down[::-1], numpy.asfortranarray(pixels)):
        assert reader.convert(same) == right


@pytest.mark.parametrize("picture", [
    numpy.zeros((4, 8), numpy.float32), numpy.zeros((4, 8, 2), numpy.uint8), numpy.zeros(8, numpy.uint8),
    numpy.zeros((0, 8), numpy.uint8), numpy.zeros((4, 8), bool), numpy.zeros((4, 8), numpy.int32),
    numpy.zeros((2, 4, 8, 3), numpy.uint8), "missing.png", 3, None, [[1, 2], [3, 4]],
])
def test_wrong_pictures_are_refused_in_one_line(picture):
    with pytest.raises((panonav.ContractError, panonav.FileError)) as caught:
        panonav.Observation(picture)
    assert "\n" not in str(caught.value)


def test_pixels_of_16_bit_and_of_four_channels_are_those_of_a_file():
    grey = numpy.random.default_rng(3).integers(0, 256, (8, 24), dtype=numpy.uint8)
    colour = numpy.random.default_rng(4).integers(0, 256, (8, 24, 3), dtype=numpy.uint8)
    alpha = numpy.full((8, 24, 1), 7, numpy.uint8)
    for same, right in ((grey[..., None], grey), (numpy.dstack([colour, alpha]), colour),
                        (grey.astype(numpy.uint16) * 257, grey), (colour.astype(numpy.uint16) * 257, colour),
                        (grey // 2 * numpy.uint16(257) + numpy.uint16(120), grey // 2)):
        assert numpy.array_equal(panonav.Observation(same).picture, right)


def test_pil_images_are_read_as_their_files(tmp_path):
    """Whoever opens a file with PIL gets the same answer as with its path."""
    image = pytest.importorskip("PIL.Image")
    random = numpy.random.default_rng(5)
    grey, colour = (random.integers(0, 256, shape, dtype=numpy.uint8) for shape in ((8, 24), (8, 24, 4)))
    wide = random.integers(0, 65536, (8, 24), dtype=numpy.uint16)
    kinds = {"1": image.fromarray(grey).convert("1"), "L": image.fromarray(grey), "RGBA": image.fromarray(colour),
             "RGB": image.fromarray(colour[..., :3].copy()), "LA": image.fromarray(colour).convert("LA"),
             "P": image.fromarray(colour[..., :3].copy()).convert("P"), "I;16": image.fromarray(wide)}
    for mode, one in kinds.items():
        path = tmp_path / f"{mode[0]}.png"
        one.save(path)
        read = panonav.read_image(path)
        for same in (one, image.open(path), path, str(path)):
            assert numpy.array_equal(panonav.Observation(same).picture, read), mode
    turned = image.Exif()
    turned[0x0112] = 6  # the camera was held upright
    image.fromarray(grey).save(tmp_path / "turned.jpg", exif=turned)
    upright = panonav.Observation(image.open(tmp_path / "turned.jpg")).picture
    assert upright.shape == (24, 8) == panonav.read_image(tmp_path / "turned.jpg").shape
    with pytest.raises(panonav.ContractError, match="dtype of picture is float32"):
        panonav.Observation(image.fromarray(VALUES))


def test_what_is_handed_out_is_read_only_and_outlives_its_owner():
    panorama = panonav.Panorama(VALUES)
    values = panorama.values
    assert values.base is panorama
    with pytest.raises(ValueError):
        values[0, 0] = 1
    signature = panonav.compute_signature(panorama, 8)
    magnitudes, phases = signature.magnitudes, signature.packed(1.0).phases
    assert magnitudes.shape == (8, 16) and phases.dtype == numpy.uint8
    before = values.copy(), magnitudes.copy(), phases.copy()
    del panorama, signature
    gc.collect()
    for array, kept in zip((values, magnitudes, phases), before):
        assert numpy.array_equal(array, kept)


def test_signature_is_the_fourier_transform():
    signature = panonav.compute_signature(panonav.Panorama(VALUES), 8)
    expected = 2 / 64 * numpy.abs(numpy.fft.rfft(VALUES, axis=1))[:, :8].T
    assert numpy.allclose(signature.magnitudes, expected, atol=1e-5)
    again = panonav.FourierSignature(signature.magnitudes, signature.phases_rad)
    assert again == signature
    assert panonav.PackedSignature(signature.packed(0.5).magnitudes, signature.packed(0.5).phases) == signature.packed(0.5)
    with pytest.raises(panonav.ContractError, match="shape of phases_rad"):
        panonav.FourierSignature(signature.magnitudes, signature.phases_rad[:4])
    with pytest.raises(panonav.ContractError, match="components"):
        panonav.compute_signature(panonav.Panorama(VALUES), 33)


def test_compass_reads_a_turn():
    panorama = panonav.Panorama(VALUES)
    reading = panonav.compass(panonav.compute_signature(panorama.turned(16)), panonav.compute_signature(panorama))
    assert reading.heading_rad == pytest.approx(numpy.pi / 2, abs=1e-4)
    flat = panonav.compute_signature(panonav.Panorama(numpy.zeros((16, 64), numpy.float32)))
    assert panonav.compass(flat, flat) is None


def test_options_have_ranges_names_and_types():
    panorama = panonav.Panorama(VALUES)
    assert panonav.preprocess(panorama, remove_mean=False, normalise_gain=False) == panorama
    for wrong, line in [({"remove_men": True}, "there is no option 'remove_men'; did you mean 'remove_mean'?"),
                        ({"zzz": 1}, "there is no option 'zzz'; allowed: masked_rows_top"),
                        ({"masked_rows_top": -1}, "masked_rows_top is -1; allowed: >= 0"),
                        ({"masked_rows_top": 1.5}, "masked_rows_top is 1.5; allowed: whole numbers"),
                        ({"remove_mean": 1}, "remove_mean is 1; allowed: True, False")]:
        with pytest.raises(ValueError) as caught:
            panonav.preprocess(panorama, **wrong)
        assert line in str(caught.value)
    assert "masked_rows_top: int = 0" in panonav.preprocess.__doc__


def test_camera_projects_and_unwraps(tmp_path):
    camera = panonav.Camera("hyperboloidal", (320, 240), {"focal_length_px": 100.0}, centre=(160, 120),
                            rim_radius_px=110, inner_radius_px=15)
    pixel = camera.project((1, 0, 0))
    assert camera.unproject(pixel) == pytest.approx((1, 0, 0), abs=1e-9)
    assert camera.project((0, 0, 1)) is None
    unwarper = panonav.Unwarper(camera, rows=20, columns=64)
    panorama = unwarper.unwrap(numpy.full((240, 320, 3), 128, numpy.uint8))
    assert numpy.allclose(panorama.values, 128 / 255, atol=0.01)
    assert panorama.elevations == unwarper.elevations
    with pytest.raises(panonav.ContractError):
        unwarper.unwrap(numpy.zeros((4, 8), numpy.uint8))
    path = tmp_path / "raw.png"
    panonav.write_png(path, numpy.full((240, 320, 3), 128, numpy.uint8))
    assert unwarper.unwrap(path) == unwarper.unwrap(str(path)) == unwarper.unwrap(panonav.Observation(path)) == panorama
    with pytest.raises(panonav.ContractError, match="nonsense"):
        panonav.Camera("hyperboloidal", (320, 240), {"nonsense": 1})


def test_structured_poses_are_rows():
    rows = numpy.array([[i, 0.5 * i, 1.0, 0.1] for i in range(5)])
    poses = panonav.structured_poses(rows)
    assert poses.dtype.names == ("stamp_s", "x_m", "y_m", "heading_rad") and poses.shape == (5,)
    assert numpy.shares_memory(poses, rows) and numpy.array_equal(poses["x_m"], rows[:, 1])
    assert panonav.trajectory_error(poses, rows, align="none").position_m.rms == 0
    assert panonav.structured_poses(rows[:, 1:])["heading_rad"][2] == 0.1
    assert panonav.align(panonav.structured_poses(rows[:, 1:3]), rows[:, 1:3]).rms_m == pytest.approx(0)
    for wrong in (lambda: panonav.structured_poses(rows[0]), lambda: panonav.align(poses, poses)):
        with pytest.raises(panonav.ContractError):
            wrong()


def test_stubs_know_every_name_and_option():
    text = (pathlib.Path(panonav.__file__).parent / "_core.pyi").read_text()
    reported = {node.name for node in ast.parse(text).body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert reported == {name for name in vars(panonav._core) if name[0] != "_"} - {"camera_models", "scenes"}
    assert "top: int = 10" in text and "::" not in text and "_core" not in text.replace("python/make_stubs", "")


def texts_of(name, value):
    """Returns the docstring without signatures: for a function one text for each overload."""
    doc = "" if value.__doc__ in (None, type(value).__doc__) else value.__doc__
    texts = re.split(rf"^(?:\d+\. )?{name}\(.*$", doc.replace("Overloaded function.", ""), flags=re.MULTILINE)
    return [text.strip() for text in texts[2 if len(texts) > 2 else len(texts) - 1:]]


def test_every_public_name_has_a_text():
    # camera_models and scenes are tuples, which hold no text: comments of __init__.py, which Sphinx reads, are theirs.
    reported = re.findall(r"^#: .+\n(\w+): tuple$", pathlib.Path(panonav.__file__).read_text(), re.MULTILINE)
    names = [(name, name, value) for name, value in vars(panonav).items() if name[0] != "_" and name not in reported]
    for kind, _, value in names[:]:
        if isinstance(value, type):
            names += [(f"{kind}.{name}", name, member) for name, member in vars(value).items()
                      if name[0] != "_" or name == "__init__"]
    assert [whole for whole, name, value in names if not all(texts_of(name, value))] == []
    assert len(names) > 500


def test_the_source_archive_holds_what_the_build_reads():
    root = pathlib.Path(__file__).resolve().parents[2]
    read = set(re.findall(r"add_subdirectory\(([a-z0-9]+)", (root / "CMakeLists.txt").read_text())) - {"apps", "bench", "lab", "tests"}
    packed = re.findall(r"^graft (\w+)$", (root / "MANIFEST.in").read_text(), re.MULTILINE)
    assert read | {"cmake"} == set(packed) and "src" in packed


def test_a_wheel_links_what_its_page_says():
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text()
    folder = pathlib.Path(panonav.__file__).parent
    for binary in (panonav._core.__file__,):
        printed = subprocess.run(["readelf", "-d", binary], capture_output=True, text=True, check=True).stdout
        needed = re.findall(r"NEEDED.*\[(lib[\w+-]*?)\d?\.", printed)
        assert len(needed) > 8 and [name for name in needed if name not in page] == []
