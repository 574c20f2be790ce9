"""Runs and structures on the page in a real browser.

Runs are distinguished, renamed, seen from all sides and downloaded; two tabs keep their drafts. Structures are built of
parts, and run; their start, modes and equilibria are drawn.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
import urllib.request
import zipfile

import pytest

import evolvent
from evolvent import cases, results
from evolvent_studio import exporter, exports
from studio.serving import SHORT, WAIT, choose, part, serving, settle

#: The first picture of the page.
VIEWER = "document.querySelector('.ev-motion')?.viewer"
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
  weight: {kind: load, at: boom.tip, force: [0, 0, -0.05 N]}
"""


@pytest.fixture(scope="module")
def folder(work):
    """A working folder with cases and their runs."""
    place = work
    for name in ("short", "two-curves"):
        (place / f"{name}.yaml").write_text(SHORT)
    results.save(evolvent.run(place / "short.yaml"), place / "saved.nc")
    results.save(evolvent.run(place / "short.yaml", {"solver.duration": "3 s"}), place / "saved-brief.nc")
    rows = "".join(f"{k / 100},{(k * 7) % 5}\n" for k in range(200))
    (place / "timed.csv").write_text("time (ms),sensor (mm)\n" + rows)
    (place / "untimed.csv").write_text("a,b\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(50)))
    content = cases.content_of("boom-slew", {"simulate.until": "0.4 s"})
    content["limits"] = ["hub.rate.magnitude <= 1 rad/s", "boom.tip_deflection.magnitude <= 1 nm"]
    (place / "slew.yaml").write_text(cases.dump(content))
    (place / "cantilever.yaml").write_text(CANTILEVER)
    run = evolvent.run(content)
    for name in ("slew.nc", "again.nc"):
        results.save(run, place / name)
    return place


def opened(context, server):
    page = context.new_page()
    page.goto(server.url)
    page.click(part("tab-case"))
    page.wait_for_selector(part("run"))
    page.wait_for_timeout(400)
    return page


def show_saved(page, name="saved.nc"):
    page.click(part("tab-runs"))
    before = page.query_selector(part("result"))
    page.locator(".ev-link", has_text=name).click()
    if before is not None:
        before.wait_for_element_state("hidden")
    page.locator(part("result"), has_text=name).wait_for()
    page.wait_for_function(f"{VIEWER} && {VIEWER}.motions[0].frames > 1")


def test_runs_are_told_apart_and_renamed(page, server, folder, shots):
    choose(page, "case", "two-curves.yaml")  # which no other test runs
    page.locator(part("field-blade.length")).fill("80 cm")
    page.locator(part("field-body.rate")).fill("60 rpm")
    page.click(part("run"))
    page.wait_for_selector(part("result"))
    changes = page.locator(part("changes")).inner_text()
    assert changes.endswith("body.rate = 60 rpm, blade.length = 80 cm")
    assert changes[:5].replace(":", "").isdigit(), "the time at which it was added"
    row = page.locator(".ev-job").first
    number = row.locator(".ev-link").inner_text().split()[0]
    assert "blade.length = 80 cm" in row.inner_text()
    page.click(part("rename"))
    page.locator(part("title")).fill("  slow  spin ")
    page.click(part("title-done"))
    page.locator(f"{part('result')} >> text=slow spin").wait_for()
    assert "slow spin" in row.inner_text()
    assert "two-curves: body.rate" in row.inner_text(), "the case that it is a change of"
    page.screenshot(path=shots / "two-curves.png")
    # the case that is opened again has the values as they were typed
    page.locator(f"{part('main')} >> text=Open its case").click()
    page.wait_for_function("s => document.querySelector(s)?.value === '80 cm'", arg=part("field-blade.length"))
    page.locator(part("field-body.rate")).fill("50 rpm")
    page.click(part("run"))
    again = page.locator(
        part("changes"), has_text=f"since run {number}: body.rate = 50 rpm"
    )  # that run may still be shown
    again.wait_for()
    assert "blade.length = 80 cm" in again.inner_text(), "changes against the same case"
    assert f"since run {number}: body.rate = 50 rpm" in row.inner_text()
    assert "blade.length" not in row.inner_text(), "which is the same as before"
    kept = json.loads((folder / ".evolvent-studio" / "queue.json").read_text())
    assert "slow spin" in json.dumps(kept)


def test_a_result_opens_at_its_first_frame_and_plays_on_the_space_bar(page):
    show_saved(page)
    assert page.evaluate(f"{VIEWER}.now") == page.evaluate(f"{VIEWER}.begin")
    assert not page.evaluate(f"{VIEWER}.playing")
    page.keyboard.press(" ")
    page.wait_for_function(f"{VIEWER}?.playing && {VIEWER}.now > 0.0")
    page.keyboard.press(" ")
    page.locator(part("figure-1")).click()
    page.wait_for_selector(f"{part('figure-1')}[aria-selected=true]")
    page.keyboard.press(" ")  # also after a click on a tab of the charts
    page.wait_for_function(f"{VIEWER}?.playing")


def test_two_runs_are_compared_with_the_differences_of_their_results(page, shots):
    page.click(part("tab-runs"))
    ticked = page.locator("[data-testid^='tick-'][aria-checked=true]")  # by another test
    while ticked.count():
        ticked.first.click()
        settle(page)
    for name in ("saved.nc", "saved-brief.nc"):
        page.locator(part(f"tick-file:{name}")).click()
    page.click(part("compare"))
    page.wait_for_selector(part("comparison"))
    tables = page.locator(".ev-beside table")
    page.locator(f"{part('main')} >> text=difference: saved-brief.nc less saved.nc").wait_for()
    for table in (tables.first, tables.last):
        assert table.locator("th").all_inner_texts()[1:] == ["saved.nc", "saved-brief.nc", "difference", "unit"]
    box = page.locator(".ev-beside")
    assert box.evaluate("e => e.scrollWidth <= e.clientWidth"), "all columns are seen at 1440 px"
    # only one of the cases gives it
    row = tables.first.locator("tr", has_text="solver.duration").locator("td").all_inner_texts()
    assert row[2].endswith("\u00a0s"), "a value and its unit stay together"
    steps = tables.last.locator("tr", has_text="steps").first.locator("td").all_inner_texts()
    before, after, less = map(float, steps[1:4])
    assert less == pytest.approx(after - before, rel=1e-3)
    chart = f"document.querySelector('{part('charts')} .ev-chart')?.chart?.getOption()"
    page.wait_for_function(f"{chart}?.series.length > 1")
    series, ends = page.evaluate(f"(({{ series, xAxis }}) => [series, [xAxis[0].min, xAxis[0].max]])({chart})")
    assert ends == [0.0, max(one["data"][-1][0] for one in series)], "curves are shown over their whole time"
    assert len({one["symbol"] for one in series if one.get("markPoint")}) == 2, "each run has a mark of its own"
    page.screenshot(path=shots / "compared.png")
    for name in ("saved.nc", "saved-brief.nc"):
        page.locator(part(f"tick-file:{name}")).click()


def test_views_are_named_by_what_they_show(page, shots):
    show_saved(page)
    names = page.locator(".ev3-views button").all_inner_texts()
    assert names == ["spin axis z", "oblique", "along y", "along x", "bodies", "start"]
    assert page.evaluate(f"{VIEWER}.camera.elevation") == pytest.approx(1.5708, abs=1e-4), "along the axis of the spin"
    for name in names:
        page.click(part(f"view-{name}"))
        page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")  # it is drawn
        places = page.evaluate(f"{VIEWER}.axisLabels")
        gaps = [((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5 for i, a in enumerate(places) for b in places[:i]]
        assert min(gaps) > 12.0, "names of axes stand apart"
    page.screenshot(path=shots / "views.png")


def downloaded(page, kind, path):
    """The content of a download of the run that is shown."""
    page.click(part("download"))
    with page.expect_download(timeout=WAIT) as download:
        page.click(part(f"download-{kind}"))
        page.wait_for_selector(part("export-cancel"))
    download.value.save_as(path)
    assert download.value.suggested_filename.startswith("saved")
    page.wait_for_selector(part("export-cancel"), state="detached")
    return path.read_bytes()


def test_downloads(page, tmp_path):
    """One is written by its process and fetched, another is cancelled."""
    show_saved(page, "saved-brief.nc")
    content = downloaded(page, "csv", tmp_path / "csv")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        rows = list(csv.reader(io.StringIO(archive.read("series.csv").decode("utf-8-sig"))))
    assert len(rows) > 10
    page.click(part("download"))
    for kind in exporter.KINDS:
        page.wait_for_selector(part(f"download-{kind}"))
    page.click(part("download-gif"))
    page.click(part("export-cancel"))
    page.wait_for_selector(part("export"), state="detached")


@pytest.mark.parametrize(
    ("kind", "name", "first"),
    [
        ("report", "", b"<html"), ("mat", "", b"MATLAB 5.0"), ("glb", "", b"glTF"), ("vtk", "about.txt", b""),
        ("figures", "animation.html", b""),
    ],
)  # fmt: skip
def test_files_of_downloads(folder, tmp_path, sketched, kind, name, first):
    """What the process of a download writes."""
    if reason := exports.missing(kind):
        pytest.skip(reason)
    target = tmp_path / kind
    exporter._write(kind, str(folder / "saved-brief.nc"), str(target))
    if name:
        with zipfile.ZipFile(target) as archive:
            assert name in archive.namelist()
    else:
        assert first in target.read_bytes()[:200]


@pytest.mark.release
@pytest.mark.skipif(bool(exports.missing("mp4")), reason=exports.missing("mp4"))
def test_a_film_is_downloaded(page, tmp_path):
    """Of twelve seconds; `tests/exports/test_files.py` writes shorter ones without the page."""
    show_saved(page, "saved-brief.nc")
    assert downloaded(page, "mp4", tmp_path / "mp4")[4:8] == b"ftyp"


def test_an_untouched_form_has_no_errors(page, shots):
    begin(page)
    page.click(part("add-part"))
    page.locator(part("part-kind")).fill("beam")
    page.click(part("kind-beam"))
    page.wait_for_function("s => document.querySelector(s)?.value", arg=part("part-name"))
    page.click(part("part-done"))
    page.wait_for_selector(part("field-parts.beam.length"))
    page.locator(part("start-error"), has_text="parts.beam.").wait_for()
    assert page.locator(".ev-wrong").count() == 0
    assert page.locator(".ev-banner.bad >> visible=true").count() == 0
    assert page.locator(part("run")).is_enabled()
    page.screenshot(path=shots / "untouched.png")
    page.click(part("run"))
    page.locator(".ev-wrong").first.wait_for()
    assert page.locator(part("error-parts.beam.length")).inner_text() != ""
    assert not page.locator(part("run")).is_enabled()


def test_yaml_needs_no_side_scroll(page):
    choose(page, "case", "boom-slew")
    page.wait_for_selector(part("part-boom"))  # the form before has a field of that name, too
    page.locator(part("field-simulate.until")).fill("20000 ms")
    page.click(part("yaml"))
    code = page.locator(".ev-code")
    code.filter(has_text="until: 20000 ms").wait_for()  # units as they were typed
    text = code.inner_text()
    assert "radius: 1 cm" in text
    assert "{" not in text
    assert code.evaluate("e => e.scrollWidth <= e.clientWidth")
    page.keyboard.press("Escape")


@pytest.mark.release
def test_two_tabs_keep_their_own_drafts_over_a_restart(context, browser, tmp_path):
    """On two servers, one after the other; `test_what_a_browser_sends_as_a_tab_is_no_path` reads a kept draft again."""
    place = tmp_path / "work"
    place.mkdir()
    (place / "short.yaml").write_text(SHORT)
    for name in ("one", "two"):
        (place / f"{name}.csv").write_text("a,b\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(50)))
    port = "8437"
    tabs = []
    with serving(place, "--port", port) as server:
        for length, name in (("70 cm", "one"), ("60 cm", "two")):
            tab = opened(context, server)
            choose(tab, "case", "short.yaml")
            tab.locator(part("field-blade.length")).fill(length)
            tab.click(part("tab-measure"))
            tab.wait_for_timeout(1000)
            leave = tab.locator(".ev-row:has(.ev-link) >> button:has(i:text('close')) >> visible=true")
            if leave.count():  # a new tab begins with what was open last
                leave.first.click()
            choose(tab, "signal-file", f"{name}.csv")
            tab.locator(f".ev-row >> text={name}.csv").wait_for()
            tab.wait_for_timeout(1000)
            tabs.append(tab)
    with serving(place, "--port", port) as server:
        for tab, length, name in zip(tabs, ("70 cm", "60 cm"), ("one", "two"), strict=True):
            tab.goto(server.url)
            tab.click(part("tab-measure"))
            tab.locator(f".ev-row >> text={name}.csv").wait_for()
            assert tab.locator(".ev-row .ev-link >> visible=true").all_inner_texts() == [f"{name}.csv"]
            tab.click(part("tab-case"))
            tab.wait_for_function(
                "([s, x]) => document.querySelector(s)?.value === x", arg=[part("field-blade.length"), length]
            )
            tab.close()


def wait_for_axis(page, name):
    """Wait until the axis of the chart of signals has a name that begins so."""
    axis = f"document.querySelector('{part('signal-chart')}')?.chart?.getOption()?.xAxis[0]"
    page.wait_for_function(f"name => {axis}?.name.startsWith(name)", arg=name)


def test_the_preview_of_signals_has_a_time_axis(page):
    page.click(part("tab-measure"))
    choose(page, "stand", "new: springs")  # another may be there, which has no signals
    choose(page, "signal-file", "timed.csv")
    page.wait_for_selector(part("columns"))
    wait_for_axis(page, "time [s]")
    last = page.evaluate(f"document.querySelector('{part('signal-chart')}').chart.getOption().xAxis[0].max")
    assert last == pytest.approx(1.99e-3), "ms of the file are s of the axis"
    page.locator(".ev-row:has-text('timed.csv') >> button:has(i:text('close'))").click()
    choose(page, "signal-file", "untimed.csv")
    page.locator(f"{part('columns')} >> text=b").first.wait_for()
    wait_for_axis(page, "sample")
    page.locator(f"{part('group-signals')} .ev-title").click()
    page.locator(part("field-signals.rate")).fill("50 Hz")
    wait_for_axis(page, "time [s]")


def test_what_a_browser_sends_as_a_tab_is_no_path(tmp_path):
    from evolvent_studio import pages
    from evolvent_studio.folder import Folder
    from evolvent_studio.state import Studio

    studio = Studio(Folder(tmp_path))
    try:
        for name in ("../../outside", "", "a" * 36, "0" * 8):
            tab = studio.of_tab(name)
            tab.save()
        assert not (tmp_path / ".evolvent-studio" / "pages").exists()
        name = "01234567-89ab-cdef-0123-456789abcdef"
        tab = studio.of_tab(name)
        tab.take_case(cases.content_of("heliogyro", {"blade.length": "4 m"}), "changed", "case:heliogyro")
        tab.save()
        assert studio.of_tab(name).draft == tab.draft
        damaged = tmp_path / ".evolvent-studio" / "pages" / f"{name}.json"
        for text in ("", "[]", "{}", '{"draft": {"base": "heliogyro"}}', damaged.read_text()[:-40]):
            damaged.write_text(text)
            assert studio.of_tab(name).draft.source == "case:boom-slew", "a damaged file counts as none"
        assert pages.is_name(name)
        os.remove(damaged)
        damaged.symlink_to(tmp_path / "elsewhere.json")
        (tmp_path / "elsewhere.json").write_text("{}")
        tab.draft.about = "again"
        tab.save()
        assert (tmp_path / "elsewhere.json").read_text() == "{}", "a link is replaced, not followed"
    finally:
        studio.jobs.stop()


def test_a_run_is_compared_with_the_one_of_its_case_before(tmp_path):
    from evolvent_studio.folder import Folder
    from evolvent_studio.jobview import since_text
    from evolvent_studio.state import Studio

    studio = Studio(Folder(tmp_path))
    studio.jobs.stop()  # what is submitted waits
    texts = []
    for change in ({}, {"blade.length": "4 m"}, {"blade.length": "4 m"}):
        draft = studio.read_case("case:heliogyro")
        draft.content = cases.content_of(draft.content, change)
        texts.append(since_text(studio.jobs.get(studio.submit(draft))))
    assert texts == ["", "since run 1: blade.length = 4 m", "the same case as run 2"]


def test_changes_are_keys_whose_values_differ_and_not_their_units():
    from evolvent_studio.changes import changes

    base = cases.content_of("boom-slew")
    same = cases.content_of("boom-slew", {"simulate.until": "20000 ms", "parts.boom.length": 3})
    assert changes(base, same) == []
    content = cases.content_of("boom-slew", {"parts.boom.section.tube.radius": "12 mm", "parts.slew": None})
    del content["parts"]["slew"]
    content["parts"]["end"] = {"kind": "point", "mass": "1 g", "at": "boom.tip"}
    content["parts"]["boom"]["elements"] = 8
    found = dict(changes(base, content))
    assert found["parts.boom.section.tube.radius"] == "12 mm"
    assert found["parts.boom.elements"] == "8"
    assert found["parts.slew"] == "removed"
    assert found["parts.end"] == "added"
    assert len(found) == 4
    profile = cases.content_of("boom-slew")
    profile["parts"]["slew"]["profile"] = [["0 s", "0 N m"], ["1 s", "300 mN m"], ["2 s", "0 N m"]]
    assert changes(base, profile) == [("parts.slew.profile", "[[0 s, 0 N m], [1 s, 300 mN m], [2 s, 0 N m]]")]


# --------------------------------------------------------------------------------------------- structures


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
    if "new structure" in page.locator(f".q-field:has({part('case')})").inner_text():
        page.click("button:has(i:text('refresh')) >> nth=0")
    else:
        choose(page, "case", "new structure")
    settle(page)
    page.wait_for_selector(part("part-body"))


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
    page.locator(f"{part('start')} >> text=the last complete state").wait_for()  # it stays, with a note
    assert abs(page.evaluate(TIP) - 1.7) < 1e-6
    assert not page.locator(part("run")).is_enabled()
    page.screenshot(path=shots / "structure-error.png")
    length.fill("2 m")
    reaches(page, 2.2)
    page.locator(f"{part('start')} >> text=the last complete state").wait_for(state="hidden")
    assert page.locator(part("run")).is_enabled()
    # rows from a spreadsheet, with the curve that they are
    page.click(part("part-slew"))
    profile = page.locator(part("field-parts.slew.profile"))
    profile.fill("time (s)\ttorque (mN m)\n0\t0\n1\t150,5\n2\t-80\n4\t0")
    page.locator(".ev-curve >> text=4 rows: time 0 to 4 s, value -80 to 150.5 mN m").wait_for()
    assert profile.input_value() == "[[0 s, 0 mN m],\n [1 s, 150.5 mN m],\n [2 s, -80 mN m],\n [4 s, 0 mN m]]"
    assert len(page.locator(".ev-curve polyline").get_attribute("points").split()) == 4
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
    assert "Slew of a hub with a boom" in page.locator(part("result")).inner_text(), "a run has the title of its case"
    for place in (part("result"), ".ev-job.on"):
        assert page.locator(f"{place} {part('limits')}").inner_text() == "1 of 2 limits met"
    assert not page.locator(f"{part('result')} .ev-status.success").count(), "a missed limit is not shown in green"
    titles = page.locator(".ev-tabs .q-tab__label").all_inner_texts()
    assert {"Beam", "Energy balance", "Variables"} <= set(titles)
    page.click(part("figure-chosen"))
    choose(page, "variables", re.compile(r"hub\.rate"), typed="hub.ra")
    page.keyboard.press("Escape")
    page.wait_for_selector(f"{part('chosen')} canvas")
    page.screenshot(path=shots / "structure-variables.png")
    ref = "job:" + max(p.name for p in (folder / ".evolvent-studio").glob("0*"))
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
    heads = rows.first.locator("th").all_inner_texts()
    assert heads[:4] == ["mode", "frequency, Hz", "frequency, rad/s", "damping ratio"]
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
    assert kept.value.suggested_filename.endswith("Slew-of-a-hub-with-a-boom-modes.nc")
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
