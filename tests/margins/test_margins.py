"""Margins of mechanisms against calculations by hand: levers, reflected inertias, dead points, refusals."""

import dataclasses
import math

import numpy as np
import pytest

import cf
import evolvent
from evolvent import System, parts
from evolvent_base.errors import InputError

pytestmark = pytest.mark.slow

NONE = ("friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration")
STILL = {"motion": False, "stations": 7}
G = 9.81


def reflected(a, b):
    """Inertia that two free bodies in a plane reflect to the hinge between them.

    Each is (mass, inertia about its centre, centre from the hinge). Of the turn w of a, 1 + w of b and the relative
    velocity of the centres, the kinetic energy is least at the w without angular momentum.
    """
    (ma, ia, ra), (mb, ib, rb) = a, b
    mu, d = ma * mb / (ma + mb), rb - ra
    twice, once = ia + ib + mu * d @ d, ib + mu * d @ rb
    return ib + mu * rb @ rb - once**2 / twice


def joined(*bodies):
    """Bodies as one: mass, inertia about the centre, centre."""
    mass = sum(m for m, _, _ in bodies)
    centre = sum(m * x for m, _, x in bodies) / mass
    return mass, sum(i + m * (x - centre) @ (x - centre) for m, i, x in bodies), centre


def array_by_hand(hinge, x, others=1.0):
    """Driving torque and reflected inertia of a hinge of the built-in solar array; others: share of their start."""
    angles = [others * math.pi / 2, -others * math.pi, others * math.pi]
    angles[hinge] = x
    corner, turn, bodies = np.array([0.55, -0.5]), 0.0, [(300.0, 70.0, np.zeros(2))]
    hinges = []
    for one in angles:
        turn += one
        along = np.array([math.cos(turn), math.sin(turn)])
        hinges.append(corner)
        bodies.append((4.0, 4.0 / 12.0 * (1.0 + 0.02**2), corner + 0.5 * along))
        corner = corner + along
    sides = joined(*bodies[: hinge + 1]), joined(*bodies[hinge + 1 :])
    a, b = ((m, i, c - hinges[hinge]) for m, i, c in sides)
    stiffness, rest = [(0.2, -20.0), (0.1, 20.0), (0.05, -20.0)][hinge]
    sense = -math.copysign(1.0, [math.pi / 2, -math.pi, math.pi][hinge])
    return sense * stiffness * (math.radians(rest) - x), reflected(a, b)


@pytest.fixture(scope="module")
def array():
    """Margins of the built-in solar array at rest."""
    return evolvent.load("solar-array").margin(motion=False)


def test_hinges_that_move_together():
    """At each station all hinges of the solar array stand at the same share of their travels."""
    margins = evolvent.load("solar-array").margin(others="together", **STILL)
    for hinge in range(3):
        table = margins[f"hinge {hinge + 1}"]
        for x, inertia, available in zip(table.x, table.inertia, table.available, strict=True):
            torque, by_hand = array_by_hand(hinge, x, x / table.x[0])
            assert inertia == pytest.approx(by_hand, rel=1e-9)
            assert available == pytest.approx(0.8 * torque, abs=1e-9)
    assert "at the same share of their travel" in str(margins)


@pytest.mark.parametrize("hinge", [0, 1, 2])
def test_solar_array_by_hand(array, hinge):
    table = array[f"hinge {hinge + 1}"]
    start = [math.pi / 2, -math.pi, math.pi][hinge]
    assert table.x == pytest.approx(np.linspace(start, 0.0, 37), abs=1e-12)
    acceleration = 2.0 * abs(start) / 40.0**2
    for n, x in enumerate(table.x):
        torque, inertia = array_by_hand(hinge, x)
        assert table.inertia[n] == pytest.approx(inertia, rel=1e-9)
        assert table.available[n] == pytest.approx(0.8 * torque, abs=1e-9)
        assert table.required("motorization")[n] == pytest.approx(1.25 * inertia * acceleration, abs=1e-9)
        assert table.margin("motorization")[n] == pytest.approx(
            0.8 * torque / (1.25 * inertia * acceleration) - 1.0, rel=1e-9
        )
    assert table.governing() == ("motorization", 36)
    assert table.coordinate.held == tuple(f"hinge {k + 1}" for k in range(3) if k != hinge)


def test_solar_array_with_the_others_deployed():
    found = evolvent.load("solar-array").margin(motion=False, others="end", stations=3)
    one = found["hinge 1"]
    # three panels in a row of 3 m and 12 kg
    row = (12.0, 12.0 / 12.0 * 9.0 + 3 * 4.0 / 12.0 * 0.02**2, 1.5 * np.array([1.0, 0.0]))
    body = (300.0, 70.0, -np.array([0.55, -0.5]))
    assert one.inertia[-1] == pytest.approx(reflected(body, row), rel=1e-9)


def hinged(*, stiffness=0.1, friction=0.0, **more):
    """An arm on the ground that a spring turns from 0 to a latch at 90 degrees."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, 0.0, 0.0)), "arm")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute"), "pivot")
    system.add(
        parts.JointSpring(
            joint="pivot", stiffness=stiffness, rest=math.pi, latch=math.pi / 2, latch_stiffness=500.0,
            friction=friction, **more
        ),
        "hinge",
    )  # fmt: skip
    return system


def test_half_a_spring_turns_the_verdict():
    zero = [one for one in NONE if one != "friction"]
    ask = {"zero": zero, **STILL}
    # at the end 0.8 k pi/2 against 6 x 0.015: 0.08 k/0.1 ... k = 0.1 holds by 0.1257/0.09, half of it does not
    whole, half = (hinged(stiffness=k, friction=0.015).margin(**ask) for k in (0.1, 0.05))
    assert whole.least == pytest.approx(0.8 * 0.1 * math.pi / 2 / (6 * 0.015) - 1.0, rel=1e-12)
    assert half.least == pytest.approx(0.8 * 0.05 * math.pi / 2 / (6 * 0.015) - 1.0, rel=1e-12)
    assert (whole.negative, half.negative) == ([], ["hinge"])
    assert half["hinge"].spring_to_add() == pytest.approx(6 * 0.015 / 0.8 - 0.05 * math.pi / 2, rel=1e-12)
    assert half["hinge"].friction_to_lose() == pytest.approx(0.015 - 0.8 * 0.05 * math.pi / 2 / 6, rel=1e-12)
    # what it takes brings the margin to 0
    less = hinged(stiffness=0.05, friction=0.015 - half["hinge"].friction_to_lose()).margin(**ask)
    assert less.least == pytest.approx(0.0, abs=1e-12)
    assert less.negative in ([], ["hinge"])  # 0 to round-off


def test_a_change_names_the_station_that_decides_it():
    """The least margin is the smallest ratio of 0.8 spring to 6 friction; a spring may lose their least difference."""
    zero = [one for one in NONE if one != "friction"]
    found = hinged(friction=0.015).margin(zero=zero, motion=False, stations=3)
    table = found["hinge"]
    spring, friction = np.array([1.0, 0.02, 1.0]), np.array([0.13, 0.002, 0.01])
    found.still[0] = table = dataclasses.replace(table, values=np.array([spring, -friction, np.zeros(3)]))
    assert [share.category for share in table.shares] == ["spring", "friction", "spring"]
    assert table.governing()[1] == 0
    assert table.spring_change() == (pytest.approx((6.0 * 0.002 - 0.8 * 0.02) / 0.8), 1)
    assert table.friction_change() == (pytest.approx(0.002 - 0.8 * 0.02 / 6.0), 1)
    row = dict(zip(*found.balance_rows(), strict=True))
    assert (row["margin"], row["governed at"]) == (f"{0.8 / 0.78 - 1.0:+.4f} at rest", "0 deg")
    assert (row["counts"], row["required"]) == ("0.8 N m", "0.78 N m")  # both where the margin is least
    assert (row["spring"], row["friction"]) == ("spare 0.005 N m (45 deg)", "spare 0.0006667 N m (45 deg)")


def test_measured_friction_and_the_source():
    keys = {"hinge.friction": {"evidence": "measured", "source": "TR-12"}}
    found = hinged(friction=0.02).margin(zero=[one for one in NONE if one != "friction"], parts=keys, **STILL)
    table = found["hinge"]
    assert table.required("motorization") == pytest.approx(np.full(7, 2 * 1.5 * 0.02), rel=1e-12)
    share = next(one for one in table.shares if one.label == "hinge.friction")
    assert (share.category, share.evidence, share.source) == ("friction", "measured", "TR-12")
    assert found.to_dict()["coordinates"]["hinge"]["shares"][1]["source"] == "TR-12"


def test_a_harness_beside_the_hinge_is_no_coordinate_of_its_own():
    system = hinged(friction=0.01)
    system.add(parts.JointSpring(joint="pivot", stiffness=0.004, rest=-0.5, friction=0.002), "harness")
    keys = {"harness": {"category": "harness"}, "harness.friction": {"category": "hysteresis"}}
    zero = ("motor losses", "adhesion", "load", "acceleration")
    found = system.margin(zero=zero, parts=keys, **STILL)
    assert [table.coordinate.name for table in found.still] == ["hinge"]
    table = found["hinge"]
    harness = 0.004 * (table.x + 0.5)
    assert table.required("motorization") == pytest.approx(6 * (0.01 + 0.002 + harness), rel=1e-12)
    assert table.available == pytest.approx(0.8 * 0.1 * (math.pi - table.x), rel=1e-12)


def pendulum(*, start=-60.0, end=60.0, rate=0.0, stiffness=0.0, mass=2.0, length=0.5):
    """A bob on an arm above its hinge: the angle is that from the vertical, gravity is along -z."""
    angle = math.radians(start)
    up = np.array([-math.sin(angle), 0.0, math.cos(angle)])  # right-handed about -y
    system = System(gravity=(0.0, 0.0, -G))
    system.add(
        parts.RigidBody(
            mass=mass, inertia=(0.01, 0.01, 0.01), position=tuple(length * up),
            velocity=tuple(rate * length * np.array([-math.cos(angle), 0.0, -math.sin(angle)])),
            angular_velocity=(0.0, -rate, 0.0),
        ),
        "bob",
    )  # fmt: skip
    system.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b=("bob", tuple(-length * up)), type="revolute", axis=(0, -1, 0)), "pivot"
    )
    system.add(
        parts.JointSpring(
            joint="pivot", start=angle, stiffness=stiffness, rest=angle, latch=math.radians(end), latch_stiffness=500.0
        ),
        "hinge",
    )
    return system


def test_weight_has_its_lever():
    table = pendulum(start=-60.0, end=60.0).margin(zero=NONE, **STILL)["hinge"]
    weight = 2.0 * G * 0.5 * np.sin(table.x)  # drives beyond the top
    weight[3] = 0.0
    assert table.values[[one.label for one in table.shares].index("gravity")] == pytest.approx(weight, abs=1e-12)
    assert table.available == pytest.approx(0.9 * np.maximum(weight, 0.0), abs=1e-12)
    assert table.required("motorization") == pytest.approx(2.2 * np.maximum(-weight, 0.0), abs=1e-12)
    assert table.inertia == pytest.approx(np.full(7, 0.01 + 2.0 * 0.5**2), rel=1e-12)


def test_a_dead_point_that_speed_alone_passes():
    rate = math.sqrt(2.0 * 2.0 * G * 0.5 * (1.0 - 0.5) / (0.01 + 0.5)) + 1.0  # enough to pass the top
    system = pendulum(rate=rate)
    system.settings = {"until": "1 s", "every": "0.02 s"}
    found = system.margin(zero=NONE, stations=7)
    assert math.isfinite(found.latches[0]["time"])  # it arrives
    assert found["hinge"].margin("motorization")[0] == -1.0
    assert found.motion("hinge").margin("motorization")[0] == -1.0
    assert found.negative == ["hinge"]
    assert any("by its speed alone" in note for note in found.notes())
    # by the balance of energy: the rate at the latch is that at the start
    assert found.latches[0]["rate"] == pytest.approx(rate, rel=1e-3)
    assert found.latches[0]["energy"] == pytest.approx(0.5 * 0.51 * rate**2, rel=2e-3)


def test_the_table_along_a_run_by_newtons_law():
    system = hinged(friction=0.01, damping=0.05)
    system.settings = {"until": "2 s", "every": "0.02 s", "fine": False}
    zero = [one for one in NONE if one != "friction"]
    table = system.margin(zero=zero, stations=3).motion("hinge")
    run = system.simulate()["hinge"]
    n = table.time.size
    assert table.time == pytest.approx(run.time.values[:n], abs=1e-12)
    assert table.x == pytest.approx(run.angle.values[:n], abs=1e-9)
    labels = [one.label for one in table.shares]
    assert table.values[labels.index("hinge.damping")] == pytest.approx(-0.05 * run.rate.values[:n], abs=1e-9)
    assert table.values[labels.index("hinge.friction")] == pytest.approx(np.full(n, -0.01), rel=1e-12)
    # what all shares give accelerates the arm: (0.2 + 2 0.5^2) kg m2
    acceleration = np.gradient(run.rate.values, run.time.values)[5 : n - 5]
    assert table.values.sum(axis=0)[5 : n - 5] == pytest.approx(0.7 * acceleration, rel=1e-3)
    # dampers are in no requirement
    assert table.required("motorization") == pytest.approx(np.full(n, 0.06), rel=1e-12)


def test_a_neighbours_spring_enters_by_the_ratio_of_the_cable():
    system = hinged()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.2, 0.3), position=(0.5, 2.0, 0.0)), "other")
    system.add(parts.Joint(a=(0.0, 2.0, 0.0), b=("other", (-0.5, 0.0, 0.0)), type="revolute"), "second pivot")
    system.add(parts.JointSpring(joint="second pivot", stiffness=0.02, rest=0.0), "second")
    system.add(
        parts.Joint(type="synchronization", joints=("hinge", "second"), ratios=(1.0, 0.5), stiffness=100.0), "cable"
    )
    lines = {"second": {"leave_out": "it follows the hinge"}}
    table = system.margin(zero=NONE, lines=lines, **STILL)["hinge"]
    assert table.coordinate.follow == ("second",)
    labels = [one.label for one in table.shares]
    # it turns twice as far, and its torque has twice the lever
    assert table.values[labels.index("second.stiffness")] == pytest.approx(-0.02 * 2.0 * table.x * 2.0, abs=1e-12)
    assert table.values[labels.index("cable")] == pytest.approx(np.zeros(7), abs=1e-10)
    assert table.inertia == pytest.approx(np.full(7, 0.2 + 2.0 * 0.25 + 4.0 * (0.3 + 0.25)), rel=1e-12)


def test_a_gear_brings_its_neighbour_along():
    system = hinged()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.2, 0.2, 0.3), position=(0.0, 2.0, 0.0)), "wheel")
    system.add(parts.Joint(a=(0.0, 2.0, 0.0), b="wheel", type="revolute"), "axle")
    system.add(parts.JointSpring(joint="axle", friction=0.004, low=-9.0, high=9.0, stop=1.0), "brake")
    system.add(parts.Joint(a="pivot", b="axle", type="gear", ratio=3 / 2), "gear")
    zero = [one for one in NONE if one != "friction"]
    table = system.margin(zero=zero, lines={"brake": {"leave_out": "it follows the hinge"}}, **STILL)["hinge"]
    assert table.coordinate.follow == ("brake",)
    assert table.required("motorization") == pytest.approx(np.full(7, 6 * 0.004 / 1.5), rel=1e-12)
    assert table.inertia == pytest.approx(np.full(7, 0.2 + 0.5 + 0.3 / 1.5**2), rel=1e-12)


def test_a_slide_with_motor_load_and_distant_spring():
    system = System()
    system.add(parts.RigidBody(mass=3.0, inertia=(1.0, 1.0, 1.0)), "slider")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="slider", type="prismatic", axis=(1, 0, 0)), "rail")
    system.add(parts.JointSpring(joint="rail", stiffness=0.0, low=0.0, high=0.8, stop=1e4), "slide")
    system.add(parts.Motor(joint="slide", torque={"constant": 5.0}), "motor")
    system.add(parts.Load(at="slider", force=(-0.5, 3.0, 0.0)), "pull")
    system.add(parts.Spring(a=(0.0, 0.6, 0.0), b="slider", length=0.5, stiffness=2.0), "aside")
    zero = [one for one in NONE if one not in ("load", "acceleration")]
    table = system.margin(zero=zero, lines={"slide": {"acceleration": "0.1 m/s^2"}}, **STILL)["slide"]
    x, length = table.x, np.hypot(table.x, 0.6)
    assert x == pytest.approx(np.linspace(0.0, 0.8, 7), abs=1e-12)
    pulled = 2.0 * (length - 0.5) * x / length
    assert table.available == pytest.approx(np.full(7, 5.0), rel=1e-12)
    assert table.required("motorization") == pytest.approx(2.4 * pulled + 0.5 + 1.25 * 3.0 * 0.1, rel=1e-11)
    assert table.coordinate.units == ("m", "N")


def test_a_motor_that_follows_a_motion_has_its_limit():
    system = hinged(stiffness=0.0)
    motion = {"joint": "hinge", "motion": {"constant": {"rate": 0.1}}, "position_gain": 5.0}
    system.add(parts.Motor(**motion, limit=0.3), "motor")
    table = system.margin(zero=NONE, **STILL)["hinge"]
    assert table.available == pytest.approx(np.full(7, 0.3), rel=1e-12)
    system = hinged(stiffness=0.0)
    system.add(parts.Motor(**motion), "motor")
    with pytest.raises(InputError, match=r"'motor' follows a motion.*give motor.limit"):
        system.margin(zero=NONE, **STILL)


def test_a_steady_turn_drives_by_what_the_frame_asks_for():
    spin, found = 0.5, None
    system = hinged()
    found = system.margin(zero=NONE, spin=(0.0, 0.0, spin), centre=(0.0, 0.3, 0.0), **STILL)["hinge"]
    share = found.values[[one.label for one in found.shares].index("spin")]
    # the centrifugal force m W^2 (r - c) at the centre of mass, 0.5 m from the hinge
    x = found.x
    r = 0.5 * np.array([np.cos(x), np.sin(x)])
    across = 0.5 * np.array([-np.sin(x), np.cos(x)])
    assert share == pytest.approx(2.0 * spin**2 * np.sum((r - [[0.0], [0.3]]) * across, axis=0), abs=1e-12)


def test_refusals():
    with pytest.raises(InputError, match=r"friction, .*, acceleration of 'hinge' are neither given nor declared to be"):
        hinged().margin(**STILL)
    with pytest.raises(InputError, match=r"adhesion of 'hinge' is neither given nor declared to be zero; add a part"):
        hinged().margin(zero=[one for one in NONE if one != "adhesion"], **STILL)
    with pytest.raises(InputError, match="friction of 'hinge' is declared to be zero, but the case gives it"):
        hinged(friction=0.1).margin(zero=NONE, **STILL)
    with pytest.raises(InputError, match=r"margin.lines has 'hinges'.*did you mean 'hinge'"):
        hinged().margin(zero=NONE, lines={"hinges": {}}, **STILL)
    with pytest.raises(InputError, match=r"margin.parts has 'arm', which has no force"):
        hinged().margin(zero=NONE, parts={"arm": {"category": "load"}}, **STILL)
    with pytest.raises(InputError, match=r"margin.evidence is 'mesured'; did you mean 'measured'"):
        hinged().margin(zero=NONE, evidence="mesured", **STILL)
    system = hinged()
    system.add(parts.JointSpring(a="ground", b="arm", axis=(1, 0, 0), stiffness=1.0), "twist")
    with pytest.raises(InputError, match=r"'twist' cannot move|'twist' has no latch and no stop"):
        system.margin(zero=NONE, **STILL)
    with pytest.raises(InputError, match="no coordinate of the system has a margin"):
        hinged().margin(zero=NONE, lines={"hinge": {"leave_out": "is redundant"}}, **STILL)
    with pytest.raises(InputError, match=r"'hinge' does not reach|'hinge' cannot move"):
        blocked().margin(zero=NONE, **STILL)
    beam = evolvent.load("boom-slew")
    with pytest.raises(InputError, match="no coordinate of the system has a margin; it needs a hinge or slide"):
        beam.margin(motion=False)


def blocked():
    """The hinged arm with a link that lets it turn by 30 degrees or so."""
    system = hinged()
    system.add(parts.Joint(a=(1.0, 0.0, 0.5), b=("arm", (0.5, 0.0, 0.0)), type="link", length=0.5), "link")
    return system


def test_margins_at_rest_and_in_a_run_are_one_file(tmp_path):
    """Their tables have other numbers of stations, and a group inherits dimensions of the one around it."""
    import xarray as xr

    loaded = evolvent.cases.load("solar-array")
    found = evolvent.cases.system(loaded.system).margin(loaded)
    found.save(tmp_path / "m.nc")
    assert cf.faults(tmp_path / "m.nc") == []
    with xr.open_datatree(tmp_path / "m.nc", engine="h5netcdf") as tree:
        still, moving = tree["hinge 1"], tree["hinge 1/motion"]
        assert still.sizes["station"] != moving.sizes["motion_station"]
        assert moving.margin_motorization.values == pytest.approx(found.moving[0].margin("motorization"), rel=1e-14)


def test_files(array, tmp_path):
    import json

    import xarray as xr

    array.save(tmp_path / "m.nc")
    array.save(tmp_path / "m.json")
    array.save(tmp_path / "m.csv")
    with xr.open_datatree(tmp_path / "m.nc", engine="h5netcdf") as tree:
        group = tree["hinge 2"].to_dataset()
        assert group.margin_motorization.values == pytest.approx(array["hinge 2"].margin("motorization"), rel=1e-14)
        assert group.share.attrs["units"] == "N m"
        assert tree.attrs["factors"] == "ECSS-E-ST-33-01C"
    found = json.loads((tmp_path / "m.json").read_text())
    assert found["coordinates"]["hinge 3"]["least_margin"] == pytest.approx(array.least, rel=1e-14)
    rows = (tmp_path / "m.csv").read_text().splitlines()
    assert len(rows) == 1 + 3 * 37
    with pytest.raises(InputError, match=r"'m.txt' ends with '.txt'"):
        array.save("m.txt")
    assert array.plot(tmp_path / "m.png") == str(tmp_path / "m.png")
