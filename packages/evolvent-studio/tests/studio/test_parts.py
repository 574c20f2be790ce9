"""What the studio is made of, without a browser: form, folder, gate, queue, charts."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
import types

import numpy as np
import pytest

from evolvent import cases, results
from evolvent.design import studies
from evolvent_base import schema
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_massprops import description
from evolvent_studio import charts, command, form, gate, parts, reading
from evolvent_studio.differences import difference, whole
from evolvent_studio.folder import Folder
from evolvent_studio.jobkinds import CASE
from evolvent_studio.jobs import Jobs
from evolvent_studio.state import Studio
from studio.serving import LONG, SHORT

BRIEF = SHORT + "solver: {duration: 1 s}\n"

# ------------------------------------------------------------------------------------------------ form


@pytest.mark.parametrize("name", cases.built_in())
def test_form_gives_back_every_built_in_case(name):
    content = cases.content_of(name)
    kind = cases.system(content["system"]).Case
    shown = form.describe(kind)
    back, wrong = form.content_of(shown, form.texts(shown, content), form.given(shown, content))
    assert wrong == {}
    assert back == content
    assert cases.problems(back) == {}


@pytest.mark.parametrize("system", cases.systems())
def test_form_holds_every_key_of_the_schema(system):
    kind = cases.system(system).Case
    shown = form.describe(kind)
    inside = {field.key for field in shown.fields()}
    sections = {group.key for group in shown.groups()}
    # keys of the entries of a list stand in the list's own field
    left = {key for key in schema.keys(kind) if key not in inside | sections}
    assert all(any(key.startswith(f"{field}.") for field in inside) for key in left)
    for field in shown.fields():
        assert field.help or field.choices, field.key


@pytest.mark.parametrize("kind", description.KINDS)
def test_form_of_a_stand(kind):
    shown = form.describe(description.model(kind))
    assert any(field.required for field in shown.fields())
    units = {field.key: field.unit for field in shown.fields()}
    of_kind = {"springs": "stand.stiffness", "torsion": "stand.stiffness", "compound": "stand.distance"}
    assert units[of_kind.get(kind, "stand.length")] in ("N/m", "N m/rad", "m")


def test_fields_take_units_limits_and_defaults_from_the_schema():
    fields = {field.key: field for field in form.describe(cases.system("heliogyro").Case).fields()}
    assert fields["blade.line_density"].unit == "kg/m"
    assert fields["blade.segments"].choices == ("springs", "inextensible")
    assert fields["blade.rotate_velocity"].kind == "switch"
    assert fields["blade.stiffness"].default == "10000 N/m"
    assert "from 1 to 64" in fields["body.blades"].help
    assert not fields["body.mass"].required


def test_every_wrong_field_is_told_at_once():
    content = cases.content_of("heliogyro")
    content["blade"] |= {"length": "5 kg", "nodez": 3}
    content["body"]["rate"] = "fast"
    found = cases.problems(content)
    assert set(found) == {"blade.length", "blade.nodez", "body.rate"}
    assert "did you mean 'blade.nodes'" in found["blade.nodez"]
    content = cases.content_of("heliogyro")
    content["spool"]["start_length"] = "9 m"
    assert set(cases.problems(content)) == {"spool.start_length"}
    assert cases.problems(cases.content_of("heliogyro")) == {}
    assert set(cases.problems({"system": "nothing"})) == {"system"}


def test_single_ones_of_a_repeated_part_are_written_out():
    ball = {"kind": "point", "mass": "200 g", "repeat": {"count": 2}}
    content = {"system": "structure", "parts": {"ball": ball}}
    assert parts.one_by_one(content) == content
    found = parts.one_by_one({**content, "parts": {"ball": ball, "ball 2": {"mass": "300 g"}}})
    assert {name: part["mass"] for name, part in found["parts"].items()} == {"ball 1": "200 g", "ball 2": "300 g"}
    wrong = {**content, "parts": {"ball": {"mass": 1.0}}}
    assert parts.one_by_one(wrong) == wrong


def test_what_is_no_yaml_is_told_beside_its_field():
    shown = form.describe(cases.system("heliogyro").Case)
    content = cases.content_of("heliogyro")
    texts = form.texts(shown, content) | {"spool.rate": "[1, 2"}
    _, wrong = form.content_of(shown, texts, set())
    assert list(wrong) == ["spool.rate"]


def test_what_no_field_shows_is_known():
    shown = form.describe(cases.system("heliogyro").Case, skip=("system",))
    content = cases.content_of("heliogyro")
    assert form.unknown_content(shown, content, ("system",)) == {}
    content["blade"]["nodez"] = 3
    content["spool"] = [1, 2]
    content["colour"] = {"of": "blade"}
    assert form.unknown_content(shown, content, ("system",)) == {
        "blade.nodez": 3,
        "spool": [1, 2],
        "colour": {"of": "blade"},
    }
    typed = {"blade": {"nodes": 4}, "spool": {"rate": 2}}
    for key, value in form.unknown_content(shown, content, ("system",)).items():
        form.put(typed, key, value)
    assert typed == {"blade": {"nodes": 4, "nodez": 3}, "spool": [1, 2], "colour": {"of": "blade"}}


# ------------------------------------------------------------------------------------------------ folder, gate


def test_yaml_files_are_read_again_only_when_they_changed(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text("system: heliogyro")
    (tmp_path / "list.yaml").write_text("[1, 2]")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "large.yaml").write_text("a: 1 # " + "x" * 600_000)
    read = []
    ask = reading.Reader.ask
    monkeypatch.setattr(
        reading.Reader, "ask", lambda self, *task, **given: read.append(given["name"]) or ask(self, *task, **given)
    )
    folder = Folder(tmp_path)
    for _ in range(2):
        assert {name: found.keys for name, found in folder.yaml().items()} == {"a.yaml": {"system"}}
        assert list(folder.unreadable()) == ["binary.yaml", "large.yaml", "list.yaml"]
    assert read == ["a.yaml", "list.yaml"]
    (tmp_path / "a.yaml").write_text("system: wrapped-rib")
    assert folder.content("a.yaml") == {"system": "wrapped-rib"}
    for name, said in (("binary.yaml", "not UTF-8 text"), ("large.yaml", "too large"), ("none.yaml", "no such file")):
        with pytest.raises(InputError, match=said):
            folder.text(name)


def test_results_of_studies_are_no_runs(tmp_path):
    for name in (
        "a.nc",
        "grid/study.json",
        "spread/study.json",
        "spread/dispersion.csv",
        "spread/dispersion.nc",
        "old/b.nc",
    ):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("")
    folder = Folder(tmp_path)
    assert folder.runs() == ["a.nc", "old/b.nc"]
    assert folder.studies() == ["grid", "spread"]
    assert (folder.studies(dispersed=False), folder.studies(dispersed=True)) == (["grid"], ["spread"])
    assert folder.report("spread") is None
    (tmp_path / "spread" / "report.html").write_text("")
    (tmp_path / "grid" / "report.html").write_text("")
    assert folder.report("spread") == tmp_path / "spread" / "report.html"
    assert folder.report("grid") is None
    assert folder.report("../spread") is None


def test_folder_opens_nothing_outside(tmp_path):
    root = tmp_path / "work"
    (root / "sub").mkdir(parents=True)
    (tmp_path / "secret.nc").write_text("x")
    (root / "link.nc").symlink_to(tmp_path / "secret.nc")
    (root / "sub" / "out").symlink_to(tmp_path, target_is_directory=True)
    folder = Folder(root)
    assert folder.inside("sub/a.nc") == root / "sub" / "a.nc"
    for name in ("../secret.nc", "/etc/passwd", "link.nc", "sub/out/secret.nc", "sub/../../secret.nc", "", ".", "a\0b"):
        with pytest.raises(InputError):
            folder.inside(name)
    assert folder.files(".nc") == []
    with pytest.raises(InputError, match="outside"):
        folder.placed({"start": "../secret.nc"})
    with pytest.raises(InputError, match="outside"):
        folder.placed({"case": "../other.yaml"})
    folder.placed({"start": "sub/a.nc", "rate": "3 rad/s"})


def test_a_case_file_runs_no_code(tmp_path):
    proof = tmp_path / "proof"
    for name, text in (
        ("apply.yaml", f"system: !!python/object/apply:os.mkdir ['{proof}']"),
        ("new.yaml", f"!!python/object/new:os.mkdir ['{proof}']"),
        ("name.yaml", "system: !!python/name:os.system"),
        ("system.yaml", "system: ../../os"),
    ):
        (tmp_path / name).write_text(text)
    studio = Studio(Folder(tmp_path))
    try:
        for name in ("apply.yaml", "new.yaml", "name.yaml", "system.yaml"):
            with pytest.raises(InputError):
                studio.open_case(f"file:{name}")
        studio.sources(), studio.study_sources(), studio.stands()
        studio.draft.content = cases.content_of("wrapped-rib-deploy") | {"start": "../outside.nc"}
        with pytest.raises(InputError, match="outside"):
            studio.submit()
    finally:
        studio.jobs.stop()
    assert not proof.exists()


def test_dropped_files_keep_a_plain_name(tmp_path):
    folder = Folder(tmp_path)
    for name in ("../../evil.csv", "C:\\x\\evil.csv", "/evil.csv"):
        assert folder.keep(name, b"1") == ".evolvent-studio/uploads/evil.csv"
    assert folder.keep("..", b"1") == ".evolvent-studio/uploads/file"


def test_a_name_that_is_taken_is_not_written_over(tmp_path):
    folder = Folder(tmp_path)
    (tmp_path / "a.yaml").write_text("x")
    with pytest.raises(InputError, match="there already"):
        folder.new("a", ".yaml")
    with pytest.raises(InputError, match="outside"):
        folder.new("../b", ".yaml")
    with pytest.raises(InputError, match="own files"):
        folder.new(".evolvent-studio/b", ".yaml")
    with pytest.raises(InputError, match="at most 200"):
        folder.new("b" * 300, ".yaml")
    with pytest.raises(InputError, match="dot"):
        folder.new(".b", ".yaml")


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::", "example.org"])
def test_an_open_address_needs_a_token(host):
    with pytest.raises(InputError, match="--token"):
        gate.check(host, None)
    gate.check(host, "long enough")


def test_loopback_needs_none_and_a_short_token_is_refused():
    for host in ("127.0.0.1", "localhost", "::1"):
        gate.check(host, None)
    with pytest.raises(InputError, match="8 characters"):
        gate.check("0.0.0.0", "short")


@pytest.mark.slow
def test_command_refuses_in_one_sentence(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for options, said in (
            (["--host", "0.0.0.0", "--no-token"], "needs --token"),
            (["--token", "long enough", "--no-token"], "both given"),
            (["--port", port], "give another with --port"),
        ):
            words = [sys.executable, "-m", "evolvent", "studio", "--no-browser", *options]
            done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
            assert done.returncode == 2
            assert said in done.stderr
            assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_the_page_needs_a_new_secret_unless_told_otherwise(monkeypatch):
    given = []
    server = types.SimpleNamespace(serve=lambda root, **options: given.append(options["token"]))
    monkeypatch.setitem(sys.modules, "evolvent_studio.server", server)
    monkeypatch.setattr("evolvent_studio.server", server, raising=False)
    monkeypatch.delenv(command.TOKEN, raising=False)
    for options in ([], [], ["--no-token"], ["--token", "long enough"]):
        command.studio.main(["--no-browser", "--port", "0", *options], standalone_mode=False)
    first, second, *others = given
    assert len(first) >= 32
    assert first != second
    assert others == [None, "long enough"]


def knock(headers, *, token=None, host="127.0.0.1", query=b"", kind="http"):
    """Status of a request at the gate; 200 if it was let through."""
    seen = []

    async def app(scope, receive, send):
        seen.append(200)

    async def send(message):
        seen.append(message.get("status", message.get("code")))

    async def receive():
        return {"type": "websocket.connect"}

    lines = [(name.encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": kind, "method": "GET", "headers": lines, "query_string": query}
    with pytest.raises(StopIteration):  # nothing in it waits, so that no loop is needed
        gate.Gate(app, host=host, token=token)(scope, receive, send).send(None)
    return seen[0]


def test_gate():
    mine = {"host": "127.0.0.1:8421"}
    assert knock(mine) == 200
    assert knock(mine | {"origin": "http://127.0.0.1:8421"}) == 200
    assert knock({"host": "localhost:8421"}) == 200
    assert knock({"host": "evil.example:8421"}) == 421
    assert knock({}) == 421
    assert knock(mine | {"origin": "http://evil.example"}) == 403
    assert knock(mine | {"origin": "null"}) == 403
    assert knock(mine | {"origin": "http://evil.example"}, kind="websocket") == 1008
    secret = {"token": "long enough", "host": "0.0.0.0"}
    assert knock(mine, **secret) == 401
    assert knock(mine, kind="websocket", **secret) == 1008
    assert knock(mine, query=b"token=wrong", **secret) == 401
    assert knock(mine, query=b"token=long%20enough", **secret) == 303
    assert knock(mine | {"cookie": "evolvent-studio=long%20enough"}, **secret) == 200
    assert knock(mine | {"cookie": "evolvent-studio=other"}, **secret) == 401
    assert knock(mine | {"cookie": "evolvent-studio=t%C3%B6"}, **secret) == 401


def test_the_link_of_the_browser_that_is_started_works_once():
    """Other users see its command line; the cookie holds the secret itself, which they do not see."""
    answers = []

    async def send(message):
        answers.append(message)

    async def receive():
        return {}

    guard = gate.Gate(None, host="127.0.0.1", token="the secret", once="for one time")
    scope = {
        "type": "http",
        "method": "GET",
        "headers": [(b"host", b"localhost")],
        "query_string": b"token=for+one+time",
    }
    for _ in range(2):
        with pytest.raises(StopIteration):
            guard(scope, receive, send).send(None)
    statuses = [one["status"] for one in answers if "status" in one]
    assert statuses == [303, 401]
    assert b"the%20secret" in dict(answers[0]["headers"])[b"set-cookie"]


# ------------------------------------------------------------------------------------------------ queue


def test_a_process_of_the_studio_loads_no_array_libraries():
    """They are hidden before anything is loaded; xarray takes half a second to load those that it finds."""
    script = (
        "import sys, types; from evolvent_studio import child; main = lambda *given: print(given, sys.modules['dask']);"
        "sys.modules['evolvent_studio.x'] = types.SimpleNamespace(main=main); child.main('x', 'y')"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout == "('y',) None\n", done.stderr


def until(condition, seconds=60.0):
    """Wait for something."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.05)


@pytest.mark.slow
def test_queue_runs_cancels_and_goes_on_after_a_restart(tmp_path):
    folder = Folder(tmp_path)
    jobs = Jobs(folder)
    try:
        killed = jobs.add("run", "killed", case=LONG)
        until(lambda: jobs._process is not None)
        jobs._process.kill()
        until(lambda: not killed.open)
        assert killed.status == "failed"
        assert "died" in killed.message
        assert jobs.result(killed.key) is None

        long = jobs.add("run", "long", case=LONG)
        last = jobs.add("run", "last", case=BRIEF)
        until(lambda: jobs._process is not None)
        with pytest.raises(InputError, match="cancel it first"):
            jobs.remove(long.key)
        with pytest.raises(InputError, match="another process"):
            Jobs(folder)
    finally:
        jobs.stop()
    jobs = Jobs(folder)
    try:
        assert [job.key for job in jobs.listed()] == [last.key, long.key, killed.key]
        assert jobs.get(killed.key).status == "failed"
        assert jobs.get(last.key).status == "waiting"
        again = jobs.get(long.key)
        assert again.open
        until(lambda: again.marks and again.reached > 0.2)
        jobs.cancel(again.key)
        until(lambda: not again.open)
        assert again.status == "interrupted"
        kept = results.open(jobs.result(again.key))
        assert kept.attrs["status"] == "interrupted"
        assert 0.0 < float(kept.time[-1]) < 28.0

        until(lambda: not jobs.get(last.key).open)
        assert jobs.get(last.key).status == "success"
        assert results.open(jobs.result(last.key)).attrs["status"] == "success"
        assert (jobs.folder_of(last.key) / CASE).read_text() == BRIEF
        jobs.remove(last.key)
        assert not jobs.folder_of(last.key).exists()
    finally:
        jobs.stop()


@pytest.mark.slow
def test_a_study_is_cancelled_and_goes_on(tmp_path):
    folder = Folder(tmp_path)
    (tmp_path / "short.yaml").write_text(SHORT)
    # the second case takes so long that it is still computed when the first has been seen to be finished
    over = {"solver.duration": ["1 s", "28 s", "1.5 s"]}
    content = {"study": "s", "case": "short.yaml", "over": over, "keep": ["steps"], "batch": 1}
    (tmp_path / "s.yaml").write_text(json.dumps(content))
    jobs = Jobs(folder)
    try:
        job = jobs.add("sweep", "s", case=studies.read(tmp_path / "s.yaml").text)
        until(lambda: job.reached >= 1.0)
        jobs.cancel(job.key)
        until(lambda: not job.open)
        if job.status == "interrupted":  # it may have been quicker
            assert jobs.result(job.key) is None
            jobs.resume(job.key)
            until(lambda: not job.open)
        assert job.status == "success"
        assert studies.open(jobs.result(job.key)).status.values.tolist() == ["success"] * 3
        with pytest.raises(InputError, match="nothing that was cancelled"):
            jobs.resume(job.key)
    finally:
        jobs.stop()


def test_names_that_no_page_can_show_are_left_out_and_long_ones_are_cut(tmp_path):
    folder = Folder(tmp_path)
    (tmp_path / "fine.yaml").write_text("a: 1")
    with contextlib.suppress(OSError):  # not every file system takes such a name
        (tmp_path / os.fsdecode(b"bad\xff.yaml")).write_text("a: 1")
    assert folder.files(".yaml") == ["fine.yaml"]
    kept = folder.keep("\u5c4b" * 120 + ".yaml", b"a: 1")
    assert (tmp_path / kept).read_bytes() == b"a: 1"
    with pytest.raises(InputError, match="takes 305 bytes; at most 200 are taken"):
        folder.new("x" * 300, ".yaml")


# ------------------------------------------------------------------------------------------------ pictures


def test_charts_keep_extremes_and_leave_gaps():
    x = np.linspace(0.0, 10.0, 50_001)
    y = np.sin(x)
    y[33_333] = 5.0
    y[100:200] = np.nan
    panel = Panel(x_label="time, s", y_label="rate, rad/s", lines=[Line(x=x, y=y)])
    (chart,) = charts.charts(Figure(name="a", title="A", panels=[panel]))
    data = chart.options["series"][0]["data"]
    assert chart.timed
    assert len(data) <= charts.MOST + 2
    assert max(b for _, b in data if b is not None) == 5.0
    assert any(b is None for _, b in data)
    json.dumps(chart.options, allow_nan=False)


def test_panels_above_others_share_their_time():
    line = Line(x=np.arange(3.0), y=np.array([1.0, -1.0, 2.0]))
    panels = [
        Panel(x_label="", y_label="a", lines=[line], log=True),
        Panel(x_label="time, s", y_label="b", lines=[line]),
    ]
    found = charts.charts(Figure(name="a", title="A", panels=panels))
    assert [chart.timed for chart in found] == [True, True]
    assert found[0].options["series"][0]["data"][1][1] is None, "a logarithm has no place for what is not positive"


def test_runs_over_one_another_have_a_color_each():
    lines = [Line(x=np.arange(3.0), y=np.arange(3.0), label=name) for name in ("a", "b")]
    figure = Figure(name="f", title="F", panels=[Panel(x_label="x", y_label="y", lines=lines)])
    (chart,) = charts.compared([("one", figure), ("two", figure)])
    drawn = [(s["name"], s["lineStyle"]["color"], s["lineStyle"]["type"]) for s in chart.options["series"]]
    assert drawn == [
        ("one: a", "@0", "solid"),
        ("one: b", "@0", "dashed"),
        ("two: a", "@1", "solid"),
        ("two: b", "@1", "dashed"),
    ]


def test_runs_over_one_another_stand_in_the_same_unit_and_quantity():
    """A system may show one run in J and another in mJ, and leave out a panel that would be empty."""

    def figure(unit, *quantities):
        panels = [
            Panel(
                x_label="time, s", y_label=f"{name}, {unit}", lines=[Line(x=np.arange(2.0), y=np.array([1.0, value]))]
            )
            for name, value in quantities
        ]
        return Figure(name="energy", title="Energy", panels=panels)

    one = figure("J", ("energy", 2.0), ("taken", 3.0))
    two = figure("mJ", ("energy", 4.0), ("energy stored", 5.0), ("taken", 6.0))
    found = {
        chart.options["yAxis"]["name"]: {s["name"]: s["data"][1][1] for s in chart.options["series"]}
        for chart in charts.compared([("one", one), ("two", two)])
    }
    assert found == {
        "energy [J]": {"one": 2.0, "two": 0.004},
        "taken [J]": {"one": 3.0, "two": 0.006},
        "energy stored [mJ]": {"two": 5.0},
    }
    assert charts.factor("speed, m/s", "rate, m/s") is None
    assert charts.factor("energy, J", "energy, s") is None
    assert charts.factor("angular momentum,\n1e-3 kg m2/s", "angular momentum, 1e-3 kg m2/s") == 1.0


def test_scales_are_seen_on_light_and_on_dark_pages():
    line = Line(x=np.arange(2.0), y=np.arange(2.0), color=0.0)
    (chart,) = charts.charts(Figure(name="f", title="F", panels=[Panel(x_label="x", y_label="y", lines=[line])]))
    light, dark = (
        sum(int(color[i : i + 2], 16) for i in (1, 3, 5))
        for color in chart.options["series"][0]["lineStyle"]["color"].split("|")
    )
    assert light < 200 < dark


def test_logarithmic_axes_end_at_decades():
    line = Line(x=np.arange(3.0), y=np.array([0.02, 3.0, 400.0]))
    panel = Panel(x_label="time, s", y_label="y", lines=[line], log=True)
    (chart,) = charts.charts(Figure(name="f", title="F", panels=[panel]))
    axis = chart.options["yAxis"]
    assert (axis["min"], axis["max"], axis["interval"]) == (0.01, 1000.0, 1.0)


def test_shapes_of_the_same_size_are_not_drawn_as_round_off():
    line = Line(x=np.arange(1.0, 5.0), y=3.0 + 1e-9 * np.arange(4.0), marker="o", style="")
    (chart,) = charts.charts(Figure(name="f", title="F", panels=[Panel(x_label="sensor", y_label="y", lines=[line])]))
    assert chart.options["yAxis"]["max"] - chart.options["yAxis"]["min"] > 0.1
    assert chart.options["xAxis"]["minInterval"] == 1


def test_events_are_numbered_marks_on_charts_over_time():
    t = np.linspace(0.0, 10.0, 20)
    timed = Panel(y_label="angle, rad", x_label="time, s", lines=[Line(x=t, y=t), Line(x=t, y=-t)])
    other = Panel(y_label="angle, rad", x_label="length, m", lines=[Line(x=t, y=t)])
    drawn = charts.charts(Figure(name="angles", title="Angles", panels=[timed, other]))
    events = [(2.5, "left latched"), (2.5, "right latched"), (7.0, "cord released")]
    first, second = (charts.marked(chart, events) for chart in drawn)
    mark = first.options["series"][0]["markLine"]
    assert [(line["xAxis"], line["name"]) for line in mark["data"]] == [(2.5, "1"), (7.0, "2")]
    assert "markLine" not in first.options["series"][1]
    assert second == drawn[1]
    assert charts.events_texts(events) == ["1: left latched, right latched at 2.5 s", "2: cord released at 7 s"]
    many = [(0.1 * k, "node taken up") for k in range(40)]
    assert charts.events_texts(many)[-1] == "and 28 more later"
    assert charts.marked(drawn[0], []) == drawn[0]


# ------------------------------------------------------------------------------------------------ results as texts


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (("2.5 m", "3 m"), "+0.5 m"),
        (("(1, 2, 0) mm at the end, most 4 mm", "(0, 0.002, 0) m at the end, most 5 mm"),
         "(-1, 0, 0) mm at the end, most +1 mm"),
        (("1,234 of rk4, 3 rejected", "1,034 of rk4, 5 rejected"), "-200 of rk4, +2 rejected"),
        (("1 N m", "2 N m", "5 N m"), "4 N m"),
        (("1e-3 rad/s", "-1e-3 rad/s"), "-0.002 rad/s"),
        (("clamp", "hinge"), ""),
        (("1 m", "1 kg"), ""),
        (("3 m", "-"), ""),
        (("rk4: 'pivot 1' is a constraint", "rk4: 'pivot 2' is a constraint"), ""),
    ],
)  # fmt: skip
def test_differences_of_results_have_their_units(texts, said):
    assert difference(texts) == said


def test_no_line_ends_between_a_number_and_its_unit():
    gap = "\u00a0"
    assert whole("(0, 0, 2) mN m at the end, 0.5 rad/s") == f"(0, 0, 2){gap}mN{gap}m at the end, 0.5{gap}rad/s"
    assert whole("boom-2 of 3 booms, rk4 method") == "boom-2 of 3 booms, rk4 method"
