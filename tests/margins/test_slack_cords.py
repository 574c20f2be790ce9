"""Points on cords that only pull beside hinges: slack without a share, taut with that of the least energy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate, optimize
from scipy.spatial.transform import Rotation

from evolvent import System, parts
from margin_cases import NONE

#: Radius of the hinges, length of the arms, stiffness and length of the cords, m and N/m.
INNER, ARM, STIFFNESS, LENGTH = 0.2, 1.0, 50.0, 1.1
#: Fold of the arms at the start, and that from which on the cords are taut.
FOLD, TAUT = 1.2, math.acos((LENGTH - INNER) / ARM)
ASKED = {"motion": False, "zero": NONE, "others": "together", "stations": 13}


def star(arms: int = 3, cord: float = LENGTH) -> System:
    """Arms that springs open until they lie in a plane, with a point between their tips on a cord to each."""
    system = System()
    system.add(parts.Point(mass=0.01, position=(0.0, 0.0, 0.3)), "knot")
    for n in range(arms):
        turn = 2.0 * math.pi * n / arms
        out, across = (math.cos(turn), math.sin(turn), 0.0), (-math.sin(turn), math.cos(turn), 0.0)
        along = [math.cos(FOLD) * x for x in out[:2]] + [math.sin(FOLD)]
        root = np.array([INNER * x for x in out])
        middle = root + 0.5 * ARM * np.array(along)
        turned = Rotation.from_matrix(np.array([along, across, np.cross(along, across)]).T).as_quat()
        orientation = (turned[3], *turned[:3])
        arm = parts.RigidBody(mass=0.5, inertia=(0.01, 0.04, 0.04), position=tuple(middle), orientation=orientation)
        system.add(arm, f"arm {n}")
        hinge = parts.Joint(a=tuple(root), b=[f"arm {n}", (-0.5 * ARM, 0.0, 0.0)], type="revolute", axis=across)
        system.add(hinge, f"hinge {n}")
        spring = {"start": -FOLD, "rest": 2.0, "stiffness": 5.0, "latch": 0.0, "latch_stiffness": 1e4}
        system.add(parts.JointSpring(joint=f"hinge {n}", **spring), f"spring {n}")
        ends = {"a": "knot", "b": [f"arm {n}", (0.5 * ARM, 0.0, 0.0)]}
        system.add(parts.Spring(**ends, length=cord, stiffness=STIFFNESS, slack=True), f"cord {n}")
    return system


def cords(table: Any) -> np.ndarray:
    """What all cords give."""
    return np.asarray(sum(v for one, v in zip(table.shares, table.values, strict=True) if one.part.startswith("cord")))


def by_hand(x: np.ndarray) -> np.ndarray:
    """Share of the cords in the hinge of an arm of a star, N m: their tension times its lever."""
    return np.asarray(STIFFNESS * np.maximum(INNER + ARM * np.cos(x) - LENGTH, 0.0) * ARM * np.sin(x))


@pytest.mark.parametrize("arms", [2, 3])
def test_cords_between_arms_that_open(arms: int) -> None:
    """Exactly no share while the cords are slack; then their tension times the lever of the arm."""
    found = star(arms).margin(**ASKED)
    table = found["spring 0"]
    (last,) = table.slack
    own = cords(table)
    assert np.all(own[: last + 1] == 0.0)
    assert np.all(own[last + 1 : -1] < 0.0)
    assert own == pytest.approx(by_hand(table.x), abs=1e-9)
    assert table.x[last] == pytest.approx(-TAUT, abs=FOLD / 12 / 4000)
    assert table.x[last] <= -TAUT
    share = next(one for one in table.shares if one.label == "cord 0")
    assert share.category == "spring"
    assert table.required("motorization") == pytest.approx(-2.4 * own, abs=1e-9)
    assert any("all slack" in note for note in found.notes())
    for n in range(1, arms):
        assert cords(found[f"spring {n}"]) == pytest.approx(own, abs=1e-9)


def test_their_work_is_their_energy() -> None:
    """The work of all hinges from where the cords are taut, by Simpson's rule, is the energy of the cords."""
    found = star().margin(**ASKED)
    table = found["spring 0"]
    last = table.slack[0]
    work = -3.0 * integrate.simpson(cords(table)[last:], x=table.x[last:])
    assert work == pytest.approx(1.5 * STIFFNESS * (INNER + ARM - LENGTH) ** 2, rel=1e-3)


def test_one_arm_alone_turns_against_the_others() -> None:
    """The least energy of three cords where two ends stay: by a search of its own."""
    found = star(cord=0.9).margin(**ASKED | {"others": "start"})
    table = found["spring 0"]

    def tip(n: int, x: float) -> np.ndarray:
        turn, r = 2.0 * math.pi * n / 3, INNER + ARM * math.cos(x)
        return np.array([r * math.cos(turn), r * math.sin(turn), -ARM * math.sin(x)])

    def energy(knot: np.ndarray, x: float) -> float:
        far = [np.linalg.norm(tip(n, x if n == 0 else -FOLD) - knot) - 0.9 for n in range(3)]
        return float(0.5 * STIFFNESS * sum(max(one, 0.0) ** 2 for one in far))

    def least(x: float) -> float:
        place = optimize.minimize(
            energy, np.mean([tip(n, x) for n in range(3)], axis=0), args=(x,), method="BFGS", tol=1e-12
        )
        return float(place.fun)

    own, h = cords(table), 1e-4
    for n in (2, 12):
        slope = (least(table.x[n] + h) - least(table.x[n] - h)) / (2.0 * h)
        assert own[n] == pytest.approx(-slope, rel=1e-5, abs=1e-9)


def test_beside_what_flies_free() -> None:
    """A body that nothing holds has no part in it."""
    system = star()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), position=(5.0, 0.0, 0.0)), "stray")
    table = system.margin(**ASKED | {"stations": 3})["spring 0"]
    assert cords(table) == pytest.approx(by_hand(table.x), abs=1e-9)
