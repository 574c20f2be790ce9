"""Margins and dispersions on the page in a real browser, of the case that is open."""

from __future__ import annotations

import json
import re
import shutil

import pytest

from evolvent import cases
from margin_cases import case
from studio.serving import SHORT, choose, part

#: Where the tests begin: the panel, and what it has when it is there.
FIRST_TAB = ("tab-case", "run")
#: A phone, and the screen of the other tests.
PHONE, SCREEN = {"width": 390, "height": 844}, {"width": 1440, "height": 900}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("reports") / "work"
    place.mkdir()
    (place / "hinge.yaml").write_text(cases.dump(case()))
    silent = case()
    silent["margin"]["zero"].remove("harness")
    (place / "silent.yaml").write_text(cases.dump(silent))
    (place / "springs.csv").write_text("stiffness (mN m/rad)\n98\n101\n99.5\n102\n97\n100\n")
    shutil.copyfile(cases.system("wire-booms").data_files["rbsp-a.csv"], place / "log.csv")
    (place / "short.yaml").write_text(SHORT)
    over = {"solver.step": "table(1e-4 s, 1e-4 s, 1e-4 s, 2e-2 s)", "spool.rate": "5%"}
    broken = {
        "study": "broken",
        "case": "short.yaml",
        "sample": "monte-carlo",
        "samples": 100,
        "batch": 1,
        "over": over,
    }
    broken |= {"set": {"solver.duration": "0.4 s"}, "keep": ["body_rate.last", "tip_lag.max"]}
    (place / "broken.yaml").write_text(json.dumps(broken))
    (place / "wrong.csv").write_text("stiffness (mN m/rad)\n98\nabc\n")
    return place


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


def checked(page, shots, name):
    """Screenshots on both screens; nothing is wider than the page, and no number is missing or on two lines."""
    for size, screen in (("", SCREEN), ("phone-", PHONE)):
        page.set_viewport_size(screen)
        page.wait_for_timeout(400)
        page.screenshot(path=shots / f"{size}{name}.png")
        assert page.evaluate("document.documentElement.scrollWidth") <= screen["width"], name
        for frame in page.frames:
            assert frame.evaluate("document.documentElement.scrollWidth <= innerWidth + 1"), (name, screen)
            assert not re.search(r"\b(nan|inf|None|undefined|NaN)\b", frame.locator("body").inner_text())
            assert frame.evaluate(BROKEN) == [], (name, screen)
    page.set_viewport_size(SCREEN)


def test_all_tabs_are_seen(page, shots):
    for width in (1440, 1000, 390):
        page.set_viewport_size({"width": width, "height": 844})
        page.wait_for_timeout(400)
        page.screenshot(path=shots / f"tabs-{width}.png")
        inside = page.locator(".ev-side").bounding_box()
        last = page.locator(part("tab-measure")).bounding_box()
        assert last["x"] + last["width"] <= inside["x"] + inside["width"] + 0.5
        assert not page.locator(".ev-side .q-tabs__arrow--right:visible").count()
    page.set_viewport_size(SCREEN)


def test_margins_of_the_open_case(page, shots):
    choose(page, "case", "hinge.yaml")
    page.click(part("margin"))
    page.locator(part("report-of"), has_text="Margins 1 hinge").wait_for()
    report = page.frame_locator(part("margins"))
    report.locator("text=Every margin holds.").wait_for()
    text = report.locator("body").inner_text()
    assert "motorization" in text
    assert re.search(r"hinge\.stiffness\s+spring\s", text)
    assert re.search(r"hinge\.friction\s+friction\s", text)
    assert report.locator("figure img").count() == 1
    assert "every margin holds" in page.locator(part("message")).inner_text().lower()
    checked(page, shots, "margins")


def test_a_category_that_is_not_declared_is_refused_by_name(page, shots):
    choose(page, "case", "silent.yaml")
    page.click(part("margin"))
    message = page.locator(part("message"), has_text="harness")
    message.wait_for()
    assert "'hinge'" in message.inner_text()
    assert "Traceback" not in message.inner_text()
    checked(page, shots, "margins-refused")
    page.click(part("open-job-case"))
    page.locator("text=case of run").first.wait_for()


def typed(page, field, text):
    page.locator(part(field)).fill(text)
    page.wait_for_timeout(300)


def test_a_dispersion_of_the_open_case(page, folder, shots):
    """The case is open and changed; the example's keys and results of another case are gone."""
    choose(page, "case", "hinge.yaml")
    page.click(part("tab-disperse"))
    page.wait_for_selector(part("dispersion-run-study"))
    assert "the open case: hinge.yaml" in page.locator(f".q-field:has({part('dispersion-case-of-study')})").inner_text()
    assert page.locator(part("dispersion-run-study")).is_disabled()  # no key is chosen
    assert page.locator(f".q-field:has({part('dispersion-keep')}) .q-chip").count() == 0
    choose(page, "dispersion-axis-key-0", "parts.hinge.stiffness", typed="hinge.stiff")
    assert page.locator(part("dispersion-axis-0-text")).input_value() == "normal(nominal, 5%)"
    typed(page, "dispersion-axis-0-text", "table(wrong.csv)")
    page.locator(part("dispersion-axis-error-0"), has_text="'wrong.csv', row 3: 'abc' is not a number").wait_for()
    typed(page, "dispersion-axis-0-text", "table(springs.csv)")
    page.locator(part("dispersion-axis-error-0"), has_text=re.compile("^$")).wait_for(state="attached")
    page.click(part("dispersion-add-key"))
    choose(page, "dispersion-axis-key-1", "parts.hinge.friction_torque", typed="friction_torque")
    typed(page, "dispersion-samples-of-study", "60")
    page.locator(f"{part('dispersion-state-of-study')}:has-text('60 cases')").wait_for()
    page.wait_for_timeout(1000)
    choose(page, "dispersion-keep", "hinge.margin", typed="margin")
    page.keyboard.press("Escape")
    page.locator(part("dispersion-run-study")).scroll_into_view_if_needed()
    page.wait_for_timeout(1200)
    checked(page, shots, "dispersion-form")
    page.click(part("dispersion-run-study"))
    page.locator(part("report-of"), has_text="Dispersion").wait_for()
    report = page.frame_locator(part("dispersion"))
    report.locator("text=95/95 lower").first.wait_for()
    text = report.locator("body").inner_text()
    assert "60 runs, plain random over 2 draws" in text
    assert "standardised coefficient" in text
    assert "table(98 mN m/rad, 101 mN m/rad" in text
    assert report.locator("figure img").count() == 2
    checked(page, shots, "dispersion")
    page.click(part("open-runs"))
    page.wait_for_selector(f"{part('study-chart')} canvas")
    page.wait_for_timeout(600)
    page.screenshot(path=shots / "dispersion-runs.png")


def test_a_dispersion_is_cancelled_and_continued_and_its_failures_are_results(page, shots):
    page.click(part("tab-disperse"))
    page.wait_for_selector(part("dispersion-run-study"))
    choose(page, "dispersion-study", "broken.yaml")
    page.locator(f"{part('dispersion-state-of-study')}:has-text('100 cases')").wait_for()
    page.click(part("dispersion-run-study"))
    page.locator(part("progress"), has_text=re.compile(r"[1-9]\d* of 100 runs")).wait_for()
    page.click(part("cancel"))
    page.wait_for_selector(part("continue"))
    assert "of 100 runs are done" in page.locator(part("message")).inner_text()
    page.click(part("continue"))
    report = page.frame_locator(part("dispersion"))
    report.locator("text=Runs that failed").wait_for()
    text = report.locator("body").inner_text()
    assert "stability limit" in text
    assert re.search(r"\d+ of 100 runs failed; their probability is between", text)
    assert re.match(r"\d+ of 100 runs failed", page.locator(part("message")).inner_text())
    checked(page, shots, "dispersion-failed")
    page.click(part("open-runs"))
    page.locator(f"{part('failed-cases')} button").first.click()
    page.locator("text=of study broken").first.wait_for()  # the case of the run that failed is open


def test_a_study_follows_the_case_that_is_open_and_forgets_the_one_before(page):
    choose(page, "case", "boom-slew")
    page.click(part("tab-studies"))
    choose(page, "study", "new study")
    keys = page.locator(part("axis-key-0"))
    assert keys.input_value() == "parts.boom.length"
    assert page.locator(f".q-field:has({part('keep')}) .q-chip").count() == 3
    page.click(part("tab-case"))
    choose(page, "case", "hinge.yaml")
    page.click(part("tab-studies"))
    page.wait_for_timeout(600)
    assert "the open case: hinge.yaml" in page.locator(f".q-field:has({part('case-of-study')})").inner_text()
    assert keys.input_value() == ""
    assert page.locator(f".q-field:has({part('keep')}) .q-chip").count() == 0
    assert page.locator(part("name-of-study")).input_value() == "hinge"
    choose(page, "axis-key-0", "parts.arm.mass", typed="arm.mass")
    page.click(part("tab-case"))
    page.click(part("part-arm"))
    mass = page.locator(part("field-parts.arm.mass"))
    mass.fill("3 kg")
    page.wait_for_timeout(1200)
    page.click(part("tab-studies"))
    page.locator(part("axis-0"), has_text="3 kg in the case").wait_for()  # changed, and not saved
    assert "hinge.yaml, changed" in page.locator(f".q-field:has({part('case-of-study')})").inner_text()
    assert keys.input_value() == "parts.arm.mass"


def test_keys_of_the_open_case_are_fitted_to_a_log(page, shots):
    choose(page, "case", "wire-booms")
    page.click(part("tab-calibrate"))
    page.wait_for_selector(part("calibrate"))
    assert "of the open case: wire-booms" in page.locator(part("case-of-calibration")).inner_text()
    assert page.locator(part("calibrate")).is_disabled()
    choose(page, "data-file", "log.csv")
    page.click(part("add-observe"))
    choose(page, "observe-0-variable", "spin_rate", typed="spin_rate")
    for place, key in enumerate(("wire.tip_mass", "start_lengths.1", "rates")):
        page.click(part("add-fit"))
        page.locator(part(f"fit-{place}-key")).fill(key)
        page.keyboard.press("Enter")
        page.wait_for_timeout(500)
    typed(page, "fit-0-low", "80 g")
    typed(page, "fit-0-high", "100 g")
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
