"""The page in a real browser: what a user does with it, from a typed number to a certificate."""

from __future__ import annotations

import json
import pathlib
import re
import urllib.error
import urllib.request

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import cases, results
from evolvent.design import studies
from evolvent.design.studies import draw
from evolvent_massprops.inertia import Body, Stand, linear_model
from studio.serving import LONG, SHORT, WAIT, choose, frames, open_study, part, settle

EXAMPLE = pathlib.Path(__file__).parents[4] / "examples" / "stand.yaml"
#: Values that the cases of a study take together.
LISTED = {"spool.rate": [4.0, 2.0, 3.0], "body.rate": [5.0, 7.0, 6.0]}


def refusal(request):
    """Code that a request is refused with; 200 where it is not."""
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        error.close()
        return error.code


@pytest.fixture(scope="module")
def folder(work):
    """A working folder with cases, runs, a study and a recording."""
    place = work
    (place / "short.yaml").write_text(SHORT)
    (place / "long.yaml").write_text(LONG)
    for name, rate in (("slow.nc", 3.0), ("fast.nc", 4.0)):
        run = evolvent.run(place / "short.yaml", {"spool.rate": rate})
        results.save(run, place / name)
    run.attrs |= {"status": "failed", "message": "failed at t = 3 s: the energy no longer closes"}
    results.save(run, place / "bad.nc")
    study = {
        "study": "payout",
        "case": "short.yaml",
        "set": {"blade.segments": "inextensible", "solver.method": "dopri5"},
        "over": {"spool.rate": [2.0, 3.0, 4.0], "blade.nodes": [4, 6]},
        "keep": ["body_rate.last", "hub_tension.max"],
    }
    (place / "payout.yaml").write_text(json.dumps(study))
    studies.sweep(studies.read(place / "payout.yaml"), output=place / "payout")
    common = {"case": cases.content_of(place / "short.yaml"), "set": study["set"], "keep": ["body_rate"]}
    for name, own in (
        ("lines", {"over": {"body.rate": [5.0, 6.0, 7.0]}}),
        ("listed", {"sample": "list", "over": LISTED, "keep": ["body_rate.last"]}),
    ):
        studies.sweep(studies.read({"study": name, **common, **own}), output=place / name)
    body = Body(mass=15190.0, centre=(0.0, 0.0, 0.0), inertia=(3703.0, 43920.0, 43920.0))
    stand = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, damping=200.0)
    modes = linear_model(stand, body).modes()
    t = np.arange(612) / 50.0
    x = modes.motion(t, modes.release((0.0, -9806.65, 0.0), stand.points[0]), stand.points).T
    x = x + 1e-4 * np.random.default_rng(1).standard_normal(x.shape)
    lines = ["time (s)," + ",".join(f"sensor {k + 1} (m)" for k in range(4))]
    lines += [",".join(f"{v:.9g}" for v in row) for row in np.column_stack([t, x])]
    (place.parent / "knock.csv").write_text("\n".join(lines))
    (place / "stand.yaml").write_text(EXAMPLE.read_text(encoding="utf-8"))
    return place


def open_runs(page):
    page.click(part("tab-runs"))


def test_errors_stand_beside_the_field_as_one_types(page, shots):
    choose(page, "case", "heliogyro")
    length, error = page.locator(part("field-blade.length")), page.locator(part("error-blade.length"))
    assert error.inner_text() == ""
    length.fill("5 kg")
    page.wait_for_function("e => e.textContent.includes('unit of something else')", arg=error.element_handle())
    assert not page.locator(part("run")).is_enabled()
    page.locator(part("field-body.blades")).fill("2.5")
    page.locator(f"{part('error-body.blades')} >> text=whole number from 1 to 64").wait_for()
    page.screenshot(path=shots / "form-errors.png")
    length.fill("80 cm")
    page.locator(part("field-body.blades")).fill("3")
    page.wait_for_function("e => !e.disabled && !e.classList.contains('disabled')",
                           arg=page.locator(part("run")).element_handle())  # fmt: skip
    # the message of a rule over several keys stands beside the key that it names
    page.click(part("more-spool"))
    page.locator(part("field-spool.start_length")).fill("2 m")
    page.locator(f"{part('error-spool.start_length')} >> text=more than blade.length").wait_for()


def test_run_to_results_and_play(page, server, folder, shots):
    choose(page, "case", "short.yaml")
    page.click(part("run"))
    page.wait_for_selector(part("result"))
    page.wait_for_selector(f"{part('charts')} canvas")
    assert page.locator(f"{part('main')} >> text=body rate at the end").is_visible()
    page.wait_for_selector(part("play"))
    page.wait_for_function("document.querySelector('.ev-motion')?.viewer?.motions.length === 1")
    frames(page)
    now = "document.querySelector('.ev-motion')?.viewer.now"
    view = page.locator(f"{part('motion')} canvas")
    page.locator(part("scrub")).evaluate("e => { e.value = 100; e.dispatchEvent(new Event('input')); }")
    frames(page)
    begun, before = page.evaluate(now), view.screenshot()
    cursor = "document.querySelector('.ev-cursor').style.transform"
    at = page.evaluate(cursor)
    page.click(part("play"))
    page.wait_for_function(f"{now} > {begun} + 0.2")
    page.click(part("play"))
    frames(page)
    assert view.screenshot() != before
    assert page.evaluate(cursor) != at, "the charts' cursor follows the time"
    held = page.evaluate(now)
    page.wait_for_timeout(100)
    assert page.evaluate(now) == held
    before = view.screenshot()
    page.select_option(part("axes"), "body")
    frames(page)
    assert view.screenshot() != before, "in inertial axes the body turns"
    page.select_option(part("color"), "1")
    page.screenshot(path=shots / "run.png")
    ref = "job:" + next(p.name for p in (folder / ".evolvent-studio").iterdir() if p.name.endswith("short"))
    for what, begins in (("run", b"\x89HDF"), ("case", b"system: heliogyro")):
        with urllib.request.urlopen(f"{server.url}studio/{what}?ref={ref}") as answer:
            assert answer.read().startswith(begins)


def test_cancel_and_queue_after_reload(page, shots):
    choose(page, "case", "long.yaml")
    page.click(part("run"))
    page.locator(f"{part('progress')} >> text=left").wait_for()
    page.screenshot(path=shots / "running.png")
    page.click(part("tab-case"))
    choose(page, "case", "short.yaml")
    page.click(part("run"))
    page.locator("text=queued").first.wait_for()
    page.reload()
    page.locator(f"{part('runs')} >> text=waiting").wait_for()
    listed = page.locator(part("runs")).inner_text()
    assert "long" in listed
    assert "running" in listed
    assert "waiting" in listed
    page.locator(".ev-job", has_text="long").locator("text=Cancel").click()
    page.locator(".ev-job", has_text="long").locator("text=cancelled").wait_for()
    page.locator(".ev-job", has_text="long").locator(".ev-link").click()
    page.wait_for_selector(part("interrupted"))
    assert "what was computed is kept" in page.locator(part("interrupted")).inner_text()
    page.wait_for_selector(f"{part('charts')} canvas")
    page.screenshot(path=shots / "cancelled.png")


def test_compare_saved_runs(page, shots):
    open_runs(page)
    page.click(part("tick-file:slow.nc"))
    page.click(part("tick-file:fast.nc"))
    page.click(part("compare"))
    page.wait_for_selector(part("comparison"))
    page.wait_for_selector(f"{part('charts')} canvas")
    text = page.locator(part("main")).inner_text()
    assert re.search(r"spool.rate\s+3.0\srad/s\s+4.0\srad/s", text)
    page.wait_for_function("document.querySelector('.ev-motion')?.viewer?.motions.length === 2")
    page.screenshot(path=shots / "compare.png")


def test_names_are_text_and_nothing_else(page, folder):
    sly = "<img src=x onerror=window.hacked=1>"
    name = f'a" onclick="window.hacked=1" {sly[:12]}'
    (folder / f"{name}.nc").write_bytes((folder / "slow.nc").read_bytes())
    (folder / f"{name}.csv").write_bytes((folder.parent / "knock.csv").read_bytes())
    stand = EXAMPLE.read_text(encoding="utf-8").replace("Body on four springs", json.dumps(sly))
    (folder / "sly-stand.yaml").write_text(stand)
    open_runs(page)
    page.locator("button:has(i:text('refresh')) >> visible=true").click()
    page.locator(".ev-link", has_text="onclick").click()
    page.wait_for_selector(part("result"))
    page.click(part("tab-measure"))
    choose(page, "signal-file", re.compile(r"\.csv"))
    page.wait_for_selector(part("columns"))
    page.reload()
    page.click(part("tab-measure"))
    page.wait_for_selector(part("columns"))
    shown = "text => document.querySelector('[data-testid=\"field-title\"]')?.value === text"
    choose(page, "stand", "sly-stand.yaml")
    page.wait_for_function(shown, arg=sly)
    assert page.evaluate("window.hacked") is None
    page.locator(".ev-row:has-text('onclick') >> button:has(i:text('close'))").click()
    page.locator("text=Drop a file of signals on the left").wait_for()
    choose(page, "stand", "new: springs")
    page.wait_for_function(shown, arg="")


def test_200_nodes_and_1000_frames_move_without_the_server(page, server, folder):
    """Stretched from a short run: what is drawn does not matter here, how much of it does."""
    run = results.open(folder / "slow.nc")
    time = np.linspace(float(run.time[0]), float(run.time[-1]), 1000)
    nodes = run["blade-1"].sizes["node"]

    near = np.abs(run.time.values - time[:, None]).argmin(axis=1)

    def stretched(group):
        """1000 samples, 200 nodes in place of a blade's, 201 points of its line."""
        places = {d: 200 + n - nodes for d, n in group.sizes.items() if n in (nodes, nodes + 1) and d != "time"}
        wider = {d: np.arange(count) * group.sizes[d] // count for d, count in places.items()}
        return group.isel(wider | ({"time": near} if "time" in group.sizes else {}))

    root = stretched(run.to_dataset()).assign_coords(time=("time", time, run.time.attrs))
    groups = {f"/{name}": stretched(group.to_dataset(inherit=False)) for name, group in run.children.items()}
    wide = xr.DataTree.from_dict({"/": root, **groups})
    wide.attrs = run.attrs | {"case": run.attrs["case"].replace("nodes: 6", "nodes: 200")}
    results.save(wide, folder / "wide.nc")
    open_runs(page)
    page.locator("button:has(i:text('refresh')) >> visible=true").click()
    page.locator(".ev-link", has_text="wide.nc").click()
    page.wait_for_selector(f"{part('play')} >> visible=true")
    page.wait_for_function("document.querySelector('.ev-motion')?.viewer?.motions[0]?.frames === 1000")
    assert page.evaluate("document.querySelector('.ev-motion')?.viewer.motions.map((m) => m.nodes)") == [201]
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.evaluate("document.querySelector('.ev-motion').viewer.times.length = 0")
    page.click(part("play"))
    page.wait_for_function("document.querySelector('.ev-motion')?.viewer.times.length > 40")
    page.click(part("play"))
    gap, work = np.array(page.evaluate("document.querySelector('.ev-motion')?.viewer.times")).T
    told = f"frames every {np.median(gap):.0f} ms, 95 % within {np.percentile(gap, 95):.0f} ms; "
    print(f"{told}{np.median(work):.1f} ms of them here, in software rendering")
    assert not [url for url in asked if "motion" in url]
    assert len(gap) > 20
    assert np.median(work) < 12.0, "a frame at 60 Hz has 16 ms"


def test_failed_run_is_labelled(page, shots):
    open_runs(page)
    page.locator(".ev-link", has_text="bad.nc").click()
    page.wait_for_selector(part("failed"))
    assert "the energy no longer closes" in page.locator(part("failed")).inner_text()
    page.screenshot(path=shots / "failed.png")


def test_signal_to_certificate(page, folder, shots):
    page.click(part("tab-measure"))
    page.set_input_files(f"{part('signals')} input[type=file]", folder.parent / "knock.csv")
    page.wait_for_selector(part("columns"))
    assert page.locator(".ev-wrong").count() == 0, "nothing of the stand was touched yet"
    page.click(part("measure"))
    page.locator(".ev-wrong").first.wait_for()
    assert not page.locator(part("measure")).is_enabled(), "the stand is not described yet"
    choose(page, "stand", "stand.yaml")
    page.wait_for_function(
        "s => document.querySelector(s)?.value === '2'", arg=part("point-2")
    )  # the description names the points
    page.screenshot(path=shots / "columns.png")
    page.locator(part("point-2")).fill("nowhere")
    page.locator(f"{part('form-error')} >> text=signals.sensors.1.point").wait_for()
    page.locator(part("point-2")).fill("2")
    page.locator(f"{part('form-error')} >> text=signals.sensors.1.point").wait_for(state="hidden")
    page.click(part("measure"))
    page.wait_for_selector(part("measured"))
    row = page.locator(f"{part('measured')} tr", has_text="Ixx").inner_text().split("\t")
    assert float(row[1]) == pytest.approx(3703.0, abs=3.0 * float(row[3]))
    certificate = page.frame_locator(part("certificate"))
    certificate.locator("text=Body on four springs").first.wait_for()
    first = certificate.locator("header").inner_text()
    assert "Ixx" in first, "the certificate begins with the values"
    assert "±" in first
    page.screenshot(path=shots / "certificate.png")


def test_a_torsion_rig_needs_no_signals(page, folder):
    (folder / "rig.yaml").write_bytes((EXAMPLE.parent / "torsion.yaml").read_bytes())
    page.click(part("tab-measure"))
    choose(page, "stand", "rig.yaml")
    page.locator(part("measure")).click()
    page.wait_for_selector(part("measured"))
    row = page.locator(f"{part('measured')} tr", has_text="Ixz:").inner_text().split("\t")
    assert float(row[1]) == pytest.approx(-0.625, abs=1e-3)
    assert "B1 is wrong" in page.locator(part("warnings")).inner_text()


def test_click_on_a_map_opens_the_case(page, shots):
    page.click(part("tab-studies"))
    open_study(page, "payout")
    canvas = page.wait_for_selector(f"{part('study-chart')} canvas")
    page.wait_for_timeout(500)
    page.screenshot(path=shots / "study.png")
    box = canvas.bounding_box()
    # three pay-out speeds along x, two numbers of nodes along y: the middle of the upper row
    page.mouse.click(box["x"] + 0.5 * (box["width"] - 52), box["y"] + 0.3 * box["height"])
    page.locator("text=of study payout").first.wait_for()
    assert page.locator(part("field-spool.rate")).input_value() == "3.0"
    assert page.locator(part("field-blade.nodes")).input_value() == "6"


def test_the_figures_of_a_system_stand_below_its_study(page, folder, shots):
    over = {"body.offset_x": [-0.4, 0.4], "body.offset_z": [-0.2, 0.2]}
    asked = studies.read({"study": "corners", "case": "inertia-stand", "over": over})
    names = list(draw.of_system(studies.sweep(asked, output=folder / "corners")))
    assert len(names) == 5
    page.click(part("tab-studies"))
    page.click(part("study-corners"))
    sheets = page.locator(f"{part('study-figures')} img")
    sheets.first.wait_for()
    assert [sheets.nth(k).get_attribute("alt") for k in range(sheets.count())] == [n.replace("_", " ") for n in names]
    page.wait_for_function("e => e.naturalWidth > 300", arg=sheets.last.element_handle())
    sheets.last.scroll_into_view_if_needed()
    page.screenshot(path=shots / "study-figures.png")


@pytest.mark.parametrize(
    ("study", "chart", "series", "point", "case", "rates"),
    [
        ("lines", 0, 1, 30, 2, {"body.rate": "6.0"}),  # a line of the body's rate over the time for each case
        ("listed", 0, 0, 1, 2, {"spool.rate": "2.0", "body.rate": "7.0"}),  # points over the one key
        ("listed", 1, 0, 2, 3, {"spool.rate": "3.0", "body.rate": "6.0"}),  # and over the other
    ],
)
def test_click_on_lines_and_points_opens_the_case(page, shots, study, chart, series, point, case, rates):
    page.click(part("tab-studies"))
    open_study(page, study)
    page.wait_for_timeout(500)
    page.screenshot(path=shots / f"study-{study}.png")
    box = page.locator(f"{part('study-chart')} .ev-chart").nth(chart)
    box.scroll_into_view_if_needed()
    drawn = "([e, s, k]) => e.chart?.getOption()?.series?.[s]?.data?.[k] !== undefined"
    page.wait_for_function(drawn, arg=[box.element_handle(), series, point])
    x, y = box.evaluate(
        "(e, [s, k]) => e.chart.convertToPixel({ seriesIndex: s }, e.chart.getOption().series[s].data[k])",
        [series, point],
    )
    box.click(position={"x": x, "y": y})
    page.locator(f"text=case {case} of study").first.wait_for()
    for key, value in rates.items():
        assert page.locator(part(f"field-{key}")).input_value() == value


def test_keys_that_no_field_shows_are_told(page, folder, shots):
    (folder / "typo.yaml").write_text(SHORT.replace("nodes: 6", "nodes: 6, tip_mas: 5 g"))
    (folder / "torn.yaml").write_text("system: [heliogyro")
    page.click("button:has(i:text('refresh')) >> nth=0")
    settle(page)
    choose(page, "case", "typo.yaml")
    page.locator(f"{part('form-error')} >> text=did you mean 'blade.tip_mass'").wait_for()
    assert not page.locator(part("run")).is_enabled()
    page.screenshot(path=shots / "unknown-key.png")
    page.click(part("leave-out"))
    page.wait_for_function("e => !e.disabled && !e.classList.contains('disabled')",
                           arg=page.locator(part("run")).element_handle())  # fmt: skip
    choose(page, "case", "torn.yaml (cannot be read)")
    page.locator("text=torn.yaml, line 1").first.wait_for()


def test_two_pages_run_what_each_of_them_shows(page, context, server, folder):
    length = "s => document.querySelector(s)?.value === '1 m'"
    choose(page, "case", "short.yaml")
    page.wait_for_function(length, arg=part("field-blade.length"))
    other = context.new_page()
    other.set_default_timeout(WAIT)
    other.goto(server.url)
    other.wait_for_function(length, arg=part("field-blade.length"))
    settle(other)
    other.locator(part("field-body.rate")).fill("7 rad/s")
    other.wait_for_timeout(500)
    page.locator(part("field-blade.length")).fill("90 cm")
    other.click(part("run"))
    other.wait_for_selector(part("runs"))
    page.click(part("run"))  # at once, before the form was checked
    page.wait_for_selector(part("result"))
    other.close()
    last = sorted((folder / ".evolvent-studio").glob("0*/case.yaml"))[-2:]
    found = [cases.load(path) for path in last]
    assert sorted((case.blade.length, case.body.rate) for case in found) == [(0.9, 6.0), (1.0, 7.0)]


def test_dropped_files_and_what_was_typed_stay(page, folder):
    page.click(part("tab-measure"))
    page.wait_for_selector(part("field-title"))
    leave = page.locator(".ev-row:has(.ev-link) >> button:has(i:text('close')) >> visible=true")
    while count := leave.count():  # of tests before
        leave.first.click()
        page.wait_for_function(f"document.querySelectorAll('.ev-row .ev-link + button').length < {count}")
    for name in ("one.csv", "two.csv"):
        (folder.parent / name).write_text("a,b\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(50)))
    page.locator(part("field-title")).fill("A platform")
    for _ in range(2):  # the same files once more change nothing
        with page.expect_response(lambda r: r.request.method == "POST" and "upload" in r.url):
            page.set_input_files(
                f"{part('signals')} input[type=file]", [folder.parent / "one.csv", folder.parent / "two.csv"]
            )
        page.locator(".ev-row >> text=two.csv").wait_for()
        settle(page)
    assert page.locator(".ev-row .ev-link >> visible=true").all_inner_texts() == ["one.csv", "two.csv"]
    open_runs(page)
    page.click(part("tab-measure"))
    settle(page)
    assert page.locator(part("field-title")).input_value() == "A platform"
    page.set_input_files(f"{part('signals')} input[type=file]", folder.parent / "knock.csv")
    for name in ("one.csv", "two.csv"):
        page.locator(f".ev-row:has-text('{name}') >> button:has(i:text('close'))").click()
        page.locator(f".ev-row >> text={name}").wait_for(state="detached")
    page.locator(f"{part('columns')} >> text=sensor 4").wait_for()  # columns of the file that is left
    page.locator(".ev-row:has-text('knock.csv') >> button:has(i:text('close'))").click()
    page.locator("text=Drop a file of signals on the left").wait_for()


def test_a_narrow_page_is_one_column(page, shots):
    page.set_viewport_size({"width": 390, "height": 844})
    open_runs(page)
    page.locator(".ev-link", has_text="slow.nc").click()
    page.wait_for_selector(f"{part('motion')} canvas")
    page.wait_for_selector(f"{part('charts')} canvas")
    settle(page)
    page.screenshot(path=shots / "narrow.png", full_page=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    picture, beside = (page.locator(f"{part('motion')} {place}").bounding_box() for place in ("canvas", ".ev3-numbers"))
    assert picture["width"] > 340
    assert beside["y"] + beside["height"] <= picture["y"] + 1.0, "read-outs stand above the body, not on it"


def test_a_dropped_case_is_opened(page, folder):
    other = folder.parent / "other.yaml"
    other.write_text(SHORT.replace("6 rad/s", "5 rad/s"))
    page.set_input_files(f"{part('case-upload')} input[type=file]", other)
    page.wait_for_function("s => document.querySelector(s)?.value === '5 rad/s'", arg=part("field-body.rate"))
    other.write_text("system: [heliogyro")
    page.set_input_files(f"{part('case-upload')} input[type=file]", other)
    page.locator(".ev-notify", has_text="other-2.yaml").first.wait_for()
    assert page.locator(part("field-body.rate")).input_value() == "5 rad/s", "what was there stays"


def test_case_that_reads_outside_is_refused(page, folder):
    outside = folder.parent / "secret.nc"
    outside.write_bytes((folder / "slow.nc").read_bytes())
    (folder / "sly.yaml").write_text("system: wrapped-rib\nphase: deploy\nstart: ../secret.nc\n")
    page.click("button:has(i:text('refresh')) >> nth=0")
    settle(page)
    choose(page, "case", "sly.yaml")
    page.locator("text=is outside the working folder").first.wait_for()


@pytest.mark.parametrize(
    "path", ["../secret.nc", "/etc/passwd", "payout/../../secret.nc", "link.nc", "..%2fsecret.nc", "%00", "."]
)
@pytest.mark.parametrize("what", ["run", "case", "motion", "export", "start", "report", "dispersed"])
def test_no_path_leads_outside(server, folder, path, what):
    (folder.parent / "secret.nc").write_bytes((folder / "slow.nc").read_bytes())
    if not (folder / "link.nc").is_symlink():
        (folder / "link.nc").symlink_to(folder.parent / "secret.nc")
    assert refusal(f"{server.url}studio/{what}?ref=file:{path}") == 404


def test_other_pages_and_other_names_are_refused(server, folder):
    for headers, code in (({"Host": "evil.example"}, 421), ({"Origin": "http://evil.example"}, 403)):
        for path in ("", "_nicegui_ws/socket.io/?EIO=4&transport=polling", "studio/run?ref=file:slow.nc"):
            assert refusal(urllib.request.Request(server.url + path, headers=headers)) == code


def test_no_other_page_may_show_it_inside_itself(server, folder):
    for path in ("", "studio/case?ref=file:slow.nc"):
        with urllib.request.urlopen(server.url + path) as answer:
            assert answer.headers["X-Frame-Options"] == "SAMEORIGIN"
            assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
