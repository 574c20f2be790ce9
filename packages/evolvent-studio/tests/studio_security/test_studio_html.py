"""Text of the user in pages: names of files, cases, parts and messages are shown as they are, never as HTML."""

from __future__ import annotations

import base64
import html.parser
import json

import numpy as np
import pytest

import evolvent
from evolvent import cases
from evolvent.exports import report
from evolvent.results.motion import Line as Thread, Motion
from evolvent.view import animation
from evolvent_base import plots, showing
from evolvent_base.figures import Figure, Line, Panel
from evolvent_massprops import mass_properties
from studio.serving import AT_ONCE, SHORT, WAIT, choose, part, serving, settle

#: What would run if it were HTML, or an attribute, in one of the places where text stands.
IMAGE = "<img src=x onerror=hacked()>"
ATTACKS = (
    IMAGE, f"</script><script>hacked()</script>{IMAGE}", f'"><svg onload=hacked()>{IMAGE}', "' onmouseover='hacked()",
    f"]]>--></title></style></textarea></iframe>{IMAGE}", "&lt;img src=x onerror=hacked()&gt;",
    "@DATA@ @VIEWER@ @TITLE@",
    "{{hacked()}}", "${hacked()}", "\u2028</script>\u2029", "javascript:hacked()",
)  # fmt: skip
#: A name that would be a property of an element of the page.
PROPERTY = f'x" innerHTML="{IMAGE}" onclick="hacked()'


class Read(html.parser.HTMLParser):
    """Elements and attributes of a page."""

    def __init__(self, page):
        super().__init__()
        self.found, self.scripts, self._open = [], [], False
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self._open = tag == "script"
        if self._open:
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._open = False

    def handle_data(self, data):
        if self._open:
            self.scripts[-1] += data


def assert_harmless(page, *, scripts):
    """A page has no element or attribute that an attack would make, and so many scripts; frames are read too."""
    read = Read(page)
    assert len(read.scripts) == scripts
    for tag, attributes in read.found:
        assert not [name for name in attributes if name.startswith("on")], (tag, attributes)
        assert attributes.get("src", "data:").startswith("data:"), (tag, attributes)
        assert attributes.get("href", "#").startswith("#"), (tag, attributes)
        assert tag not in ("svg", "object", "embed", "base", "form", "link")
        if "srcdoc" in attributes:
            assert attributes["sandbox"] == "allow-scripts"
            assert_harmless(attributes["srcdoc"], scripts=1)
    return read


@pytest.mark.parametrize("attack", ATTACKS, ids=range(len(ATTACKS)))
def test_an_animation_holds_texts_as_texts(attack):
    points = np.zeros((2, 3, 3))
    points[..., 0] = np.arange(3)
    line = Thread(name=attack, kind="thread", points=points, values={f"{attack}, N": np.ones((2, 3))})
    page = animation.page(Motion(title=attack, time=np.array([0.0, 1.0]), lines=[line]))[0].decode()
    (script,) = assert_harmless(page, scripts=1).scripts
    start = script.index("const data = ") + len("const data = ")
    data, _ = json.JSONDecoder().raw_decode(script[start:])
    assert (data["title"], data["lines"][0]["name"]) == (attack, attack)
    assert page.count("</script>") == 1


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short run."""
    place = tmp_path_factory.mktemp("html")
    (place / "short.yaml").write_text(SHORT)
    return evolvent.run(place / "short.yaml", {"solver.duration": "2 s"})


@pytest.mark.slow
@pytest.mark.parametrize("attack", ATTACKS[:5], ids=range(5))
def test_a_report_holds_texts_as_texts(run, attack, monkeypatch, tmp_path):
    hostile = run.copy()
    names = ("message", "warning", "latches", "method", "date", "made_with")
    hostile.attrs = dict(run.attrs) | dict.fromkeys(names, attack) | {"laws": json.dumps({attack: attack})}
    hostile.attrs |= {"status": "failed", "case": f"{run.attrs['case']}# {attack}"}
    for variable in hostile.data_vars.values():
        if "long_name" in variable.attrs:
            variable.attrs["long_name"] = attack
    with monkeypatch.context() as patch:
        patch.setattr(report, "_animation", lambda run, found, written: [])
        patch.setattr(plots, "picture", lambda figure, kind, **_: b"-")  # one is drawn below
        report.write(hostile, str(tmp_path / "report.html"))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("hacked") > 8
    assert_harmless(page, scripts=0)
    line = Line(x=np.arange(3.0), y=np.arange(3.0), label=attack)
    figure = Figure(name="x", title=attack, panels=[Panel(x_label=attack, y_label=attack, lines=[line])])
    picture = base64.b64decode(showing.figure_picture(figure).source.partition(",")[2]).decode()
    drawn = Read(picture)
    assert not drawn.scripts
    assert not {"img", "script", "iframe", "textarea"} & {tag for tag, _ in drawn.found}
    assert not [name for _, attributes in drawn.found for name in attributes if name.startswith("on")]


@pytest.mark.slow
def test_a_certificate_holds_texts_as_texts(tmp_path):
    """Texts of the description, names of the file and of its columns."""
    t = np.arange(750) / 240.0
    swing = [100.0 * np.exp(-0.01 * t) * np.cos(6.0 * t + 0.3) + a * np.cos(0.01 * t + 1.0) for a in (15.0, 20.0)]
    data = np.column_stack(swing) + 0.1 * np.random.default_rng(4).standard_normal((len(t), 2))
    path = tmp_path / f"{IMAGE}.csv"
    names = f"{IMAGE}\t</pre></script>{IMAGE}\n"
    path.write_text(names + "\n".join(f"{a:.6f}\t{b:.6f}" for a, b in data))
    description = {
        "title": ATTACKS[1],
        "remarks": ATTACKS[4],
        "signals": {"rate": "240 Hz", "unit": "px"},
        "body": {"name": ATTACKS[2]},
        "stand": {"kind": "torsion", "stiffness": "9 +- 0.009 N m/rad"},
        "tare": [{"inertia": "0.05 +- 0.0001 kg m^2", "name": IMAGE}],
    }
    mass_properties(str(path), description).report(tmp_path / "certificate.html")
    page = (tmp_path / "certificate.html").read_text(encoding="utf-8")
    assert page.count("hacked") > 8
    assert_harmless(page, scripts=0)


# ------------------------------------------------------------------------------------------------ the page


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A working folder in which every name and text is an attack."""
    place = tmp_path_factory.mktemp("html") / "work"
    (place / ".evolvent-studio" / "0001-a").mkdir(parents=True)
    (place / f"{IMAGE}.yaml").write_text(SHORT)
    structure = cases.content_of("boom-slew")
    first = next(iter(structure["parts"]))
    structure["title"] = IMAGE
    structure["parts"] = {PROPERTY: structure["parts"][first], IMAGE: {"kind": IMAGE}, **structure["parts"]}
    (place / "hostile.yaml").write_text(json.dumps(structure))
    (place / f"{IMAGE}.csv").write_text(f"time (s),{IMAGE}\n" + "".join(f"{k},{k % 3}\n" for k in range(20)))
    (place / "study.yaml").write_text(json.dumps({"study": "s", "case": IMAGE, "over": {IMAGE: [1.0, 2.0]}}))
    (place / f"{IMAGE}.nc").write_text("x")
    (place / f"{IMAGE}").mkdir()
    (place / f"{IMAGE}" / "study.json").write_text("{}")
    job = {"key": "0001-a", "kind": "run", "title": IMAGE, "status": "failed", "message": IMAGE}
    (place / ".evolvent-studio" / "queue.json").write_text(json.dumps([job]))
    return place


@pytest.mark.slow
def test_nothing_that_a_folder_holds_becomes_html(browser, folder, tmp_path_factory, shots_of):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        with serving(folder) as server:
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.set_default_timeout(WAIT)
            page.add_init_script(AT_ONCE)
            page.add_init_script("window.attacks = []; window.hacked = () => window.attacks.push(location.href)")
            violated = []
            page.on("request", lambda request: violated.append(request.url) if request.url.endswith("/x") else 0)

            def check(where):
                settle(page)
                page.wait_for_timeout(100)  # for what an image or a script does that is not loaded at once
                page.screenshot(path=shots_of(where))
                assert page.evaluate("window.attacks") == [], where
                assert page.locator("img[src='x'], [onclick], [onerror], svg[onload]").count() == 0, where

            page.goto(server.url)
            page.click(part("tab-case"))
            page.wait_for_selector(part("run"))
            choose(page, "case", f"{IMAGE}.yaml")
            check("file")
            choose(page, "case", "hostile.yaml")
            page.locator(".ev-partcard").first.wait_for()
            check("parts")
            for k in range(2):
                page.locator(".ev-partcard .q-expansion-item__toggle-icon").nth(k).click()
            check("part")
            page.locator(".ev-partcard .ev-title").first.hover()
            page.click(part("tab-runs"))
            check("runs")
            page.locator(".ev-job .ev-link").first.click()
            check("run")
            page.locator(".ev-link", has_text=f"{IMAGE}.nc").click()
            check("file of a run")
            page.click(part("tab-measure"))
            choose(page, "signal-file", f"{IMAGE}.csv")
            page.locator(part("columns")).wait_for()
            check("signals")
            page.click(part("tab-studies"))
            page.locator(".ev-link", has_text=IMAGE).last.click()
            check("study")
            choose(page, "study", "study.yaml")
            page.wait_for_function("s => document.querySelector(s).disabled", arg=part("run-study"))  # it is refused
            check("message")
            page.wait_for_timeout(600)
            check("all")
            page.close()
            assert violated == []
        assert "Traceback" not in server.log.read_text()


@pytest.fixture
def shots_of(tmp_path):
    return lambda where: tmp_path / f"{where.replace(' ', '-')}.png"
