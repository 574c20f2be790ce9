"""Structures on the page in a real browser: parts, the picture of the start, a run with its figures."""

from __future__ import annotations

import re
import urllib.request

import pytest

import evolvent
from evolvent import cases, results
from studio.serving import choose, part

#: Whether the picture of the start is drawn, and how far its first line reaches along x, m.
DRAWN = "document.querySelector('.ev-start .ev-motion')?.viewer"
TIP = (
    f"(() => {{ const line = {DRAWN}?.motions[0].lines[0]; return line ? line.points[3 * line.count - 3] : null; }})()"
)

#: The picture of results.
MOVES = f"document.querySelector('{part('motion')} .ev-motion')?.viewer"
#: A strip that a small weight bends; it has no key `system`.
CANTILEVER = """\
parts:
  boom:
    kind: beam
    length: 2 m
    section: {rectangle: {thickness: 2 mm, width: 20 mm}}
    material: {young_modulus: 70 GPa, poisson_ratio: 0, density: 1600 kg/m^3}
    elements: 6
    normal: [0, 0, 1]
  wall: {kind: joint, a: [0, 0, 0 m], b: boom.root, type: clamp}
  weight: {kind: force, at: boom.tip, force: [0, 0, -0.05 N]}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A working folder with a shortened slew, two runs of it, and a structure without a key `system`."""
    place = tmp_path_factory.mktemp("structures") / "work"
    place.mkdir()
    content = cases.content_of("boom-slew", {"simulate.until": "0.4 s"})
    (place / "slew.yaml").write_text(cases.dump(content))
    (place / "cantilever.yaml").write_text(CANTILEVER)
    run = evolvent.run(content)
    for name in ("slew.nc", "again.nc"):
        results.save(run, place / name)
    return place


def add(page, kind, name=None):
    """Add a part of a kind; the name is the proposed one unless given."""
    page.click(part("add-part"))
    page.locator(part("part-kind")).fill(kind)
    page.click(part(f"kind-{kind}"))
    page.wait_for_selector(part("part-name"))
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


def begin(page):
    """A new structure, whatever was open before."""
    choose(page, "case", "boom-slew")
    page.wait_for_selector(part("part-tip mass"))
    choose(page, "case", "new structure")
    page.locator(part("part-tip mass")).wait_for(state="detached")


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
    page.locator(f"{part('start')} >> text=the last complete state").wait_for()  # it stays, and says so
    assert abs(page.evaluate(TIP) - 1.7) < 1e-6
    assert not page.locator(part("run")).is_enabled()
    page.screenshot(path=shots / "structure-error.png")
    length.fill("2 m")
    reaches(page, 2.2)
    page.locator(f"{part('start')} >> text=the last complete state").wait_for(state="hidden")
    assert page.locator(part("run")).is_enabled()


def test_a_structure_is_built_up_renamed_and_taken_apart(page, shots):
    begin(page)
    page.wait_for_function(f"{DRAWN} && {TIP} === null")
    add(page, "beam")
    page.locator(f"{part('start-error')} >> text=parts.beam.").wait_for()
    assert page.locator(".ev-wrong").count() == 0, "fields that nobody has touched are no errors"
    fill(page, "beam", length="3 m", section="{circle: 1 cm}", material="aluminium", elements="4")
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


def test_a_panel_on_a_hinge_takes_one_dialog_and_its_keys_are_those_that_apply(page, shots):
    begin(page)
    page.click(part("add-part"))
    page.locator(part("part-kind")).fill("hinge")
    heads = page.locator(".ev-kinds .ev-h >> visible=true")
    page.wait_for_function("[...document.querySelectorAll('.ev-kinds .ev-h')].filter(e => e.offsetParent).length < 5")
    assert heads.first.inner_text() == "several parts at once"
    page.screenshot(path=shots / "structure-kinds.png")
    page.click(part("kind-panel on a hinge"))
    page.wait_for_selector(part("field-panel.hinge"))
    assert page.locator(".q-dialog input").count() <= 8
    page.locator(part("part-done")).click()
    page.locator(part("error-panel.mass"), has_text="must be a mass").wait_for()
    typed = {"hinge": "[0.3, 0, 0 m]", "size": "[1 m, 50 cm, 2 cm]", "mass": "3 kg", "stiffness": "0.2 N m/rad"}
    for key, value in (typed | {"opens": "90 deg"}).items():
        page.locator(part(f"field-panel.{key}")).fill(value)
    page.click(part("part-done"))
    page.locator(part("part-done")).wait_for(state="detached")
    page.wait_for_function(f"{DRAWN}?.motions[0].header.frames.length === 2")
    hinge = page.locator(part("part-panel hinge"))
    assert "joint, revolute" in hinge.inner_text()
    hinge.click()
    shown = {key: page.locator(part(f"field-parts.panel hinge.{key}")) for key in ("type", "axis", "axis_b", "pitch")}
    shown["axis"].wait_for()
    assert shown["type"].is_visible()
    assert not shown["axis_b"].is_visible()
    assert not shown["pitch"].is_visible()
    choose(page, "field-parts.panel hinge.type", "screw")
    shown["pitch"].wait_for()
    page.locator(f"{part('start-error')} >> text=pitch").wait_for()
    assert "joint, screw" in hinge.inner_text()
    choose(page, "field-parts.panel hinge.type", "spherical (not set)")
    shown["pitch"].wait_for(state="hidden")
    page.screenshot(path=shots / "structure-panel.png")


def test_a_part_is_repeated_in_a_row_and_round_a_ring(page, shots):
    begin(page)
    add(page, "point", "bob")
    fill(page, "bob", mass="1 kg")
    page.click(part("more-parts.bob."))
    fill(page, "bob", position="[1, 0, 0 m]")
    marks = f"{DRAWN}?.motions[0].header.marks.reduce((n, mark) => n + mark.count, 0)"
    page.wait_for_function(f"{marks} === 1")
    page.click(part("give-parts.bob.repeat"))
    page.locator(part("field-parts.bob.repeat.count")).wait_for()
    page.locator(part("start-error"), has_text="repeat.count").wait_for()
    fill(page, "bob.repeat", count="3", step="[0, 0.5, 0 m]")
    page.wait_for_function(f"{marks} === 3")
    assert not page.locator(part("field-parts.bob.repeat.axis")).is_visible(), "a row has none"
    assert "point, 3 times" in page.locator(part("part-bob")).inner_text()
    fill(page, "bob.repeat", count="6", step="")
    page.locator(part("field-parts.bob.repeat.axis")).wait_for()
    fill(page, "bob.repeat", axis="[0, 0, 1]")
    page.locator(part("field-parts.bob.repeat.angle")).wait_for()
    assert not page.locator(part("field-parts.bob.repeat.step")).is_visible(), "a ring has none"
    page.wait_for_function(f"{marks} === 6")
    page.screenshot(path=shots / "structure-repeat.png")
    page.click(part("yaml"))
    page.locator(".ev-code", has_text="repeat").wait_for()
    page.keyboard.press("Escape")


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
    choose(page, "variables", re.compile(r"hub\.rate"), typed="hub.ra")
    page.keyboard.press("Escape")
    page.wait_for_selector(f"{part('chosen')} canvas")
    page.screenshot(path=shots / "structure-variables.png")
    ref = "job:" + next(p.name for p in (folder / ".evolvent-studio").iterdir() if p.name.endswith("slew"))
    for what, begins in (("run", b"\x89HDF"), ("case", b"system: structure")):
        with urllib.request.urlopen(f"{server.url}studio/{what}?ref={ref}") as answer:
            assert answer.read().startswith(begins)
    page.click(part("tab-case"))
    page.wait_for_selector(part("start"))
    page.click(part("tab-runs"))
    page.wait_for_selector(part("result"))


def test_modes_are_listed_and_the_chosen_one_moves(page, server, shots):
    choose(page, "case", "slew.yaml")
    page.screenshot(path=shots / "structure-buttons.png")
    page.click(part("modes"))
    page.wait_for_selector(part("modes-table"))
    rows = page.locator(f"{part('modes-table')} tr")
    assert rows.first.locator("th").all_inner_texts()[:4] == ["mode", "frequency, Hz", "rad/s", "damping ratio"]
    found = evolvent.load("boom-slew").modes(count=10)
    hertz = [float(rows.nth(k + 1).locator("td").nth(1).inner_text()) for k in range(10)]
    assert hertz == pytest.approx(found.frequency_hz, rel=1e-4)
    assert rows.nth(7).get_attribute("class").split() == ["ev-pick", "on"]  # the first that is no rigid motion
    title = f"{MOVES}?.motions[0].header.title"
    page.wait_for_function(f"{title}?.startsWith('Mode 6')")
    # it plays, and begins again after each period
    page.wait_for_function(f"(window.now = {MOVES}.now) > 0.6 * {MOVES}.end")
    page.wait_for_function(f"{MOVES}.now < window.now")
    assert page.evaluate(f"{MOVES}.playing")
    page.screenshot(path=shots / "structure-modes.png")
    page.click(part("mode-8"))
    page.wait_for_function(f"{title}?.startsWith('Mode 8')")
    assert rows.nth(9).get_attribute("class").split() == ["ev-pick", "on"]
    with page.expect_download() as kept:
        page.click(part("download-modes"))
    assert kept.value.suggested_filename.endswith("slew-modes.nc")
    page.click(part("tab-case"))
    page.wait_for_selector(part("start"))
    page.click(part("tab-runs"))
    page.wait_for_function(f"{title}?.startsWith('Mode 8')")  # the one that was shown last


def test_the_equilibrium_is_found_and_drawn(page, shots):
    """A cantilever under a weight at its tip: w L^3/(3 EI) below its root."""
    content = cases.parse_yaml(CANTILEVER, "cantilever")
    choose(page, "case", "cantilever.yaml")
    page.click(part("equilibrium"))
    page.wait_for_selector(part("result"))
    page.locator(f"{part('main')} >> text=boom.tip_deflection").first.wait_for()
    page.wait_for_function(f"{MOVES}?.motions[0].lines.length === 1")
    tip = page.evaluate(f"(({{ points, count }}) => points[3 * count - 1])({MOVES}.motions[0].lines[0])")
    wanted = evolvent.load(content).equilibrium()["boom"].tip_position.values[0, 2]
    assert tip == pytest.approx(wanted, rel=1e-4)
    assert tip == pytest.approx(-0.05 * 2.0**3 / (3.0 * 70e9 * 0.02 * 0.002**3 / 12.0), rel=2e-2)
    assert not page.locator(part("play")).is_visible()
    page.screenshot(path=shots / "structure-equilibrium.png")


def test_two_runs_of_a_structure_are_compared(page):
    page.click(part("tab-runs"))
    for name in ("slew.nc", "again.nc"):
        page.click(part(f"tick-file:{name}"))
    page.click(part("compare"))
    page.wait_for_selector(part("comparison"))
    page.wait_for_selector(f"{part('charts')} canvas")
    page.click(part("figure-chosen"))
    choose(page, "variables", re.compile(r"boom\.tip_speed"), typed="boom.tip_sp")
    page.keyboard.press("Escape")
    page.wait_for_selector(f"{part('chosen')} canvas")
