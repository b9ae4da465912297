#!/usr/bin/env python3
"""panonav serve as clients meet it that nobody here wrote: Python's http.client, and curl where it is installed; and
as strangers attack it: prints how many of 200 authorised requests were answered within a second.

Usage: test_serve.py PANONAV
"""
import base64
import contextlib
import html.parser
import http.client
import json
import multiprocessing
import os
import pathlib
import re
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse

HOSTILE = 200  # connections at a time
POST = b"POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\nContent-Length: 16000000\r\n"
# Words of a stranger once it is connected, and then again and again.
ATTACKS = [
    (b"", b""),  # nothing at all
    (b"GET /v1/mem", b"o"),  # a head without an end
    (POST + b"\r\n", b""),  # a body that does not come
    (POST + b"Expect: 100-continue\r\n\r\n", b"x"),
    (POST + b"Authorization: Bearer another-token-of-some-length\r\n\r\n", b"x" * 1000),
    (b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n", b""),  # stays after its answer
    (b"", b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n" * 10),
    (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"\0"),
]


def attack(address: tuple[str, int]) -> None:
    """Keeps up HOSTILE connections until it is killed."""
    selector = selectors.DefaultSelector()

    def connect(number: int) -> None:
        peer = socket.socket()
        peer.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            peer.connect(address)
        selector.register(peer, selectors.EVENT_READ, [number, ATTACKS[number % len(ATTACKS)][0]])

    for number in range(HOSTILE):
        connect(number)
    while os.getppid() == multiprocessing.parent_process().pid:
        for key, _ in selector.select(0.02):
            try:
                gone = not key.fileobj.recv(65536)
            except OSError:
                gone = True
            if gone:
                selector.unregister(key.fileobj)
                key.fileobj.close()
                connect(key.data[0])
        for key in list(selector.get_map().values()):
            with contextlib.suppress(OSError):
                number, unsaid = key.data
                key.fileobj.send(unsaid or ATTACKS[number % len(ATTACKS)][1])
                key.data[1] = b""


def serve_under_attack(place: urllib.parse.SplitResult, picture: bytes, token: str) -> None:
    """Authorised requests are answered, on new connections and on one that stays."""
    attacker = multiprocessing.get_context("spawn").Process(
        target=attack, args=((place.hostname, place.port),), daemon=True)
    attacker.start()
    headers = {"Authorization": f"Bearer {token}"}
    try:
        time.sleep(3)
        durations = []
        staying = http.client.HTTPConnection(place.hostname, place.port, timeout=60)
        for number in range(200):
            client = staying if number % 4 == 0 else http.client.HTTPConnection(place.hostname, place.port, timeout=60)
            began = time.monotonic()
            if number % 2:
                client.request("GET", "/v1/memories", headers=headers)
            else:
                client.request("POST", "/v1/memories/hall/localise", picture, headers)
            response = client.getresponse()
            response.read()
            assert response.status == 200, response.status
            durations.append(time.monotonic() - began)
            if client is not staying:
                client.close()
            time.sleep(0.02)
        durations.sort()
        print(f"serve at {HOSTILE} hostile connections: {sum(one < 1.0 for one in durations)} of {len(durations)} "
              f"authorised requests within 1 s; median {1e3 * durations[100]:.1f} ms, longest "
              f"{1e3 * durations[-1]:.1f} ms")
    finally:
        attacker.kill()
        attacker.join()


class Page(html.parser.HTMLParser):
    """The form, the texts and what a browser would load of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.fields: dict[str, str | None] = {}
        self.files = 0
        self.loaded: list[str] = []
        self.form: dict[str, str | None] = {}
        self.tags: set[str] = set()
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = dict(attributes)
        self.tags.add(tag)
        if tag == "form":
            self.form = values
        if tag == "input" and values["type"] == "file":
            self.files += 1
            assert "image/*" in values["accept"] and values["name"] == "image", values
        elif tag == "input" or (tag == "option" and ("selected" in values or "memory" not in self.fields)):
            self.fields["memory"] = values["value"]
        if address := values.get("src") or (values.get("href") if tag == "link" else None):
            self.loaded.append(address)

    def handle_data(self, data: str) -> None:
        self.text += data


def use_the_page(place: urllib.parse.SplitResult, pictures: dict[str, bytes], expected: dict[str, dict]) -> None:
    """A browser opens the bare address, sends the form, and loads what the answer shows; all without scripts."""
    client = http.client.HTTPConnection(place.hostname, place.port, timeout=120)

    def ask(method: str, path: str, body: bytes = b"", **headers: str) -> tuple[http.client.HTTPResponse, bytes]:
        client.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        response = client.getresponse()
        return response, response.read()

    browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"
    response, text = ask("GET", "/", Accept=browser)
    assert response.status == 200 and response.headers["Content-Type"] == "text/html; charset=utf-8"
    policy = response.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "script" not in policy, policy
    page = Page(text.decode())
    assert "script" not in page.tags and "style" not in page.tags and b"http" not in text, text
    assert page.form["method"] == "post" and page.form["enctype"] == "multipart/form-data" and page.files == 2
    for address in page.loaded:
        assert ask("GET", address)[0].status == 200, address
    for accept in ({}, {"Accept": "*/*"}):  # programs get the list as before
        assert json.loads(ask("GET", "/", **accept)[1])["memories"][0]["name"] == "office"

    def send(files: list[bytes], memory: str | None = page.fields["memory"], **headers: str) -> tuple[int, Page]:
        parts = [b'Content-Disposition: form-data; name="memory"\r\n\r\n' + str(memory).encode()]
        parts += [b'Content-Disposition: form-data; name="image"; filename="a;b.png"\r\nContent-Type: image/png\r\n\r\n' + one
                  for one in files]
        body = b"".join(b"--+x+\r\n" + part + b"\r\n" for part in parts) + b"--+x+--\r\n"
        headers = {"Content-Type": 'multipart/form-data; boundary="+x+"', "Accept": browser,
                   "Origin": place.geturl(), **headers}
        response, text = ask("POST", str(page.form["action"]), body, **headers)
        assert response.headers["Content-Type"] == "text/html; charset=utf-8", response.headers
        return response.status, Page(text.decode())

    for view, picture in pictures.items():
        for files in ([picture, b""], [b"", picture]):  # chosen, or photographed
            status, answer = send(files)
            assert status == 200 and ("Known place" in answer.text) == expected[view]["known"], answer.text
            best = expected[view]["matches"][0]["file"]
            assert best in answer.text and "Probability" in answer.text, answer.text
            if position := expected[view]["position"]:
                assert f"x {position['x_m']:.2f} m".replace("-0.00", "0.00") in answer.text, answer.text
            shown = [address for address in answer.loaded if "/views/" in address]
            response, thumbnail = ask("GET", shown[0])
            assert response.status == 200 and thumbnail.startswith(b"\xff\xd8\xff"), shown
            assert answer.fields["memory"] == "office" and answer.files == 2, "the form can be used again"
    good = next(iter(pictures.values()))
    for status, words, answer in (
            (422, "no image was chosen", send([b"", b""])), (422, "the image", send([b"no image"])),
            (404, "no memory <b>", send([good], "<b>")), (422, "the image", send([good[:200]]))):
        assert answer[0] == status and "No answer" in answer[1].text and words in answer[1].text, answer[1].text
        assert "b" not in answer[1].tags, "names are escaped"
    for body, kind in ((b"x", "text/plain"), (b"--x", "multipart/form-data; boundary=x"), (b"", "multipart/form-data"),
                       (b"--x\r\nContent-Disposition: form-data; name=\"image\"", "multipart/form-data; boundary=x")):
        response, text = ask("POST", "/", body, Content_Type=kind)
        assert response.status == 400 and b"is not the form" in text, text
    response, _ = ask("POST", "/", b"", Origin="http://other.example", Content_Type="multipart/form-data; boundary=x")
    assert response.status == 403
    client.close()
    if curl := shutil.which("curl"):  # whose forms nobody here wrote
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            file.write(good)
            file.flush()
            got = subprocess.run([curl, "--silent", "--fail", "--max-time", "120", "-F", "memory=office",
                                  "-F", f"image=@{file.name}", place.geturl() + "/"], check=True, capture_output=True)
            assert b"Most similar view" in got.stdout, got.stdout


def main() -> int:
    panonav = sys.argv[1]

    def run(*words: str) -> str:
        return subprocess.run([panonav, *words], check=True, capture_output=True, text=True).stdout

    def refusal(*words: str) -> str:
        result = subprocess.run([panonav, "serve", *words], capture_output=True, text=True, timeout=120)
        assert result.returncode == 2, result
        assert result.stderr.count("\n") == 1, result.stderr
        return result.stderr

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        recording, memory = folder / "run", folder / "office.panonav"
        run("simulate", "office", str(recording), "--random", "36", "--quiet")
        run("memorise", str(memory), str(recording), "--quiet")
        expected = {}
        for line in run("localise", str(memory), str(recording), "--json").splitlines():
            answer = json.loads(line)
            del answer["turned_rad"]
            view = answer.pop("file")
            expected[view] = {"memory": "office", **answer}

        assert "--listen is 99999; allowed: a port" in refusal(str(memory), "--listen", "99999")
        assert "allowed: a name that no other memory has" in refusal(str(memory), str(memory), "--listen", "0")
        assert "no such file" in refusal(str(folder / "none.panonav"), "--listen", "0").lower()
        assert "--max-held-views" in refusal(str(memory), "--listen", "0", "--max-held-views", "5")
        (folder / "short").write_text("secret\n")
        assert "is not a valid token" in refusal(str(memory), "--listen", "0", "--token-file", str(folder / "short"))
        (folder / "token").write_text("a token of some length".replace(" ", "-") + "\n")

        server = subprocess.Popen([panonav, "serve", str(memory), "--listen", "0", "--json"], stdout=subprocess.PIPE,
                                  text=True)
        try:
            place = urllib.parse.urlsplit(json.loads(server.stdout.readline())["url"])
            client = http.client.HTTPConnection(place.hostname, place.port, timeout=120)
            for view, answer in expected.items():  # over one connection
                client.request("POST", "/v1/memories/office/localise", (recording / view).read_bytes())
                response = client.getresponse()
                assert (response.status, json.loads(response.read())) == (200, answer), view
            if curl := shutil.which("curl"):
                view = next(iter(expected))
                got = subprocess.run([curl, "--silent", "--fail", "--max-time", "120", "-H", "Expect: 100-continue",
                                      "--data-binary", f"@{recording / view}",
                                      f"{place.geturl()}/v1/memories/office/localise"],
                                     check=True, capture_output=True)
                assert json.loads(got.stdout) == expected[view]
            client.close()
            use_the_page(place, {view: (recording / view).read_bytes() for view in list(expected)[:3]}, expected)
            client.request("GET", "/metrics")
            lines = client.getresponse().read().decode().splitlines()
            sample = re.compile(r'[a-z_]+(\{[a-z_]+="[^"\\]*"(,[a-z_]+="[^"\\]*")*\})? [0-9.e+-]+')
            assert lines and all(line.startswith("# ") or sample.fullmatch(line) for line in lines), lines
            known = sum(answer["known"] for answer in expected.values())
            count = next(line for line in lines if 'answer="known"' in line)
            assert int(count.split()[-1]) >= known > 0, count
            client.close()
            server.send_signal(signal.SIGTERM)
            assert server.wait(timeout=120) == 0
        finally:
            server.kill()

        server = subprocess.Popen([panonav, "serve", str(memory), "--listen", "0"], stdout=subprocess.PIPE, text=True)
        try:
            line = server.stdout.readline()
            assert re.fullmatch(r"serving at http://127\.0\.0\.1:\d+; Ctrl-C ends it\n", line), line
        finally:
            server.kill()
            server.communicate()

        for words, warned in ((("0.0.0.0:0",), True), (("127.0.0.1:0",), False),
                              (("0.0.0.0:0", "--token-file", str(folder / "token")), False)):
            server = subprocess.Popen([panonav, "serve", str(memory), "--json", "--listen", *words],
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            try:
                server.stdout.readline()
                server.send_signal(signal.SIGTERM)
                assert ("warning: everybody who can reach 0.0.0.0" in server.communicate(timeout=120)[1]) == warned, words
            finally:
                server.kill()

        server = subprocess.Popen([panonav, "serve", f"hall={memory}", "--listen", "0", "--json",
                                   "--token-file", str(folder / "token")], stdout=subprocess.PIPE, text=True)
        try:
            place = urllib.parse.urlsplit(json.loads(server.stdout.readline())["url"])
            for headers, status in (({}, 401), ({"Authorization": "Bearer a-token-of-some-length"}, 200)):
                client = http.client.HTTPConnection(place.hostname, place.port, timeout=120)
                client.request("GET", "/v1/memories/hall", headers=headers)
                response = client.getresponse()
                assert response.status == status
                assert ("Basic" in response.headers.get("WWW-Authenticate", "")) == (status == 401)
                client.close()
            for password, origin, status in (("a-token-of-some-length", None, 200), ("another-token", None, 401),
                                             ("a-token-of-some-length", place.geturl(), 200),
                                             ("a-token-of-some-length", "http://other.example", 401)):
                sent = base64.b64encode(f"anybody:{password}".encode()).decode()  # as browsers send a password
                headers = {"Authorization": f"Basic {sent}", "Accept": "text/html", **({"Origin": origin} if origin else {})}
                client = http.client.HTTPConnection(place.hostname, place.port, timeout=120)
                client.request("GET", "/", headers=headers)
                assert client.getresponse().status == status, (password, origin)
                client.close()
            picture = (recording / next(iter(expected))).read_bytes()
            serve_under_attack(place, picture, "a-token-of-some-length")
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=120) == 0
        finally:
            server.kill()
    print("serve: answers of the command over HTTP, to the bit")
    return 0


if __name__ == "__main__":
    sys.exit(main())
