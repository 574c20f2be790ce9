"""Studies on the page in a real browser, and the page on a phone."""

from __future__ import annotations

import json
import re

import pytest

from evolvent import cases
from evolvent.design import studies
from studio.serving import SHORT, WAIT, choose, part

#: A phone.
PHONE = {"width": 390, "height": 844}
#: Where the tests begin: the panel, and what it has when it is there.
FIRST_TAB = ("tab-studies", "run-study")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("studies") / "work"
    place.mkdir()
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
    return place


def opened(browser, server, **options):
    context = browser.new_context(**options)
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.goto(server.url)
    return page


def state(page, pattern):
    """The panel's text on the study, once it matches the pattern."""
    found = page.locator(part("state-of-study"), has_text=re.compile(pattern))
    found.wait_for()
    return found.inner_text()


def typed(page, field, text):
    page.locator(part(field)).fill(text)
    page.wait_for_timeout(300)


def test_a_first_visit_offers_an_example(browser, server, shots):
    page = opened(browser, server, viewport=PHONE, has_touch=True, is_mobile=True)
    try:
        page.wait_for_selector(part("run-start"))  # the start of the first case, with a button that runs it
        page.tap(part("tab-case"))
        page.wait_for_timeout(500)
        choose(page, "case", "short.yaml")
        page.reload()
        page.wait_for_selector(part("example"))
        page.screenshot(path=shots / "phone-welcome.png")
        page.tap(part("example"))
        page.wait_for_selector(f"{part('motion')} canvas")
        assert "boom-slew" in page.locator(part("result")).inner_text()
    finally:
        page.context.close()


def test_a_study_is_written_estimated_saved_and_run(page, folder, shots):
    choose(page, "case-of-study", "short.yaml")
    page.locator(part("axis-error-0"), has_text="Choose a key").wait_for()  # that of the other case is gone
    assert page.locator(part("run-study")).is_disabled()
    choose(page, "axis-key-0", "spool.rate", typed="spool.rate")
    page.wait_for_function(f"document.querySelector('{part('axis-0-values')}')?.value === '3.5 rad/s'")
    assert "a plain number is in rad/s" in page.locator(part("axis-0")).inner_text()
    typed(page, "axis-0-values", "2, 3 rad/s, [")
    assert page.locator(part("axis-error-0")).inner_text().startswith("over.spool.rate is '[2, 3 rad/s, []'")
    assert page.locator(part("run-study")).is_disabled()
    typed(page, "axis-0-values", "2, 3 rad/s")
    while page.locator(".q-chip__icon--remove").count():
        page.locator(".q-chip__icon--remove").first.click()
        page.wait_for_timeout(300)
    page.locator(part("keep")).fill("body_rate.last")
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    page.locator(f"{part('block-set')} .q-item").first.click()
    typed(page, "set-of-study", "solver.duration: 0.4 s")
    typed(page, "name-of-study", "rates")
    state(page, "^2 cases$")
    page.wait_for_timeout(1500)
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
    page.wait_for_timeout(500)
    assert page.locator(part("name-of-study")).input_value() == "rates"
    assert page.locator(part("axis-0-values")).input_value() == "2, 3 rad/s"
    choose(page, "sample", "Latin hypercube: spread random samples")
    assert page.locator(part("axis-0-to")).input_value() == "3 rad/s"
    assert page.locator(part("samples-of-study")).input_value() == "100"
    typed(page, "samples-of-study", "12")
    state(page, "^12 cases$")


def test_a_study_is_cancelled_and_continued(page, shots):
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
    page.wait_for_timeout(500)
    assert page.locator(part("axis-0-points")).input_value() == "400"


def test_failed_cases_are_marked_with_their_reason(page, shots):
    page.click(part("study-broken"))
    page.wait_for_selector(f"{part('study-chart')} canvas")
    page.wait_for_timeout(500)
    page.screenshot(path=shots / "study-failed.png")
    assert page.locator(part("study-failed")).inner_text().startswith("3 of 6 cases failed")
    chart = page.locator(f"{part('study-chart')} .ev-chart").first
    marks = chart.evaluate("e => e.chart.getOption().series[1]")
    assert marks["name"] == "failed"
    assert len(marks["data"]) == 3
    assert "stability limit" in marks["data"][0]["tooltip"]["formatter"]
    assert page.locator(f".q-field:has({part('output')})").inner_text().count("tip lag") == 1  # not the steps
    rows = page.locator(f"{part('failed-cases')} button")
    assert rows.count() == 3
    assert "stability limit" in page.locator(part("failed-cases")).inner_text()
    rows.nth(1).click()
    page.locator("text=case 5 of study broken").first.wait_for()
    assert page.locator(part("field-solver.step")).input_value() == "0.02"


def test_categories_have_a_discrete_legend(page, shots):
    page.click(part("study-orders"))
    page.wait_for_selector(f"{part('study-chart')} canvas")
    shown = f"document.querySelector('{part('study-chart')} .ev-chart')"
    page.wait_for_function(f"{shown}?.chart?.getOption()?.visualMap")  # the canvas is there before its options
    chart = page.locator(f"{part('study-chart')} .ev-chart").first
    scale = "e => e.chart.getOption().visualMap[0].type"
    assert chart.evaluate(scale) == "continuous"
    choose(page, "output", re.compile("best spring"))
    # the chart is drawn again some time after the choice
    page.wait_for_function(f"{shown}?.chart?.getOption()?.visualMap?.[0]?.type === 'piecewise'")
    page.screenshot(path=shots / "study-categories.png")


# ------------------------------------------------------------------------------------------------ a phone


def test_the_first_result_is_seen_on_a_phone(browser, server, shots):
    page = opened(browser, server, viewport=PHONE, has_touch=True, is_mobile=True)

    def fits():
        return page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]

    try:
        page.wait_for_selector(part("shell"))
        for tab, inside in (("case", "run"), ("runs", "compare"), ("measure", "measure"), ("studies", "run-study")):
            page.tap(part(f"tab-{tab}"))
            page.wait_for_timeout(500)
            box = page.locator(part(inside)).bounding_box()
            assert box["y"] + box["height"] <= PHONE["height"], tab
            assert not page.locator(part("main")).is_visible()
            assert fits(), tab
        page.tap(part("tab-case"))
        choose(page, "case", "short.yaml")
        page.tap(part("run"))
        page.wait_for_selector(f"{part('motion')} canvas")
        page.wait_for_timeout(800)
        page.screenshot(path=shots / "phone-run.png")
        assert not page.locator(part("run")).is_visible()  # the panels are folded
        assert fits()
        motion, numbers = (page.locator(place).first.bounding_box() for place in (part("motion"), ".ev-two"))
        assert motion["y"] >= 0.0
        assert motion["height"] > 250.0
        assert motion["y"] + motion["height"] < numbers["y"]
        assert numbers["y"] + 100.0 < PHONE["height"]
        viewer = "document.querySelector('.ev-motion').viewer"
        before = page.evaluate(f"{viewer}.camera.azimuth")
        page.evaluate(
            f"""(canvas => {{ for (const [type, x] of [['pointerdown', 150], ['pointermove', 200], ['pointerup', 200]])
            canvas.dispatchEvent(new PointerEvent(type, {{ clientX: x, clientY: 300, pointerId: 1,
            pointerType: 'touch', isPrimary: true, bubbles: true }})) }})({viewer}.canvas)"""
        )
        assert page.evaluate(f"{viewer}.camera.azimuth") != before
        page.tap(part("play"))
        page.wait_for_timeout(300)
        assert page.evaluate(f"{viewer}.now") > 0.0
        page.tap(part("tab-studies"))
        page.tap(part("study-broken"))
        page.wait_for_selector(f"{part('study-chart')} canvas")
        page.wait_for_timeout(500)
        page.screenshot(path=shots / "phone-study.png")
        assert fits()
    finally:
        page.context.close()
