"""The page of an animation: what it holds can be read back, and it stays small."""

import base64
import json
import re

import numpy as np
import pytest

from evolvent import animation
from evolvent.figures import Scene


def scene(frames: int, nodes: int) -> Scene:
    time = np.linspace(0.0, 10.0, frames)
    points = np.zeros((frames, 2, nodes, 3))
    points[..., 0] = np.linspace(0.0, 1.0, nodes) * (1.0 + time[:, None, None])
    points[:, 1] *= -1.0
    value = np.broadcast_to(time[:, None, None], (frames, 2, nodes - 1)).copy()
    value[0, 0, 0] = np.nan
    return Scene(
        title="A <thing>",
        time=time,
        points=points,
        value=value,
        value_label="tension, mN",
        origin=np.zeros((frames, 3)),
        angle=6.0 * time,
        tilt=np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1)),
        body=[np.eye(3)],
        numbers={"rate, rad/s": np.where(time > 5.0, np.nan, time)},
    )


def content(path):
    page = path.read_text()
    return page, json.loads(re.search(r"const data = (.*);\n", page)[1])


def test_holds_the_scene(tmp_path):
    wanted = scene(11, 4)
    path = tmp_path / "page.html"
    assert animation.write(wanted, path) == str(path)
    page, data = content(path)
    assert "<title>A &lt;thing&gt;</title>" in page
    assert data["shape"] == [11, 2, 4]
    points = np.frombuffer(base64.b64decode(data["points"]), dtype="<i2").reshape(11, 2, 4, 3) * data["unit"]
    np.testing.assert_allclose(points, wanted.points, atol=11.0 / 32767)
    values = np.frombuffer(base64.b64decode(data["values"]), dtype="<i2").reshape(11, 2, 3)
    assert values[0, 0, 0] == -32768
    np.testing.assert_allclose(values[1:] * data["value_unit"], wanted.value[1:], atol=10.0 / 32767)
    assert (data["low"], data["high"]) == (0.0, 10.0)
    assert data["numbers"][0][1][-1] is None
    assert data["reach"] == pytest.approx(11.0)
    assert data["ring"] == 2.0


def test_leaves_out_frames_to_stay_small(tmp_path):
    path = tmp_path / "page.html"
    animation.write(scene(2000, 1000), path)
    assert path.stat().st_size <= animation.LARGEST
    _, data = content(path)
    assert data["shape"][0] >= 50
    assert data["time"][0] == 0.0
    assert data["time"][-1] == 10.0


def test_frames_speed_and_rest():
    page, frames = animation.page(scene(100, 4), frames=7, speed=3.0, playing=False)
    data = json.loads(re.search(r"const data = (.*);\n", page.decode())[1])
    assert (frames, data["shape"][0], data["speed"], data["playing"]) == (7, 7, 3.0, False)


def test_all_of_a_scene_is_in_view():
    given = scene(11, 4)
    given.points[..., 2] = 20.0  # far above its reach
    reach, wide, tall = animation.extent(given)
    seen = np.abs(animation.seen(given.points, reach)).max(axis=(0, 1, 2))
    assert seen[0] <= wide
    assert seen[1] == pytest.approx(tall)
    assert animation.seen(np.zeros(3), reach) == pytest.approx(np.zeros(2))


@pytest.mark.parametrize(("reach", "ring"), [(5.0, 1.0), (1.0, 0.2), (9.9, 2.0), (0.35, 0.05), (2.9, 0.5)])
def test_rings_are_round_and_few(reach, ring):
    assert animation.ring(reach) == pytest.approx(ring)
    assert 3 <= reach / ring <= 7.0
