"""Pictures of the studio: `python docs/images/studio.py` writes studio.png, studio-structure.png and studio-phone.png.

Needs the packages of the tests and a Chromium on the path.
"""

from __future__ import annotations

import pathlib
import shutil
import sys
import tempfile
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

import evolvent
from evolvent import results

FOLDER = pathlib.Path(__file__).parent
sys.path[0] = str(
    FOLDER.parents[1] / "packages" / "evolvent-studio" / "tests"
)  # in place of this folder, whose studio.py hides the tests' package

from studio.serving import ARGUMENTS, choose, chromium, part, serving  # noqa: E402

VIEWER = "document.querySelector('.ev-motion')?.viewer"
#: Time that is shown of the winding rib, s.
TIME = 40.0


def opened(browser: Any, url: str, width: int, height: int) -> Any:
    """A page of a size, in the light scheme."""
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="light")
    page.set_default_timeout(120_000)
    page.goto(url)
    page.wait_for_selector(part("tab-runs"))
    page.wait_for_timeout(800)
    return page


def show_run(page: Any) -> None:
    """Open the run of the rib at the time that is shown."""
    page.click(part("tab-runs"))
    page.locator(".ev-link", has_text="wrapped-rib.nc").click()
    page.wait_for_timeout(2500)  # the page shows the start of a case before
    page.wait_for_function(f"{VIEWER}?.motions?.length")
    page.evaluate(f"{VIEWER}.go({TIME})")
    page.wait_for_timeout(800)


def keep(page: Any, name: str) -> None:
    """Write a picture of the page."""
    path = FOLDER / name
    page.screenshot(path=path)
    Image.open(path).convert("RGB").save(path, optimize=True)
    print(f"{name}: {path.stat().st_size / 1000:.0f} kB", flush=True)


def main() -> None:
    """Run the rib, serve its folder and take the pictures."""
    folder = pathlib.Path(tempfile.gettempdir()) / "wrapped-rib"  # the page shows its name
    folder.mkdir()
    try:
        results.save(evolvent.run("wrapped-rib"), folder / "wrapped-rib.nc")
        with serving(folder) as server, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=ARGUMENTS)
            page = opened(browser, server.url, 1440, 900)
            show_run(page)
            keep(page, "studio.png")
            page.close()
            page = opened(browser, server.url, 1440, 900)
            page.click(part("tab-case"))
            choose(page, "case", "boom-slew")
            page.wait_for_timeout(2500)
            keep(page, "studio-structure.png")
            page.close()
            page = opened(browser, server.url, 390, 844)
            show_run(page)
            keep(page, "studio-phone.png")
            browser.close()
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
