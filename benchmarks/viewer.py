"""The viewer: JavaScript time of a frame, for structures of 200 nodes and more.

    python benchmarks/viewer.py [-o benchmarks/viewer.json] [--frames 300]

Every motion is computed, written as a page and played in headless Chromium (on the path, or $EVOLVENT_CHROMIUM) at
1440 x 900. A frame is one call of the viewer's function for a frame: interpolation, projection, sorting, drawing on the
canvas and the numbers beside it, all frames between samples of the run. The median and the 95th percentile are taken
over the frames after the first 30, by `performance.now()`. What the browser does with the picture afterwards is not in
it.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import shutil
import sys
import tempfile
from typing import Any

import numpy as np

import evolvent
from evolvent.results.motion import Motion
from evolvent.view import animation

#: Largest median of a frame of 200 nodes, ms.
WANTED = 5.0
#: Frames that are not counted, while the browser compiles.
FIRST = 30
_TIMED = """
async (count) => {
  const viewer = document.getElementById("viewer").viewer, times = [], tick = viewer.tick;
  viewer.speed = (viewer.end - viewer.begin) / 60;
  viewer.go(viewer.begin);
  viewer.play(true);
  await new Promise((done) => {
    viewer.tick = function (clock) {
      const began = performance.now();
      tick.call(this, clock);
      times.push(performance.now() - began);
      if (times.length === count) done();
    };
  });
  viewer.tick = tick;
  return times;
}
"""
_WIRES = [f"wire {side}" for side in ("east", "north", "west", "south")]


def motions() -> dict[str, tuple[Motion, bool]]:
    """Motions by name, and whether trails are shown."""
    fine = {f"parts.{wire}.elements": 49 for wire in _WIRES} | {"simulate.until": "2 s", "simulate.every": "0.02 s"}
    wires = _of_case("wire-boom-satellite", fine)
    finer = fine | {f"parts.{wire}.elements": 149 for wire in _WIRES}
    blades = {"blade.nodes": 100, "blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "0.5 s"}
    return {
        "wires, 200 nodes": (wires, False),
        "wires, 200 nodes, trails": (wires, True),
        "heliogyro, 2 x 100 nodes": (_of_case("heliogyro", blades), False),
        "wires, 600 nodes": (_of_case("wire-boom-satellite", finer), False),
    }


def _of_case(name: str, changes: dict[str, Any]) -> Motion:
    motion = animation.of_run(evolvent.run(name, changes))
    assert motion is not None
    return motion


def timed(browser: Any, folder: pathlib.Path, motion: Motion, trails: bool, frames: int) -> np.ndarray:
    """Time of every frame, ms."""
    path = folder / "page.html"
    path.write_bytes(animation.page(motion, playing=False)[0])
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.goto(path.as_uri())
    page.wait_for_timeout(300)
    if trails:
        page.keyboard.press("t")
    found = np.array(page.evaluate(_TIMED, frames + FIRST))[FIRST:]
    page.close()
    return found


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("viewer.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default, help="JSON file (default: %(default)s)")
    parser.add_argument("--frames", type=int, default=300, help="frames of each motion (default: %(default)s)")
    options = parser.parse_args()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("this benchmark needs playwright: pip install playwright")
        return 1
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    chromium = os.environ.get("EVOLVENT_CHROMIUM") or next((p for n in names if (p := shutil.which(n))), None)
    before, found = os.getloadavg(), {}
    print(f"{'':28} {'points':>6} {'median, ms':>10} {'95 %, ms':>9}  wanted")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        for name, (motion, trails) in motions().items():
            times = timed(browser, pathlib.Path(folder), motion, trails, options.frames)
            points = sum(line.points.shape[1] for line in motion.lines)
            middle, high = float(np.median(times)), float(np.percentile(times, 95.0))
            found[name] = {"points": points, "median_ms": middle, "p95_ms": high}
            wanted = f"median < {WANTED:g} ms" if "600" not in name else ""
            print(f"{name:28} {points:6} {middle:10.2f} {high:9.2f}  {wanted}")
        version = browser.version
        browser.close()
    report = {"load": [before, os.getloadavg()], "chromium": version, "frames": options.frames, "figures": found}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
