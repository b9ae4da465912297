#!/usr/bin/env python3
"""Uses an exported page in Chromium as a person does, and compares its answers with the command's.

test_page.py PANONAV SOURCE FOLDER [--pictures FOLDER]: asks with pictures of known and of unknown places and with a
camera, without a network, makes a memory from a folder of pictures, and downloads it for the command. Fails, too, if
the page asks for anything beside its folder, if text has little contrast, or if a narrow screen has to be scrolled
sideways. --pictures: also writes a picture of each state. Exits with 77, skipped, without the tools."""
import base64
import functools
import http.server
import json
import pathlib
import shutil
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "viewer"))
from browser import CONTRAST, PATIENCE_S, PROGRAM, Browser  # noqa: E402

SCREENS = {"desk": {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False},
           "phone": {"width": 420, "height": 860, "deviceScaleFactor": 1, "mobile": True},
           "narrow": {"width": 360, "height": 740, "deviceScaleFactor": 1, "mobile": True}}
USUAL_PHONE_DEG = 65  # worker.js
MIN_CONTRAST = 4.5  # WCAG 2, level AA


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder: pathlib.Path) -> http.server.ThreadingHTTPServer:
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(QuietHandler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


class Page(Browser):
    """The page in a browser, whose states are checked and drawn."""

    def __init__(self, folder: pathlib.Path, pictures: pathlib.Path | None, *arguments: str):
        super().__init__(folder, *arguments)
        self.pictures, self.states = pictures, 0
        self.call("DOM.enable")

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)
        self.wait("document.body && document.body.dataset.ready === 'true'")

    def choose(self, name: str, *files: pathlib.Path) -> None:
        """Gives files to an input."""
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=f"#{name}")["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(file) for file in files])

    def drop(self, file: pathlib.Path) -> None:
        """Drops a file or folder on the page."""
        data = {"items": [], "files": [str(file)], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=100, y=100, data=data)

    def click(self, selector: str) -> None:
        self.ask(f"document.querySelector({json.dumps(selector)}).click()")

    def text(self, selector: str) -> str:
        return self.ask(f"document.querySelector({json.dumps(selector)}).innerText")

    def wait_until_idle(self) -> None:
        self.wait("!document.body.hasAttribute('aria-busy')")

    def check(self, state: str) -> None:
        """Checks contrast and width of a state in both schemes, and draws it on all screens."""
        self.states += 1
        for screen, size in SCREENS.items():
            for dark in (False, True):
                if self.pictures is None and (screen == "phone" or (screen == "desk" and dark)):
                    continue
                self.show(size, dark)
                self.settle()
                found = self.ask(CONTRAST)
                assert found["ratio"] >= MIN_CONTRAST, (state, screen, dark, found)
                width = self.ask("document.documentElement.scrollWidth")
                assert width <= size["width"], (state, screen, width)
                if self.pictures is not None:
                    name = f"{self.states:02}_{state}_{screen}_{'dark' if dark else 'light'}.png"
                    image = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"]
                    (self.pictures / name).write_bytes(base64.b64decode(image))


def ask_known(page: Page, picture: pathlib.Path, expected: dict) -> None:
    """The page's answer is the command's."""
    page.ask("document.querySelector('#answer').hidden = true")
    page.choose("query", picture)
    page.wait("!document.querySelector('#answer').hidden")
    page.wait_until_idle()
    place = expected["matches"][0]["file"].removesuffix(".png")
    assert page.text("#answer-title") == f"You are near {place}", (page.text("#answer"), expected)
    x, y = (f"{expected['position'][key]:.2f}" for key in ("x_m", "y_m"))
    assert f"x {x}, y {y} m" in page.text("#answer"), (page.text("#answer"), expected)
    assert page.text("#status").startswith(f"You are near {place}.")  # for screen readers


def ask_unknown(page: Page, picture: pathlib.Path) -> None:
    page.choose("query", picture)
    page.wait("document.querySelector('#answer').className === 'unknown'")
    page.wait_until_idle()
    assert page.text("#answer-title") == "I do not know this place"


def ask_wrong(page: Page, picture: pathlib.Path, reason: str) -> None:
    """A picture that cannot be compared is refused with a reason."""
    page.choose("query", picture)
    page.wait("document.querySelector('#answer').className === 'error'")
    page.wait_until_idle()
    assert reason in page.text("#answer-body"), page.text("#answer")


def ask_with_photo(page: Page, photo: pathlib.Path, expected: dict) -> None:
    """A picture such as a phone's gets the command's answer, and the page says how wide it takes it to be."""
    ask_known(page, photo, expected)
    assert f"shows {USUAL_PHONE_DEG}°, as most phones do" in page.text("#answer"), page.text("#answer")
    page.check("photo")
    page.ask("document.querySelector('#angle').value = 30")
    page.choose("query", photo)
    page.wait("document.querySelector('#answer').innerText.includes('shows 30°, as you say')")
    page.wait_until_idle()
    page.ask("document.querySelector('#angle').value = ''")


def follow_camera(page: Page) -> None:
    """The camera shows the memory's own views, one after the other."""
    page.click("input[value=camera]")
    page.wait("document.querySelector('#video').videoWidth > 0")
    page.wait_until_idle()
    page.click("#live")
    page.click("#where")
    page.wait("document.querySelector('#ask-hint').dataset.rate > 0 && document.querySelector('#answer').className === 'known'")
    page.wait("document.querySelectorAll('#map .trail').length > 0")
    page.check("live")
    page.click("#where")
    page.wait_until_idle()
    assert page.text("#where") == "Where am I?"
    page.click("input[value=picture]")


def use_keyboard(page: Page) -> None:
    """The tabulator leads from the choice of the source to the large button and on to the places."""
    page.ask("document.activeElement.blur(); document.querySelector('input[value=picture]').focus()")
    seen = []
    for _ in range(12):
        page.key("Tab")
        seen.append(page.ask("document.activeElement.id || document.activeElement.closest('[id]').id"))
    assert seen[0] == "where" and "gallery" in seen, seen


def make_memory(page: Page, views: pathlib.Path, downloads: pathlib.Path) -> pathlib.Path:
    """Makes a memory of a folder of pictures that is dropped on the page, and downloads it."""
    page.drop(views)
    page.wait("document.querySelector('#status').textContent.startsWith('The memory')")
    page.wait_until_idle()
    page.session, session = None, page.session
    page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(downloads))
    page.session = session
    page.click(f"#memory-list [aria-label='Download {views.name}']")
    file = downloads / f"{views.name}.panonav"
    end = time.monotonic() + PATIENCE_S
    while not file.exists():
        assert time.monotonic() < end, page.text("body")
        time.sleep(0.05)
    return file


def make_inputs(panonav: pathlib.Path, folder: pathlib.Path) -> list[dict]:
    """Recordings, memories, the page of one, and the command's answers to two queries and a photo."""
    def run(*arguments: object) -> str:
        return subprocess.run([panonav, *arguments, "-q"], check=True, capture_output=True, text=True).stdout

    run("simulate", "office", folder / "views", "--kind", "panorama", "--grid", "0.5")
    run("simulate", "office", folder / "queries", "--kind", "panorama", "--random", "2", "--seed", "7")
    run("simulate", "lab", folder / "elsewhere", "--kind", "panorama", "--random", "1", "--seed", "1")
    run("simulate", "office", folder / "walk", "--kind", "equirectangular", "--path", "walk", "--poses", "12",
        "--spacing-m", "0.3", "--columns", "512", "--seed", "5")
    (folder / "photos").mkdir()
    subprocess.run(["ffmpeg", "-v", "error", "-i", folder / "walk/view_00006.jpg", "-vf",
                    f"v360=e:flat:h_fov={USUAL_PHONE_DEG}:v_fov=51:w=640:h=480", folder / "photos/photo.png"], check=True)
    (folder / "broken.png").write_bytes(b"no picture")
    run("memorise", folder / "office.panonav", folder / "views", "--narrow")
    run("memorise", folder / "plain.panonav", folder / "views")
    run("export", folder / "office.panonav", "--web", folder / "page", "--pictures", folder / "views")
    subprocess.run(["ffmpeg", "-v", "error", "-framerate", "10", "-i", folder / "views/view_%05d.png", "-frames:v", "60", "-vf",
                    "format=yuv420p", folder / "camera.y4m"], check=True)
    photos = run("localise", folder / "office.panonav", folder / "photos", "--json", "--field-of-view", str(USUAL_PHONE_DEG))
    queries = run("localise", folder / "office.panonav", folder / "queries", "--json")
    return [json.loads(line) for line in (queries + photos).splitlines()]


def use_exported_page(page: Page, folder: pathlib.Path, address: str, expected: list[dict]) -> None:
    page.open(address)
    page.check("start")
    ask_known(page, folder / "queries" / expected[0]["file"], expected[0])
    page.check("known")
    ask_unknown(page, next((folder / "elsewhere").glob("*.png")))
    page.check("unknown")
    ask_with_photo(page, folder / "photos/photo.png", expected[-1])
    ask_wrong(page, folder / "broken.png", "broken.png is not a picture")
    page.check("wrong")
    use_keyboard(page)
    follow_camera(page)
    page.choose("memory", folder / "plain.panonav")
    page.wait("document.querySelector('#subtitle').innerText.startsWith('plain')")
    page.wait_until_idle()
    ask_wrong(page, folder / "photos/photo.png", "360")


def use_empty_page(page: Page, folder: pathlib.Path, address: str, panonav: pathlib.Path) -> None:
    page.open(address + "index.html#new")
    page.ask("location.reload()")
    page.wait("document.body && document.body.dataset.ready === 'true' && !document.querySelector('#make-details').hidden")
    page.check("empty")
    made = make_memory(page, folder / "walk", folder)
    page.check("made")
    walk = sorted(path.name for path in (folder / "walk").glob("*.jpg"))
    subprocess.run([panonav, "verify", made, "-q"], check=True, stdout=subprocess.DEVNULL)
    lines = subprocess.run([panonav, "localise", made, folder / "walk", "--json", "-q"], check=True, capture_output=True, text=True).stdout
    answers = [json.loads(line) for line in lines.splitlines()]
    assert [answer["file"] for answer in answers] == walk and len(walk) == 12, answers
    assert all(answer["known"] and answer["matches"][0]["file"] == answer["file"] for answer in answers), answers


def main() -> int:
    panonav, source, folder = map(pathlib.Path, sys.argv[1:4])
    pictures = pathlib.Path(sys.argv[5]) if len(sys.argv) > 5 else None
    if PROGRAM is None or shutil.which("ffmpeg") is None:
        print("skipped: there is no chromium" if PROGRAM is None else "skipped: there is no ffmpeg")
        return 77
    if not (source / "build/web/bin/panonav_web.wasm").exists():
        print("skipped: there is no build/web/bin (see tests/web/test_web.py)")
        return 77
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
    expected = make_inputs(panonav, folder)
    server = serve(folder / "page")
    address = f"http://127.0.0.1:{server.server_port}/"
    page = Page(folder / "profile", pictures, "--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream",
                f"--use-file-for-fake-video-capture={folder / 'camera.y4m'}")
    try:
        page.show(SCREENS["desk"])
        use_exported_page(page, folder, address, expected)
        use_empty_page(page, folder, address, panonav)
        page.wait("!!navigator.serviceWorker.controller")
        assert not page.errors, page.errors
        server.shutdown()
        server.server_close()
        page.open(address)  # without the server
        ask_known(page, folder / "queries" / expected[1]["file"], expected[1])
        shown = "document.querySelector('#answer img')"
        page.wait(f"{shown} && {shown}.complete && {shown}.naturalWidth > 0")  # kept with the page or in the memory
        errors = [error for error in page.errors if "ERR_CONNECTION_REFUSED" not in error and "/pictures/" not in error]
        assert not errors, errors
        assert all(url.startswith((address, "blob:")) for url in page.requests), page.requests
    finally:
        page.end()
    print(f"{page.states} states; answers as the command's; a memory that the command reads; without the server, too")
    return 0


if __name__ == "__main__":
    sys.exit(main())
