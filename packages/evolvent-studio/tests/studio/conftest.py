"""A headless Chromium, and a place for screenshots."""

from __future__ import annotations

import os
import pathlib
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from studio.serving import ABSENT, WAIT, part, serving, settle

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
#: Whether a test failed.
FAILED = pytest.StashKey[bool]()


def chromium() -> str | None:
    """A Chromium of this machine: $EVOLVENT_CHROMIUM, or one on the path."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    return os.environ.get("EVOLVENT_CHROMIUM") or next((p for n in names if (p := shutil.which(n))), None)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests with a browser or a served studio are slow."""
    for item in items:
        if {"browser", "server"} & set(getattr(item, "fixturenames", ())):
            item.add_marker("slow")


@pytest.fixture(scope="session", autouse=True)
def state_of_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A state folder for the secret of the user, so that tests leave nothing in the home folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless Chromium; where there is none the test is skipped, with the reason.

    Not for several files: while it runs, no other event loop can be run, as some tests elsewhere do.
    """
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="browser tests need playwright (pip install playwright)"
    )
    if ABSENT:
        pytest.skip(ABSENT[0])
    path = chromium()
    with sync_api.sync_playwright() as playwright:
        try:
            started = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        except sync_api.Error as error:
            reason = str(error).splitlines()[0]
            ABSENT.append(f"browser tests need Chromium (on the path, or $EVOLVENT_CHROMIUM): {reason}")
            pytest.skip(ABSENT[0])
        with pytest.MonkeyPatch.context() as patch:
            if not os.environ.get("EVOLVENT_SCREENSHOTS"):
                leave_out_files(patch, sync_api.Page)
            yield started
        started.close()


def leave_out_files(patch: pytest.MonkeyPatch, page: Any) -> None:
    """Take no screenshots that go into files, where nobody asked for them: each takes a third of a second."""
    taken = page.screenshot
    patch.setattr(page, "screenshot", lambda self, **keys: b"" if "path" in keys else taken(self, **keys))


@pytest.fixture(scope="module")
def server(browser: Any, folder: pathlib.Path) -> Iterator[Any]:
    """A studio that serves the working folder of the tests of a file."""
    with serving(folder) as started:
        yield started


@pytest.fixture(scope="module")
def context(browser: Any) -> Iterator[Any]:
    """One profile for all pages of a file, so that what a page is made of is fetched once; nothing fades in or out."""
    opened = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    opened.set_default_timeout(WAIT)
    opened.add_init_script(AT_ONCE)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def kept_pages() -> list[Any]:
    """The page that the tests of a file share, none before the first of them and after one that failed."""
    return []


@pytest.fixture
def page(request: pytest.FixtureRequest, context: Any, server: Any, kept_pages: list[Any]) -> Iterator[Any]:
    """The page, at the file's `FIRST_TAB`; it asks nothing of another machine, and nothing goes wrong in it.

    It is loaded once for a file: a load costs a browser some seconds of processor time.
    """
    tab, button = getattr(request.module, "FIRST_TAB", ("tab-case", "run"))
    if not kept_pages:
        opened = context.new_page()
        opened.outside, opened.wrong = [], []
        own = (server.url, "data:", "blob:")
        opened.on("request", lambda r: None if r.url.startswith(own) else opened.outside.append(r.url))
        opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
        opened.goto(server.url)
        kept_pages.append(opened)
    shown = kept_pages.pop()
    if shown.locator(".q-dialog").count():  # of the test before
        shown.keyboard.press("Escape")
        shown.locator(".q-dialog").wait_for(state="detached")
    shown.click(part(tab))
    shown.wait_for_selector(part(button))
    settle(shown)
    yield shown
    try:
        assert shown.outside == []
        assert shown.wrong == []
        assert "Traceback" not in server.log.read_text()
    except AssertionError:
        shown.close()
        raise
    if request.node.stash.get(FAILED, False):
        shown.close()
    else:
        kept_pages.append(shown)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Note whether a test failed, for its page."""
    report = yield
    if report.when == "call":
        item.stash[FAILED] = report.failed
    return report


@pytest.fixture(scope="session")
def shots(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Where screenshots go, if they are taken: $EVOLVENT_SCREENSHOTS, or a temporary folder."""
    given = os.environ.get("EVOLVENT_SCREENSHOTS")
    folder = pathlib.Path(given) if given else tmp_path_factory.mktemp("screenshots")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
