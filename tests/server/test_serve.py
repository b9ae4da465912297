#!/usr/bin/env python3
"""panonav serve as clients meet it that nobody here wrote: Python's http.client, and curl where it is installed.

Usage: test_serve.py PANONAV
"""
import http.client
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.parse


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
        run("memorise", str(recording), str(memory), "--quiet")
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
        assert "is no token" in refusal(str(memory), "--listen", "0", "--token-file", str(folder / "short"))
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

        server = subprocess.Popen([panonav, "serve", f"hall={memory}", "--listen", "0", "--json",
                                   "--token-file", str(folder / "token")], stdout=subprocess.PIPE, text=True)
        try:
            place = urllib.parse.urlsplit(json.loads(server.stdout.readline())["url"])
            for headers, status in (({}, 401), ({"Authorization": "Bearer a-token-of-some-length"}, 200)):
                client = http.client.HTTPConnection(place.hostname, place.port, timeout=120)
                client.request("GET", "/v1/memories/hall", headers=headers)
                assert client.getresponse().status == status
                client.close()
            server.send_signal(signal.SIGINT)
            assert server.wait(timeout=120) == 0
        finally:
            server.kill()
    print("serve: answers of the command over HTTP, to the bit")
    return 0


if __name__ == "__main__":
    sys.exit(main())
