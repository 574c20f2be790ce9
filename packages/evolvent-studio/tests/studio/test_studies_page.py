"""Studies, margins, dispersions and calibrations on the page in a real browser, and the page on a phone."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import urllib.error
import urllib.request

import numpy as np
import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent.elements.viscoelastic import Viscoelastic
from margin_cases import case
from studio.serving import AT_ONCE, SHORT, WAIT, choose, open_study, part

#: A phone, and the screen of the other tests.
PHONE, SCREEN = {"width": 390, "height": 844}, {"width": 1440, "height": 900}
#: Times of curves of relaxation, s.
CURVE = np.geomspace(10.0, 1e6, 40)
#: The picture of a result.
VIEWER = "document.querySelector('.ev-motion')?.viewer"


@pytest.fixture(scope="module")
def folder(work):
    place = work
    (place / "short.yaml").write_text(SHORT)
    common = {"case": "short.yaml", "set": {"solver.duration": "0.4 s"}, "keep": ["steps", "tip_lag.max"]}
    many = {"study": "many", **common, "batch": 1, "over": {"spool.rate": {"from": 2, "to": 4, "points": 400}}}
    (place / "many.yaml").write_text(json.dumps(many))
    common["case"] = cases.content_of(place / "short.yaml")
    broken = {"over": {"solver.step": ["1e-4 s", "2e-2 s"], "spool.rate": [2.0, 3.0, 3.5]}}
    studies.sweep(studies.read({"study": "broken", **common, **broken}), output=place / "broken")
    over = {f"body.offset_{axis}": {"from": -0.4, "to": 0.4, "points": 3} for axis in "xz"}
    keep = ["best_spring", "mode_energy"]
    orders = {"study": "orders", "case": "inertia-stand", "over": over, "keep": keep}
    studies.sweep(studies.read(orders), output=place / "orders")
    (place / "hinge.yaml").write_text(cases.dump(case()))
    silent = case()
    silent["margin"]["zero"].remove("harness")
    (place / "silent.yaml").write_text(cases.dump(silent))
    bare = cases.content_of("hinge-stored")
    law = Viscoelastic.model_validate(bare["parts"]["hinge"].pop("viscoelastic"))
    (place / "stored.yaml").write_text(cases.dump(bare))
    warm = [(T, law.replaced(temperature=273.15 + T).modulus(CURVE)) for T in (20.0, 60.0, 100.0)]
    rows = [f"{t:.6g},{f:.9g},{T:g}" for T, forces in warm for t, f in zip(CURVE, forces, strict=True)]
    (place / "curves.csv").write_text("\n".join(["time (s),torque (N m),oven (degC)", *rows]))
    (place / "springs.csv").write_text("stiffness (mN m/rad)\n98\n101\n99.5\n102\n97\n100\n")
    shutil.copyfile(cases.system("wire-booms").data_files["rbsp-a.csv"], place / "log.csv")
    over = {"solver.step": "table(1e-4 s, 1e-4 s, 1e-4 s, 2e-2 s)", "spool.rate": "5%"}
    loose = {
        "study": "loose",
        "case": "short.yaml",
        "sample": "monte-carlo",
        "samples": 100,
        "batch": 1,
        "over": over,
    }
    loose |= {"set": {"solver.duration": "0.4 s"}, "keep": ["body_rate.last", "tip_lag.max"]}
    (place / "loose.yaml").write_text(json.dumps(loose))
    (place / "wrong.csv").write_text("stiffness (mN m/rad)\n98\nabc\n")
    return place


def has_value(page, field, text):
    """Wait until a field shows a text: the form is drawn again after some choices."""
    page.wait_for_function("([s, text]) => document.querySelector(s)?.value === text", arg=[part(field), text])


def begin(page, mark, saved, new):
    """A new study of a panel, whatever another test has left in its form: choosing what is chosen changes nothing."""
    choose(page, f"{mark}study", saved)
    choose(page, f"{mark}study", new)


def state(page, pattern):
    """The panel's text on the study, once it matches the pattern."""
    found = page.locator(part("state-of-study"), has_text=re.compile(pattern))
    found.wait_for()
    return found.inner_text()


#: Numbers of a page that stand on two lines, and those that reach out of it to the right where nothing scrolls.
BROKEN = r"""() => {
  const found = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const hides = (e) => e && (getComputedStyle(e).overflowX !== "visible" || hides(e.parentElement));
  while (walk.nextNode()) {
    const node = walk.currentNode, range = document.createRange(), text = node.data.trim();
    if (["STYLE", "SCRIPT", "TEXTAREA", "PRE"].includes(node.parentElement.tagName)) continue;
    for (const match of node.data.matchAll(/(?<![\w.-])[-+]?\d[\d.]*(e[-+]?\d+)?/g)) {
      range.setStart(node, match.index);
      range.setEnd(node, match.index + match[0].length);
      const boxes = [...range.getClientRects()].filter((box) => box.width > 0);
      if (new Set(boxes.map((box) => Math.round(box.top))).size > 1) found.push(`${match[0]} on two lines: ${text}`);
      if (boxes.some((box) => box.right > innerWidth + 1) && !hides(node.parentElement)) found.push(`outside: ${text}`);
    }
  }
  return found;
}"""


def resized(page, screen):
    """Give the page another size, and wait until the reports in it have theirs."""
    page.set_viewport_size(screen)
    page.wait_for_function("width => innerWidth === width", arg=screen["width"])
    for frame in page.frames[1:]:
        place = frame.frame_element()
        while place.is_visible() and place.evaluate("e => e.clientWidth") != frame.evaluate("innerWidth"):
            page.wait_for_timeout(20)


def checked(page, shots, name):
    """Screenshots on both screens; nothing is wider than the page, and no number is missing or on two lines."""
    for size, screen in (("", SCREEN), ("phone-", PHONE)):
        resized(page, screen)
        page.screenshot(path=shots / f"{size}{name}.png")
        for frame in page.frames:
            assert frame.evaluate("document.documentElement.scrollWidth <= innerWidth + 1"), (name, screen)
            assert not re.search(r"\b(nan|inf|None|undefined|NaN)\b", frame.locator("body").inner_text())
            assert frame.evaluate(BROKEN) == [], (name, screen)
    resized(page, SCREEN)


# ------------------------------------------------------------------------------------------------ a phone


def test_a_first_visit_on_a_phone_offers_an_example_and_shows_its_result(browser, server, folder, shots):
    context = browser.new_context(viewport=PHONE, has_touch=True, is_mobile=True)
    context.add_init_script(AT_ONCE)
    context.set_default_timeout(WAIT)
    page = context.new_page()

    def fits():
        return page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]

    try:
        shutil.rmtree(folder / ".evolvent-studio" / "pages", ignore_errors=True)  # nobody was here before
        page.goto(server.url)
        page.wait_for_selector(part("run-start"))  # the start of the first case, with a button that runs it
        for tab, inside in (("runs", "compare"), ("measure", "measure"), ("studies", "run-study"), ("case", "run")):
            page.tap(part(f"tab-{tab}"))
            page.wait_for_selector(part(inside))
            box = page.locator(part(inside)).bounding_box()
            assert box["y"] + box["height"] <= PHONE["height"], tab
            assert not page.locator(part("main")).is_visible()
            assert fits(), tab
        choose(page, "case", "short.yaml")
        page.reload()
        page.wait_for_selector(part("example"))
        page.screenshot(path=shots / "phone-welcome.png")
        page.tap(part("example"))
        page.wait_for_selector(part("result"))
        assert "Slew of a hub with a boom" in page.locator(part("result")).inner_text()
        page.wait_for_function(f"{VIEWER}?.motions[0].frames > 1")
        page.screenshot(path=shots / "phone-run.png")
        assert fits()
        motion, numbers = (page.locator(place).first.bounding_box() for place in (part("motion"), ".ev-two"))
        assert motion["y"] >= 0.0
        assert motion["height"] > 250.0
        assert motion["y"] + motion["height"] < numbers["y"]
        assert numbers["y"] + 100.0 < PHONE["height"]
        before = page.evaluate(f"{VIEWER}.camera.azimuth")
        page.evaluate(
            f"""(canvas => {{ for (const [type, x] of [['pointerdown', 150], ['pointermove', 200], ['pointerup', 200]])
            canvas.dispatchEvent(new PointerEvent(type, {{ clientX: x, clientY: 300, pointerId: 1,
            pointerType: 'touch', isPrimary: true, bubbles: true }})) }})({VIEWER}.canvas)"""
        )
        assert page.evaluate(f"{VIEWER}.camera.azimuth") != before
        page.tap(part("play"))
        page.wait_for_function(f"{VIEWER}.now > 0.0")
        page.tap(part("tab-studies"))
        page.tap(part("study-broken"))
        page.wait_for_selector(f"{part('study-chart')} canvas")
        page.screenshot(path=shots / "phone-study.png")
        assert not page.locator(part("run-study")).is_visible()  # the panels are folded
        assert fits()
    finally:
        context.close()


# ------------------------------------------------------------------------------------------------ studies


def test_a_study_is_written_estimated_saved_and_run(page, folder, shots):
    page.click(part("tab-studies"))
    begin(page, "", "many.yaml", "new study")
    choose(page, "case-of-study", "short.yaml")
    page.locator(part("axis-error-0"), has_text="Choose a key").wait_for()  # that of the other case is gone
    assert page.locator(part("run-study")).is_disabled()
    choose(page, "axis-key-0", "spool.rate", typed="spool.rate")
    has_value(page, "axis-0-values", "3.5 rad/s")
    assert "a plain number is in rad/s" in page.locator(part("axis-0")).inner_text()
    page.locator(part("axis-0-values")).fill("2, 3 rad/s, [")
    page.locator(part("axis-error-0"), has_text="over.spool.rate is '[2, 3 rad/s, []'").wait_for()
    assert page.locator(part("run-study")).is_disabled()
    page.locator(part("axis-0-values")).fill("2, 3 rad/s")
    chips = page.locator(f".q-field:has({part('keep')}) .q-chip")
    for left in reversed(range(chips.count())):
        chips.locator(".q-chip__icon--remove").first.click()
        chips.nth(left).wait_for(state="detached")
    page.locator(part("keep")).fill("body_rate.last")
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    page.locator(f"{part('block-set')} .q-item").first.click()
    page.locator(part("set-of-study")).fill("solver.duration: 0.4 s")
    page.locator(part("name-of-study")).fill("rates")
    state(page, "^2 cases$")
    page.screenshot(path=shots / "study-form.png")
    page.click(part("estimate"))
    assert "2 cases of about" in state(page, "each|failed|cancelled")
    page.click(part("save-study"))
    assert page.locator(part("file-name")).input_value() == "rates.yaml"
    page.click(part("file-save"))
    page.locator("text=Saved as rates.yaml").wait_for()
    written = cases.parse_yaml((folder / "rates.yaml").read_text(), "rates")
    assert written == {
        "study": "rates",
        "case": "short.yaml",
        "sample": "grid",
        "over": {"spool.rate": [2, "3 rad/s"]},
        "keep": ["body_rate.last"],
        "set": {"solver.duration": "0.4 s"},
    }
    assert studies.read(folder / "rates.yaml").count == 2
    page.click(part("run-study"))
    page.locator(part("study-result"), has_text="study rates").wait_for()
    page.click(part("edit-study"))
    has_value(page, "name-of-study", "rates")
    assert page.locator(part("axis-0-values")).input_value() == "2, 3 rad/s"
    choose(page, "sample", "Latin hypercube: spread random samples")
    assert page.locator(part("axis-0-to")).input_value() == "3 rad/s"
    assert page.locator(part("samples-of-study")).input_value() == "100"
    page.locator(part("samples-of-study")).fill("12")
    state(page, "^12 cases$")


@pytest.mark.release
def test_a_study_is_cancelled_and_continued(page, shots):
    """As a dispersion is in `test_a_dispersion_is_cancelled_and_continued_and_its_failures_are_results`."""
    page.click(part("tab-studies"))
    choose(page, "study", "many.yaml")
    state(page, "^400 cases$")
    page.click(part("run-study"))
    page.locator(part("progress"), has_text=re.compile(r"[1-9]\d* of 400 cases")).wait_for()
    page.click(part("cancel"))
    page.wait_for_selector(part("continue"))
    page.screenshot(path=shots / "study-cancelled.png")
    assert "of 400 cases are done" in page.locator(part("message")).inner_text()
    page.click(part("continue"))
    page.locator(part("progress"), has_text=re.compile(r"[1-9]\d* of 400 cases")).wait_for()
    page.click(part("cancel"))
    page.wait_for_selector(part("continue"))
    page.click(part("edit-study"))
    has_value(page, "axis-0-points", "400")


def test_failed_cases_are_marked_with_their_reason(page, shots):
    page.click(part("tab-studies"))
    open_study(page, "broken")
    shown = f"document.querySelector('{part('study-chart')} .ev-chart')"
    page.wait_for_function(f"{shown}?.chart?.getOption()?.series?.length > 1")  # the canvas is there before its options
    page.screenshot(path=shots / "study-failed.png")
    assert page.locator(part("study-failed")).inner_text().startswith("3 of 6 cases failed")
    chart = page.locator(f"{part('study-chart')} .ev-chart").first
    marks = chart.evaluate("e => e.chart.getOption().series[1]")
    assert marks["name"] == "failed"
    assert len(marks["data"]) == 3
    assert "stability limit" in marks["data"][0]["tooltip"]["formatter"]
    assert page.locator(f".q-field:has({part('output')})").inner_text().count("tip lag") == 1  # not the steps
    with page.expect_download() as table:
        page.click(part("study-table"))
    rows = list(csv.DictReader(io.StringIO(table.value.path().read_text())))
    assert [row["solver.step [s]"] for row in rows] == ["0.0001"] * 3 + ["0.02"] * 3
    assert [row["status"] for row in rows] == ["success"] * 3 + ["failed"] * 3
    assert "stability limit" in rows[4]["reason"]
    rows = page.locator(f"{part('failed-cases')} button")
    assert rows.count() == 3
    assert "stability limit" in page.locator(part("failed-cases")).inner_text()
    rows.nth(1).click()
    page.locator("text=case 5 of study broken").first.wait_for()
    assert page.locator(part("field-solver.step")).input_value() == "0.02 s"  # as it was typed


def test_categories_have_a_discrete_legend(page, shots):
    page.click(part("tab-studies"))
    open_study(page, "orders")
    shown = f"document.querySelector('{part('study-chart')} .ev-chart')"
    # the canvas is there before its options, and they go while it is drawn again
    page.wait_for_function(f"{shown}?.chart?.getOption()?.visualMap?.[0].type === 'continuous'")
    choose(page, "output", re.compile("best spring"))
    # the chart is drawn again some time after the choice
    page.wait_for_function(f"{shown}?.chart?.getOption()?.visualMap?.[0]?.type === 'piecewise'")
    page.screenshot(path=shots / "study-categories.png")


# ------------------------------------------------------------------------- margins, dispersions, calibrations


def test_all_tabs_are_seen(page, shots):
    for width in (1440, 1000, 390):
        resized(page, {"width": width, "height": 844})
        page.screenshot(path=shots / f"tabs-{width}.png")
        inside = page.locator(".ev-side").bounding_box()
        last = page.locator(part("tab-measure")).bounding_box()
        assert last["x"] + last["width"] <= inside["x"] + inside["width"] + 0.5
        content = page.locator(".ev-side .q-tabs__content").first
        assert content.evaluate("e => e.scrollWidth <= e.clientWidth"), "which arrows would move"
        assert not page.locator(".ev-side .q-tabs__arrow--right:visible").count()
    resized(page, SCREEN)


def test_margins_of_the_open_case(page, shots):
    choose(page, "case", "hinge.yaml")
    page.click(part("margin"))
    page.locator(part("report-of"), has_text=re.compile(r"Margins \d+ hinge")).wait_for()
    report = page.frame_locator(part("margins"))
    report.locator("text=every margin holds").wait_for()
    text = report.locator("body").inner_text()
    assert "motorization" in text
    assert re.search(r"hinge\.stiffness\s+spring\s", text)
    assert re.search(r"hinge\.friction\s+friction\s", text)
    assert report.locator("figure img").count() == 1
    assert "every margin holds" in page.locator(part("message")).inner_text().lower()
    checked(page, shots, "margins")
    for look, is_dark in (("dark", True), ("light", False)):
        page.locator(part("theme")).get_by_text(look).click()
        page.wait_for_function("look => document.querySelector('iframe')?.src.endsWith(look)", arg=look)
        report.locator("text=every margin holds").wait_for()
        back = report.locator("body").evaluate("e => getComputedStyle(e).backgroundColor.match(/\\d+/g).map(Number)")
        assert (max(back) < 60) == is_dark
    page.locator(part("theme")).get_by_text("auto").click()


def test_a_category_that_is_not_declared_is_refused_by_name(page, shots):
    choose(page, "case", "silent.yaml")
    page.click(part("margin"))
    message = page.locator(part("message"), has_text="harness")
    message.wait_for()
    assert "'hinge'" in message.inner_text()
    assert "Traceback" not in message.inner_text()
    checked(page, shots, "margins-refused")
    assert page.locator(part("zero-done")).is_disabled()
    page.click(part("zero-harness"))
    page.click(part("zero-done"))
    page.locator(part("message"), has_text="Every margin holds").wait_for()
    page.click(part("tab-case"))
    page.locator("text=case of run").first.wait_for()
    declared = page.locator(part("field-margin.zero"))
    assert declared.input_value().endswith("harness]")


def test_a_dispersion_of_the_open_case(page, folder, shots):
    """The case is open and changed; the example's keys and results of another case are gone."""
    choose(page, "case", "hinge.yaml")
    page.click(part("tab-disperse"))
    page.wait_for_selector(part("dispersion-run-study"))
    begin(page, "dispersion-", "loose.yaml", "new dispersion")
    page.locator(f".q-field:has({part('dispersion-case-of-study')})", has_text="the open case: hinge.yaml").wait_for()
    assert page.locator(part("dispersion-run-study")).is_disabled()  # no key is chosen
    assert page.locator(f".q-field:has({part('dispersion-keep')}) .q-chip").count() == 0
    choose(page, "dispersion-axis-key-0", "parts.hinge.stiffness", typed="hinge.stiff")
    has_value(page, "dispersion-axis-0-text", "normal(nominal, 5%)")
    page.locator(part("dispersion-axis-0-text")).fill("table(wrong.csv)")
    page.locator(part("dispersion-axis-error-0"), has_text="cannot read 'wrong.csv': line 3").wait_for()
    page.locator(part("dispersion-axis-0-text")).fill("table(springs.csv)")
    page.locator(part("dispersion-axis-error-0"), has_text=re.compile("^$")).wait_for(state="attached")
    page.click(part("dispersion-add-key"))
    choose(page, "dispersion-axis-key-1", "parts.hinge.friction", typed="friction")
    has_value(page, "dispersion-axis-1-text", "normal(nominal, 5%)")
    page.locator(part("dispersion-samples-of-study")).fill("60")
    page.locator(f"{part('dispersion-state-of-study')}:has-text('60 cases')").wait_for()
    choose(page, "dispersion-keep", "hinge.margin", typed="margin")
    page.keyboard.press("Escape")
    page.locator(part("dispersion-run-study")).scroll_into_view_if_needed()
    checked(page, shots, "dispersion-form")
    page.click(part("dispersion-run-study"))
    page.locator(part("report-of"), has_text="Dispersion").wait_for()
    report = page.frame_locator(part("dispersion"))
    report.locator("text=95/95 lower").first.wait_for()
    text = report.locator("body").inner_text()
    assert "60 runs, plain random over 2 draws" in text
    assert "standardised coefficient" in text
    assert "table(98.0 mN m/rad, 101.0 mN m/rad" in text
    assert report.locator("figure img").count() == 2
    checked(page, shots, "dispersion")
    page.click(part("open-runs"))
    page.wait_for_selector(f"{part('study-chart')} canvas")
    page.screenshot(path=shots / "dispersion-runs.png")


def test_a_dispersion_is_cancelled_and_continued_and_its_failures_are_results(page, shots):
    page.click(part("tab-disperse"))
    page.wait_for_selector(part("dispersion-run-study"))
    choose(page, "dispersion-study", "loose.yaml")
    page.locator(f"{part('dispersion-state-of-study')}:has-text('100 cases')").wait_for()
    page.click(part("dispersion-run-study"))
    page.locator(part("progress"), has_text=re.compile(r"[1-9]\d* of 100 runs")).wait_for()
    page.click(part("cancel"))
    page.wait_for_selector(part("continue"))
    assert "of 100 runs are done" in page.locator(part("message")).inner_text()
    page.click(part("continue"))
    report = page.frame_locator(part("dispersion"))
    report.locator("h2", has_text=re.compile(r"\d+ runs? failed")).wait_for()
    text = report.locator("body").inner_text()
    assert "stability limit" in text
    assert re.search(r"\d+ of 100 runs failed; their probability is between", text)
    assert re.match(r"\d+ of 100 runs failed", page.locator(part("message")).inner_text())
    checked(page, shots, "dispersion-failed")
    page.click(part("open-runs"))
    page.locator(f"{part('failed-cases')} button").first.click()
    page.locator("text=of study loose").first.wait_for()  # the case of the run that failed is open


def test_a_study_follows_the_case_that_is_open_and_forgets_the_one_before(page):
    choose(page, "case", "boom-slew")
    page.click(part("tab-studies"))
    begin(page, "", "many.yaml", "new study")
    keys = page.locator(part("axis-key-0"))
    has_value(page, "axis-key-0", "parts.boom.length")
    assert page.locator(f".q-field:has({part('keep')}) .q-chip").count() == 3
    page.click(part("tab-case"))
    choose(page, "case", "hinge.yaml")
    page.click(part("tab-studies"))
    page.locator(f".q-field:has({part('case-of-study')})", has_text="the open case: hinge.yaml").wait_for()
    assert keys.input_value() == ""
    assert page.locator(f".q-field:has({part('keep')}) .q-chip").count() == 0
    assert page.locator(part("name-of-study")).input_value() == "hinge"
    choose(page, "axis-key-0", "parts.arm.mass", typed="arm.mass")
    page.click(part("tab-case"))
    page.click(part("part-arm"))
    page.locator(part("field-parts.arm.mass")).fill("3 kg")
    page.click(part("tab-studies"))
    page.locator(part("axis-0"), has_text="3 kg in the case").wait_for()  # changed, and not saved
    assert "hinge.yaml, changed" in page.locator(f".q-field:has({part('case-of-study')})").inner_text()
    assert keys.input_value() == "parts.arm.mass"


def test_keys_of_the_open_case_are_fitted_to_a_log(page, shots):
    choose(page, "case", "wire-booms")
    page.click(part("tab-calibrate"))
    page.locator(part("form-of-calibration")).locator("button").first.click()
    page.wait_for_selector(part("calibrate"))
    page.locator(part("case-of-calibration"), has_text="of the open case: wire-booms").wait_for()
    assert page.locator(part("calibrate")).is_disabled()
    choose(page, "data-file", "log.csv")
    page.locator("text=add a variable that was measured").wait_for()
    page.click(part("add-observe"))
    choose(page, "observe-0-variable", "spin_rate", typed="spin_rate")
    for place, key in enumerate(("wire.tip_mass", "start_lengths.1", "rates")):
        page.click(part("add-fit"))
        page.locator(part(f"fit-{place}-key")).fill(key)
        page.keyboard.press("Enter")
        page.locator(f"{part(f'fit-{place}')} .ev-what").wait_for(state="attached")  # the rows are drawn again
    page.locator(part("fit-0-low")).fill("80 g")
    page.locator(part("fit-0-high")).fill("100 g")
    page.keyboard.press("Escape")
    checked(page, shots, "calibration-form")
    page.click(part("calibrate"))
    report = page.frame_locator(part("calibration"))
    report.locator("text=standard error").first.wait_for()
    text = report.locator("body").inner_text()
    assert re.search(r"wire\.tip_mass\s+0\.09\d+ kg\s+0\.0\d+ kg", text)
    assert report.locator("figure img").count() == 1
    assert "parameters fitted, root mean square" in page.locator(part("message")).inner_text()
    checked(page, shots, "calibration")
    page.click(part("open-fitted"))
    page.locator("text=case with the values of calibration").first.wait_for()
    mass = float(page.locator(part("field-wire.tip_mass")).input_value().split()[0])
    assert 0.08 < mass < 0.1
    assert mass != 0.091


def test_a_law_is_fitted_put_into_the_open_case_and_stored(page, server, shots):
    """The law of hinge-stored is found again from its curves; what is left after ten years is that of the law."""
    choose(page, "case", "stored.yaml")
    page.click(part("tab-calibrate"))
    page.locator(part("form-of-calibration")).get_by_text("relaxation curves").click()
    choose(page, "curves-file", "curves.csv")
    page.wait_for_selector(part("curve-0"))
    choose(page, "curves-column", "torque")
    page.click(part("fit-series"))
    page.locator(".q-notification", has_text="name the column with temperature oven").wait_for()
    choose(page, "curves-temperature", "oven")
    choose(page, "field-relaxation.shift", "arrhenius")
    page.locator(part("field-relaxation.terms")).fill("99")
    page.locator(part("error-relaxation.terms"), has_text="whole number from 1 to").wait_for()
    assert page.locator(part("fit-series")).is_disabled()
    page.locator(part("field-relaxation.terms")).fill("3")
    checked(page, shots, "relaxation-form")
    page.click(part("fit-series"))
    report = page.frame_locator(part("relaxation fit"))
    report.locator("text=standard uncertainty").first.wait_for()
    assert report.locator("figure img").count() == 1
    assert "3 terms; the share that stays is 0.72" in page.locator(part("message")).inner_text()
    checked(page, shots, "relaxation")
    page.click(part("edit-job"))
    has_value(page, "field-relaxation.terms", "3")
    page.click(part("put-law"))
    page.locator(f".q-field:has({part('law-places')}) .q-chip", has_text="hinge").wait_for()  # the only place
    page.click(part("law-done"))
    page.click(part("part-hinge"))
    rows = page.locator(part("field-parts.hinge.viscoelastic.prony"))
    rows.wait_for()
    assert np.array(re.findall(r"\[(0\.\d+), ", rows.input_value()), float) == pytest.approx(
        [0.08, 0.08, 0.12], rel=1e-3
    )
    page.click(part("storage"))
    page.locator(part("report-of"), has_text=re.compile(r"Storage \d+ ")).wait_for()
    report = page.frame_locator(part("storage"))
    report.locator("text=Relaxation in storage").first.wait_for()
    assert report.locator("figure img").count() == 2
    left = re.search(r"torque\s.*\s([\d.]+) %", report.locator("body").inner_text())[1]
    law = Viscoelastic.model_validate(cases.content_of("hinge-stored")["parts"]["hinge"]["viscoelastic"])
    assert float(left) == pytest.approx(100.0 * float(law.modulus(np.array([10 * 365.25 * 86400.0]))[0]), abs=0.05)
    checked(page, shots, "storage")
    ref = f"job:{page.locator('.ev-job.on').get_attribute('data-testid').removeprefix('job-')}"
    with urllib.request.urlopen(f"{server.url}studio/kept?ref={ref}:storage.nc") as answer:
        assert answer.read().startswith(b"\x89HDF")
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(f"{server.url}studio/kept?ref={ref}:case.yaml")
