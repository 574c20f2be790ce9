"""Structures on the page in a real browser: parts, the picture of the start, a run with its figures."""

from __future__ import annotations

import io
import urllib.request
import zipfile

import pytest

from evolvent import cases
from studio.serving import choose, part, serving

#: Whether the picture of the start is drawn, and how far its first line reaches along x, m.
DRAWN = "document.querySelector('.ev-start .ev-motion')?.viewer"
TIP = (
    f"(() => {{ const line = {DRAWN}?.motions[0].lines[0]; return line ? line.points[3 * line.count - 3] : null; }})()"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A working folder with a shortened slew."""
    place = tmp_path_factory.mktemp("structures") / "work"
    place.mkdir()
    content = cases.content_of("boom-slew", {"simulate.until": "0.4 s"})
    (place / "slew.yaml").write_text(cases.dump(content))
    return place


@pytest.fixture(scope="module")
def server(browser, folder):
    with serving(folder) as started:
        yield started


@pytest.fixture
def page(browser, server):
    """A page; it asks nothing of another machine, and nothing goes wrong in it."""
    opened = browser.new_page(viewport={"width": 1400, "height": 900})
    outside, errors = [], []
    opened.on("request", lambda r: outside.append(r.url) if not r.url.startswith((server.url, "data:", "blob:")) else 0)
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.set_default_timeout(40_000)
    opened.goto(server.url)
    opened.click(part("tab-case"))
    opened.wait_for_selector(part("run"))
    opened.wait_for_timeout(400)
    yield opened
    opened.close()
    assert outside == []
    assert errors == []
    assert "Traceback" not in server.log.read_text()


def add(page, kind, name=None):
    """Add a part of a kind; the name is the proposed one unless given."""
    page.click(part("add-part"))
    page.locator(f".q-field:has({part('part-kind')})").click()
    page.keyboard.type(kind)
    page.locator(".q-menu .q-item").filter(has_text=f"{kind}:").first.click()
    page.wait_for_function("s => document.querySelector(s).value !== ''", arg=part("part-name"))
    if name is not None:
        page.locator(part("part-name")).fill(name)
    page.click(part("part-done"))
    page.locator(part("part-done")).wait_for(state="detached")


def choose_from_menu(page, name, word):
    page.click(part(f"part-menu-{name}"))
    page.locator(".q-menu .q-item").filter(has_text=word).click()


def fill(page, part_name, **values):
    for key, value in values.items():
        page.locator(part(f"field-parts.{part_name}.{key}")).fill(value)


def reaches(page, x):
    """Wait until the first line of the start ends at x, m."""
    page.wait_for_function(f"x => Math.abs({TIP} - x) < 1e-6", arg=x)


def test_the_start_follows_what_is_typed(page, shots):
    choose(page, "case", "boom-slew")
    reaches(page, 3.2)
    page.click(part("part-boom"))
    length = page.locator(part("field-parts.boom.length"))
    length.fill("1.5 m")
    reaches(page, 1.7)
    page.screenshot(path=shots / "structure.png")
    length.fill("1.5 kg")
    page.locator(f"{part('error-parts.boom.length')} >> text=unit of something else").wait_for()
    page.locator(f"{part('start-error')} >> text=parts.boom.length").wait_for()
    assert not page.locator(part("start")).is_visible()
    assert not page.locator(part("run")).is_enabled()
    page.screenshot(path=shots / "structure-error.png")
    length.fill("2 m")
    reaches(page, 2.2)
    assert page.locator(part("start")).is_visible()
    assert page.locator(part("run")).is_enabled()


def test_a_structure_is_built_up_renamed_and_taken_apart(page, shots):
    choose(page, "case", "new structure")
    page.wait_for_function(f"{DRAWN} && {TIP} === null")
    add(page, "beam")
    page.locator(f"{part('error-parts.beam.length')} >> text=length above 0").wait_for()
    fill(page, "beam", length="3 m", section="{rod: 1 cm}", material="aluminium", elements="4")
    reaches(page, 3.0)
    add(page, "joint", "clamp")
    fill(page, "clamp", a="body", b="beem.root")
    error = page.locator(f"{part('error-parts.clamp.b')} >> text=did you mean 'beam'")
    error.wait_for()
    page.screenshot(path=shots / "structure-reference.png")
    fill(page, "clamp", b="beam.root")
    error.wait_for(state="detached")
    choose_from_menu(page, "beam", "Rename")
    page.locator(part("part-name")).fill("body")
    page.click(part("part-done"))
    page.locator("text=already taken").first.wait_for()
    page.locator(part("part-name")).fill("mast")
    page.click(part("part-done"))
    page.wait_for_selector(part("part-mast"))
    assert page.locator(part("field-parts.clamp.b")).input_value() == "mast.root"
    choose_from_menu(page, "mast", "Duplicate")
    page.wait_for_selector(part("field-parts.mast 2.length"))
    page.wait_for_function(f"{DRAWN}.motions[0].lines.length === 2")
    page.screenshot(path=shots / "structure-built.png")
    choose_from_menu(page, "mast", "Remove")
    page.locator(part("start-error"), has_text="'clamp' refers to 'mast'").wait_for()
    choose_from_menu(page, "clamp", "Remove")
    page.wait_for_function(f"{DRAWN}.motions[0].lines.length === 1")
    page.click(part("yaml"))
    page.locator(".ev-code", has_text="mast 2").wait_for()
    text = page.locator(".ev-code").inner_text()
    assert "clamp" not in text


def test_a_structure_is_run_and_its_variables_are_drawn(page, server, folder, shots):
    choose(page, "case", "slew.yaml")
    page.click(part("run"))
    page.wait_for_selector(part("result"))
    page.wait_for_selector(f"{part('charts')} canvas")
    page.wait_for_selector(part("play"))
    assert page.locator(f"{part('main')} >> text=boom.tip_deflection").first.is_visible()
    titles = page.locator(".ev-tabs .q-tab__label").all_inner_texts()
    assert {"Beam", "Energy balance", "Variables"} <= set(titles)
    page.click(part("figure-chosen"))
    page.locator(f".q-field:has({part('variables')})").click()
    page.keyboard.type("hub.ra")
    page.locator(".q-menu .q-item").filter(has_text="hub.rate").click()
    page.keyboard.press("Escape")
    page.wait_for_selector(f"{part('chosen')} canvas")
    page.wait_for_timeout(500)
    page.screenshot(path=shots / "structure-variables.png")
    ref = "job:" + next(p.name for p in (folder / ".evolvent-studio").iterdir() if p.name.endswith("slew"))
    for what, begins in (("run", b"\x89HDF"), ("case", b"system: structure"), ("figures", b"PK")):
        with urllib.request.urlopen(f"{server.url}studio/{what}?ref={ref}") as answer:
            content = answer.read()
        assert content.startswith(begins)
    with zipfile.ZipFile(io.BytesIO(content)) as drawn:
        assert {"beam.png", "animation.html"} <= set(drawn.namelist())
    page.click(part("tab-case"))
    page.wait_for_selector(part("start"))
    page.click(part("tab-runs"))
    page.wait_for_selector(part("result"))


def test_two_runs_of_a_structure_are_compared(page, server):
    for _ in range(2):
        page.click(part("tab-case"))
        choose(page, "case", "slew.yaml")
        page.click(part("run"))
        page.wait_for_selector(part("result"))
    page.wait_for_timeout(500)
    boxes = page.locator(f"{part('runs')} .q-checkbox")
    for k in range(2):
        boxes.nth(k).click()
    page.click(part("compare"))
    page.wait_for_selector(part("comparison"))
    page.wait_for_selector(f"{part('charts')} canvas")
    page.click(part("figure-chosen"))
    page.locator(f".q-field:has({part('variables')})").click()
    page.keyboard.type("boom.tip_sp")
    page.locator(".q-menu .q-item").filter(has_text="boom.tip_speed").click()
    page.keyboard.press("Escape")
    page.wait_for_selector(f"{part('chosen')} canvas")
