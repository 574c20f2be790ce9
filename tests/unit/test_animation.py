"""The page of an animation and the bytes for the studio: what they hold can be read back, with one scale of colours."""

import base64
import dataclasses
import itertools
import json
import pathlib
import re
import shutil

import numpy as np
import pytest

from evolvent.exports import pictures as films
from evolvent.exports.faces import Camera
from evolvent.results.motion import Line, Motion
from evolvent.view import animation
from many_bodies import many_bodies

TYPES = {"i1": np.int8, "i2": np.dtype("<i2"), "f4": np.dtype("<f4"), "f8": np.dtype("<f8")}


def read_page(made):
    """Header and blocks of a page."""
    text = made.decode()
    header = json.loads(re.search(r"const data = (.*);\n", text)[1])
    blocks = {}
    for block in header["blocks"]:
        values = np.frombuffer(base64.b64decode(block["data"]), TYPES[block["type"]]).reshape(block["shape"])
        if block["type"][0] == "i":
            missing = values == np.iinfo(values.dtype).min
            values = np.where(missing, np.nan, values * block["scale"])
        blocks[block["name"]] = values
    return text, header, blocks


def read_pack(made):
    """Header and blocks of packed bytes."""
    length = int.from_bytes(made[:4], "little")
    assert length % 4 == 0
    header, at, blocks = json.loads(made[4 : 4 + length]), 4 + length, {}
    for block in header["blocks"]:
        kind, count = TYPES[block["type"]], int(np.prod(block["shape"]))
        blocks[block["name"]] = np.frombuffer(made, kind, count, at).reshape(block["shape"])
        at += count * kind.itemsize
    assert at == len(made)
    return header, blocks


def long_line(frames, nodes):
    time = np.linspace(0.0, 10.0, frames)
    points = np.zeros((frames, nodes, 3))
    points[..., 0] = np.linspace(0.0, 1.0, nodes) * (1.0 + time[:, None])
    return Motion(title="A <line>", time=time, lines=[Line(name="<a>", points=points)])


def test_page_and_pack_hold_the_motion(tmp_path):
    wanted = many_bodies()
    seen = wanted.in_body()
    path = tmp_path / "page.html"
    assert animation.write(wanted, path) == str(path)
    text, header, page = read_page(path.read_bytes())
    other, pack = read_pack(animation.pack(wanted))
    assert "<title>Two bodies &amp; a boom</title>" in text
    assert "@" not in re.sub(r"@media[^{]*", "", text.partition("const data")[0])
    for found, exact in ((page, 2e-4), (pack, 1e-6)):
        assert found["time"] == pytest.approx(wanted.time)
        for k, line in enumerate(seen.lines):
            assert found[f"line {k}"] == pytest.approx(line.points, abs=exact)
            for label, values in line.values.items():
                assert found[f"value {k} {label}"] == pytest.approx(values, abs=exact * np.abs(values).max())
        assert found["across 0"] == pytest.approx(seen.lines[0].across, abs=0.01)
        assert found["origin"] == pytest.approx(wanted.body.origin)
        assert found["frame 1 origin"] == pytest.approx(seen.frames[1].origin, abs=1e-6)
        assert found["mark 1"] == pytest.approx(seen.marks[1].points, abs=exact)
        assert found["frame 0 turned 2"] == pytest.approx(3.0 * wanted.time, rel=1e-6)
        assert np.isnan(found["number 1"][0])
        scale = wanted.arrow_scale("N")
        assert found["force 0"] == pytest.approx(scale * seen.forces[0].vectors, abs=exact)
    for one in (header, other):
        assert [line["count"] for line in one["lines"]] == [13, 2, 2]
        assert [line["kind"] for line in one["lines"]] == ["line", "rod", "spring"]
        assert [frame["name"] for frame in one["frames"]] == ["bus", "panel", "ball"]
        assert [len(frame["solids"]) for frame in one["frames"]] == [3, 1, 1]
        assert one["numbers"] == [["spin", "rad/s"], ["late", "m"]]
        assert one["main"] == "bus"
    assert len(animation.pack(wanted, most=3)) < len(animation.pack(wanted))


@pytest.mark.slow
def test_one_scale_of_colours_for_page_pack_and_pictures(monkeypatch):
    """Of all samples, also those that a page leaves out."""
    motion = many_bodies(1001)
    wanted = [motion.value_range(label) for label in motion.labels]
    _, page, _ = read_page(animation.page(motion, frames=5)[0])
    pack, _ = read_pack(animation.pack(motion, most=7))
    for header in (page, pack):
        assert [(c["low"], c["high"]) for c in header["colors"]] == wanted
        assert [(c["name"], c["unit"]) for c in header["colors"]] == [("moment", "N m"), ("strain", ""), ("force", "N")]
    used = []
    drawer = films.Drawer
    monkeypatch.setattr(films, "Drawer", lambda *a, **k: used.append((k["label"], k["ends"])) or drawer(*a, **k))
    list(films.pictures(motion, motion.time[:1], size=(200, 150), inertial=True))
    assert used == [("moment [N m]", wanted[0])]


@pytest.mark.slow
def test_leaves_out_frames_to_stay_small(tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "LARGEST", 600_000)
    path = tmp_path / "page.html"
    animation.write(long_line(2000, 400), path)
    assert path.stat().st_size <= animation.LARGEST
    text, header, found = read_page(path.read_bytes())
    assert header["lines"][0]["name"] == "<a>"
    assert "<a>" not in text
    assert len(found["time"]) >= 50
    assert (found["time"][0], found["time"][-1]) == (0.0, 10.0)


@pytest.mark.slow
def test_long_lines_are_thinned_and_keep_their_ends_and_scales():
    """Many points would leave few frames; the scale of colours is that of all points."""
    motion = long_line(300, 5000)
    values = np.zeros((300, 5000))
    values[:, 1:200] = 7.0  # some of them are left out
    lines = [dataclasses.replace(motion.lines[0], values={"v [N]": values}, tip=0), many_bodies(300).lines[1]]
    _, header, found = read_page(animation.page(dataclasses.replace(motion, lines=lines))[0])
    assert header["lines"][0]["count"] <= animation.MOST_POINTS
    assert header["lines"][1]["count"] == 2
    assert header["lines"][0]["tip"] == 0
    assert found["line 0"][-1, -1, 0] == pytest.approx(11.0, rel=1e-4)
    assert header["colors"][0]["high"] == 7.0
    assert len(found["time"]) > 100


def test_frames_speed_and_playing():
    page, frames = animation.page(long_line(100, 4), frames=7, speed=3.0, playing=False)
    _, header, found = read_page(page)
    assert (frames, len(found["time"]), header["speed"], header["playing"]) == (7, 7, 3.0, False)
    _, header, _ = read_page(animation.page(long_line(100, 4))[0])
    assert header["speed"] == pytest.approx(10.0 / 15.0, rel=1e-2)  # 15 s for the run
    assert not header["repeats"]
    period = dataclasses.replace(long_line(100, 4), repeats=True)
    for header in (read_page(animation.page(period)[0])[1], read_pack(animation.pack(period))[0]):
        assert (header["repeats"], header["speed"]) == (True, 5.0)  # a period takes 2 s


def test_positions_far_away_keep_their_precision():
    """In an orbit the origin is 7000 km away; single precision would move points by half a metre."""
    motion = many_bodies(11)
    away = motion.carried(np.tile([7e6, 0.0, 0.0], (11, 1)), np.tile([1.0, 0, 0, 0], (11, 1)))
    _, found = read_pack(animation.pack(away))
    assert found["origin"][:, 0] == pytest.approx(7e6 + motion.body.origin[:, 0], abs=1e-8)
    assert found["line 0"] == pytest.approx(motion.in_body().lines[0].points, abs=1e-6)


@pytest.mark.parametrize("drift", [0.0, 10.0])
def test_all_of_a_motion_is_in_the_picture(drift):
    """Also where it travels far: the camera goes with it."""
    motion, size = many_bodies(drift=drift), (800, 600)
    camera = Camera.of(motion, size)
    assert camera.follows == (drift > 0.0)
    for k in range(0, motion.time.size, 10):
        here = camera.at(motion, k)
        for line in motion.lines:
            at = np.abs(here.screen(here.view(line.points[k]))[0])
            assert (at < [400, 300]).all()


@pytest.mark.slow
def test_films_show_bodies_strips_springs_forces_and_marks():
    motion = many_bodies()
    (picture,) = films.pictures(motion, [6.0], size=(800, 600), inertial=True)

    def drawn(**changes):
        (other,) = films.pictures(dataclasses.replace(motion, **changes), [6.0], size=(800, 600), inertial=True)
        return np.abs(other.astype(int) - picture).max(axis=-1)

    assert picture.shape == (600, 800, 4)
    assert (drawn(frames=[dataclasses.replace(f, solids=()) for f in motion.frames]) > 20).sum() > 3000
    assert (drawn(lines=[dataclasses.replace(motion.lines[0], across=None), *motion.lines[1:]]) > 20).sum() > 200
    assert (drawn(lines=motion.lines[:2]) > 20).sum() > 100
    assert (drawn(forces=()) > 20).sum() > 30
    assert (drawn(marks=()) > 20).sum() > 30
    (body,) = films.pictures(motion, [6.0], size=(800, 600), inertial=False)
    assert (np.abs(body.astype(int) - picture) > 20).any()


def test_what_is_missing_is_hidden():
    """A line and a body that are there in the second half alone, and a mark that never is."""
    motion = many_bodies(21)
    missing = np.where(motion.time < 6.0, np.nan, 0.0)[:, None]
    lines = [dataclasses.replace(x, points=x.points + missing[..., None]) for x in motion.lines]
    ball = dataclasses.replace(motion.frames[2], origin=motion.frames[2].origin + missing)
    marks = [dataclasses.replace(motion.marks[0], points=np.full_like(motion.marks[0].points, np.nan))]
    some = dataclasses.replace(motion, lines=lines, marks=marks, frames=[*motion.frames[:2], ball], magnification=2.0)
    _, _, found = read_page(animation.page(some)[0])
    assert np.isnan(found["line 0"][5]).all()
    assert np.isfinite(found["line 0"][15]).all()
    assert np.isnan(found["mark 0"]).all()
    early, late = films.pictures(some, [1.0, 11.0], size=(400, 300), inertial=True)
    assert (early < 250).sum() < (late < 250).sum()


def test_enlarged_displacements_are_named():
    motion = dataclasses.replace(many_bodies(21), magnification=1.5)
    text, page, found = read_page(animation.page(motion)[0])
    pack, _ = read_pack(animation.pack(motion))
    assert page["magnification"] == pack["magnification"] == 1.5
    assert "<title>Two bodies &amp; a boom (displacements enlarged 1.5 times)</title>" in text
    mean = motion.body.origin.mean(axis=0)
    assert found["origin"] == pytest.approx(mean + 1.5 * (motion.body.origin - mean))


def test_a_single_sample_is_a_still_picture():
    one = many_bodies().at(np.array([40]))
    _, header, found = read_page(animation.page(one, playing=False)[0])
    assert (found["time"].tolist(), header["speed"]) == ([4.0], 1.0)
    (picture,) = films.pictures(one, [4.0], size=(400, 300), inertial=True)
    (same,) = films.pictures(many_bodies(), [4.0], size=(400, 300), inertial=True)
    assert picture.shape == same.shape


def test_a_motion_without_bodies():
    motion = dataclasses.replace(many_bodies(11), frames=[])
    _, header, found = read_page(animation.page(motion)[0])
    assert header["main"] is None
    assert "attitude" not in found
    assert found["line 0"] == pytest.approx(motion.lines[0].points, abs=2e-4)
    (picture,) = films.pictures(motion, [4.0], size=(400, 300), inertial=False)
    assert (picture[..., :3] < 250).any()


@pytest.mark.parametrize(("reach", "step"), [(5.0, 1.0), (1.0, 0.2), (9.9, 2.0), (0.35, 0.05), (2.9, 0.5)])
def test_steps_of_the_floor_are_round_and_few(reach, step):
    assert animation.grid_step(reach) == pytest.approx(step)
    assert 3 <= reach / step <= 7.0


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api")
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        pytest.skip("there is no Chromium here to open the page with")
    with sync_api.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        yield opened
        opened.close()


def test_the_page_opens_at_the_first_frame_and_obeys_keys(browser, tmp_path):
    """Without a network; inertial axes first."""
    path = animation.write(many_bodies(), tmp_path / "page.html")
    page = browser.new_context(offline=True).new_page()
    errors, asked = [], []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(pathlib.Path(path).as_uri())

    def state(name):
        return page.evaluate(f"document.getElementById('viewer').viewer.{name}")

    assert (state("now"), state("playing"), state("inertial")) == (state("begin"), False, True)
    speed = state("speed")
    page.keyboard.press("+")
    assert state("speed") > speed
    page.keyboard.press("-")
    assert state("speed") == speed
    page.keyboard.press("ArrowRight")
    assert state("now") > state("begin")
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    page.wait_for_function("document.getElementById('viewer').viewer.now > 0.2")
    page.keyboard.press(" ")
    assert not state("playing")
    for key, name in (("b", "inertial"), ("m", "symbols"), ("a", "arrows"), ("g", "grid")):
        before = state(name)
        page.keyboard.press(key)
        assert state(name) != before, key
    before = state("camera.elevation")
    page.keyboard.press("2")
    assert state("camera.elevation") != before
    page.keyboard.press("?")
    assert page.get_by_test_id("panel").inner_text().startswith("space")
    assert errors == []
    assert all(url.startswith("file:") for url in asked)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
def test_texts_beside_the_picture_do_not_cover_one_another(browser, tmp_path, size):
    motion = dataclasses.replace(
        many_bodies(), numbers={"angle of the first hinge [rad]": np.zeros(many_bodies().time.size)}
    )
    path = animation.write(motion, tmp_path / "page.html")
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.goto(pathlib.Path(path).as_uri())
    boxes = [
        page.locator(place).bounding_box()
        for place in ("header", ".ev3-numbers", ".ev3-bar", ".ev3-views", ".ev3-foot")
    ]
    found = [box for box in boxes if box is not None]
    assert len(found) >= 4
    for box in found:
        assert box["x"] >= 0.0
        assert box["x"] + box["width"] <= size[0] + 0.5
        assert box["y"] + box["height"] <= size[1] + 0.5
    for a, b in itertools.combinations(found, 2):
        wide = min(a["x"] + a["width"], b["x"] + b["width"]) - max(a["x"], b["x"])
        high = min(a["y"] + a["height"], b["y"] + b["height"]) - max(a["y"], b["y"])
        assert wide <= 1.0 or high <= 1.0, (a, b)
