"""Margins of viscoelastic parts: along a run by the strains of each sample, at rest by the pace that is asked for."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.analysis.margins.tables import MarginTable
from evolvent.parts.base import Part
from evolvent_base.errors import InputError

Array = np.ndarray
ZERO = ["friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
#: Stiffness (N m/rad), E_inf = 0.4 and E_1 = 0.6 of it, relaxation time and time of storage (s), rest (rad) and rate.
STIFFNESS, LEFT, SHARE, TAU, STORED, REST, RATE = 2.0, 0.4, 0.6, 1.0, 0.7, 1.5, 0.5
LAW = {"prony": [(SHARE, TAU)]}
#: A hold-down keeps what is unloaded until this time, s.
HELD = 0.3


def torsion_spring() -> parts.JointSpring:
    return parts.JointSpring(joint="pin", stiffness=STIFFNESS, rest=REST, viscoelastic=LAW)


def curve() -> parts.Resistance:
    """The same spring as a curve of a harness."""
    rows = [(REST - 3.0, -3.0 * STIFFNESS), (REST + 3.0, 3.0 * STIFFNESS)]
    return parts.Resistance(joint="spring", type="harness", torque=rows, viscoelastic=LAW)


def deployed_at_a_rate(kind: str, **settings: Any) -> System:
    """A hub that turns at a given rate below a panel that inertia holds, and a spring between them."""
    system = System(sections={"store": {"time": STORED}, "margin": {"zero": ZERO}}, settings={"until": 2.5} | settings)
    system.add(parts.RigidBody(motion="driven", rate=-RATE), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=(1e10, 1e10, 1e10)), "panel")
    system.add(parts.Joint(a="hub", b="panel", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    if kind == "spring":
        system.add(torsion_spring(), "spring")
    else:
        system.add(parts.JointSpring(joint="pin"), "spring")
        system.add(curve(), "harness")
    system.add(parts.Joint(a="ground", b="panel", type="clamp", position=(0, 0, 0), until=HELD), "hold")
    return system


def share(table: MarginTable, label: str) -> Array:
    """Values of a share."""
    return np.asarray(table.values[[one.label for one in table.shares].index(label)])


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize(("kind", "label"), [("spring", "spring.stiffness"), ("curve", "harness.elastic")])
def test_the_torque_along_a_run_is_the_convolution_of_the_deployment(kind: str, label: str, method: str) -> None:
    """Stored for a time, then turned at a constant rate; samples lie within long steps."""
    system = deployed_at_a_rate(kind, every=0.1, method=method)
    zero = [one for one in ZERO if kind == "spring" or one != "harness"]
    table = system.margin(zero=zero, stations=3, lines={"spring": {"travel": (0.0, 1.0)}}).motion("spring")
    assert table.time[0] == pytest.approx(HELD + 0.1, abs=0.11)
    assert table.x == pytest.approx(RATE * table.time, abs=1e-8)
    left = np.exp(-table.time / TAU)
    branch = REST * math.exp(-STORED / TAU) * left - RATE * TAU * (1.0 - left)
    torque = STIFFNESS * (LEFT * (REST - RATE * table.time) + SHARE * branch)
    assert torque.max() > 1.4
    assert share(table, label) == pytest.approx(torque, abs=1e-6)
    assert table.available == pytest.approx(table.standard.counts(table.shares[-1].category) * torque, abs=1e-6)
    assert table.pace == "run"


def test_the_stations_at_rest_are_those_of_a_fast_or_a_slow_deployment(tmp_path: Path) -> None:
    system = deployed_at_a_rate("spring", every=0.5)
    lines = {"spring": {"travel": (0.0, 1.0)}}
    branch = REST * math.exp(-STORED / TAU)
    cases: list[tuple[dict[str, Any], str]] = [({}, "fast"), ({"pace": "fast"}, "fast"), ({"pace": "slow"}, "slow")]
    for keys, at_rest in cases:
        found = system.margin(motion=False, stations=5, lines=lines, **keys)
        x = found["spring"].x
        strain = branch - x if at_rest == "fast" else 0.0 * x
        wanted = STIFFNESS * (LEFT * (REST - x) + SHARE * strain)
        assert share(found["spring"], "spring.stiffness") == pytest.approx(wanted, rel=1e-9)
        assert f"pace {at_rest}: at each station" in str(found)
        assert found.to_dict()["coordinates"]["spring"]["pace"] == at_rest
        assert found.to_tree()["spring"].attrs["pace"] == at_rest
        assert not found.warnings
        found.save(str(tmp_path / "margins.csv"))
        with (tmp_path / "margins.csv").open(encoding="utf-8", newline="") as file:
            assert {row["table"] for row in csv.DictReader(file)} == {f"at rest, {at_rest}"}
    both = system.margin(stations=5, lines=lines, pace="slow")
    fast = system.margin(stations=5, lines=lines)
    assert both.motion("spring").values == pytest.approx(fast.motion("spring").values, rel=1e-9)


def test_a_pace_without_what_relaxes_is_refused() -> None:
    system = System(sections={"margin": {"zero": ZERO}})
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "panel")
    system.add(parts.Joint(a="ground", b="panel", type="revolute", position=(0, 0, 0)), "pin")
    system.add(parts.JointSpring(joint="pin", stiffness=1.0, rest=2.0, latch=1.0, latch_stiffness=9.0), "spring")
    with pytest.raises(InputError, match=r"`margin\.pace` has no effect: no part is viscoelastic"):
        system.margin(pace="slow")
    with pytest.raises(InputError, match=r"pace is .quick.; known: fast, slow"):
        system.margin(pace="quick")


def test_what_no_margin_along_a_run_counts_is_a_warning() -> None:
    """Of a panel that stays held, whose spring relaxes meanwhile."""
    system = deployed_at_a_rate("spring", every=0.5)
    system.replace("hold", parts.Joint(a="ground", b="panel", type="clamp", position=(0, 0, 0), until=9.0))
    found = system.margin(stations=3, lines={"spring": {"travel": (0.0, 2.0)}})
    assert found.motion("spring") is None
    (warning,) = found.warnings
    assert "is in no margin of 'spring': 'spring' has a relaxation time of 1 s, and the run takes 2.5 s" in warning


# ------------------------------------------------------------------------------------- every part that relaxes

ELEMENTS = 4
BEND = 0.5
#: A law that relaxes in a short run, and that run: held until 0.02 s, and hardly moved then.
QUICK = {"prony": [(SHARE, 0.02)]}
RUN = {"until": 0.05, "every": 0.01, "method": "generalized-alpha", "step": 1e-3}


def held(extra: dict[str, Part], *, angle: float = 1.0, at: Any = (0.0, 0.0, 0.0)) -> System:
    """A body that no part moves much in the time, clamped at first, with a part from the ground to it."""
    system = System(sections={"margin": {"zero": ZERO, "stations": 2}}, settings=RUN)
    body = parts.RigidBody(mass=1e7, inertia=(1e9, 1e9, 1e9), position=at, points={"tip": (0, 1.0, 0)})
    system.add(body, "body")
    for name, part in extra.items():
        system.add(part, name)
    system.add(parts.JointSpring(a="ground", b="body", axis=(0, 0, 1), start=angle), "hinge")
    system.add(parts.Joint(a="ground", b="body", type="clamp", position=at, until=0.02), "hold")
    return system


def pinned(part: Part, *, angle: float = 1.0) -> System:
    pin = parts.Joint(a="ground", b="body", type="revolute", axis=(0, 0, 1), position=(0, 0, 0))
    return held({"pin": pin, "it": part}, angle=angle)


def bent(kind: Any) -> System:
    """A strip that is bent to an arc, with the body at its end."""
    angle = np.linspace(0.0, BEND, ELEMENTS + 1)
    x = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1) / BEND
    along = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    across = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    nodes = np.stack([x, along, across, np.tile([0.0, 0.0, 1.0], (angle.size, 1))], axis=1)
    material = elements.Material(young_modulus=1e9, density=1000.0, viscoelastic=QUICK)
    shape = {"length": 1.0, "elements": ELEMENTS, "section": elements.Circle(radius=0.005), "nodes": nodes.tolist()}
    strip = kind(**shape, material=material)
    clamp = parts.Joint(a="ground", b="it.root", type="clamp")
    weld = parts.Joint(a="it.tip", b="body", type="clamp")
    return held({"it": strip, "clamp": clamp, "weld": weld}, angle=BEND, at=tuple(x[-1]))


def bent_shell() -> System:
    """The same of a shell."""
    angle, width = np.repeat(np.linspace(0.0, BEND, ELEMENTS + 1), 2), np.tile([0.0, -0.05], ELEMENTS + 1)
    start = np.stack([np.sin(angle) / BEND, (1.0 - np.cos(angle)) / BEND, width], axis=1)
    normals = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0, viscoelastic=QUICK)
    strip = parts.Shell(
        size=(1.0, 0.05), elements=(ELEMENTS, 1), thickness=0.01, material=material, normal=(0, 1, 0), clamped=("x0",),
        start=start.tolist(), start_normals=normals.tolist(),
    )  # fmt: skip
    return held({"it": strip, "weld": parts.Seam(a="it.x1", b="body", type="clamp")}, angle=BEND, at=tuple(start[-2]))


def pulling(*, slack: bool) -> System:
    return pinned(
        parts.Spring(a=(2.0, 0, 0), b="body.tip", stiffness=3.0, length=1.0, slack=slack, viscoelastic=QUICK), angle=0.0
    )


TAPE = {"straight": [[-1.0, -20.0], [0.1, 2.0]], "folded": [[0.04, 0.3], [3.2, 0.3]]}
PARTS = {
    "a spring": lambda: pulling(slack=False),
    "a spring that only pulls": lambda: pulling(slack=True),
    "a tape-spring hinge": lambda: pinned(
        parts.Resistance(joint="hinge", type="tape-spring", viscoelastic=QUICK, **TAPE), angle=1.5
    ),
    "a rod": lambda: bent(parts.Rod),
    "a beam": lambda: bent(parts.Beam),
    "a shell": bent_shell,
}


@pytest.mark.parametrize("name", PARTS)
def test_a_part_that_is_held_drives_by_what_its_relaxation_leaves(name: str) -> None:
    """Of its share at once E(t) is left at each sample, and E_inf slowly. Elements of a beam vibrate a little."""
    system = PARTS[name]()
    start = 1.5 if "tape" in name else BEND if name in ("a rod", "a beam", "a shell") else 0.0
    lines = {"hinge": {"travel": (start, start - 0.01)}}
    found = system.margin(lines=lines)
    first, table = share(found["hinge"], "it")[0], found.motion("hinge")
    assert first > 0.01
    left = LEFT + SHARE * np.exp(-table.time / 0.02)
    assert table.time.size >= 3
    assert share(table, "it") / first == pytest.approx(left, rel=1e-5 if name == "a beam" else 1e-6)
    slow = system.margin(motion=False, lines=lines, pace="slow")["hinge"]
    assert share(slow, "it")[0] / first == pytest.approx(LEFT, rel=1e-6)


def test_a_tape_that_snaps_in_the_run_has_the_torque_of_the_run() -> None:
    settings = {"until": 6.0, "every": 0.05, "method": "energy-momentum"}
    sections: dict[str, Any] = {"store": {"time": 0.3}, "margin": {"zero": ZERO, "stations": 2}}
    system = System(sections=sections, settings=settings)
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Joint(a="ground", b="body", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    system.add(parts.JointSpring(joint="pin", start=1.5), "hinge")
    system.add(parts.Resistance(joint="hinge", type="tape-spring", viscoelastic=LAW, **TAPE), "it")
    system.add(parts.Joint(a="ground", b="body", type="clamp", position=(0, 0, 0), until=0.01), "hold")
    table = system.margin(lines={"hinge": {"travel": (1.5, -0.05)}}).motion("hinge")
    run = system.simulate()["it"]
    assert table.x[-1] < 0.04 < table.x[0]
    assert share(table, "it") == pytest.approx(run.torque.sel(time=table.time, method="nearest").values, abs=1e-12)
