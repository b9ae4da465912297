"""Tests `panonav synchronise`: files of several robots and one memory on a server, for test_server.py."""
import json
import re
import subprocess

from fleet_server import PANONAV, refused, run


def recorded(folder, prefix, count):
    """Pictures of the hall whose names begin so."""
    run(PANONAV, "simulate", "hall", folder, "--random", count, "--kind", "panorama", "--seed", len(prefix))
    for picture in folder.glob("view_*.png"):
        picture.rename(picture.with_name(prefix + picture.name))
    poses = folder / "poses.csv"
    poses.write_text(poses.read_text().replace("view_", prefix + "view_"))
    return folder


def synchronised(server, folder):
    """The verb: what it says, who may what, a server that is older than before, rows that nobody wrote."""
    address = server.memory("fleet", more="&robot=one")
    one, two = folder / "one.panonav", folder / "two.panonav"
    run(PANONAV, "memorise", one, folder / "grid")
    views = json.loads(run(PANONAV, "list", one, "--json"))["views"]

    def sync(file, address, *more):
        return json.loads(run(PANONAV, "synchronise", file, address, "--json", *more))

    def names(memory):
        return sorted(view["name"] for view in json.loads(run(PANONAV, "list", memory, "--json"))["views"])

    first = sync(one, address)
    assert first["uploaded"] == first["views"] == len(views) and first["seconds"] > 0, first
    assert "no changes" in run(PANONAV, "synchronise", one, address)
    second = sync(two, address)
    assert second["downloaded"] == len(views), second
    assert names(one) == names(two)
    # The files answer alike, with models that were learnt again.
    answers = [run(PANONAV, "localise", file, folder / "drive", "--json") for file in (one, two)]
    assert re.sub("one.panonav", "two.panonav", answers[0]) == answers[1]
    near = ("--around", "0", "0", "--within-m", "10")
    assert sync(folder / "part.panonav", address, *near)["downloaded"] == len(views)
    far = sync(folder / "part.panonav", address, "--around", "500", "0", "--within-m", "10")
    assert (far["left"], far["removed_on_server"], far["views"]) == (len(views), 0, 0), far
    for words, saying in ((("--around", "1", "1"), "needs --within-m"), (("--within-m", "1"), "needs --around"),
                          (("--around", "1", "1", "--within-m", "-1"), "radius_m is -1"),
                          (("--around", "1", "1", "--within-m", "1e9"), "up to a million")):
        done = subprocess.run([PANONAV, "synchronise", one, address, *words], capture_output=True, text=True)
        assert done.returncode == 2 and saying in done.stderr, (words, done.stderr)
    refused(PANONAV, "synchronise", one, two, saying="two.panonav.*address of a memory on a server")
    refused(PANONAV, "synchronise", folder / "absent.panonav", server.memory("nothing"), saying="no memory 'nothing'")

    # Whoever may only read takes, whoever may only add adds; the rest stays in the file.
    reads, adds, curates = (server.memory("fleet", user) for user in ("reads", "adds", "curates"))
    run(PANONAV, "copy", two, folder / "three.panonav")
    three = folder / "three.panonav"
    run(PANONAV, "memorise", three, recorded(folder / "third", "of_three_", 20))
    run(PANONAV, "forget", three, "view_00001.png")
    added = len(names(three)) - len(views) + 1
    assert added == 20
    said = sync(three, reads)
    assert said["withheld"] == added and said["uploaded"] == 0 and said["downloaded"] == 1, said
    run(PANONAV, "forget", three, "view_00001.png")
    run(PANONAV, "rename", three, "view_00002.png", "renamed")
    said = sync(three, adds)
    assert said["uploaded"] == added and said["withheld"] == 2, said
    assert "renamed" not in names(server.memory("fleet")) and "renamed" in names(three)
    said = sync(three, curates)
    assert (said["removed_on_server"], said["updated_on_server"], said["withheld"]) == (1, 1, 0), said
    sync(one, address)
    assert names(one) == names(three) == names(server.memory("fleet"))
    # A view that makes way for another's name takes none that comes with it.
    run(PANONAV, "rename", server.memory("fleet", "curates"), "of_three_view_00001.png", "red/door")
    run(PANONAV, "rename", server.memory("fleet", "curates"), "of_three_view_00002.png", "door")
    five = folder / "five.panonav"
    run(PANONAV, "copy", one, five)
    run(PANONAV, "forget", five, *[name for name in names(five) if name != "view_00005.png"])
    run(PANONAV, "rename", five, "view_00005.png", "door")
    said = sync(five, reads + "&robot=red")
    assert (said["renamed"], said["withheld"], said["views"]) == (1, 1, len(names(one)) + 1), said
    assert {"door", "red/door", "red/door (2)"} < set(names(five))
    run(PANONAV, "rename", server.memory("fleet", "curates"), "red/door", "of_three_view_00001.png")
    run(PANONAV, "rename", server.memory("fleet", "curates"), "door", "of_three_view_00002.png")
    # The other fleet has no such memory, and makes one of its own.
    run(PANONAV, "copy", one, folder / "south.panonav")
    assert sync(folder / "south.panonav", server.memory("fleet", "other"))["uploaded"] == len(names(one))
    refused(PANONAV, "synchronise", one, server.memory("fleet", "other"), saying="with a memory other than")
    refused(PANONAV, "synchronise", one, server.memory("fleet", "stranger"), saying="permission denied")

    # A server that comes back from a backup gets back what it had lost.
    sync(two, address)
    backup = folder / "backup"
    backup.mkdir()
    tables = ("memories", "views", "thumbnails", "features", "links", "uploads")
    server.sql("; ".join(f"CREATE TABLE public.{table} AS SELECT * FROM panonav.{table}" for table in tables))
    run(PANONAV, "memorise", one, recorded(folder / "more", "more_", 7))
    assert sync(one, address)["uploaded"] == 7
    assert sync(two, address)["downloaded"] == 7
    expected = names(two)
    identity = "(SELECT id FROM panonav.memories WHERE name = 'fleet' AND fleet = '')"
    server.sql("".join(f"DELETE FROM panonav.{table} WHERE memory = {identity}; INSERT INTO panonav.{table} SELECT * FROM "
                       f"public.{table} WHERE memory = {identity};" for table in tables[1:]) +
               f"UPDATE panonav.memories m SET last_view = b.last_view FROM public.memories b WHERE b.id = m.id")
    run(PANONAV, "memorise", folder / "four.panonav", folder / "grid")
    # A file that knows nothing of it, with the view that was removed and the one that was renamed.
    assert sync(folder / "four.panonav", address)["uploaded"] == 2
    expected = sorted(expected + ["view_00001.png", "view_00002.png"])
    back = sync(two, address)
    assert back["restored"] and back["uploaded"] == 7 and back["removed_in_file"] == 0, back
    again = sync(one, address)
    assert again["uploaded"] == 0 and again["removed_in_file"] == 0, again
    for file in (one, two, three, server.memory("fleet")):
        if file in (one, two, three):
            sync(file, address)
        assert names(file) == expected, (file, names(file))
    # Ids that were given again are other views.
    server.sql("".join(f"DELETE FROM panonav.{table} WHERE memory = {identity}; INSERT INTO panonav.{table} SELECT * FROM "
                       f"public.{table} WHERE memory = {identity};" for table in tables[1:]) +
               f"UPDATE panonav.memories m SET last_view = b.last_view FROM public.memories b WHERE b.id = m.id")
    run(PANONAV, "memorise", server.memory("fleet"), recorded(folder / "others", "other_", 30))
    back = sync(two, address)
    assert back["restored"] and back["uploaded"] == 9 and back["downloaded"] == 30, back
    sync(one, address)
    assert names(one) == names(two) == names(server.memory("fleet")) and set(expected) < set(names(one))

    # A row that nobody can read is left out and named, and the others are read.
    before = names(one)
    server.sql(f"UPDATE panonav.views SET signature = signature || '\\x00' WHERE memory = {identity} AND id = 3; UPDATE "
               f"panonav.views SET checksum = 5 WHERE memory = {identity} AND id = 3")
    for file in one, folder / "new.panonav":
        done = subprocess.run([PANONAV, "synchronise", file, address], capture_output=True, text=True, timeout=120)
        assert done.returncode == 0 and "left out: view 3 does not match its checksum" in done.stderr, done
    checked = subprocess.run([PANONAV, "verify", server.memory("fleet")], capture_output=True, text=True, timeout=120)
    assert checked.returncode == 2 and "left out" not in checked.stderr, checked
    assert checked.stdout.count("view 3 does not match its checksum") == 1, checked
    assert names(one) == before
    assert names(folder / "new.panonav") == names(server.memory("fleet"))
    server.sql(f"DELETE FROM panonav.views WHERE memory = {identity} AND id = 3")
    assert sync(one, address)["removed_in_file"] == 1
    run(PANONAV, "verify", one)
    server.sql("; ".join(f"DROP TABLE public.{table}" for table in tables))
