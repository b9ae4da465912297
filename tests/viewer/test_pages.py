#!/usr/bin/env python3
"""Pages as people see them: test_pages.py PANONAV [FOLDER] writes each kind of report, with and without positions, and
looks at it on a desk, on a phone and on paper. Screenshots go into FOLDER. Exits with 77 (skipped) without chromium.
"""
import base64
import pathlib
import re
import subprocess
import sys
import tempfile

from browser import PROGRAM, Browser

PANONAV = sys.argv[1]
DESK = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
PHONE = {"width": 420, "height": 860, "deviceScaleFactor": 1, "mobile": True}
PAPER = {"width": 720, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
# Notes where each canvas has text since it was last cleared.
NOTE_TEXTS = """(() => {
  const context = CanvasRenderingContext2D.prototype, { fillText, clearRect } = context;
  const width = Object.getOwnPropertyDescriptor(HTMLCanvasElement.prototype, 'width');
  Object.defineProperty(HTMLCanvasElement.prototype, 'width', { ...width, set(value) { this.texts = []; width.set.call(this, value); } });
  context.clearRect = function (...box) { this.canvas.texts = []; return clearRect.apply(this, box); };
  context.fillText = function (text, x, y, most) {
    const size = this.measureText(text), shrunk = most < size.width ? most / size.width : 1;
    (this.canvas.texts ??= []).push({ text, left: x - size.actualBoundingBoxLeft * shrunk, right: x + size.actualBoundingBoxRight * shrunk,
      top: y - size.actualBoundingBoxAscent, bottom: y + size.actualBoundingBoxDescent });
    return most === undefined ? fillText.call(this, text, x, y) : fillText.call(this, text, x, y, most);
  };
})();"""
# Faults of the page: each one a sentence.
FAULTS = """(isPaper => {
  const faults = [], name = e => `${e.localName}.${e.className}`, shown = e => e.checkVisibility() && e.getBoundingClientRect().width > 1;
  const overlap = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
  if (document.documentElement.scrollWidth > innerWidth) faults.push(`the page is ${document.documentElement.scrollWidth} wide`);
  for (const e of document.querySelectorAll('body *')) {
    if (!shown(e) || e.closest('.unseen, script')) continue;
    const style = getComputedStyle(e), scrolls = side => !['visible'].includes(style[side]);
    if (e.getBoundingClientRect().right > innerWidth + 1) faults.push(`${name(e)} is beyond the edge`);
    if (scrolls('overflowX') && e.scrollWidth > e.clientWidth + 1) faults.push(`${name(e)} is cut at the side`);
    if (isPaper && scrolls('overflowY') && e.scrollHeight > e.clientHeight + 2) faults.push(`${name(e)} is cut below`);
    if (isPaper && e.matches('button:not(ol button), input, select')) faults.push(`${name(e)} is a control`);
    const text = [...e.childNodes].filter(node => node.nodeType === 3).map(node => node.textContent).join(' ');
    const raw = text.replace(/\\S+\\.(png|jpg|panonav)\\b|tmp[a-z0-9_]{8}/g, '').match(/\\b[a-z]+(_[a-z0-9]+)+\\b/);
    if (raw && !e.closest('pre')) faults.push(`${raw[0]} is no word`);
  }
  for (const canvas of document.querySelectorAll('canvas')) {
    if (!shown(canvas)) continue;
    const box = canvas.getBoundingClientRect(), texts = canvas.texts ?? [], of = name(canvas.parentElement);
    texts.forEach((a, i) => {
      if (!isPaper && (a.left < -1 || a.right > box.width + 1 || a.top < -1 || a.bottom > box.height + 1)) faults.push(`${of} cuts ${a.text}`);
      for (const b of texts.slice(0, i)) if (overlap(a, b)) faults.push(`${of} draws ${a.text} over ${b.text}`);
    });
    const legend = canvas.parentElement.querySelector('.legend');
    if (legend && shown(legend) && overlap(legend.getBoundingClientRect(), box)) faults.push(`the legend of ${of} lies over it`);
  }
  const light = getComputedStyle(document.body).backgroundColor;
  if (isPaper && light !== 'rgb(255, 255, 255)') faults.push(`paper is ${light}`);
  return [...new Set(faults)];
})"""
# Plots and maps that are blank: all their pixels have the same colour, but for the scale bar in the corner.
BLANK = """[...document.querySelectorAll('pn-plan canvas, pn-map canvas, pn-chart canvas')].filter(canvas => {
  if (!canvas.checkVisibility()) return false;
  const top = Math.round(canvas.height * 0.15), { data } = canvas.getContext('2d').getImageData(0, top, canvas.width, canvas.height - top);
  return new Set(new Uint32Array(data.buffer)).size < 2;
}).map(canvas => canvas.parentElement.localName)"""
# Brings every plot near the visible part.
SCROLL = """(async () => {
  for (let y = 0; y < document.documentElement.scrollHeight; y += 700) { scrollTo(0, y); await new Promise(done => setTimeout(done, 20)); }
  scrollTo(0, 0);
})()"""


def panonav(*words, codes=(0,)):
    done = subprocess.run([PANONAV, *map(str, words)], capture_output=True, text=True)
    assert done.returncode in codes, (words, done.stderr)


def write_reports(folder):
    """Reports of all verbs on a small hall, and of those that need no positions on pictures without any."""
    size = ("--kind", "panorama", "--rows", "40", "--columns", "256", "--rays-per-axis", "1")
    grid, drive, memory, bare = folder / "grid", folder / "drive", folder / "hall.panonav", folder / "bare"
    panonav("simulate", "hall", grid, "--grid", "1.2", "--seed", "3", *size)
    panonav("simulate", "hall", drive, "--path", "walk", "--spacing-m", "0.1", "--poses", "24", "--seed", "3", *size)
    panonav("memorise", memory, grid)
    panonav("route", "record", memory, drive, "--report", folder / "recorded")
    panonav("localise", memory, drive, "--report", folder / "localised")
    panonav("track", memory, drive, "--report", folder / "tracked", codes=(0, 1))
    panonav("route", "follow", memory, drive, "--report", folder / "followed")
    panonav("map", folder / "map.panonav", drive, "--report", folder / "mapped")
    panonav("arrange", memory, "--report", folder / "arranged")
    panonav("home", "view_00003.png", drive, "--memory", memory, "--report", folder / "home", codes=(0, 1))
    panonav("catchment", grid, "--report", folder / "catchment")
    panonav("navigate", memory, "--goal", "view_00011.png", "--scene", "hall", "--report", folder / "mission", codes=(0, 1))
    panonav("gallery", memory, "-o", folder / "gallery")
    bare.mkdir()
    for file in drive.glob("*.png"):
        (bare / f"IMG_20251006_201042_00_{file.name}").write_bytes(file.read_bytes())
    kind = ("--kind", "panorama", "--elevation-deg", "-30", "40")
    panonav("memorise", folder / "bare.panonav", bare, *kind)
    panonav("localise", folder / "bare.panonav", bare, "--report", folder / "bare_localised")
    panonav("map", folder / "bare_map.panonav", bare, *kind, "--report", folder / "bare_mapped")
    panonav("arrange", folder / "bare.panonav", "--report", folder / "bare_arranged")
    panonav("gallery", folder / "bare.panonav", "-o", folder / "bare_gallery")
    return sorted([*folder.glob("*/index.html"), *folder.glob("*/gallery.html")])


def save(browser, file):
    height = int(browser.call("Page.getLayoutMetrics")["cssContentSize"]["height"])
    width = browser.ask("innerWidth")
    shot = browser.call("Page.captureScreenshot", format="png", captureBeyondViewport=True,
                        clip={"x": 0, "y": 0, "width": width, "height": min(height, 9000), "scale": 1})
    file.write_bytes(base64.b64decode(shot["data"]))


def look_at(browser, page, shots):
    """The faults of a page on each medium."""
    faults = []
    for medium, screen in (("desk", DESK), ("phone", PHONE), ("paper", PAPER)):
        browser.show(screen, medium == "paper")
        browser.call("Emulation.setEmulatedMedia", media="", features=[
            {"name": "prefers-color-scheme", "value": "dark" if medium == "paper" else "light"},
            {"name": "prefers-reduced-motion", "value": "reduce"}])
        browser.call("Page.navigate", url="about:blank")
        browser.wait("location.href === 'about:blank'")
        browser.call("Page.navigate", url=page.as_uri())
        browser.wait("document.readyState === 'complete'")
        if medium == "paper":
            # Scripts run as before printing; plots that were never near the visible part are drawn, too.
            browser.ask("dispatchEvent(new Event('beforeprint'))")
            browser.call("Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        else:
            browser.ask(SCROLL)
        browser.settle()
        browser.settle()
        faults += [f"{page.parent.name} on {medium}: {fault}"
                   for fault in browser.ask(f"{FAULTS}({'true' if medium == 'paper' else 'false'})")]
        # Nobody has started an animation: it shows what it leads to.
        faults += [f"{page.parent.name} on {medium}: {blank} is blank" for blank in browser.ask(BLANK)]
        if shots:
            save(browser, shots / f"{page.parent.name}_{medium}.png")
    assert not browser.errors, browser.errors
    browser.call("Emulation.setEmulatedMedia", media="", features=[])
    return faults


def look_at_live_page(browser, folder):
    """A run without positions has no empty map, and the bare address says where the page is."""
    run = subprocess.Popen([PANONAV, "localise", folder / "bare.panonav", folder / "bare", "--view", "0"],
                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        said = next(line for line in run.stderr if line.startswith("Open "))
        url = re.search(r"http://[\d.:]+/\w+/", said).group()
        browser.show(DESK)
        browser.call("Page.navigate", url=re.match(r"http://[\d.:]+/", url).group())
        browser.wait("document.body?.textContent.includes('Open http://')")
        browser.errors.clear()  # the status of this page is 404
        browser.call("Page.navigate", url=url)
        browser.wait("document.querySelector('#panorama-figure canvas')?.width > 300")
        assert browser.ask("document.querySelector('pn-map').checkVisibility()")
        faults = browser.ask(f"{FAULTS}(false)")
        assert not faults, faults
    finally:
        run.kill()
        run.wait()


def main():
    if PROGRAM is None:
        print("skipped: there is no chromium here")
        return 77
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name)
        shots = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
        pages = write_reports(folder)
        assert len(pages) == 14, pages
        browser = Browser(folder / "profile")
        try:
            browser.call("Page.addScriptToEvaluateOnNewDocument", source=NOTE_TEXTS)
            faults = [fault for page in pages for fault in look_at(browser, page, shots)]
            assert not faults, "\n".join(["faults:", *faults])
            look_at_live_page(browser, folder)
        finally:
            browser.end()
    return 0


sys.exit(main())
