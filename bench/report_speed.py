#!/usr/bin/env python3
"""How fast a report opens and scrubs in Chromium: report_speed.py PANONAV [PICTURES]

A drive of N pictures (1000) through a hall, tracked; its page opened from its file until the first panorama is
drawn, the best of three, and its slider moved 150 times, once a frame. Needs the browser of tests/viewer.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "tests" / "viewer"))
from browser import DESK, Browser

PANONAV, PICTURES = pathlib.Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 1000
SCRUB = """(async () => {
  const slider = document.querySelector('.slider'), steps = 150, times = [];
  document.querySelector('pn-run').scrollIntoView();
  let last = performance.now();
  for (let i = 0; i < steps; ++i) {
    slider.value = Math.round(i / steps * slider.max);
    slider.dispatchEvent(new Event('input'));
    await new Promise(requestAnimationFrame);
    const now = performance.now();
    times.push(now - last);
    last = now;
  }
  const sum = times.reduce((a, b) => a + b, 0);
  times.sort((a, b) => a - b);
  return JSON.stringify([1000 * steps / sum, times[steps / 2], times[Math.floor(0.95 * steps)]]);
})()"""


def main():
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name)
        panonav = lambda *words: subprocess.run([PANONAV, *map(str, words), "--quiet"], check=True, capture_output=True)
        panonav("simulate", "hall", folder / "grid", "--grid", "1", "--kind", "panorama", "--seed", "3")
        panonav("simulate", "hall", folder / "drive", "--kind", "panorama", "--seed", "3", "--path", "walk",
                "--spacing-m", "0.06", "--poses", PICTURES)
        panonav("memorise", folder / "hall.panonav", folder / "grid")
        panonav("track", folder / "hall.panonav", folder / "drive", "--report", folder / "report")
        page = folder / "report" / "index.html"
        browser = Browser(folder / "profile")
        try:
            browser.show(DESK)
            opened = []
            for _ in range(3):
                browser.call("Page.navigate", url="about:blank")
                browser.settle()
                began = time.monotonic()
                browser.call("Page.navigate", url=page.as_uri())
                browser.wait("document.querySelector('pn-pictures .panorama canvas')?.width > 300")
                opened.append(time.monotonic() - began)
            rate, median_ms, most_ms = json.loads(browser.ask(SCRUB))
        finally:
            browser.end()
        print(f"{PICTURES} pictures, {page.stat().st_size / 1e6:.1f} MB: first panorama {min(opened):.2f} s after the page "
              f"was asked for; scrubbing {rate:.0f} frames a second, a frame {median_ms:.0f} ms, 95 % within {most_ms:.0f} ms")


main()
