"""Margins of reels along a run: a load on a thread, whose tension is its weight once it moves steadily."""

from __future__ import annotations

import math

import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError

G, RADIUS, MASS = 9.81, 0.02, 0.1
OTHERS = ["hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
#: Torque of the load on the spool, N m.
LOAD = RADIUS * MASS * G


def hoist(drive: parts.DriveKind | dict, zero: list[str], **line: object) -> System:
    """A load on a thread that leaves a reel downwards; the margin begins once the tension has grown."""
    margin = {"zero": zero, "lines": {"reel": line}}
    system = System(gravity=(0.0, 0.0, -G), settings={"until": "4 s", "every": "0.05 s"}, sections={"margin": margin})
    reel = parts.Reel(body="ground", radius=RADIUS, drive=drive, payout_axis=(0, 0, -1), spool_axis=(0, 1, 0))
    system.add(reel, "reel")
    line_ = {"line_density": 1e-6, "nodes": 4, "stiffness": 1e4, "damping": 20.0, "boundary_segment": "constant"}
    system.add(parts.Thread(reel="reel", length=2.0, tip_mass=MASS, **line_), "line")
    return system


@pytest.mark.slow
def test_a_free_spool_that_a_load_turns() -> None:
    """0.9 of the load's torque over 6 times the friction, less 1 (ECSS); the damper of the spool does not count."""
    friction = 1e-3
    spool = parts.FreeSpool(inertia=1e-6, friction_torque=friction, viscous_damping=0.02, angle=20.0)
    system = hoist(spool, OTHERS, travel=("20.5 rad", "22 rad"))
    found = system.margin()
    table = found.motion("reel")
    assert table is not None
    assert table.values[0][-1] == pytest.approx(LOAD, rel=1e-4)
    assert found.least == pytest.approx(0.9 * LOAD / (6.0 * friction) - 1.0, rel=2e-3)
    assert found["reel"] is table
    assert [row[0] for row in found.contributions("reel")[1:]] == ["reel.tension", "reel.friction", "reel.damping"]
    assert any("'reel' is a reel" in note for note in found.notes())
    kept = system.simulate(keep=["reel.margin_in_run"])
    assert kept["reel.margin_in_run"] == pytest.approx(found.least, rel=1e-9)
    with pytest.raises(InputError, match=r"'reel' is a reel, whose margin is that along a run: reel\.margin_in_run"):
        system.simulate(keep=["reel.margin"])


@pytest.mark.slow
def test_a_motor_that_reels_in() -> None:
    """Its torque over 2.2 times that of the weight."""
    system = hoist(
        {"table": {"time": [0.0, 2.0, 4.0], "rate": [0.0, -1.0, -1.0], "start": 60.0}}, ["friction", *OTHERS],
        torque="50 mN m", travel=("59.5 rad", "57 rad"),
    )  # fmt: skip
    found = system.margin()
    assert found.least == pytest.approx(0.05 / (2.2 * LOAD) - 1.0, abs=5e-3)
    assert found.negative == []
    rows = found.rows()
    assert rows[1][0] == "reel"
    assert rows[1][2] == "-"
    assert rows[1][5] == "holds"


def test_tables_of_a_reel_without_a_run(tmp_path) -> None:
    system = hoist(parts.FreeSpool(inertia=1e-6, friction_torque=1e-3, angle=20.0), OTHERS)
    found = system.margin(motion=False)
    assert math.isnan(found.least)
    assert found.rows()[1] == ["reel", "-", "-", "-", "-", "needs a run in which it turns"]
    with pytest.raises(InputError, match="'reel' is a reel, whose margin is that along a run"):
        found["reel"]
    for ending in (".json", ".csv", ".nc"):
        found.save(tmp_path / f"margins{ending}")


DRIVEN = {"constant": {"rate": -2.0, "angle": 50.0}}


@pytest.mark.parametrize(
    ("drive", "line", "sentence"),
    [
        (DRIVEN, {}, "follows a drive, whose motor the case does not describe; give margin.lines.reel"),
        ({"free": {"inertia": 1e-6}}, {"torque": "1 N m"}, "but the spool is free and has its own motor"),
        (DRIVEN, {"torque": "1 N m", "travel": ("1 rad", "2 rad")}, "but the spool turns from 50 to 42 rad in the run"),
    ],
)  # fmt: skip
def test_what_a_reel_does_not_state_is_refused(drive: dict, line: dict, sentence: str) -> None:
    with pytest.raises(InputError) as error:
        hoist(drive, ["friction", *OTHERS], **line).margin()
    assert sentence in str(error.value)
