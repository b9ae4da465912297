#!/usr/bin/env python3
"""The command's --view. test_view.py PANONAV verbs: what each verb shows. test_view.py PANONAV browser [FOLDER]: the
page in chromium, spoken to by its DevTools protocol over pipes, with screenshots into FOLDER. test_view.py PANONAV
demo [FOLDER]: the same with the page of the demonstration. Exits with 77 (skipped) where there is no chromium.
"""
import http.client
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from browser import CONTRAST, DESK, PATIENCE_S, PHONE, PROGRAM, Browser, colours, text_of

PANONAV = sys.argv[1]


def record(folder):
    """A memory of a small hall and a drive through it."""
    subprocess.run([PANONAV, "simulate", "hall", folder / "grid", "--grid", "1.2", "--kind", "panorama", "--seed", "3"],
                   check=True, capture_output=True)
    subprocess.run([PANONAV, "simulate", "hall", folder / "drive", "--kind", "panorama", "--seed", "3", "--path",
                    "walk", "--spacing-m", "0.06", "--poses", "60"], check=True, capture_output=True)
    subprocess.run([PANONAV, "memorise", folder / "hall.panonav", folder / "grid"], check=True, capture_output=True)


def every_panel_draws(browser):
    for name, minimum in (("pn-map canvas", 5), ("pn-timeline canvas", 4), ("#panorama-figure canvas", 50),
                        ("#best-figure canvas", 50), ("#difference-figure canvas", 2)):
        browser.wait(f"{colours(name)} >= {minimum}")
    assert browser.ask("document.querySelectorAll('pn-facts tr').length") >= 5
    assert "0.0 s  localised" in text_of(browser, "pn-facts ol li:last-child")


def look_at_report(browser, file, shots):
    """The page of a run that is over, from its file: it plays without a click and stops on one."""
    browser.call("Page.navigate", url="about:blank")
    browser.settle()
    browser.requests.clear()
    browser.errors.clear()
    browser.show(DESK)
    browser.call("Page.navigate", url=file.as_uri())
    browser.wait("document.querySelector('#difference-figure canvas')?.width > 300")
    browser.wait("document.querySelector('pn-map').run.index > 3")
    every_panel_draws(browser)
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, x=300, y=300, button="left", clickCount=1, buttons=1)
    assert text_of(browser, "#play") == "Play"
    browser.key("End")
    browser.wait("document.querySelector('#clock').textContent.endsWith('image 60 of 60')")
    browser.picture(shots / "report.png")
    assert not browser.errors, browser.errors
    elsewhere = [one for one in browser.requests if not one.startswith((file.as_uri(), "data:"))]
    assert not elsewhere, elsewhere


def look_at_demo(browser, file, shots):
    """The demonstration: its story moves without a click and stops on one, and each part plays when it is looked at."""
    browser.show(DESK)
    browser.call("Page.navigate", url=file.as_uri())
    story = "[...document.querySelectorAll('.story pn-plan')]"
    browser.wait(f"{story}.length === 3 && {story}.every(plan => plan.frames)")
    seen = browser.ask(f"{story}.map(plan => plan.index)")
    browser.wait(f"{story}.every((plan, i) => plan.playing && plan.index !== {seen}[i])")
    browser.picture(shots / "demo.png")
    assert browser.ask("document.querySelector('.begin pre').getBoundingClientRect().bottom <= innerHeight"), \
        "how to use it is on the first screen"
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, x=1270, y=300, button="left", clickCount=1, buttons=1)
    assert not browser.ask(f"{story}.some(plan => plan.playing)")
    unfolding = "document.querySelector('#part5 ~ .pictures pn-plan')"
    # It plays while it is in view, and parts above it that are drawn meanwhile have other heights.
    look = f"{unfolding}.scrollIntoView({{ block: 'center' }})"
    browser.wait(f"({look}, {unfolding}.frames)")
    browser.wait(f"({look}, {unfolding}.playing)")
    browser.wait(f"({look}, {unfolding}.index === {unfolding}.frames.length - 1 && !{unfolding}.playing)")
    assert browser.ask("document.querySelectorAll('pn-run').length") == 3
    for number in range(3):
        run = f"document.querySelectorAll('pn-run')[{number}]"
        browser.ask(f"{run}.scrollIntoView()")
        browser.wait(f"{run}.run.index > 1")
    for dark in (False, True):
        browser.show(DESK, dark)
        browser.settle()
        minimum = browser.ask(CONTRAST)
        assert minimum["ratio"] >= 4.5, minimum
    browser.show(PHONE)
    browser.ask("scrollTo(0, 0)")
    browser.picture(shots / "demo_phone.png")
    wide = browser.ask("document.documentElement.scrollWidth")
    assert wide <= PHONE["width"], wide
    assert not browser.errors, browser.errors
    elsewhere = [one for one in browser.requests if not one.startswith((file.as_uri(), "data:", "about:"))]
    assert not elsewhere, elsewhere


def look(browser, url, shots):
    browser.show(DESK)
    browser.call("Page.navigate", url=url)
    began = time.monotonic()
    browser.wait("document.querySelector('#clock')?.textContent !== ''")
    browser.wait("document.querySelector('#panorama-figure canvas')?.width > 300")
    print(f"first picture {time.monotonic() - began:.2f} s after the page was asked for")
    browser.wait("document.querySelector('#state').classList.contains('good')")
    speed = lambda factor: browser.ask(f"document.querySelector('#speed').value = '{factor}'; "
                                       "document.querySelector('#speed').dispatchEvent(new Event('change'))")
    speed(2)
    browser.wait("document.querySelector('pn-map').run.last >= 8")
    every_panel_draws(browser)
    # Keys: hold, step back and on, go on.
    browser.key(" ", "Space")
    assert text_of(browser, "#play") == "Play"
    browser.wait("document.querySelector('#clock').textContent.endsWith('paused')")
    time.sleep(0.2)
    held = text_of(browser, "#clock")
    time.sleep(0.4)
    assert text_of(browser, "#clock") == held, "it was held"
    browser.key("ArrowLeft")
    assert text_of(browser, "#clock") != held
    browser.key("ArrowRight")
    browser.wait(f"document.querySelector('#clock').textContent === {json.dumps(held)}")
    browser.key("ArrowRight")  # beyond what has come: the run makes a step
    browser.wait(f"document.querySelector('#clock').textContent !== {json.dumps(held)}")
    for number, panel in enumerate(("map", "pictures", "facts", "timeline"), 1):
        browser.key(str(number), f"Digit{number}")
        assert browser.ask(f"document.querySelector('pn-{panel}').hidden"), panel
        browser.key(str(number), f"Digit{number}")
        assert not browser.ask(f"document.querySelector('pn-{panel}').hidden"), panel
    before = browser.ask("document.querySelector('pn-map').zoom")
    browser.key("+", "Equal")
    assert browser.ask("document.querySelector('pn-map').zoom") > before
    browser.key("0", "Digit0")
    browser.settle()
    # The line is interrupted where the robot was kidnapped; it is whole for one that stands or keeps its speed.
    line = lambda places: browser.ask(f"import('panonav/store').then(({{ steady }}) => steady({places}.map((x, t) => "
                                      "({ t, truth: [x, 0] })), 'truth').map(at => at ? at[0] : 'apart'))")
    assert line([0, 0.1, 0.2, 0.3, 3.3, 3.4, 3.5]) == [0, 0.1, 0.2, 0.3, "apart", 3.3, 3.4, 3.5]
    assert line([1, 1, 1, 2, 3, 4]) == [1, 1, 1, 2, 3, 4]
    assert line([5]) == [5] and line([5, 5, 5]) == [5, 5, 5]
    # Uses keys alone: to the view nearest to the robot, to the next one, into its card, and the robot's pose is set to this view.
    browser.ask("document.querySelector('pn-map').focus()")
    browser.key("ArrowUp")
    near = text_of(browser, "pn-card h2")
    browser.key("ArrowUp")
    assert near.startswith("view_") and text_of(browser, "pn-card h2") not in ("", near), near
    browser.wait("document.querySelector('pn-card img').naturalWidth > 100")
    browser.key("Enter")
    assert browser.ask("document.activeElement.textContent") == "The robot is here"
    browser.ask("document.activeElement.click()")
    browser.wait("document.querySelector('pn-card output').textContent === 'Sent to the run.'")
    browser.key("Escape")
    assert browser.ask("document.querySelector('pn-card').hidden && document.activeElement.localName === 'pn-map'")
    # A click on a reference names it.
    at = browser.ask("""(() => { const map = document.querySelector('pn-map'), box = map.getBoundingClientRect();
      const [x, y] = map.run.retained.references; return [box.x + map.px(x), box.y + map.py(y)]; })()""")
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", clickCount=1, buttons=1)
    assert "view 0" in text_of(browser, "pn-map .readout"), text_of(browser, "pn-map .readout")
    for dark in (False, True):
        browser.show(DESK, dark)
        browser.picture(shots / f"desk{'_dark' * dark}.png")
        minimum = browser.ask(CONTRAST)
        assert minimum["ratio"] >= 4.5, minimum
    # A phone: nothing wider than the screen, buttons that a finger finds, touch moves the map.
    browser.show(PHONE)
    browser.picture(shots / "phone.png")
    assert browser.ask("document.documentElement.scrollWidth") <= PHONE["width"]
    assert browser.ask("Math.min(...[...document.querySelectorAll('button')].map(b => b.offsetHeight))") >= 40
    browser.key("Escape")  # the card of the view, which covers the map here
    assert browser.ask("document.querySelector('pn-card').hidden")
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    shift = browser.ask("document.querySelector('pn-map').shift[0]")
    for kind, x in (("touchStart", 150), ("touchMove", 190), ("touchMove", 230)):
        browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": 250}])
    browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    assert browser.ask("document.querySelector('pn-map').shift[0]") > shift, "touch moves the map"
    browser.show(DESK)
    # To the end.
    speed(20)
    browser.key(" ", "Space")
    browser.wait("document.querySelector('#clock').textContent.endsWith('the run has ended')")
    # On a slow machine the run is over before its last pictures are asked for.
    errors = [one for one in browser.errors if "/picture/" not in one]
    assert not errors, errors
    elsewhere = [one for one in browser.requests if not one.startswith((url, "data:", "about:", "blob:"))]
    assert not elsewhere, elsewhere


def watch(arguments, requests=()):
    """The events of a run that a viewer follows to its end. `requests`: requests after the first moment, each a method, what
    is below the page's address, a text and the status that is expected.
    """
    run = subprocess.Popen([PANONAV, *map(str, arguments), "--view", "0"], stdout=subprocess.DEVNULL,
                           stderr=subprocess.PIPE, text=True)
    try:
        url = next(re.search(r"http://[\d.]+:(\d+)(/\w+/)", line) for line in run.stderr if line.startswith("Open "))
        connect = lambda: http.client.HTTPConnection("127.0.0.1", int(url[1]), timeout=PATIENCE_S)
        follower = connect()
        follower.request("GET", url[2] + "events")
        answer = follower.getresponse()
        text = ""
        while requests and "event: moment\n" not in text:
            text += answer.readline().decode()
        for method, below, body, status in [*requests, ("POST", "control", json.dumps({"speed": 100}), 204)]:
            other = connect()
            other.request(method, url[2] + below, body)
            assert (got := other.getresponse().status) == status, (arguments, below, body, got)
        text += answer.read().decode()
        run.stderr.read()
        assert run.wait(PATIENCE_S) in (0, 1), arguments
    finally:
        run.kill()
        run.wait()
    events = [one.split("\n", 1) for one in text.replace("retry: 500\n", "").split("\n\n") if one.startswith("event: ")]
    return [(name[7:], json.loads(data[6:])) for name, data in events]


def watch_verbs(folder):
    """Each verb shows its moments in order, and what it alone knows."""
    panonav = lambda *words: subprocess.run([PANONAV, *map(str, words)], check=True, capture_output=True)
    drive, memory = folder / "short", folder / "hall.panonav"
    panonav("simulate", "hall", drive, "--kind", "panorama", "--path", "walk", "--spacing-m", "0.1", "--poses", "12",
            "--rows", "40", "--columns", "256", "--rays-per-axis", "1")
    panonav("memorise", memory, drive)
    panonav("route", "record", memory, drive)
    verbs = {
        "localise": ([memory, drive], {"pose", "turn", "probability", "compared"}, {"references", "names", "regions"}),
        "track": ([memory, drive, "--record", folder / "track.mcap"],
                  {"pose", "particles", "modes", "compared", "turn", "probability"}, {"references", "names", "regions"}),
        "map": ([folder / "map.panonav", drive], {"pose"}, {"references", "names", "edges"}),
        "route follow": ([memory, drive], {"pose", "covariance"}, {"plan"}),
        "navigate": ([memory, "--goal", "view_00011.png", "--scene", "hall"], {"pose", "probability"},
                     {"references", "plan", "directions", "goal", "walls", "regions"}),
    }
    for verb, (arguments, shown, retained) in verbs.items():
        events = watch([*verb.split(), *arguments])
        moments = [data for name, data in events if name == "moment"]
        assert [moment["n"] for moment in moments] == list(range(len(moments))), verb
        assert len(moments) == 12 or verb == "navigate" and len(moments) > 1, (verb, len(moments))
        assert any(shown <= moment.keys() for moment in moments), (verb, moments[-1].keys())
        assert {"camera", "panorama"} <= set(moments[-1]["pictures"]), verb
        assert all(ms >= 0 for moment in moments for ms in moment["stages"].values()), verb
        assert retained <= {key for name, data in events if name == "retained" for key in data}, verb
        assert events[0][0] == "past" and events[-1] == ("ended", {}), verb
        if verb == "map":
            grown = [len(data["references"]) // 2 for name, data in events if name == "retained"]
            assert grown[0] == 1 and grown == sorted(grown) and len(grown) > 3, grown
    assert (folder / "track.mcap").stat().st_size > 100_000, "a run that is shown is recorded, too"


def tell_verbs(folder):
    """Wishes of viewers are accepted and acted upon."""
    drive, memory = folder / "short", folder / "hall.panonav"
    views = [("GET", "view/0", None, 200), ("GET", "view/12", None, 404), ("GET", "view/../0", None, 404)]
    wishes = lambda pose, goal: [("POST", "control", json.dumps({"pose": pose}), 204 if not goal else 400),
                                 ("POST", "control", json.dumps({"goal": goal or [1, 2]}), 204 if goal else 400)]
    references = lambda events: next(data["references"] for name, data in events if name == "retained")
    events = watch(["localise", memory, drive], [*views, ("POST", "control", '{"pose": [0, 0, 0]}', 400)])
    # The robot is told to be where its last reference is: its estimates go there.
    first, last = references(events)[:2], references(events)[-2:]
    events = watch(["track", memory, drive], [*views, *wishes([*last, None], None)])
    moments = [data for name, data in events if name == "moment"]
    wish = next(i for i, moment in enumerate(moments) if "a viewer tells" in moment["values"].get("event", ""))
    x, y = moments[wish]["modes"][0][1:3]
    assert math.hypot(x - last[0], y - last[1]) < 1.0, (x, y, last)
    # It is sent to the first reference instead of the last: goal and end are there.
    events = watch(["navigate", memory, "--goal", "view_00011.png", "--scene", "hall"],
                   [*views, *wishes([0, 0, 0], [first[0] + 0.01, first[1]])])
    goals = [data["goal"] for name, data in events if name == "retained" and "goal" in data]
    assert math.dist(goals[-1][:2], first) < 1e-3 and goals[0] != goals[-1], goals


def main():
    what = sys.argv[2]
    if what != "verbs" and PROGRAM is None:
        print("skipped: there is no chromium here")
        return 77
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name)
        if what == "verbs":
            watch_verbs(folder)
            tell_verbs(folder)
            return 0
        shots = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else folder
        if what == "demo":
            subprocess.run([PANONAV, "demo", "--quick", "-o", folder / "demo"], check=True, capture_output=True)
            browser = Browser(folder / "profile")
            try:
                look_at_demo(browser, folder / "demo" / "index.html", shots)
            finally:
                browser.end()
            return 0
        record(folder)
        browser = Browser(folder / "profile")
        run = subprocess.Popen([PANONAV, "track", folder / "hall.panonav", folder / "drive", "--view", "0"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            said = next(line for line in run.stderr if line.startswith("Open "))
            look(browser, re.search(r"http://\S+", said).group(), shots)
            assert run.wait(PATIENCE_S) == 0
            subprocess.run([PANONAV, "track", folder / "hall.panonav", folder / "drive", "--report", folder / "report"],
                           check=True, capture_output=True)
            look_at_report(browser, folder / "report" / "index.html", shots)
        finally:
            browser.end()
            run.kill()
            run.wait()
    return 0


sys.exit(main())
