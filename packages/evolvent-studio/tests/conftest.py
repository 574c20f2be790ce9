"""A headless Chromium, and a place for screenshots."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterator
from typing import Any

import pytest

from studio.serving import ABSENT, ARGUMENTS, AT_ONCE, WAIT, chromium, part, serving, settle

#: Size of the page.
SCREEN = {"width": 1440, "height": 900}
#: Whether a test failed.
FAILED = pytest.StashKey[bool]()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests with a browser or a served studio are slow; those with a browser come last.

    All of them share it, and while it runs, no other event loop can be run, as other tests do.
    """
    for item in items:
        if {"browser", "server"} & set(getattr(item, "fixturenames", ())):
            item.add_marker("slow")
    items.sort(key=lambda item: "browser" in getattr(item, "fixturenames", ()))


@pytest.fixture(scope="session", autouse=True)
def state_of_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A state folder for the secret of the user, so that tests leave nothing in the home folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium; where there is none the test is skipped, with the reason."""
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


@pytest.fixture(scope="session")
def work(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The working folder of the studio; each file of tests adds what its own need, as its fixture `folder`."""
    place = tmp_path_factory.mktemp("studio") / "work"
    place.mkdir()
    return place


@pytest.fixture(scope="session")
def server(browser: Any, work: pathlib.Path) -> Iterator[Any]:
    """A studio that serves the working folder: a start takes ten seconds of processor time."""
    with serving(work) as started:
        yield started


@pytest.fixture(scope="session")
def context(browser: Any) -> Iterator[Any]:
    """One profile for all pages, so that what a page is made of is fetched once; nothing fades in or out."""
    opened = browser.new_context(viewport=SCREEN, accept_downloads=True)
    opened.set_default_timeout(WAIT)
    opened.add_init_script(AT_ONCE)
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def kept_pages() -> list[Any]:
    """The page that the tests share, none before the first of them and after one that failed."""
    return []


@pytest.fixture
def page(
    context: Any, server: Any, folder: pathlib.Path, kept_pages: list[Any], request: pytest.FixtureRequest
) -> Iterator[Any]:
    """The page, with the panel of the case; it asks nothing of another machine, and nothing goes wrong in it.

    It is loaded once: a load costs a browser some seconds of processor time.
    """
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
    shown.set_viewport_size(SCREEN)
    if getattr(shown, "tests", "") != request.module.__name__:  # a panel lists new files when it is turned to
        shown.tests = request.module.__name__
        shown.click(part("tab-runs"))
        shown.wait_for_selector(part("runs"))
    shown.click(part("tab-case"))
    shown.wait_for_selector(part("run"))
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
