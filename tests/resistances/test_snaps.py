"""Tape-spring hinges and adhesions: motions in closed form across their changes, energies lost there, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, System, parts
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from resistances.rigs import IMPLICIT, INERTIA, run, seen, turned, wheel

Array = np.ndarray
STRAIGHT = [[-1.0, -20.0], [0.1, 2.0]]
FOLDED = [[0.04, 0.3], [3.2, 0.3]]
#: Moments of the straight tape less those of the folded one, from snap-back to buckling.
AREA = 0.5 * (0.8 + 2.0) * 0.06 - 0.3 * 0.06


def tape(**keys: Any) -> parts.Resistance:
    return parts.Resistance(joint="hinge", type="tape-spring", **({"straight": STRAIGHT, "folded": FOLDED} | keys))


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_cycle_takes_the_area_between_the_curves(book: Book, method: str) -> None:
    """A drive folds the tape and opens it again: two snaps a cycle."""
    found = run(turned(tape(), 0.5), np.linspace(0.0, 3.0, 61), method, step=1e-3)
    own = seen(found, "it")
    assert own["snaps"][-1] == 6.0
    book(
        "Rigid bodies", f"Tape-spring hinge folded and opened by a drive ({method}): energy lost in a cycle",
        reference=f"{AREA:.9f} J", source="area between the moment-angle curves",
        error=np.abs(np.diff(own["snap_work"][::20]) - AREA).max() / AREA, allowed=1e-7,
    )  # fmt: skip
    assert own["snap_time"][-1] == pytest.approx(2.5 - math.asin(0.08) / (2.0 * math.pi), abs=1e-8)
    assert found.balance.by_friction == pytest.approx(own["snap_work"], abs=1e-14)
    assert np.abs(found.energy_defect).max() < {"alpha": 1e-4, "energy": 1e-6}[method]
    x, folded = own["angle"], own["state"] == 1.0
    assert own["torque"][folded] == pytest.approx(0.3)
    assert own["torque"][~folded] == pytest.approx(20.0 * x[~folded], abs=1e-9)


@pytest.mark.parametrize("step", [0.04, 0.011])
def test_a_folded_panel_opens_and_snaps(step: float) -> None:
    """It swings under a constant moment, then about the straight tape; what it loses is half of the area."""
    found = run(wheel(tape(), start=1.5), np.linspace(0.0, 2.5, 6), "energy", step=step)
    own = seen(found, "it")
    assert np.abs(found.energy_defect).max() < 1e-12
    assert own["snap_work"][-1] == pytest.approx(0.5 * AREA * own["snaps"][-1], abs=1e-9)
    assert own["snap_time"][0] > math.sqrt(2.0 * INERTIA * 1.46 / 0.3) - 1e-9
    assert own["snaps"][-1] >= 1.0


def test_both_ways() -> None:
    """A tape that folds either way, with other moments one way."""
    found = run(turned(tape(opposite=[[-3.0, -0.4], [-0.02, -0.4]], straight=[[-0.05, -1.0], [0.1, 2.0]]), 0.5),
                np.linspace(0.0, 1.0, 41), "energy")  # fmt: skip
    own = seen(found, "it")
    assert own["snaps"][-1] == 4.0
    other = 0.5 * (0.4 + 1.0) * 0.03 - 0.4 * 0.03
    assert own["snap_work"][-1] == pytest.approx(AREA + other, rel=1e-7)
    assert own["torque"][own["state"] == 2.0] == pytest.approx(-0.4)


def test_mirrored() -> None:
    """A tape that folds towards smaller angles loses the same."""
    mirrored = {
        key: [[-x, -M] for x, M in reversed(rows)] for key, rows in (("straight", STRAIGHT), ("folded", FOLDED))
    }
    found = run(turned(tape(**mirrored), 0.5), [0.0, 1.0], "energy")
    assert seen(found, "it")["snap_work"][-1] == pytest.approx(AREA, rel=1e-7)


def test_modes_of_either_state() -> None:
    """The stiffness is that of the present curve."""
    found = modes(wheel(tape(state="straight"), start=0.05).assemble(), count=1).pole
    assert np.abs(found) == pytest.approx([math.sqrt(20.0 / INERTIA)], rel=1e-6)
    found = modes(wheel(tape(), start=0.6, stiffness=1.0, rest=0.9).assemble(), count=1).pole
    assert np.abs(found) == pytest.approx([math.sqrt(1.0 / INERTIA)], rel=1e-6)


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("distance", [None, 2e-3])
def test_an_adhesion_breaks_at_its_torque(book: Book, method: str, distance: float | None) -> None:
    """Under a torque that grows by 2 N m/s the joint starts as it reaches that of the adhesion, 0.7 N m."""
    it = parts.Resistance(
        joint="hinge", type="adhesion", strength=0.7, **({} if distance is None else {"distance": distance})
    )
    system = wheel(it)
    system.add(parts.Motor(joint="hinge", torque=[[0.0, 0.0], [1.0, 2.0]]), "motor")
    found = run(system, np.linspace(0.0, 0.8, 17), method)
    own = seen(found, "it")
    way = 1e-4 if distance is None else distance
    # its torque is 2 (t - sin(w t)/w), w that of the wheel on the stiffness 0.7/way
    w = math.sqrt(0.7 / way / INERTIA)
    times = np.linspace(0.0, 0.5, 200_001)
    breaks = float(times[np.argmax(2.0 * (times - np.sin(w * times) / w) >= 0.7)])
    assert abs(breaks - 0.35) < 1.0 / w
    book(
        "Rigid bodies",
        f"Adhesion that gives way by {way:g} rad under a growing torque ({method}): time at which it breaks",
        reference=f"{breaks:.5f} s", source="closed form of the wheel on it",
        error=abs(own["release_time"][-1] - breaks) / breaks, allowed=5e-4,
    )  # fmt: skip
    assert own["adhesion_work"][-1] == pytest.approx(0.35 * way, rel=1e-6)
    assert own["released"][[0, 6, 8, -1]].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert own["torque"][-1] == 0.0
    assert own["angle"][6] < way
    rate = seen(found, "hinge")["rate"][-1]
    exact = 2.0 * way / 0.7 * (1.0 - math.cos(w * breaks)) + (0.8**2 - breaks**2) / INERTIA
    assert rate == pytest.approx(exact, rel=2e-3)
    assert np.abs(found.energy_defect).max() < 1e-4


def test_an_adhesion_of_a_slide_that_is_strong_enough_holds() -> None:
    """A point hangs on it."""
    system = System(gravity=(9.0, 0.0, 0.0))
    system.add(parts.Point(mass=2.0), "mass")
    system.add(parts.JointSpring(a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation"), "slide")
    system.add(parts.Resistance(joint="slide", type="adhesion", strength="40 N"), "it")
    own = seen(run(system, np.linspace(0.0, 0.2, 5), "energy"), "it")
    assert own["released"][-1] == 0.0
    assert own["travel"].max() < 1e-5


def test_equilibria() -> None:
    """A tape and an adhesion hold what they can; a load beyond that has no equilibrium as they are."""
    system = wheel(tape(), stiffness=1.0, rest=0.5)
    found = solve_static(system.assemble())
    assert found.success
    assert seen(found, "it")["angle"][-1] == pytest.approx(0.5 / 21.0)
    for load, holds in ((0.69, True), (0.71, False)):
        system = wheel(parts.Resistance(joint="hinge", type="adhesion", strength=0.7))
        system.add(parts.Motor(joint="hinge", torque={"constant": load}), "motor")
        found = solve_static(system.assemble())
        assert found.success == holds
        assert holds or "'it' has no equilibrium as it is" in found.message


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"folded": [[0.2, 0.3], [3.0, 0.3]]}, r"it\.folded goes from 0\.2 to 3; it must start within it\.straight"),
    ({"folded": [[0.04, 3.0], [3.0, 3.0]]}, r"it\.folded and it\.straight give .* J a cycle"),
    ({"opposite": [[0.0, 0.2], [3.0, 0.2]]}, r"it\.opposite goes from 0 to 3; .*, and end below it"),
    ({"state": "folded"}, r"it\.state is 'folded', but at 0 the tape is straight"),
    ({"straight": [[0, 0], ["1 m", "1 N m"]]}, r"it\.straight"),
]


@pytest.mark.parametrize(("keys", "sentence"), REFUSED)
def test_refusals(keys: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        wheel(tape(**keys)).assemble()


def test_a_start_that_may_be_either() -> None:
    with pytest.raises(InputError, match=r"it\.state is missing: at 0\.05 the tape may be straight or folded"):
        wheel(tape(), start=0.05).assemble()
