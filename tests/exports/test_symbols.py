"""Symbols of parts without an extent of their own: where each one is at a given time, and what its size follows."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import cf
import evolvent as ev
from evolvent import parts
from evolvent.exports import vtk
from evolvent.exports.pictures import pictures
from evolvent.exports.request import Request
from evolvent.results.rotations import turned
from evolvent.view import animation, show


@pytest.fixture(scope="module")
def craft():
    """A satellite with hardware of every kind, a panel on a motor, and a gear to a second panel."""
    made = ev.System(title="Craft")
    box, plate = {"box": (1, 1, 1)}, {"box": (1, 0.02, 1)}
    made.add(
        parts.RigidBody(mass=50, shape=box, angular_velocity=(0, 0.1, 0.3), points={"jet": (-0.5, 0.4, 0.1)}), "bus"
    )
    for n, y in ((1, 1.0), (2, -1.0)):
        panel = parts.RigidBody(mass=2, shape=plate, position=(0, y, 0), points={"inner": (0, -y / 2, 0)})
        made.add(panel, f"panel {n}")
        place = {"a": ("bus", (0, y / 2, 0)), "b": f"panel {n}.inner"}
        made.add(parts.Joint(**place, type="revolute", axis=(0, 1, 0), stiffness=1e4, damping=100), f"pin {n}")
        made.add(parts.JointSpring(a="bus", b=f"panel {n}", axis=(0, 1, 0), stiffness=0.1), f"hinge {n}")
    made.add(parts.Joint(type="synchronization", joints=("hinge 1", "hinge 2"), ratios=(1, 1), stiffness=5), "cables")
    made.add(parts.Motor(joint="pin 1", torque={"constant": 0.1}), "motor")
    made.add(parts.ReactionWheel(body="bus", inertia=0.05, torque=0.1, centre=(0.1, 0, 0)), "wheel")
    made.add(
        parts.Thruster(at="bus.jet", direction=(1, 0, 0), thrust=4, profile=[[0, 1], [0.5, 1], [0.6, 0], [1, 0]]), "jet"
    )
    made.add(parts.Radiation(at="panel 2", area=1, normal=(0, 1, 0), pressure=9e-6), "light")
    made.add(parts.Load(at="bus", torque=(0, 0, 0.01)), "twist")
    return made.simulate(until="1 s", every="0.05 s", method="dopri5")


@pytest.fixture(scope="module")
def machine():
    """Joints of the remaining types, two gears, and a driven point."""
    made = ev.System(title="Machine")
    shape = {"box": (0.2, 0.1, 0.1)}

    def body(name, x):
        made.add(parts.RigidBody(mass=1, shape=shape, position=x, velocity=(0, 0, 0)), name)

    body("slide", (0.5, 0, 0))
    made.add(parts.Joint(a=(0.2, 0, 0), b="slide", position=None, type="prismatic", axis=(1, 0, 0)), "rail")
    made.add(parts.Load(at="slide", force=(1, 0, 0)), "push")
    for n, (kind, x) in enumerate(
        [("spherical", 1.0), ("clamp", 2.0), ("universal", 3.0), ("cylindrical", 4.0), ("point-on-line", 5.0),
         ("in-plane", 6.0)]
    ):  # fmt: skip
        body(f"b{n}", (x, 0, 0))
        extra = {"axis_b": (0, 1, 0)} if kind == "universal" else {}
        made.add(parts.Joint(a=(x, 0, 0), b=f"b{n}", type=kind, **extra), kind)
    body("released", (8.0, 0, 0))
    made.add(parts.Joint(a=(8.0, 0, 0), b="released", type="clamp", until="0.1 s"), "hold-down")
    body("bob", (0, 1, 0))
    made.add(parts.Joint(a=(0, 0, 0), b=("bob", (0, 0, 0)), type="distance"), "stay")
    for n, x in ((1, 0.0), (2, 0.9)):
        made.add(parts.RigidBody(motion="spin", inertia=0.1, position=(x, 3, 0), rate=(2, -1)[n - 1]), f"wheel {n}")
    made.add(parts.Joint(a="wheel 1", b="wheel 2", type="gear", ratio=2), "gear")
    made.add(parts.Point(mass=1, position=(0, -1, 0), velocity=(1, 0, 0)), "point")
    made.add(
        parts.Joint(
            a="ground", b="point", type="point-on-line", axis=(1.0, 0.0, 0.0), drive={"constant": {"rate": "1 m/s"}}
        ),
        "drive",
    )
    made.add(parts.RigidBody(motion="spin", inertia=0.1, position=(3, 3, 0), rate=2), "table")
    made.add(parts.Joint(a="ground", b="table", type="revolute", drive={"constant": {"rate": "2 rad/s"}}), "turn")
    return made.simulate(until="0.2 s", every="0.02 s", method="generalized-alpha")


def symbols(run, name):
    return [frame for frame in show.motion(run).symbols if frame.name == name]


def on(run, body, place):
    """Position (nt, 3) of a point of a body."""
    group = run[body]
    return group.position.values + turned(group.attitude.values, np.broadcast_to(place, (run.time.size, 1, 3)))[:, 0]


def axis_of(frame, k=0):
    """Direction of the first solid of a symbol, inertial axes."""
    return turned(frame.attitude[k : k + 1], np.array(frame.solids[0].axis)[None, None])[0, 0]


@pytest.mark.parametrize(
    ("name", "body", "place"),
    [
        ("pin 1", "bus", (0, 0.5, 0)),
        ("hinge 1", "bus", (0, 0.5, 0)),
        ("hinge 2", "bus", (0, -0.5, 0)),
        ("motor", "bus", (0, 0.5, 0)),
        ("wheel", "bus", (0.1, 0, 0)),
        ("jet", "bus", (-0.5, 0.4, 0.1)),
        ("light", "panel 2", (0, 0, 0)),
    ],
)
def test_symbols_move_with_their_bodies(craft, name, body, place):
    (found,) = symbols(craft, name)
    assert found.origin == pytest.approx(on(craft, body, place), abs=1e-9)
    assert np.abs(found.attitude - craft[body].attitude.values).max() < 1e-12


@pytest.mark.slow
def test_rotors_turn_and_plumes_follow_the_thrust(craft):
    wheel, motor, jet = (symbols(craft, name)[0] for name in ("wheel", "motor", "jet"))
    assert np.array_equal(wheel.solids[0].turned, craft["wheel"].angle.values)
    assert np.array_equal(motor.solids[0].turned, craft["motor"].angle.values)
    assert np.ptp(wheel.solids[0].turned) > 0.1
    plume = jet.solids[1]
    assert plume.scale == pytest.approx(craft["jet"].thrust.values / 4.0)
    assert plume.scale[0] == pytest.approx(0.25)
    assert plume.scale[-1] == 0.0
    assert plume.axis == (-1.0, 0.0, 0.0)
    assert axis_of(symbols(craft, "pin 1")[0]) == pytest.approx(axis_of(symbols(craft, "hinge 1")[0]))


@pytest.mark.parametrize("made", ["craft", "machine"])
def test_files_of_all_kinds_follow_the_conventions(request, made, tmp_path):
    """The axis of a joint has not the name of the dimension that counts x, y, z."""
    run = request.getfixturevalue(made)
    ev.save(run, tmp_path / "run.nc")
    assert cf.faults(tmp_path / "run.nc") == []
    again = ev.open(tmp_path / "run.nc")
    xr.testing.assert_identical(again, run)


def test_cables_run_from_hinge_to_hinge(craft):
    (cable,) = (line for line in show.motion(craft).lines if line.name == "cables")
    for k, y in ((0, 0.5), (1, -0.5)):
        assert cable.points[:, k] == pytest.approx(on(craft, "bus", (0, y, 0)), abs=1e-9)


def test_the_outline_of_a_panel_has_its_area(craft):
    edges = np.diff(symbols(craft, "light")[0].outline[0], axis=0)
    assert np.linalg.norm(edges, axis=1) == pytest.approx(np.ones(4))
    assert edges[:, 1] == pytest.approx(np.zeros(4))  # the normal is y


def test_loads_are_arrows(craft, machine):
    (twist,) = (force for force in show.motion(craft).forces if force.name == "twist")
    assert twist.unit == "N m"
    assert twist.points[:, 0] == pytest.approx(craft["bus"].position.values)
    (push,) = (force for force in show.motion(machine).forces if force.name == "push")
    assert push.points[:, 0] == pytest.approx(machine["slide"].position.values)


def test_every_type_of_joint_has_a_symbol(machine):
    places = {
        "spherical": 1.0,
        "clamp": 2.0,
        "universal": 3.0,
        "cylindrical": 4.0,
        "point-on-line": 5.0,
        "in-plane": 6.0,
    }
    for kind, x in places.items():
        assert symbols(machine, kind)[0].origin[0] == pytest.approx([x, 0, 0]), kind
    assert len(symbols(machine, "universal")) == 2
    rail, slider = symbols(machine, "rail")
    assert np.ptp(rail.origin, axis=0).max() < 1e-12
    # the end on the body is where the other end is at the start
    assert slider.origin == pytest.approx(machine["slide"].position.values - [0.3, 0, 0], abs=1e-9)
    assert np.ptp(slider.origin[:, 0]) > 0.01
    (stay,) = (line for line in show.motion(machine).lines if line.name == "stay")
    assert stay.points[:, 1] == pytest.approx(machine["bob"].position.values, abs=1e-9)


def test_meshing_wheels_touch(machine):
    """Ratio 2 at a distance of 0.9 m: radii of 0.3 and 0.6 m, which turn with their bodies."""
    wheels = symbols(machine, "gear")
    radii = [float(np.linalg.norm(wheel.outline[0][0])) for wheel in wheels]
    assert radii == pytest.approx([0.3, 0.6])
    for wheel, name in zip(wheels, ("wheel 1", "wheel 2"), strict=True):
        assert np.array_equal(wheel.attitude, machine[name].attitude.values)


def test_drives_have_symbols(machine):
    (drive,), (turn,) = symbols(machine, "drive"), symbols(machine, "turn")
    assert drive.origin == pytest.approx(machine["point"].position.values)
    assert axis_of(drive) == pytest.approx([1, 0, 0])
    assert turn.solids[0].turned[-1] == pytest.approx(0.4)


def test_symbols_are_small_beside_the_structure_and_its_bodies(craft):
    motion = show.motion(craft)
    least = min(max(solid.size for solid in frame.solids) for frame in motion.frames)
    for frame in motion.symbols:
        for solid in frame.solids:
            assert 1e-3 * motion.reach < solid.size < 0.3 * least, frame.name


def test_nothing_is_drawn_of_a_joint_that_is_released(machine):
    motion, closed = show.motion(machine), machine["hold-down"].closed.values > 0.5
    assert 2 < closed.sum() < closed.size - 2
    (symbol,) = symbols(machine, "hold-down")
    assert np.array_equal(symbol.shown, closed)
    (mark,) = (one for one in motion.marks if one.name == "hold-down")
    assert np.array_equal(np.isfinite(mark.points).all(axis=(1, 2)), closed)
    assert symbols(machine, "clamp")[0].shown.all(), "one that is never released stays"
    header, blocks = animation.described(motion, 5, points=100)
    k = [one["name"] for one in header["symbols"]].index("hold-down")
    assert (blocks[f"symbol {k} shown"][0], blocks[f"symbol {k} shown"][-1]) == (1.0, 0.0)


def test_what_acts_on_a_joint_by_way_of_its_spring_is_not_drawn_after_the_release(released):
    drawn = [frame for frame in show.motion(released).symbols if frame.name in ("pin", "hinge", "harness")]
    assert len(drawn) > 1
    for frame in drawn:
        assert np.array_equal(frame.shown, released["pin"].closed.values > 0.5), frame.name


def test_animation_and_pictures_show_symbols(craft):
    motion = show.motion(craft)
    header, blocks = animation.described(motion, 5, points=100)
    names = [symbol["name"] for symbol in header["symbols"]]
    assert names == [frame.name for frame in motion.symbols]
    k = names.index("jet")
    assert header["symbols"][k]["solids"][1]["scaled"]
    assert blocks[f"symbol {k} scaled 1"][0] == pytest.approx(0.25)
    without = show.motion(craft)
    bare = type(without)(**{**vars(without), "symbols": ()})
    one, other = (next(pictures(m, np.zeros(1), size=(300, 200), inertial=True)) for m in (motion, bare))
    assert (one != other).any(axis=-1).sum() > 50


def test_vtk_has_the_symbols(craft, tmp_path):
    said = vtk.write(craft, str(tmp_path), Request(frames=2))
    assert "symbols.pvd" in said
    assert (tmp_path / "data" / "symbols-00001.vtp").stat().st_size > 1000
    assert "jet" in (tmp_path / "about.txt").read_text().split("symbols.pvd")[1].splitlines()[0]
