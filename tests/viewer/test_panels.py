#!/usr/bin/env python3
"""Whether the page's panels draw what they drew: test_panels.py [FOLDER] draws one made-up run that holds everything a
panel can show and compares each canvas, cell by cell, with its reference in tests/viewer/panels. Writes what differs
into FOLDER. test_panels.py --renew draws the references again: look at them. Exits with 77 (skipped) without chromium.

A cell is the mean colour of 8 x 8 pixels, and what counts is the mean of the 20 that differ most. Text is not drawn, as fonts differ from machine to machine. The tolerance
has to be above what another rasteriser does to edges, which drawing with more pixels tells, and below what a layer that
is missing does: the test measures both.
"""
import base64
import json
import math
import pathlib
import sys
import tempfile
import urllib.parse

from browser import DESK, PROGRAM, Browser

HERE = pathlib.Path(__file__).resolve().parent
WEB = HERE.parent.parent / "src" / "panonav_viewer" / "web"
REFERENCES = HERE / "panels"
CELL_PX = 8
TOLERANCE = 8  # of 255
SIZES = {"pn-map canvas": (480, 360), "pn-timeline": (480, 120), "pn-pictures": (496, 800)}
PANELS = {"map": "pn-map canvas", "timeline": "pn-timeline canvas", "panorama": "#panorama-figure canvas",
          "best": "#best-figure canvas", "difference": "#difference-figure canvas"}
# The mean colours of a canvas over the page's ground, as [columns, rows, PNG of a pixel a cell].
CELLS = """((name, cell) => {
  const from = document.querySelector(name), flat = document.createElement('canvas');
  const [width, height] = [from.clientWidth, from.clientHeight].map(size => Math.ceil(size / cell) * cell);
  [flat.width, flat.height] = [from.width, from.height];
  const context = flat.getContext('2d', { willReadFrequently: true });
  context.fillStyle = getComputedStyle(from).getPropertyValue('--ground');
  context.fillRect(0, 0, flat.width, flat.height);
  context.drawImage(from, 0, 0);
  const small = document.createElement('canvas');
  [small.width, small.height] = [width / cell, height / cell];
  const pixels = small.getContext('2d').createImageData(small.width, small.height), side = cell * from.width / from.clientWidth;
  for (let row = 0; row < small.height; ++row) for (let column = 0; column < small.width; ++column) {
    const [left, top] = [column * side, row * side].map(Math.round);
    const { data } = context.getImageData(left, top, Math.round(side), Math.round(side)), sum = [0, 0, 0];
    for (let i = 0; i < data.length; i += 4) for (const c of [0, 1, 2]) sum[c] += data[i + c];
    const mean = sum.map(value => Math.round(4 * value / data.length));
    pixels.data.set([...mean, 255], 4 * (row * small.width + column));
  }
  small.getContext('2d').putImageData(pixels, 0, 0);
  return small.toDataURL('image/png');
})"""
# Difference of two such PNGs: the mean of the 20 cells that differ most; 255 where their sizes differ.
DIFFERENCE = """(async (...urls) => {
  const [a, b] = await Promise.all(urls.map(async url => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
    canvas.getContext('2d').drawImage(image, 0, 0);
    return canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  }));
  if (a.width !== b.width || a.height !== b.height) return 255;
  const apart = [];
  for (let i = 0; i < a.data.length; i += 4) apart.push(Math.max(...[0, 1, 2].map(c => Math.abs(a.data[i + c] - b.data[i + c]))));
  return apart.sort((x, y) => y - x).slice(0, 20).reduce((sum, value) => sum + value / 20, 0);
})"""


def striped(turn):
    """A panorama with things at six azimuths, as an SVG: no library writes it."""
    things = "".join(f'<rect x="{(70 * i + 13 * (i % 3) + turn) % 480}" y="{2 * i}" width="{20 + 6 * i}" '
                     f'height="{80 - 4 * i}" fill="{colour}"/>'
                     for i, colour in enumerate(("#333", "#bbb", "#1a6a4d", "#ccc080", "#4b2a4f", "#9cb")))
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="480" height="80"><rect width="480" height="80" fill="#777"/>{things}</svg>'
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()


def made_up_run():
    """Twelve moments on an arc of a circle among references on a grid."""
    moments = []
    for i in range(12):
        angle = 0.12 * i
        truth = [4.0 * math.sin(angle), 4.0 - 4.0 * math.cos(angle), angle]
        sure = i > 6
        moments.append({
            "n": i, "t": float(i), "pictures": ["panorama", "best"], "turn": math.pi / 4, "truth": truth, "sure": sure,
            "pose": [truth[0] + 0.25, truth[1] - 0.3, truth[2] + 0.1], "covariance": [0.09, 0.03, 0.04],
            "odometry": [truth[0], truth[1], truth[2]], "state": "localised" if sure else "ambiguous" if i > 3 else "lost",
            "probability": round(1 - math.exp(-0.3 * i), 4), "values": {"best_match": "view_00003.png"},
            "particles": [round(value, 3) for k in range(80) for value in
                          (truth[0] + 0.02 * k * math.cos(2.4 * k), truth[1] + 0.02 * k * math.sin(2.4 * k), 0.1 * k)],
            "modes": [[0.7, truth[0] + 0.25, truth[1] - 0.3, truth[2], 0.09, 0.03, 0.04],
                      [0.3, truth[0] - 1.5, truth[1] + 1.0, 1.0, 0.16, -0.05, 0.09]], "homing": [2.0, 0.7],
            "compared": [value for k in range(35) for value in ((11 * k + i) % 35, 100 + 20 * k)],
            "stages": {"reading": 2.0 + i, "filter": 1.5},
            "data": {"panorama": striped(0), "best": striped(70)}})
    grid = [(0.9 * column - 0.5, 0.9 * row - 1.0) for row in range(5) for column in range(7)]
    edges = [[*grid[i], *grid[i + 1], i % 4] for i in range(0, 34, 2) if i % 7 != 6]
    return {"moments": moments, "retained": {
        "references": [value for at in grid for value in at],
        "regions": [[i % 7 // 4, *(v for dx, dy in ((-.4, -.4), (.4, -.4), (.4, .4), (-.4, .4)) for v in (x + dx, y + dy))]
                    for i, (x, y) in enumerate(grid)],
        "walls": [[-1.0, -1.5, 5.4, -1.5, 5.4, 3.0], [1.6, 1.2, 2.2, 1.3, 2.1, 1.8, 1.5, 1.7, 1.6, 1.2]], "edges": [value for edge in edges for value in edge],
        "plan": [0.0, 3.0, 0.0, 2.0, 2.5, 0.0, 5.0, -0.6, 0.0], "goal": [5.0, -0.6, 0.0],
        "directions": [value for i, at in enumerate(grid) for value in (*at, 0.3 * i)]}}


def without(run, layer):
    """The run as if it told nothing of one layer."""
    run = json.loads(json.dumps(run))
    run["retained"].pop(layer, None)
    for moment in run["moments"]:
        moment.pop(layer, None)
    return run


def page(run):
    """The page with the run in it, its panels as large as SIZES say and without text."""
    imports = {"panonav/" + file.stem: "data:text/javascript;charset=utf-8," + urllib.parse.quote(file.read_text())
               for file in WEB.glob("*.js")}
    style = (WEB / "viewer.css").read_text() + "pn-run, .shown { display: block !important; height: auto !important; }" + "".join(
        f"{name} {{ width: {width}px !important; height: {height}px !important; flex: none !important; }}"
        for name, (width, height) in SIZES.items())
    script = "CanvasRenderingContext2D.prototype.fillText = () => {};"
    text = (WEB / "index.html").read_text().replace("<style>", f"<script>{script}</script><style>", 1)
    data = json.dumps(run).replace("<", "\\u003c")
    for name, filled in (
            ("title", "panels"), ("generator", ""), ("style", style),
            ("imports", f'<script type="importmap">{json.dumps({"imports": imports})}</script>'),
            ("body", f'<pn-run class="whole"><script type="application/json">{data}</script></pn-run>'),
            ("scripts", "<script type=\"module\">import 'panonav/main';</script>")):
        text = text.replace("{{" + name + "}}", filled)
    return text


def draw(browser, run, folder, density=1, panels=PANELS):
    """Cells of panels at the run's last moment."""
    file = folder / "page.html"
    file.write_text(page(run))
    browser.show(DESK | {"height": 1600, "deviceScaleFactor": density})
    browser.call("Page.navigate", url="about:blank")
    browser.wait("location.href === 'about:blank'")
    browser.call("Page.navigate", url=file.as_uri())
    browser.wait("document.querySelector('pn-map')?.run?.last === 11")
    browser.key("End")
    browser.wait("document.querySelector('pn-map').run.index === 11")
    browser.wait("!document.querySelector('pn-pictures').loading")
    browser.settle()
    browser.settle()
    assert not browser.errors, browser.errors
    return {panel: browser.ask(f"{CELLS}({json.dumps(PANELS[panel])}, {CELL_PX})") for panel in panels}


def difference(browser, a, b):
    return browser.ask(f"{DIFFERENCE}({json.dumps(a)}, {json.dumps(b)})")


def compare(browser, folder, kept):
    run = made_up_run()
    drawn = draw(browser, run, folder)
    wrong = []
    for panel, cells in drawn.items():
        reference = "data:image/png;base64," + base64.b64encode((REFERENCES / f"{panel}.png").read_bytes()).decode()
        apart = difference(browser, cells, reference)
        print(f"{panel:10} {apart:5.1f} from its reference, {TOLERANCE} allowed")
        if apart > TOLERANCE:
            wrong.append(panel)
            if kept:
                (kept / f"{panel}.png").write_bytes(base64.b64decode(cells.split(",")[1]))
    assert not wrong, f"{wrong} look different; where that is meant, test_panels.py --renew draws the references again"
    finer = draw(browser, run, folder, 2)
    for panel, cells in finer.items():
        apart = difference(browser, cells, drawn[panel])
        print(f"{panel:10} {apart:5.1f} with twice as many pixels")
        assert apart <= TOLERANCE, panel
    for moment in run["moments"]:
        moment["turn"] = 0.0
    unturned = draw(browser, run, folder)
    for panel in ("best", "difference"):
        apart = difference(browser, unturned[panel], drawn[panel])
        print(f"{panel:10} {apart:5.1f} with the best match not turned")
        assert apart > TOLERANCE, panel
    run = made_up_run()
    for panel, layers in (("map", ("references", "edges", "plan", "directions", "goal", "truth", "pose", "particles",
                                   "regions", "walls", "compared", "modes", "homing")),
                          ("timeline", ("probability", "state"))):
        for layer in layers:
            apart = difference(browser, draw(browser, without(run, layer), folder, panels=[panel])[panel], drawn[panel])
            print(f"{panel:10} {apart:5.1f} without {layer}")
            assert apart > TOLERANCE, f"nobody would notice that {panel} misses {layer}"


def main():
    if PROGRAM is None:
        print("skipped: there is no chromium here")
        return 77
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name)
        browser = Browser(folder / "profile")
        try:
            if sys.argv[1:] == ["--renew"]:
                REFERENCES.mkdir(exist_ok=True)
                for panel, cells in draw(browser, made_up_run(), folder).items():
                    (REFERENCES / f"{panel}.png").write_bytes(base64.b64decode(cells.split(",")[1]))
            else:
                compare(browser, folder, pathlib.Path(sys.argv[1]) if sys.argv[1:] else None)
        finally:
            browser.end()
    return 0


sys.exit(main())
