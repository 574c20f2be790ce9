"""Margins of a mechanism with a hold-down that opens in the run: both tables, as without it."""

import math

import numpy as np
import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError

pytestmark = pytest.mark.slow

ZERO = ("hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration")


def wing(hold=None, *, events=(), **keys):
    """A panel on a free bus, which a hold-down keeps closed."""
    system = System(settings={"until": "3 s", "every": "0.02 s"})
    system.add(parts.RigidBody(mass=8, shape={"box": (0.1, 0.2, 0.34)}), "bus")
    system.add(
        parts.RigidBody(
            mass=0.25, shape={"box": (0.32, 0.18, 0.004)}, position=(0.056, 0, 0.01), points={"root": (-0.16, 0, 0)},
            orientation={"axis": (0, 1, 0), "angle": "90 deg"},
        ),
        "panel",
    )  # fmt: skip
    system.add(parts.Joint(a=("bus", (0.056, 0, 0.17)), b="panel.root", type="revolute", axis=(0, 1, 0)), "pin")
    system.add(
        parts.JointSpring(
            joint="pin", start="90 deg", stiffness=0.06, rest="-30 deg", friction=0.002, damping=0.02, latch=0,
            latch_stiffness=50, latch_damping=0.2
        ),
        "hinge",
    )  # fmt: skip
    for name, event in events:
        system.add(event, name)
    if hold:
        system.add(parts.Joint(a="bus", b=("panel", (0, 0, 0)), type=hold, **keys), "hold")
    return system


def labelled(table):
    return dict(zip([share.label for share in table.shares], table.values, strict=True))


def check(found, released, free):
    """The table at rest is that without a hold-down; the one along the run begins with the release."""
    assert found["hinge"].margin("motorization") == pytest.approx(free["hinge"].margin("motorization"), rel=1e-9)
    table = found.motion("hinge")
    assert released <= table.time[0] < released + 0.025
    assert np.all(np.diff(table.x) < 0.0)
    by_hand = 0.8 * 0.06 * (table.x + math.radians(30.0)) / (6.0 * 0.002) - 1.0
    assert table.margin("motorization") == pytest.approx(by_hand, rel=1e-6)
    latch = found.latches[0]
    reached = free.latches[0]["time"] + released
    assert latch["time"] == pytest.approx(reached, abs=2e-3)
    assert latch["rate"] == pytest.approx(free.latches[0]["rate"], rel=2e-3)


@pytest.fixture(scope="module")
def free():
    return wing().margin(zero=ZERO, stations=4)


@pytest.mark.parametrize("hold", ["clamp", "in-plane"])
@pytest.mark.parametrize("time", [{}, {"time": 1.5}])
def test_a_hold_down_with_a_time(hold, time, free):
    axis = {"axis": (1, 0, 0)} if hold == "in-plane" else {}
    found = wing(hold, until=1.0, **axis).margin(zero=ZERO, stations=4, **time)
    check(found, 1.0, free)
    assert any("'hold'" in note for note in found.notes()) is not bool(time)


@pytest.mark.parametrize("time", [{}, {"time": 0.5}])
def test_a_hold_down_that_an_event_opens(time, free):
    """It has no time: the tables at rest are without it."""
    event = ("go", parts.Event(law="t - 0.7"))
    found = wing("clamp", events=[event], released_by="go").margin(zero=ZERO, stations=4, **time)
    check(found, 0.7, free)


def test_a_time_before_the_release_is_refused():
    system = wing("clamp", until=1.0)
    with pytest.raises(
        InputError, match=r"'hinge' cannot move at 1\.5708 rad: at the time 0\.5 s it is held by 'hold'"
    ):
        system.margin(zero=ZERO, motion=False, time=0.5)


def test_a_run_that_ends_before_the_release(free):
    system = wing("clamp", until=5.0)
    found = system.margin(zero=ZERO, stations=4)
    assert found.motion("hinge") is None
    assert math.isnan(found.latches[0]["time"])
    assert "'hinge' is held throughout the run, which has no margin along it" in found.notes()
    assert found["hinge"].margin("motorization") == pytest.approx(free["hinge"].margin("motorization"))


def test_what_cannot_move_is_refused_as_before():
    system = wing("clamp")
    with pytest.raises(InputError, match="the constraints and the coordinates that are held do not let it"):
        system.margin(zero=ZERO, motion=False)
