"""The viewer in its own page, in a browser: what it shows at first, its keys, and where it draws points."""

import dataclasses
import json

import numpy as np
import pytest

from evolvent.results.motion import Frame, Line, Motion
from evolvent.results.solids import Solid
from evolvent.view import animation
from evolvent.view.views import views
from many_bodies import many_bodies
from studio.serving import frames

VIEWER = "document.getElementById('viewer').viewer"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    made = tmp_path_factory.mktemp("page") / "page.html"
    made.write_bytes(animation.page(many_bodies(), playing=False)[0])
    return made


@pytest.fixture(scope="module")
def tab(browser):
    """A tab of the browser for all tests; each reloads its page."""
    opened = browser.new_page(viewport={"width": 1000, "height": 700})
    opened.wrong, opened.asked = [], []
    opened.on("pageerror", lambda error: opened.wrong.append(str(error)))
    opened.on("request", lambda request: opened.asked.append(request.url))
    yield opened
    opened.close()


@pytest.fixture
def opened(tab):
    """The tab, in which nothing may go wrong, and which may ask for nothing but one page."""
    tab.goto("about:blank")
    tab.wrong.clear()
    tab.asked.clear()
    yield tab
    assert not tab.wrong
    assert len(tab.asked) == 1, "the page needs nothing else"


@pytest.fixture
def page(opened, path):
    opened.goto(path.as_uri())
    frames(opened)
    return opened


def get(page, what):
    return page.evaluate(f"{VIEWER}.{what}")


def press(page, key):
    page.keyboard.press(key)
    frames(page)


def image(page):
    return page.locator("canvas").screenshot()


def test_it_opens_at_the_first_frame_in_inertial_axes_with_all_scales(page, shots):
    assert get(page, "now") == 0.0
    assert not get(page, "playing")
    assert get(page, "inertial")
    assert page.locator("[data-testid=time]").inner_text() == "0.00 s"
    assert page.locator("[data-testid=color-name]").inner_text() == "moment"
    low, high = many_bodies().value_range("moment [N m]")
    assert page.locator("[data-testid=color-low]").inner_text() == f"{low:.3g} N m"
    assert page.locator("[data-testid=color-high]").inner_text() == f"{high:.3g} N m"
    beside = page.locator("[data-testid=numbers]").inner_text().split()
    assert beside == ["time", "0.00", "s", "spin", "0.8000", "rad/s", "late", "-"]
    assert get(page, "scaleText") in ("1 m", "500 mm", "2 m")
    assert len(get(page, "forceText")) == 2
    assert get(page, "forceText").pop().endswith("N m")
    page.screenshot(path=shots / "viewer.png")


def test_it_plays_once_in_15_seconds(opened, tmp_path):
    playing = tmp_path / "playing.html"
    playing.write_bytes(animation.page(many_bodies())[0])
    opened.goto(playing.as_uri())
    opened.keyboard.press("Space")
    opened.wait_for_function(f"{VIEWER}.now > 0.3")
    assert get(opened, "playing")
    assert get(opened, "speed") == pytest.approx(12.0 / 15.0)
    assert get(opened, "now") < 3.0
    opened.evaluate(f"{VIEWER}.go({VIEWER}.end - 0.01)")
    opened.wait_for_function(f"!{VIEWER}.playing")
    assert get(opened, "now") == 12.0


def test_a_period_is_played_again_and_again(opened, tmp_path):
    page = tmp_path / "period.html"
    page.write_bytes(animation.page(dataclasses.replace(many_bodies(), repeats=True))[0])
    opened.goto(page.as_uri())
    opened.keyboard.press("Space")
    opened.wait_for_function(f"{VIEWER}.now > 0.0")
    opened.evaluate(f"{VIEWER}.go({VIEWER}.end - 0.01)")
    opened.wait_for_function(f"{VIEWER}.now < 6.0")
    assert get(opened, "playing")


def test_keys(page):
    press(page, "ArrowRight")
    assert get(page, "now") == pytest.approx(0.1)
    press(page, "ArrowLeft")
    press(page, "ArrowLeft")
    assert get(page, "now") == 0.0
    press(page, "End")
    assert get(page, "now") == 12.0
    press(page, "Home")
    assert get(page, "now") == 0.0
    press(page, " ")
    assert get(page, "playing")
    press(page, " ")
    assert not get(page, "playing")
    press(page, "Home")
    press(page, "End")
    for key, what in (("b", "inertial"), ("g", "grid"), ("a", "arrows"), ("c", "follow")):
        before, held = image(page), get(page, what)
        press(page, key)
        assert get(page, what) != held, key
        if key != "c":
            assert image(page) != before, key
        press(page, key)
        assert get(page, what) == held, key
    press(page, "t")
    assert len(get(page, "trails.map(t => t.point.name)")) == 2
    press(page, "t")
    assert not get(page, "trails.length")
    press(page, "?")
    assert page.locator("[data-testid=panel]").is_visible()
    for word in ("space", "Home", "full screen", "body axes", "trails"):
        assert word in page.locator("[data-testid=panel]").inner_text()
    press(page, "Escape")
    assert not page.locator("[data-testid=panel]").is_visible()
    press(page, "f")
    page.wait_for_function("document.fullscreenElement !== null")
    press(page, "f")


def test_points_are_where_the_motion_has_them(page):
    """Between frames of the page, in inertial and in body axes; positions are kept to 1/32767."""
    motion = many_bodies()
    for t in (0.0, 3.333, 7.77, 12.0):
        page.evaluate(f"{VIEWER}.go({t}), {VIEWER}.draw()")
        exact = motion.resampled(np.array([t]))
        for inertial, wanted in ((True, exact), (False, exact.in_body())):
            run = f"{VIEWER}.motions[0]"
            place = f"p => [p.name, {run}.place(p, {json.dumps(inertial)})]"
            places = dict(page.evaluate(f"{run}.traceable.map({place})"))
            assert places["boom, last point"] == pytest.approx(wanted.lines[0].points[0, -1], abs=2e-4)
            assert places["strut, first point"] == pytest.approx(wanted.lines[1].points[0, 0], abs=2e-4)
            assert places["tip mass"] == pytest.approx(wanted.marks[1].points[0, 0], abs=2e-4)
            assert places["ball"] == pytest.approx(wanted.frames[2].origin[0], abs=2e-4)
            assert places["bus"] == pytest.approx(wanted.frames[0].origin[0], abs=2e-4)


@pytest.mark.parametrize("what", ["no bodies", "one sample", "hidden"])
def test_less_is_drawn_as_well(opened, tmp_path, what):
    motion = many_bodies(11)
    if what == "no bodies":
        motion = dataclasses.replace(motion, frames=[], forces=[], marks=[])
    elif what == "one sample":
        motion = motion.at(np.array([3]))
    else:
        lines = [dataclasses.replace(x, points=np.full_like(x.points, np.nan)) for x in motion.lines]
        motion = dataclasses.replace(motion, lines=lines)
    path = tmp_path / "less.html"
    path.write_bytes(animation.page(motion)[0])
    opened.goto(path.as_uri())
    for key in "tbctb?":
        press(opened, key)
    assert get(opened, "inertial")  # b twice; without bodies there is nothing else
    assert opened.locator("[data-testid=axes]").is_visible() == (what != "no bodies")


def test_a_click_on_a_point_shows_its_trail(page, shots):
    page.evaluate(f"{VIEWER}.go(6)")
    frames(page)
    found = f"{VIEWER}.spots.find(s => s.point.name === 'boom, last point')"
    spot = page.evaluate(f"(({{ x, y }}) => ({{ x, y }}))({found})")
    box = page.locator("canvas").bounding_box()
    before = image(page)
    page.mouse.click(box["x"] + spot["x"], box["y"] + spot["y"])
    frames(page)
    (name,) = get(page, "trails.map(t => t.point.name)")
    assert name in ("boom, last point", "hinge", "panel")  # all three are there
    assert image(page) != before
    page.screenshot(path=shots / "trail.png")
    page.click("[data-testid=trails]")
    names = page.locator("[data-testid=panel] label").all_inner_texts()
    assert [n.strip() for n in names][:3] == ["boom, last point", "boom, first point", "strut, last point"]
    page.locator("[data-testid=panel] label", has_text="ball").click()
    assert "ball" in get(page, "trails.map(t => t.point.name)")


def test_it_is_turned_moved_and_zoomed(page):
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]

    def drag(**options):
        page.mouse.move(x, y)
        page.mouse.down(**options)
        page.mouse.move(x + 60, y + 30, steps=3)
        page.mouse.up(**options)
        frames(page)

    before = get(page, "camera")
    drag()
    turned = get(page, "camera")
    assert turned["azimuth"] < before["azimuth"]
    assert turned["elevation"] > before["elevation"]
    drag(button="right")
    assert get(page, "camera")["pan"] == [60, 30]
    page.mouse.wheel(0, -300)
    frames(page)
    assert get(page, "camera")["zoom"] > 1.2
    press(page, "r")
    assert get(page, "camera") == before


def test_bodies_hide_what_is_behind_them(page):
    """The middle of the bus seen from the side: its colour there is grey, though the boom begins behind."""
    page.evaluate(f"{VIEWER}.arrows = false, {VIEWER}.look(Math.PI, 0, null), {VIEWER}.go(0), {VIEWER}.draw()")
    colour = page.evaluate(
        f"""(() => {{ const v = {VIEWER}, run = v.motions[0], bus = v.spots.find(s => s.point.name === 'bus'),
        r = v.canvas.width / v.canvas.clientWidth;
        return [...v.pen.getImageData(Math.round((bus.x + 8) * r), Math.round((bus.y + 8) * r), 1, 1).data]; }})()"""
    )
    assert max(colour[:3]) - min(colour[:3]) < 40
    assert colour[3] == 255


#: Of the faces of bodies under a point of the picture, the name of the body whose face is drawn last.
TOP = """([name, of]) => {
  const v = document.getElementById('viewer').viewer, { x, y } = v.spots.find((s) => s.point?.name === name);
  const inside = (at) => {
    let found = false;
    for (let i = 0, j = at.length - 2; i < at.length; j = i, i += 2) {
      const [p, q, r, s] = [at[i], at[i + 1], at[j], at[j + 1]];
      if ((q > y) !== (s > y) && x < p + (r - p) * (y - q) / (s - q)) found = !found;
    }
    return found;
  };
  const under = v.solids.flatMap(({ faces }, k) => faces.filter(({ at }) => inside(at)).map(({ depth }) => [depth, k]));
  return of[under.sort((a, b) => a[0] - b[0])[0][1]];
}"""


def test_bodies_2_mm_apart_are_drawn_in_their_order_and_symbols_vanish_with_the_release(opened, tmp_path):
    """A stack of plates of other sizes on a box, seen from all sides from which the outer plate is in front."""
    still = {"attitude": np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))}
    stack = {"box": (0.0, (1.0, 1.0, 1.5)), "inner": (0.512, (0.02, 1.0, 1.5)), "outer": (0.534, (0.02, 0.7, 1.1))}
    bodies = [
        Frame(name=name, origin=np.tile([x, 0.0, 0.0], (2, 1)), solids=[Solid.box(edges)], **still)
        for name, (x, edges) in stack.items()
    ]
    pin = Frame(
        name="pin", origin=np.tile([0.6, 0.0, 0.0], (2, 1)), solids=[Solid.box((0.02, 0.02, 0.02))],
        shown=np.array([True, False]), **still,
    )  # fmt: skip
    motion = Motion(title="stack", time=np.array([0.0, 1.0]), frames=bodies, symbols=[pin])
    animation.write(motion, tmp_path / "stack.html")
    opened.goto((tmp_path / "stack.html").as_uri())
    names = list(stack)
    for azimuth in np.radians([30.0, 60.0, 89.0, 120.0, 150.0]):
        for elevation in np.radians([-50.0, 0.0, 35.0, 70.0]):
            opened.evaluate(f"{VIEWER}.look({azimuth}, {elevation}, null), {VIEWER}.draw()")
            assert opened.evaluate(TOP, ["outer", names]) == "outer", (azimuth, elevation)
            opened.evaluate(f"{VIEWER}.look({-azimuth}, {elevation}, null), {VIEWER}.draw()")
            assert opened.evaluate(TOP, ["outer", names]) != "outer", (azimuth, elevation)
    seen = f"{VIEWER}.spots.some(s => s.name === 'pin')"
    for time, is_seen in ((0.0, True), (1.0, False)):
        opened.evaluate(f"{VIEWER}.go({time}), {VIEWER}.draw()")
        assert opened.evaluate(seen) == is_seen


def test_pieces_of_a_line_with_one_colour_are_one_path(page):
    """A frame of many nodes is mostly pieces of lines; neighbours of one colour and width are drawn together."""
    strokes = page.evaluate(
        f"""(() => {{ const v = {VIEWER}, seen = []; let points = 0;
        v.pen.stroke = function () {{ seen.push([this.strokeStyle, this.lineWidth, points]); points = 0; }};
        v.pen.moveTo = function (x, y) {{ points++; }};
        const piece = (line, width = 2) => ({{ at: [0, 0, 5, 5], line, width }});
        v.parts = [piece("#ff0000"), piece("#ff0000"), piece("#ff0000", 3),
          {{ at: [0, 0, 1, 0, 1, 1], fill: "#00ff00" }}, piece("#0000ff"), piece("#0000ff"), piece("#0000ff")];
        v.paintParts();
        delete v.pen.stroke, delete v.pen.moveTo;
        return seen; }})()"""
    )
    assert strokes == [["#ff0000", 2, 2], ["#ff0000", 3, 1], ["#0000ff", 2, 4]]  # one point of the four is the face's


def boom(start):
    """A straight line that grows from `start` to 6 m."""
    points = np.zeros((21, 9, 3))
    points[:, :, 0] = np.linspace(start, 6.0, 21)[:, None] * np.linspace(0.0, 1.0, 9)
    points[:, :, 2] = 0.1 * points[:, :, 0]
    return Motion(title="boom", time=np.linspace(0.0, 4.0, 21), frames=[], lines=[Line(name="boom", points=points)])


@pytest.mark.parametrize(("start", "has"), [(0.1, True), (2.3, True), (2.5, False), (6.0, False)])
def test_what_is_stowed_small_has_a_view_of_its_start(start, has):
    """Below 0.4 of the extent of the whole motion; the first view opens on it, and else takes in all."""
    found = views(boom(start))
    assert ("start" in [view.name for view in found]) == has
    assert found[0].what == ("opening" if has else "")


def test_what_is_stowed_fills_the_first_frame_and_then_the_scale_is_that_of_all(opened, tmp_path):
    """After 8 % of the run the length on the screen is in proportion to that of the boom."""
    animation.write(boom(0.1), tmp_path / "boom.html")
    opened.goto((tmp_path / "boom.html").as_uri())
    ends = f"{VIEWER}.spots.filter((s) => s.point).map((s) => s.x)"

    def spread():
        frames(opened)
        found = opened.evaluate(ends)
        return max(found) - min(found)

    def at(time):
        opened.evaluate(f"{VIEWER}.go({time})")
        return spread()

    assert 500.0 < spread() < 1000.0
    opened.click("[data-testid='view-along z']")
    assert spread() < 30.0
    opened.click("[data-testid='view-start']")
    assert 500.0 < spread() < 1000.0
    press(opened, "r")
    long = at(4.0)
    assert 500.0 < long < 1000.0
    assert at(2.0) == pytest.approx(3.05 / 6.0 * long, rel=0.05)
    assert at(0.4) == pytest.approx(0.69 / 6.0 * long, rel=0.1)
    assert 500.0 < at(0.0) < 1000.0
