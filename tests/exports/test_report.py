"""The report: one page that needs nothing else, says how the run ended first, and renders."""

import base64
import datetime
import functools
import html.parser
import pathlib
import re
import shutil
import subprocess

import imageio.v3 as imageio
import numpy as np
import pytest

from evolvent import cases
from evolvent.exports import report
from evolvent_base import pages, plots, showing

DATE = datetime.datetime(2026, 5, 4, 12, 30, tzinfo=datetime.UTC)
_VOID = {"meta", "img", "br", "link", "input"}


class Page(html.parser.HTMLParser):
    """Elements of a page, in order, with their text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.text.append(data)


@pytest.fixture
def write(tmp_path):
    def made(run):
        path = tmp_path / "report.html"
        report.write(run, str(path), date=DATE)
        return path, Page(path.read_text(encoding="utf-8"))

    return made


@pytest.fixture(scope="module")
def reported(runs, tmp_path_factory):
    """The report of a run by its name, written once."""

    @functools.cache
    def path(name):
        found = tmp_path_factory.mktemp("reports") / f"{name}.html"
        report.write(runs[name], str(found), date=DATE)
        return found

    return path


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heliogyro", "stand", "rib"])
def test_holds_everything_and_needs_nothing(runs, reported, name):
    run, path = runs[name], reported(name)
    page = Page(path.read_text(encoding="utf-8"))
    text = " ".join(page.text)
    module = cases.system(run.attrs["system"])
    for number in module.numbers(run):
        assert number.value in text
    for figure in module.figures(run):
        assert figure.title in text
    assert run.attrs["case"] in text
    for word in ("evolvent 0.", "Python 3.", "numpy ", "numba ", " cores", "4 May 2026, 12:30 UTC", "largest defect"):
        assert word in text
    assert datetime.datetime.fromisoformat(run.attrs["date"]).strftime("%B %Y") in text
    assert __import__("platform").node() not in text
    # images are within the page, the animation too; nothing is loaded from elsewhere
    images = [attrs["src"] for tag, attrs in page.seen if tag == "img"]
    assert len(images) == len(module.figures(run)) + 3
    for source in images:
        kind, content = re.fullmatch(r"data:image/(png|svg\+xml);base64,(.*)", source).groups()
        start = base64.b64decode(content)[:60]
        assert start.startswith(b"\x89PNG" if kind == "png" else b"<?xml")
    frames = [attrs for tag, attrs in page.seen if tag == "iframe"]
    assert len(frames) == 1
    assert frames[0]["sandbox"] == "allow-scripts"
    Page(frames[0]["srcdoc"].partition("<script>")[0] + "</body></html>")
    assert '"playing":false' in frames[0]["srcdoc"]
    assert not any(tag in ("script", "link") for tag, _ in page.seen)
    assert all(attrs.get("href", "#").startswith("#") for _, attrs in page.seen)
    assert not re.search(r'(src|href)="?https?:', path.read_text())
    assert path.stat().st_size < 4e6


@pytest.mark.usefixtures("sketched")
def test_a_failed_run_is_labelled_at_the_top(failed, write):
    _, page = write(failed)
    text = " ".join(page.text)
    assert "This run failed" in text
    assert text.index("This run failed") < text.index("time reached")
    message = failed.attrs["message"]
    assert message[0].upper() + message[1:] in text
    assert "is no result of the whole case" in text


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_interrupted_warned_and_old_runs(runs, write):
    old = runs["rib"].isel(time=[0, 1])
    old.attrs |= {"status": "interrupted", "message": "interrupted at t = 4 s", "warning": "a <b> & c"}
    del old.attrs["date"], old.attrs["made_with"]
    path, page = write(old)
    text = " ".join(page.text)
    assert "This run was interrupted" in text
    assert "A <b> & c" in text
    assert "A &lt;b&gt; &amp; c" in path.read_text()
    assert "not recorded" in text


@pytest.mark.parametrize("name", ["heliogyro", "stand", "rib"])
def test_a_single_sample_is_reported(runs, write, name):
    _, page = write(runs[name].isel(time=[0]))
    assert not any(tag == "iframe" for tag, _ in page.seen)


@pytest.fixture
def browser():
    found = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chromium-browser")
    if found is None:
        pytest.skip("there is no Chromium here to render the report with")
    return found


@pytest.mark.slow
def test_it_fits_a_narrow_screen(reported, browser):
    playwright = pytest.importorskip("playwright.sync_api")
    path = reported("rib")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        page = opened.new_page(viewport={"width": 390, "height": 800})
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == 390  # wide tables scroll, the page does not
        opened.close()


@pytest.mark.slow
def test_chromium_renders_it(reported, tmp_path, browser):
    path = reported("heliogyro")
    shot = tmp_path / "shot.png"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=900,1500"]
    private = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [browser, *options, private, "--virtual-time-budget=2000", f"--screenshot={shot}", path.as_uri()],
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert shot.exists(), done.stderr.decode()[-500:]
    picture = imageio.imread(shot)[..., :3].astype(int)
    green = (abs(picture - np.array([0x00, 0x79, 0x5A])).max(axis=-1) < 12).sum()
    assert green > 300  # the mark of success
    animation = picture[900:, 100:800]
    assert len(np.unique(animation.reshape(-1, 3), axis=0)) > 50


@pytest.mark.slow
def test_the_report_shows_the_figures_that_were_written(runs, tmp_path, monkeypatch):
    """None is drawn a second time, and the titles that the images have are not repeated above them."""
    run = runs["heliogyro"]
    figures = cases.presenter(run).figures(run)
    written = plots.draw(figures[:-1], tmp_path)
    drawn = []
    monkeypatch.setattr(showing, "figure_picture", lambda one: drawn.append(one.name) or pages.Picture("", ""))
    report.write(run, str(tmp_path / "r.html"), date=DATE, written=written)
    page = Page((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert drawn == [figures[-1].name]
    images = {attrs["alt"]: attrs["src"] for tag, attrs in page.seen if tag == "img"}
    for figure, path in zip(figures, written, strict=False):
        assert base64.b64decode(images[figure.title].partition(",")[2]) == pathlib.Path(path).read_bytes()
    assert figures[0].title not in page.text
