#!/usr/bin/env python3
"""Memories on a PostgreSQL server: test_server.py PANONAV_POSTGRESQL TEST_FLEET [PANONAV]. One server for all, in a
temporary folder. Without PANONAV the tests of TEST_FLEET run on it, with PANONAV those of the verbs. Exits with 77
(skipped) where there is no server program or panonav was built without libpq.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

from fleet_server import PANONAV, SERVER, TEST_FLEET, Server, refused, run
from synchronised_files import synchronised

SHARED = ("MemoryFileContent.HeadersComeBack:MemoryFileContent.ContentComesBack:MemoryFileContent.IdsAre*:"
          "MemoryFileContent.Para*:MemoryFileContent.ABad*:MemoryFileContent.Readers*:MemoryFileContent.TwoW*:"
          "MapTables.*:RouteTables.W*:RouteTables.B*:MemoryFileUndo.*:"
          "ViewsOfAMemoryFile.AreThose*:ViewsOfAMemoryFile.See*:MemoryOnServer.*:SynchronisedMemory.*:PlaceSearchTest.*"
          # Excluded: attacks on a file, and the number of changes a file keeps for undo: a server keeps the last one.
          "-*Tampered*:MemoryFileUndo.Damage*:MemoryFileUndo.BringsBackAll*:MemoryFileUndo.History*")


def same_answers(server, folder):
    """Every verb that answers says the same of both, to the last digit."""
    run(PANONAV, "simulate", "hall", folder / "grid", "--grid", "1.2", "--kind", "panorama", "--seed", "3")
    run(PANONAV, "simulate", "hall", folder / "drive", "--kind", "panorama", "--seed", "3", "--path", "walk",
        "--spacing-m", "0.1", "--poses", "25")
    answers = {}
    for memory, mapped in ((folder / "hall.panonav", folder / "mapped.panonav"),
                           (server.memory("hall"), server.memory("mapped"))):
        def answer(*words):
            done = subprocess.run([PANONAV, *words, "--json"], capture_output=True, text=True, timeout=120)
            assert done.returncode in (0, 1), (words, done.stderr)  # 1: no answer, for both
            said = f"{done.returncode} {done.stdout}"
            for one in (memory, mapped):
                said = said.replace(json.dumps(str(one)), '"MEMORY"')
            said = re.sub(r'"(created_s|bytes|file_bytes|\w*_ms)":[^,}]*', "", said)
            answers.setdefault(str(memory), []).append(said)
        answer("memorise", memory, folder / "grid")
        answer("memorise", memory, folder / "grid")  # continues: nothing is new
        answer("localise", memory, folder / "drive")
        answer("home", "view_00003.png", folder / "drive/view_00004.png", "--memory", memory)
        answer("route", "record", memory, folder / "drive", "--name", "way")
        answer("route", "follow", memory, folder / "drive")
        answer("map", mapped, folder / "drive")
        answer("list", memory)
        answer("info", memory)
        answer("rename", memory, "view_00002.png", "the 'door'")
        answer("forget", memory, "view_00001.png")
        answer("undo", memory)
        answer("list", memory)
        answer("verify", memory)
        run(PANONAV, "export", memory, "-o", folder / f"export{len(answers)}")
    file, kept = answers.values()
    for one, other in zip(file, kept, strict=True):
        assert one == other, (one[:3000], other[:3000])
    exported = [{str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}
                for root in (folder / "export1", folder / "export2")]
    assert exported[0].keys() == exported[1].keys() and len(exported[0]) > 10
    assert all(exported[0][name] == exported[1][name] for name in exported[0] if name.endswith(".png"))
    # merged on the server as in a file
    run(PANONAV, "memorise", folder / "second.panonav", folder / "drive")
    for first, out in ((folder / "hall.panonav", folder / "both.panonav"),
                       (server.memory("hall"), server.memory("both"))):
        run(PANONAV, "merge", first, folder / "second.panonav", "-o", out, code=1)  # nothing in common: kept apart
    views = [run(PANONAV, "list", out, "--json") for out in (folder / "both.panonav", server.memory("both"))]
    assert [re.sub(r'"memory":"[^"]*"', "", view) for view in views][0] == \
        [re.sub(r'"memory":"[^"]*"', "", view) for view in views][1]


def copies(server, folder):
    """To the server and back: the same, and never instead of something. A copy has no history to undo."""
    def said(memory):
        return re.sub(r'"(memory|created_s|file_bytes)":[^,}]*|"undo",', "", run(PANONAV, "list", memory, "--json") +
                      run(PANONAV, "info", memory, "--json") + run(PANONAV, "verify", memory))
    run(PANONAV, "copy", folder / "hall.panonav", server.memory("the%20copy"))
    run(PANONAV, "copy", server.memory("the%20copy"), folder / "back.panonav")
    assert said(folder / "back.panonav").replace("back.panonav", "hall.panonav") == said(folder / "hall.panonav")
    refused(PANONAV, "copy", folder / "hall.panonav", server.memory("hall"), saying="already exists")
    refused(PANONAV, "copy", server.memory("hall"), folder / "back.panonav", saying="already exists")


def served(server, folder):
    """`serve` answers from a memory on a server, and from its new state once somebody changed it."""
    memory = server.memory("served")
    run(PANONAV, "memorise", memory, folder / "grid")
    serving = subprocess.Popen([PANONAV, "serve", memory, "--listen", "0", "--json"], stdout=subprocess.PIPE, text=True)
    try:
        url = json.loads(serving.stdout.readline())["url"]
        def views():
            with urllib.request.urlopen(url.rstrip("/") + "/v1/memories", timeout=60) as answer:
                return json.load(answer)
        before = views()
        assert "served" in json.dumps(before), before
        run(PANONAV, "forget", memory, "view_00001.png")
        for _ in range(600):
            if views() != before:
                return
            time.sleep(0.1)
        raise AssertionError(views())
    finally:
        serving.send_signal(signal.SIGINT)
        serving.wait(timeout=60)


class Serving:
    """`serve` of one memory in a process of its own."""
    def __init__(self, memory, *words):
        self.process = subprocess.Popen([PANONAV, "serve", f"m={memory}", "--listen", "0", "--json", *words],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.url = json.loads(self.process.stdout.readline())["url"].rstrip("/")

    def get(self, path, body=None):
        try:
            with urllib.request.urlopen(urllib.request.Request(self.url + path, body), timeout=60) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def localise(self, picture):
        status, answer = self.get("/v1/memories/m/localise", picture.read_bytes())
        return status, re.sub(r'"bytes_read":\d+', "", answer)

    def end(self):
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(timeout=60) == 0


def searched(server, folder):
    """Two processes that search a memory on the server where it lies answer as one that holds it, to the last digit,
    also while others change it and once the server was away."""
    memory = server.memory("searched")
    run(PANONAV, "memorise", memory, folder / "grid")
    pictures = sorted((folder / "drive").glob("*.png"))[::6] + sorted((folder / "grid").glob("*.png"))[:2]
    assert len(pictures) >= 5
    serving = [Serving(memory, "--max-held-views", "0"), Serving(memory, "--max-held-views", "0")]
    try:
        def same(views):
            holding = Serving(memory)
            try:
                for one in serving:
                    for _ in range(600):
                        if f'"views":{views},' in one.get("/v1/memories")[1]:
                            break
                        time.sleep(0.05)
                    assert f'"views":{views},' in one.get("/v1/memories")[1], (views, one.get("/v1/memories"))
                for picture in pictures:
                    held = holding.localise(picture)
                    assert held[0] == 200 and '"matches":[{' in held[1], held
                    for one in serving:
                        for _ in range(200):  # what is learnt of new views comes a moment after these
                            if one.localise(picture) == held:
                                break
                            time.sleep(0.05)
                        assert one.localise(picture) == held, (picture, one.localise(picture), held)
                assert "panonav_sketch_bytes" not in holding.get("/metrics")[1]
            finally:
                holding.end()
        before = int(json.loads(run(PANONAV, "info", memory, "--json"))["views"])
        same(before)
        run(PANONAV, "forget", memory, "view_00001.png", "view_00004.png")
        same(before - 2)
        run(PANONAV, "undo", memory)
        same(before)
        run(PANONAV, "forget", memory, "view_00002.png", "view_00007.png", "view_00009.png")
        same(before - 3)
        run(PANONAV, "memorise", memory, folder / "grid")  # adds them again, under other ids
        same(before)
        metrics = serving[0].get("/metrics")[1]
        for name, minimum in (("panonav_sketch_bytes", 1000), ("panonav_searches_total", len(pictures)),
                            ("panonav_search_views_read_total", len(pictures)), ("panonav_memory_views", before)):
            assert float(re.search(name + r'\{memory="m"\} (\S+)', metrics)[1]) >= minimum, metrics
        assert float(re.search(r'panonav_search_seconds_total\{memory="m"\} (\S+)', metrics)[1]) > 0.0
        server.stop()
        status, answer = serving[0].localise(pictures[0])
        assert status == 503 and len(answer.strip().splitlines()) == 1 and "error" in answer, (status, answer)
        server.start()
        same(before)
    finally:
        for one in serving:
            one.end()


def stalled(server, folder):
    """While a server of memories hangs, `serve` answers /health and for other memories, tells clients of its own to
    try again, without an address, and ends when it is asked to; a verb waits no longer than a lock does."""
    memory = server.memory("searched")
    process = subprocess.Popen(
        [PANONAV, "serve", f"file={folder / 'hall.panonav'}", f"m={memory}", "--listen", "0", "--json",
         "--max-held-views", "0", "--threads", "1"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = process.stdout.readline() or process.stderr.read()
    assert line.startswith("{"), line
    url = json.loads(line)["url"].rstrip("/")
    picture = next((folder / "grid").glob("*.png")).read_bytes()
    answers = []

    def ask(path, body=None):
        began = time.monotonic()
        try:
            with urllib.request.urlopen(urllib.request.Request(url + path, body), timeout=120) as answer:
                said = answer.status, answer.read().decode(errors="replace")
        except urllib.error.HTTPError as error:
            said = error.code, error.read().decode()
        answers.append((path, *said, time.monotonic() - began))
        return said[0]

    assert ask("/v1/memories/m/localise", picture) == ask("/v1/memories/file/localise", picture) == 200
    hung = [int((server.folder / "data/postmaster.pid").read_text().split()[0])] + [int(pid) for pid in server.sql(
        "SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()").split()]
    assert len(hung) >= 3, hung
    for pid in hung:
        os.kill(pid, signal.SIGSTOP)
    try:
        waiting = [threading.Thread(target=ask, args=("/v1/memories/m" + path, body)) for path, body in
                   2 * (("/localise", picture), ("/views/view_00003.png/picture", None))]
        for thread in waiting:
            thread.start()
        answers.clear()
        for _ in range(5):
            for path, body in (("/health", None), ("/v1/memories", None), ("/metrics", None),
                               ("/v1/memories/file/localise", picture),
                               ("/v1/memories/file/views/view_00003.png/picture", None)):
                assert ask(path, body) == 200, answers[-1]
        others = max(seconds for path, *_, seconds in answers if not path.startswith("/v1/memories/m/"))
        for thread in waiting:
            thread.join()
        own = [answer for answer in answers if answer[0].startswith("/v1/memories/m/")]
        assert len(own) == 4 and all(status == 503 for _, status, *_ in own), own
        assert not any(re.search("postgres|host=|panonav@|/", text) for _, _, text, _ in own), own
        late = threading.Thread(target=lambda: subprocess.run(
            ["curl", "--silent", "--max-time", "60", "--data-binary", "@-", url + "/v1/memories/m/localise"],
            input=picture, capture_output=True))
        late.start()
        time.sleep(0.5)
        began = time.monotonic()
        process.send_signal(signal.SIGTERM)
        noted = process.communicate(timeout=100)[1]
        late.join()
        assert process.returncode == 0 and "cannot be read" in noted, noted
        print(f"a server that hangs: others answered within {others:.2f} s, 503 after {max(one[3] for one in own):.1f} "
              f"s, ended after {time.monotonic() - began:.1f} s")
    finally:
        process.kill()
        for pid in hung:
            try:
                os.kill(pid, signal.SIGCONT)
            except ProcessLookupError:
                pass


def roles(server, folder):
    server.sql("""CREATE ROLE reads LOGIN IN ROLE panonav_reader; CREATE ROLE adds LOGIN IN ROLE panonav_contributor;
        CREATE ROLE curates LOGIN IN ROLE panonav_curator; CREATE ROLE stranger LOGIN;
        CREATE ROLE other LOGIN IN ROLE panonav_curator; INSERT INTO panonav.members VALUES ('other', 'south')""")
    reads, adds, curates, other = (server.memory("hall", user) for user in ("reads", "adds", "curates", "other"))
    before = run(PANONAV, "list", reads, "--json").split('"views"')[1]
    refused(PANONAV, "memorise", reads, folder / "drive", saying="cannot be changed.*panonav_contributor")
    refused(PANONAV, "memorise", server.memory("new", "reads"), folder / "grid", saying="permission denied")
    refused(PANONAV, "localise", server.memory("hall", "stranger"), folder / "drive", saying="permission denied")
    for verb in (("forget", adds, "view_00001.png"), ("rename", adds, "view_00001.png", "a")):
        refused(PANONAV, *verb, saying="permission denied.*panonav_curator")
    refused(PANONAV, "localise", other, folder / "drive", saying="no memory 'hall'")
    refused(PANONAV, "localise", other + "&fleet=", folder / "drive", saying="no memory 'hall'")
    refused(PANONAV, "memorise", other.replace("hall", "new") + "&fleet=", folder / "grid", saying="row-level security")
    assert before == run(PANONAV, "list", reads, "--json").split('"views"')[1]
    # Rights of each role.
    run(PANONAV, "memorise", server.memory("small", "adds", "&robot=red%20one"), folder / "grid")
    run(PANONAV, "forget", server.memory("small", "curates"), "view_00001.png")
    run(PANONAV, "memorise", other, folder / "grid")  # of the same name, in the other fleet
    assert server.sql("SELECT string_agg(fleet || '/' || name, ' ' ORDER BY fleet, name) FROM panonav.memories "
                      "WHERE name IN ('hall', 'small')") == "/hall /small south/hall"
    assert server.sql("SELECT r.name || ' ' || s.login || ' ' || count(*) FROM panonav.views v JOIN panonav.sessions s "
                      "ON s.id = v.session JOIN panonav.robots r ON r.id = s.robot WHERE r.name LIKE 'red%' "
                      "GROUP BY r.name, s.login").startswith("red one adds ")
    # Row-level security leaves the index of positions in use.
    plan = run("psql", "-X", "-q", "-t", "-A", "-h", server.folder, "-U", "adds", "-d", "panonav", "-c",
               "SET enable_seqscan = off", "-c", "EXPLAIN SELECT id FROM panonav.views WHERE memory = 1 AND x_m IS NOT "
               "NULL AND x_m BETWEEN 0 AND 0.1 AND y_m BETWEEN 0 AND 0.1")
    assert re.search(r"views_by_position.*\n? *Index Cond: .*x_m >=.*y_m >=", plan), plan
    # Not by SQL of one's own, either, nor under the name of a role.
    assert run("psql", "-X", "-q", "-t", "-A", "-h", server.folder, "-U", "other", "-d", "panonav", "-c",
               "SET ROLE panonav_curator", "-c", "SELECT fleet || '/' || name FROM panonav.memories").split() == \
        ["south/hall"]
    for sql in ("DELETE FROM panonav.views", "UPDATE panonav.settings SET checksum = 0 WHERE key = 'rows' RETURNING "
                "1 / 0", "INSERT INTO panonav.views VALUES ((SELECT min(id) FROM panonav.memories), 99, 'a', "
                "NULL, NULL, NULL, NULL, NULL, '', 0)"):
        done = subprocess.run(["psql", "-X", "-v", "ON_ERROR_STOP=1", "-h", server.folder, "-U", "other", "-d",
                               "panonav", "-c", "BEGIN", "-c", "SELECT set_config('role', 'adds', true)", "-c", sql],
                              capture_output=True, text=True)
        assert done.returncode != 0 or "UPDATE 0" in done.stdout, (sql, done.stdout)


def wrong_addresses(server, folder):
    hba = server.folder / "data/pg_hba.conf"
    hba.write_text("local all locked scram-sha-256\n" + hba.read_text())
    server.sql("CREATE ROLE locked LOGIN PASSWORD 'richtig' IN ROLE panonav_reader; SELECT pg_reload_conf()")
    locked = server.memory("hall", "locked:geheim").replace("@/", "@/")
    for _ in range(100):  # until the server has read its file again
        if subprocess.run([PANONAV, "info", locked], capture_output=True).returncode == 2:
            break
        time.sleep(0.05)
    refused(PANONAV, "info", locked, saying="password authentication failed")
    assert '"views"' in run(PANONAV, "info", server.memory("hall", "locked:richtig"), "--json")
    assert "richtig" not in run(PANONAV, "info", server.memory("hall", "locked:richtig"), "--json")
    refused(PANONAV, "info", server.memory("hall").replace("/panonav?", "/nowhere?"), saying='"nowhere" does not exist')
    refused(PANONAV, "info", server.memory("nothing"), saying="no memory 'nothing'")
    refused(PANONAV, "info", f"postgresql:///panonav?host={folder}/absent&memory=m", saying="No such file")
    refused(PANONAV, "info", "postgresql://u:geheim@127.0.0.1:1/d?memory=m", saying="refused")
    refused(PANONAV, "info", "postgresql://u:geh%eim@h/d?memory=m", saying="libpq")
    refused(PANONAV, "info", f"postgresql:///panonav?host={server.folder}", saying="names no memory")
    refused(PANONAV, "info", server.memory("hall", more="&sslmode=sometimes"), saying="sslmode")


def certificate(folder, name, *more):
    run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}",
        "-keyout", folder / f"{name}.key", "-out", folder / f"{name}.crt", *more)


def encrypted(server, folder):
    """The settings of TLS reach libpq: over a network a server that takes nothing else, and who it must be."""
    certificate(folder, "server", "-addext", "subjectAltName=DNS:localhost")
    certificate(folder, "another")
    for name in ("server.crt", "server.key"):
        shutil.copy(folder / name, server.folder / "data" / name)
    (server.folder / "data/server.key").chmod(0o600)
    hba = server.folder / "data/pg_hba.conf"
    before = hba.read_text()
    hba.write_text("hostssl all all 127.0.0.1/32 trust\nlocal all all trust\n")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server.stop()
    server.start("ssl=on", "listen_addresses=127.0.0.1", f"port={port}")
    refused(SERVER, server.folder, "start", "ssl=off", saying="runs already")

    def memory(host, mode, root="server"):
        return f"postgresql://panonav@{host}:{port}/panonav?memory=hall&hostaddr=127.0.0.1&sslmode={mode}" \
            f"&sslrootcert={folder}/{root}.crt"
    try:
        assert "TLS" in run("psql", "-X", "-t", "-A", memory("localhost", "verify-full").replace("memory=hall&", ""),
                            "-c", "SELECT version FROM pg_stat_ssl WHERE pid = pg_backend_pid()")
        said = run(PANONAV, "info", memory("localhost", "verify-full"), "--json")
        assert json.loads(said)["views"] > 0, said
        refused(PANONAV, "info", memory("localhost", "disable"), saying="no encryption")
        refused(PANONAV, "info", memory("localhost", "verify-full", "another"), saying="certificate verify failed")
        refused(PANONAV, "info", memory("elsewhere", "verify-full"), saying='does not match host name "elsewhere"')
        refused(PANONAV, "memorise", memory("localhost", "verify-full", "absent"), folder / "grid", saying="absent.crt")
    finally:
        server.stop()
        hba.write_text(before)
        server.start()


def other_schema(server):
    """A server whose schema another version of panonav made."""
    for version in 0, 2:
        server.sql(f"UPDATE panonav.schema_version SET version = {version}")
        refused(PANONAV, "info", server.memory("hall"), saying=f"has schema version {version}; allowed: 1")
    server.sql("UPDATE panonav.schema_version SET version = 1")


def killed_server(server):
    """Acknowledged views are there once, the others not at all or whole."""
    address = server.memory("appended")
    appending = subprocess.Popen([TEST_FLEET, "--gtest_filter=MemoryOnServer.AppendsUntil*"], text=True,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                 env=os.environ | {"PANONAV_TEST_SERVER": address, "PANONAV_TEST_APPEND": address})
    acknowledged = 0
    killed = False
    said = []
    for line in appending.stdout:
        said.append(line)
        if line.startswith("acknowledged"):
            acknowledged = int(line.split()[1])
            if acknowledged >= 400 and not killed:
                killed = True
                server.kill()
    assert appending.wait() == 0 and acknowledged >= 400, "".join(said)
    server.start()
    views = json.loads(run(PANONAV, "list", address, "--json"))["views"]
    names = [view["name"] for view in views]
    assert names == [f"view_{i}.png" for i in range(len(names))], names
    assert len(names) in (acknowledged, acknowledged + 20), (len(names), acknowledged)
    run(PANONAV, "verify", address)


def storage(server):
    """The tests of storage and of this component hold of memories on the server."""
    tests = subprocess.run([TEST_FLEET, f"--gtest_filter={SHARED}"], capture_output=True, text=True,
                           env=os.environ | {"PANONAV_TEST_SERVER": server.memory("x").replace("&memory=x", "")})
    failures = re.findall(r".*(?:Failure|FAILED|ERROR: )(?:.*\n){1,6}", tests.stdout + tests.stderr)
    assert tests.returncode == 0, "".join(failures)[-4000:]
    assert int(re.search(r"PASSED +\] (\d+)", tests.stdout)[1]) >= 20, tests.stdout


def verbs(server, folder):
    same_answers(server, folder)
    print("same answers")
    copies(server, folder)
    print("copies")
    served(server, folder)
    print("served")
    searched(server, folder)
    print("searched")
    stalled(server, folder)
    roles(server, folder)
    print("roles")
    synchronised(server, folder)
    print("synchronised")
    other_schema(server)
    print("other schema")
    wrong_addresses(server, folder)
    print("addresses")
    encrypted(server, folder)
    print("encrypted")
    killed_server(server)
    print("killed server")


def is_built_without_postgresql():
    refusal = subprocess.run([PANONAV, "info", "postgresql:///d?memory=m&host=/nowhere"], capture_output=True, text=True)
    return "built without PostgreSQL" in refusal.stderr


def main():
    if PANONAV and is_built_without_postgresql():
        print("skipped: built without PostgreSQL")
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        server = Server(folder / "server")
        started = subprocess.run([SERVER, server.folder, "start"], capture_output=True, text=True)
        if "the package postgresql has it" in started.stderr:
            print("skipped: no PostgreSQL server is installed")
            return 77
        assert started.returncode == 0, started.stderr
        try:
            if PANONAV:
                verbs(server, folder)
            else:
                storage(server)
        finally:
            server.stop()
    return 0


sys.exit(main())
