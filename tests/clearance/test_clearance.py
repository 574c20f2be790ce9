"""Clearances against closed forms: shapes under translation and rotation, contact times, what lies between samples."""

import json
import math
import pathlib
import re
import sys

import numpy as np
import pytest
import xarray as xr

import evolvent
from evolvent import cases
from evolvent.analysis import accessor as accessor, clearance
from evolvent.results.rotations import from_rotation_vectors, product, rotation_matrices

I = (1.0, 0.0, 0.0, 0.0)  # noqa: E741
BOX, PLATE = {"box": {"size": [1.0, 2.0, 3.0]}}, {"box": {"size": [2.0, 1.0, 0.02]}}
BALL, CAN = {"sphere": {"radius": 0.3}}, {"cylinder": {"radius": 0.4, "length": 1.5}}
PILL = {"capsule": {"radius": 0.2, "length": 1.0}}


@pytest.fixture
def coal():
    return pytest.importorskip("coal")


def made(time, *bodies, parts=None):
    """A run of bodies: shape, positions, quaternions, velocities, rates (body axes), each of one sample or of all."""
    time = np.asarray(time, dtype=float)
    content = {"parts": dict(parts or {}), "simulate": {"until": 1.0}}
    groups = {}
    for n, (shape, *given) in enumerate(bodies):
        content["parts"][f"body {n}"] = {"kind": "rigid-body", "mass": 1.0, "shape": shape}
        given += [(0.0, 0.0, 0.0)] * (4 - len(given))
        values = [np.broadcast_to(np.asarray(x, dtype=float), (time.size, width)) for x, width in zip(
            given, (3, 4, 3, 3), strict=True)]  # fmt: skip
        groups[f"/body {n}"] = xr.Dataset(
            {"position": (("time", "axis"), values[0]), "attitude": (("time", "quaternion"), values[1]),
             "velocity": (("time", "axis"), values[2]), "rate": (("time", "axis"), values[3])}
        )  # fmt: skip
    attrs = {"title": "", "laws": "{}", "case": cases.dump({"system": "structure", **content})}
    return xr.DataTree.from_dict({"/": xr.Dataset(coords={"time": time}, attrs=attrs), **groups})


def about(axis, angle):
    return from_rotation_vectors(angle * np.array([axis], dtype=float))[0]


def moved(x, q, whole):
    """A pose carried by another one, so that no axis is special."""
    shift, turn = np.array([3.0, -2.0, 0.7]), about((0.6, -0.36, 0.7141), 0.9)
    if not whole:
        return x, q
    return shift + rotation_matrices(turn) @ np.array(x), product(turn[None], np.array([q]))[0]


half = math.sqrt(0.5)
PLACES = [
    # shapes, place and attitude of the second, distance
    (BOX, BOX, (1.5, 0.3, 0.2), I, 0.5),
    (BOX, BOX, (1.3, 2.4, 3.0), I, 0.5),  # of two edges: 0.3 and 0.4
    (BOX, BOX, (0.8, 0.3, 0.2), I, -0.2),
    (BOX, BOX, (2.0, 0.0, 0.0), about((0, 0, 1), math.pi / 2), 0.5),
    (PLATE, BOX, (0.0, 0.0, 0.0), I, -1.01),  # sideways 1.5, along the normal 1.51, across 1.5
    (BOX, BALL, (1.1, 0.2, 0.1), I, 0.3),
    (BOX, BALL, (1.5, 2.0, 3.5), I, math.sqrt(6.0) - 0.3),  # of a corner
    (BOX, BALL, (0.7, 0.2, 0.1), I, -0.1),
    (BOX, BALL, (0.4, 0.2, 0.1), I, -0.4),
    (CAN, BALL, (1.0, 0.0, 0.1), I, 0.3),
    (CAN, BALL, (0.7, 0.0, 1.15), I, 0.2),  # of the rim: 0.3 and 0.4
    (CAN, BALL, (0.3, 0.0, 0.1), I, -0.4),  # centre inside: out through the side
    (CAN, BALL, (0.05, 0.0, 0.7), I, -0.35),  # centre inside: out through the end
    (CAN, CAN, (1.1, 0.0, 0.2), I, 0.3),
    (CAN, CAN, (0.9, 0.0, 0.2), about((1, 0, 0), math.pi / 2), 0.1),
    (CAN, CAN, (0.6, 0.1, 0.2), about((1, 0, 0), math.pi / 2), -0.2),
    (CAN, CAN, (0.1, 0.0, 1.8), I, 0.3),
    (BOX, CAN, (0.0, 0.0, 2.6), about((0, 1, 0), math.pi / 2), 0.7),
    (BOX, CAN, (0.0, 0.0, 2.6), about((0, 1, 0), math.pi / 4), 1.1 - half * (0.75 + 0.4)),  # the rim points down
    (BOX, CAN, (0.0, 0.0, 2.2), about((0, 1, 0), math.pi / 4), 0.7 - half * (0.75 + 0.4)),
    (PILL, CAN, (0.9, 0.0, 0.1), I, 0.3),
    (PILL, PILL, (0.0, 0.0, 1.2), about((0, 1, 0), math.pi / 2), 0.3),
    (PILL, PILL, (0.3, 0.0, 0.4), I, -0.1),
    (PILL, BALL, (0.0, 0.3, 0.9), I, 0.0),
    (BALL, BALL, (0.2, 0.0, 0.0), I, -0.4),
]


@pytest.mark.slow
@pytest.mark.usefixtures("coal")
@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize(("first", "second", "x", "q", "distance"), PLACES)
def test_shapes(first, second, x, q, distance, whole):
    if (first, second) == (PLATE, BOX):
        distance = -(0.5 + 1.0)  # along x: 1 + 0.5; along y: 0.5 + 1; along z: 0.01 + 1.5
    run = made([0.0], (first, *moved((0.0, 0.0, 0.0), I, whole)), (second, *moved(x, q, whole)))
    there = run.ev.clearance([("body 0", "body 1")]).dataset
    back = run.ev.clearance([("body 1", "body 0")]).dataset
    assert float(there.clearance[0, 0]) == pytest.approx(distance, abs=1e-5)
    assert float(back.clearance[0, 0]) == pytest.approx(distance, abs=1e-5)
    assert bool((there.exact == 1).all())


@pytest.mark.usefixtures("coal")
def test_coaxial_round_bodies_in_one_another():
    """Any direction across is the way out: the depth by facets is within 3e-4 of the radii."""
    run = made([0.0], (CAN, (0.0, 0.0, 0.0), I), (CAN, (0.0, 0.0, 0.1), I))
    assert float(run.ev.clearance().dataset.smallest[0]) == pytest.approx(-0.8, abs=3e-4)


@pytest.mark.usefixtures("coal")
def test_axes_of_shapes():
    """A cylinder along (0.6, 0.8, 0) in body axes beside a ball at its end."""
    can = {"cylinder": {"radius": 0.4, "length": 1.5, "axis": [3.0, 4.0, 0.0]}}
    run = made([0.0], (can, (0.0, 0.0, 0.0), I), (BALL, (0.6 * 1.5, 0.8 * 1.5, 0.0), I))
    assert float(run.ev.clearance().dataset.smallest[0]) == pytest.approx(1.5 - 0.75 - 0.3, abs=1e-6)


@pytest.mark.usefixtures("coal")
def test_interference_in_time(tmp_path):
    """A ball flies past a box, 0.1 m too deep, at 1 m/s: |x| is below 0.8 m from t = 1.2 s to 2.8 s."""
    time = np.linspace(0.0, 4.0, 41)
    x = np.stack([time - 2.0, np.full(41, 1.2), np.zeros(41)], axis=1)
    run = made(time, (BOX, (0.0, 0.0, 0.0), I), (BALL, x, I, (1.0, 0.0, 0.0)))
    shown = run.ev.clearance()
    found = shown.dataset
    # beside the edge of the box x = 0.5 m, y = 1 m: sqrt(0.3^2 - 0.2^2) m further
    reach = 0.5 + math.sqrt(0.3**2 - 0.2**2)
    assert found.start.values == pytest.approx([2.0 - reach], abs=2e-3)
    assert found.end.values == pytest.approx([2.0 + reach], abs=2e-3)
    assert found.depth.values == pytest.approx([0.1], abs=1e-6)
    assert json.loads(found.attrs["sentences"]) == [
        f"'body 0' is up to 100 mm inside 'body 1' from t = {float(found.start[0]):.5g} s to "
        f"{float(found.end[0]):.5g} s"
    ]
    assert shown.rows()[1][:2] == ["body 0 - body 1", "-100 mm"]
    assert shown.interfering == ["body 0 - body 1"]
    assert "'body 0' is up to 100 mm inside 'body 1'" in str(shown)
    assert "-100 mm" in shown._repr_html_()
    assert repr(shown) == "<Clearances: 1 pairs, smallest -100 mm>"
    kept = xr.load_dataset(shown.save(str(tmp_path / "c.nc")), engine="h5netcdf")
    assert kept.smallest.values == pytest.approx(found.smallest.values)
    assert json.loads(pathlib.Path(shown.save(str(tmp_path / "c.json"))).read_text())["pairs"][0]["smallest"] < 0.0
    with pytest.raises(evolvent.InputError, match=re.escape("clearances are written as .nc, .json")):
        shown.save(str(tmp_path / "c.csv"))


@pytest.mark.usefixtures("coal")
def test_many_interferences_are_one_sentence():
    """A ball dives into a box five times, each time deeper: the table and the sentence stay short."""
    time = np.arange(11.0)
    x = np.stack([np.where(time % 2 == 0, 2.0, 0.8 - 0.01 * time), 0 * time, 0 * time], axis=1)
    shown = made(time, (BOX, (0.0, 0.0, 0.0), I), (BALL, x, I)).ev.clearance()
    found = shown.dataset
    assert found.depth.values == pytest.approx([0.01, 0.03, 0.05, 0.07, 0.09], abs=1e-6)
    (sentence,) = json.loads(found.attrs["sentences"])
    assert sentence.startswith("'body 0' is up to 90 mm inside 'body 1' from t = ")
    assert sentence.endswith(", and less deep in 4 more intervals")
    assert shown.rows()[1][4].endswith(" and 3 more")


@pytest.mark.usefixtures("coal")
def test_far_bodies_have_bounds_and_an_exact_smallest_distance():
    time = np.linspace(0.0, 1.0, 11)
    x = np.stack([6.0 + 4.0 * time, np.zeros(11), np.zeros(11)], axis=1)
    found = made(time, (BOX, (0.0, 0.0, 0.0), I), (BALL, x, I, (4.0, 0.0, 0.0))).ev.clearance().dataset
    assert float(found.smallest[0]) == pytest.approx(6.0 - 0.5 - 0.3, abs=1e-6)
    assert found.exact.values[0, 0] == 1
    assert found.exact.values.min() == 0
    assert (found.clearance.values[:, 0] <= x[:, 0] - 0.8 + 1e-9).all()
    assert found.sizes["interference"] == 0


@pytest.mark.usefixtures("coal")
def test_a_body_that_passes_another_between_samples():
    """A ball goes through a plate from 1 m below to 1 m above it in one interval."""
    x = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    run = made([0.0, 0.5], (PLATE, (0.0, 0.0, 0.0), I), (BALL, x, I, (0.0, 0.0, 4.0)))
    shown = run.ev.clearance()
    found = shown.dataset
    assert float(found.smallest[0]) == pytest.approx(0.69, abs=1e-6)
    assert float(found.least_between[0]) == pytest.approx(0.69 - 1.0, abs=1e-6)
    assert found.sizes["interference"] == 0
    (warning,) = shown.answer().warnings
    assert warning.startswith("'body 0' and 'body 1' may touch unseen between samples, by their rates, in one interval")


@pytest.mark.usefixtures("coal")
def test_bodies_that_turn_together_do_not_come_closer():
    """As on a spinning satellite: 50 rad/s, samples a turn and more apart."""
    time, rate = np.linspace(0.0, 1.0, 6), 50.0
    c, s = np.cos(rate * time), np.sin(rate * time)
    out = np.stack([c, s, 0 * c], axis=1)
    q = from_rotation_vectors(np.stack([0 * c, 0 * c, rate * time], axis=1))
    v = rate * np.stack([-s, c, 0 * c], axis=1)
    spin = (0.0, 0.0, rate)
    found = made(time, (BALL, 2.0 * out, q, 2.0 * v, spin), (BALL, 3.0 * out, q, 3.0 * v, spin)).ev.clearance().dataset
    assert float(found.smallest[0]) == pytest.approx(0.4, abs=1e-6)
    assert float(found.least_between[0]) == pytest.approx(0.4, abs=1e-6)
    assert json.loads(found.attrs["warnings"]) == []


@pytest.mark.usefixtures("coal")
def test_pairs_and_what_is_left_out():
    parts = {
        "hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0},
        "mast": {"kind": "point", "mass": 0.1},
        "hinge": {"kind": "joint", "a": ["body 0", [0, 0, 0]], "b": ["body 1", [0, 0, 0]], "type": "revolute"},
        "hold": {"kind": "joint", "a": "body 1", "b": "body 2", "until": 0.5},
    }
    bodies = [(BALL, (n, 0.0, 0.0), I) for n in range(3)]
    run = made([0.0], *bodies, parts=parts)
    found = run.ev.clearance().dataset
    assert found.pair.values.tolist() == ["body 0 - body 2", "body 1 - body 2"]
    assert json.loads(found.attrs["left_out"]) == ["'body 0' and 'body 1', held by 'hinge'"]
    assert json.loads(found.attrs["not_checked"]) == ["rigid body without a shape 'hub'", "point mass 'mast'"]
    assert run.ev.clearance([("body 1", "body 0")]).dataset.smallest.values == pytest.approx([0.4], abs=1e-6)


def swinging(rate=0.5, every=0.01):
    """A panel, 1 m x 0.02 m, hinged to the ground, swings from -90 degrees towards a bus whose side is at x = 0.8 m."""
    panel = {
        "kind": "rigid-body", "mass": 2.0, "shape": {"box": {"size": [1.0, 0.02, 0.5]}},
        "position": [0.0, -0.5, 0.0], "orientation": about((0, 0, 1), -math.pi / 2).tolist(),
        "velocity": [0.5 * rate, 0.0, 0.0], "angular_velocity": [0.0, 0.0, rate], "points": {"root": [-0.5, 0, 0]},
    }  # fmt: skip
    bus = {"kind": "rigid-body", "motion": "driven", "shape": {"box": {"size": [1.0, 4.0, 1.0]}},
           "position": [1.3, 0.0, 0.0]}  # fmt: skip
    hinge = {"kind": "joint", "a": [0.0, 0.0, 0.0], "b": "panel.root", "type": "revolute"}
    parts = {"panel": panel, "bus": bus, "hinge": hinge}
    return {"system": "structure", "parts": parts, "simulate": {"until": 2.4, "every": every}}


@pytest.mark.slow
@pytest.mark.usefixtures("coal")
def test_first_contact_of_a_panel_that_swings_into_a_bus(tmp_path):
    """Its corner is at x = rho cos(phi + delta), rho^2 = 1 + 0.01^2, tan(delta) = 0.01, phi = -90 deg + w t."""
    run = evolvent.load(swinging()).simulate()
    shown = run.ev.clearance()
    found = shown.dataset
    rho, delta = math.hypot(1.0, 0.01), math.atan(0.01)
    contact = (math.pi / 2 - math.acos(0.8 / rho) - delta) / 0.5
    assert found.start.values == pytest.approx([contact], abs=1e-4)
    assert found.end.values == pytest.approx([2.4])
    lead = np.pi / 2 - 0.5 * found.time.values
    expected = 0.8 - np.cos(lead) - 0.01 * np.sin(lead)
    assert found.clearance.values[:, 0] == pytest.approx(expected, abs=5e-5)
    evolvent.save(run, str(tmp_path / "run.nc"))
    again = evolvent.open(str(tmp_path / "run.nc")).ev.clearance().dataset
    assert again.clearance.values == pytest.approx(found.clearance.values)
    # marked from the contact on
    motion = shown.marked(run.ev.motion())
    assert all(np.array_equal(frame.marked, found.time.values >= contact) for frame in motion.frames)
    run.ev.animate(str(tmp_path / "a.html"), clearance=shown)
    assert '"frame 0 marked"' in (tmp_path / "a.html").read_text().replace("&#34;", '"')


def rectangles(a, b):
    """Signed distance of two rectangles in a plane: (centre, angle, sides)."""
    corners, axes = [], []
    for x, angle, (length, width) in (a, b):
        e = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        corners.append(x + np.array([[i * length, j * width] for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]) / 2 @ e)
        axes += list(e)
    p, q = corners
    gap = max(max((q @ n).min() - (p @ n).max(), (p @ n).min() - (q @ n).max()) for n in axes)
    if gap <= 0.0:
        return gap
    found = []
    for points, shape in ((p, q), (q, p)):
        for start, end in zip(shape, np.roll(shape, 1, axis=0), strict=True):
            along = end - start
            share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
            found.append(np.linalg.norm(points - start - share[:, None] * along, axis=1).min())
    return min(found)


@pytest.fixture(scope="module")
def array():
    pytest.importorskip("coal")
    return evolvent.run("solar-array")


@pytest.mark.slow
def test_solar_array(array):
    """Panels open in a plane; folded, panel 3 is where panel 1 is. No panel meets the satellite."""
    found = array.ev.clearance().dataset
    assert found.pair.values.tolist() == ["satellite - panel 2", "satellite - panel 3", "panel 1 - panel 3"]
    sides = {"satellite": (1.0, 1.0)}
    poses = {}
    for name in ("satellite", "panel 1", "panel 2", "panel 3"):
        q = array[name]["attitude"].values
        angle = 2.0 * np.arctan2(q[:, 3], q[:, 0])
        poses[name] = [(x, a, sides.get(name, (1.0, 0.02))) for x, a in zip(
            array[name]["position"].values[:, :2], angle, strict=True)]  # fmt: skip
    for k in range(3):
        one = found.isel(pair=k)
        expected = [rectangles(a, b) for a, b in zip(poses[str(one.a.values)], poses[str(one.b.values)], strict=True)]
        exact = one.exact.values == 1
        assert one.clearance.values[exact] == pytest.approx(np.array(expected)[exact], abs=1e-5)
    assert found.smallest.values == pytest.approx([0.04, 0.04, -0.02], abs=1e-6)
    assert found.between.values.tolist() == [2]
    assert found.start.values == pytest.approx([0.0])
    assert found.end.values == pytest.approx([1.166], abs=2e-3)


# ------------------------------------------------------------------------------------------------ refusals


@pytest.mark.parametrize(
    ("pairs", "sentence"),
    [
        ([("body 1", "body0")], "'body0' is no rigid body with a shape and no shell; did you mean 'body 0'?"),
        ([("body 0", "body 0")], "a pair is 'body 0' twice"),
        ([("body 0",)], "it must be two names of bodies"),
        (["body 0"], "it must be two names of bodies"),
    ],
)
def test_pairs_that_are_none(pairs, sentence):
    run = made([0.0], (BALL, (0.0, 0.0, 0.0), I), (BALL, (1.0, 0.0, 0.0), I))
    with pytest.raises(evolvent.InputError, match=re.escape(sentence)):
        run.ev.clearance(pairs)


def test_no_pair_and_no_shapes(monkeypatch):
    alone = made([0.0], (BALL, (0.0, 0.0, 0.0), I))
    with pytest.raises(evolvent.InputError, match="two rigid bodies with a shape or shells, and 1 body has one"):
        alone.ev.clearance()
    hinge = {"hinge": {"kind": "joint", "a": "body 0", "b": "body 1"}}
    held = made([0.0], (BALL, (0.0, 0.0, 0.0), I), (BALL, (1.0, 0.0, 0.0), I), parts=hinge)
    with pytest.raises(evolvent.InputError, match="every pair of them is held by a joint"):
        held.ev.clearance()
    held.attrs["case"] = ""
    with pytest.raises(evolvent.InputError, match="the run does not hold its whole case"):
        held.ev.clearance()
    monkeypatch.setitem(sys.modules, "coal", None)
    with pytest.raises(evolvent.InputError, match=r"need the package coal; pip install 'evolvent\[clearance\]'"):
        clearance.check_package()
