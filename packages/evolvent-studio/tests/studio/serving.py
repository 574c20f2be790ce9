"""A studio that is served from a folder, by its own process."""

from __future__ import annotations

import contextlib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

#: Of the browser.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]

#: Run in each page: no transitions, which are drawn in software and awaited.
AT_ONCE = """addEventListener("DOMContentLoaded", () => {
  const style = document.createElement("style");
  style.textContent = "*, *::before, *::after { transition: none !important; animation-duration: 1ms !important; }";
  document.head.append(style);
});"""

#: A run that takes a second: short blades of few nodes.
SHORT = """\
system: heliogyro
body: {inertia: 0.004 kg m^2, rate: 6 rad/s, spool_offset: 0.05 m}
blade: {length: 1 m, line_density: 0.735 g/m, tip_mass: 0.5 g, nodes: 6}
spool: {radius: 1 cm, rate: 3.5 rad/s}
output: {every: 0.2 s}
"""
#: The same with springs so stiff that it takes a minute.
LONG = SHORT.replace("nodes: 6}", "nodes: 20, stiffness: 1e8 N/m, damping: 0.1 N s/m}").replace("0.2 s", "0.05 s")

#: Why no browser can be started, once one of the files has tried.
ABSENT: list[str] = []
#: Longest wait for a page, ms.
WAIT = 120_000
#: Timeouts for an entry of a list, ms, tried in turn: a redrawn page may have closed the list, and slow machines need
#: more time.
TRIES = (1_000, 2_000, 4_000, 8_000, 16_000, 32_000)


def chromium() -> str | None:
    """A Chromium of this machine: $EVOLVENT_CHROMIUM, or one on the path."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    return os.environ.get("EVOLVENT_CHROMIUM") or next((p for n in names if (p := shutil.which(n))), None)


def part(name: str) -> str:
    """What finds an element of the page."""
    return f'[data-testid="{name}"]'


#: Returns when the page shows what the server has sent in answer to all before: the first answer comes after the server
#: has handled what was done before, the second after what it sent thereupon.
_SETTLED = """async () => {
  for (let k = 0; k < 2; k++)
    await new Promise((done) => socket.emit("ack", { client_id: clientId, next_message_id: 0 }, done));
}"""


def settle(page: Any) -> None:
    """Wait until the page shows what the server answers at once; not what it does later, as by a timer or a process."""
    page.wait_for_function("window.did_handshake")
    page.evaluate(_SETTLED)
    frames(page)


def frames(page: Any) -> None:
    """Wait until the page has drawn what was changed in it: two frames."""
    page.evaluate("async () => { for (let k = 0; k < 2; k++) await new Promise(requestAnimationFrame); }")


def choose(page: Any, select: str, option: str | re.Pattern[str], *, typed: str = "") -> None:
    """Choose an entry of one of the page's lists, by its whole text or a pattern.

    `typed` is typed before, which leaves those entries that contain it. The list is opened again where the page redraws
    it meanwhile.
    """
    from playwright.sync_api import TimeoutError as PlaywrightTimeout

    wanted = re.compile(rf"^{re.escape(option)}$") if isinstance(option, str) else option
    entry = page.locator(".q-menu .q-item").filter(has_text=wanted).first
    for wait in TRIES:
        page.locator(f".q-field:has({part(select)})").click()
        if typed:
            page.locator(part(select)).fill(typed)
        try:
            entry.click(timeout=wait)
            break
        except PlaywrightTimeout:
            page.keyboard.press("Escape")
    else:
        raise AssertionError(f"{select} has no entry {option!r}")
    page.locator(".q-menu[class*='-leave-']").first.wait_for(state="detached")
    settle(page)


def open_study(page: Any, name: str) -> None:
    """Open a finished study from the list of its panel, again where the list is redrawn under the click."""
    from playwright.sync_api import TimeoutError as PlaywrightTimeout

    link, chart = page.locator(part(f"study-{name}")), page.locator(f"{part('study-chart')} canvas").first
    for _ in range(8):
        link.click()
        try:
            chart.wait_for(timeout=8_000)
            break
        except PlaywrightTimeout:
            continue
    else:
        raise AssertionError(f"the study {name!r} does not open")
    settle(page)


class Server:
    """A studio that runs in its own process."""

    def __init__(self, folder: pathlib.Path, *options: str) -> None:
        self.folder = folder
        self.log = folder.parent / f"{folder.name}.log"
        command = [sys.executable, "-m", "evolvent", "studio", "--port", "0", "--no-browser", *options]
        if "--token" not in options:
            command.append("--no-token")
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        for name in list(environment):  # NiceGUI behaves otherwise where it believes that it is tested itself
            if name.startswith(("PYTEST_", "NICEGUI_")):
                del environment[name]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, env=environment)
        self.url = self._url()

    def _url(self) -> str:
        for _ in range(600):
            found = re.search(r"http://\S+", self.log.read_text())
            if found:
                return found[0]
            if self.process.poll() is not None:
                break
            time.sleep(0.1)
        raise AssertionError(f"the studio did not start: {self.log.read_text()}")

    def stop(self) -> str:
        """End it as Ctrl-C does; returns what it printed."""
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.log.read_text()


@contextlib.contextmanager
def serving(folder: pathlib.Path, *options: str) -> Iterator[Server]:
    pytest.importorskip("nicegui", reason="the studio needs nicegui (extra studio)")
    server = Server(folder, *options)
    try:
        yield server
    finally:
        if server.process.poll() is None:
            server.stop()
