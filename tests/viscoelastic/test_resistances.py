"""Viscoelastic harnesses and tape-spring hinges: a second implementation, held curves, snaps, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy

from evolvent import System, parts
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent_base.errors import InputError

Array = np.ndarray
PRONY = [(0.3, 0.5), (0.3, 5.0)]
#: A curve with no torque at 0, where its slope is 10 N m/rad.
CURVE = [(-1.0, -30.0), (-0.3, -3.0), (0.4, 4.0), (1.5, 60.0)]
STRAIGHT = [[-1.0, -20.0], [0.1, 2.0]]
FOLDED = [[0.04, 0.3], [3.2, 0.3]]
CURVES = {"straight": STRAIGHT, "folded": FOLDED}
HELD = 0.01
ZERO = ["friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]


def hinge(resistance: parts.Resistance, start: float, held: float | None = None, **content: Any) -> System:
    """A wheel of 1 kg m2 on a hinge, held at its angle until a time."""
    system = System(**content)
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0)), "body")
    system.add(parts.Joint(a="ground", b="body", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "pin")
    system.add(parts.JointSpring(joint="pin", start=start), "hinge")
    system.add(resistance, "it")
    if held is not None:
        system.add(parts.Joint(a="ground", b="body", type="clamp", position=(0, 0, 0), until=held), "hold")
    return system


def harness(**keys: Any) -> parts.Resistance:
    given = {"torque": CURVE, "viscoelastic": {"prony": PRONY}} | keys
    return parts.Resistance(joint="hinge", type="harness", **given)


def strain(x: float) -> tuple[float, float]:
    """sign(x) sqrt(2 U) of the curve, and its derivative."""
    place, torque = np.array(CURVE).T
    i = int(np.clip(np.searchsorted(place, x, side="right") - 1, 0, place.size - 2))
    slope = (torque[i + 1] - torque[i]) / (place[i + 1] - place[i])
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(place))])
    energy -= energy[1] - 0.5 * 10.0 * 0.3**2
    off = x - place[i]
    if i == 1:
        return math.sqrt(10.0) * x, math.sqrt(10.0)
    y = math.copysign(math.sqrt(2.0 * (energy[i] + off * (torque[i] + 0.5 * slope * off))), x)
    return y, (torque[i] + slope * off) / y


def integrated(start: float, until: float) -> float:
    """Angle by SciPy."""
    share, time = np.array(PRONY).T

    def rates(_: float, z: Any) -> list[float]:
        y, by_x = strain(z[0])
        return [z[1], -((1.0 - share.sum()) * y + share @ z[2:]) * by_x, *(by_x * z[1] - z[2:] / time)]

    y0, _ = strain(start)
    found = scipy.integrate.solve_ivp(rates, (0.0, until), [start, 0.0, y0, y0], rtol=1e-11, atol=1e-13, max_step=1e-3)
    return float(found.y[0, -1])


@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha", "energy-momentum"])
def test_a_wheel_on_a_harness_moves_as_in_a_second_implementation(method: str) -> None:
    exact = integrated(1.2, 1.0)

    def moved(**options: Any) -> tuple[float, Any]:
        run = hinge(harness(), 1.2).simulate(until=1.0, every=0.1, fine=False, method=method, **options)
        return abs(float(run["hinge"].angle.values[-1]) - exact), run

    if method == "dopri5":
        error, run = moved(tolerance=1e-9)
        assert error < 1e-6
    elif method == "rk4":
        error, run = moved(step=0.002)
        assert error < 1e-5
    else:
        (before, _), (error, run) = (moved(step=step, spectral_radius=1.0) for step in (0.01, 0.005))
        assert 3.5 < before / error < 4.5  # second order
    defect = np.abs(run.energy_defect.values).max()
    assert defect < {"rk4": 1e-3, "dopri5": 1e-5, "generalized-alpha": 1e-2, "energy-momentum": 1e-12}[method]
    assert np.all(np.diff(run.energy_dissipated.values) > 0.0)


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("start", [1.2, -0.7, 0.2])
def test_a_held_curve_relaxes_by_its_series(method: str, start: float) -> None:
    law = Viscoelastic(prony=PRONY)
    run = hinge(harness(), start, 9.0).simulate(until=2.0, every=0.5, fine=False, method=method, step=0.1)
    torque = run["it"].torque.values
    assert torque[0] == pytest.approx(np.interp(start, *np.array(CURVE).T), rel=1e-12)
    assert torque / torque[0] == pytest.approx(law.modulus(run.time.values), abs=1e-12)
    energy = run["it"].energy_elastic.values
    assert float(run.energy_dissipated.values[-1]) == pytest.approx(energy[0] - energy[-1], rel=1e-10)


def test_no_step_gains_energy_whatever_its_length() -> None:
    run = hinge(harness(), 1.2).simulate(
        until=12.0, every=0.4, fine=False, method="energy-momentum", step=0.4, spectral_radius=1.0
    )
    assert np.all(np.diff(run.energy_dissipated.values) >= -1e-12)
    assert np.abs(run.energy_defect.values).max() < 1e-10


def test_a_stored_tape_opens_slower_and_snaps_with_less() -> None:
    """Folded until all of the share 0.3 has relaxed, then released faster than it recovers; exact until the snap."""
    share, start = 0.3, 1.5
    law = {"prony": [(share, "1 day")]}
    tape = parts.Resistance(joint="hinge", type="tape-spring", straight=STRAIGHT, folded=FOLDED, viscoelastic=law)
    system = hinge(tape, start, HELD, sections={"store": {"time": "1 year"}})
    found = system.simulate(
        until=4.0, every=0.05, fine=False, method="energy-momentum", step=0.005, spectral_radius=1.0
    )
    own = found["it"]
    assert own.torque.values[0] == pytest.approx(0.3 * (1.0 - share), rel=1e-9)
    area = 0.5 * (0.8 + 2.0) * 0.06 - 0.3 * 0.06
    back = 0.5 * 20.0 * 0.04**2 - 0.5 * area  # energies at snap-back, folded and straight
    folded = np.sqrt(2.0 * (back + area + 0.3 * (np.array([start, 0.04]) - 0.04)))

    def speed(x: float) -> float:
        y = math.sqrt(2.0 * (back + area + 0.3 * (x - 0.04)))
        left = (1.0 - share) * (folded[0] ** 2 - y**2) - share * (folded[0] - y) ** 2
        return math.sqrt(left)

    time, _ = scipy.integrate.quad(lambda u: 2.0 * u / speed(start - u * u), 0.0, math.sqrt(start - 0.04))
    first = int(np.argmax(own.snap_work.values > 0.0))
    assert own.snap_time.values[-1] == pytest.approx(HELD + time, abs=1e-4)
    assert own.snap_work.values[first] == pytest.approx((1.0 - share) * 0.5 * area, rel=1e-4)
    assert np.abs(found.energy_defect.values).max() < 1e-11


def test_a_margin_after_storage_follows_the_tape_past_its_snap() -> None:
    """On the folded curve what is left of the moment; then that of the straight one, with the branches' strains."""
    share, start = 0.3, 1.5
    law = {"prony": [(share, "1 day")]}
    rows = {"straight": [[-0.1, -4.0], [0.1, 4.0]], "folded": [[0.04, 0.2], [3.0, 0.2]]}
    tape = parts.Resistance(joint="hinge", type="tape-spring", **rows, viscoelastic=law)
    sections = {"store": {"time": "1 year"}, "margin": {"zero": ZERO}}
    system = hinge(tape, start, 9.0, sections=sections)
    system.replace("hinge", parts.JointSpring(joint="pin", start=start, latch=-0.05, latch_stiffness=10.0))
    table = system.margin(motion=False, stations=5)["hinge"]
    values = dict(zip([one.label for one in table.shares], table.values, strict=True))["it"]
    energy = 0.5 * 40.0 * 0.04**2 + 0.5 * (0.5 * (1.6 + 4.0) * 0.06 - 0.2 * 0.06)  # folded, at its snap-back
    folded, snap = (math.sqrt(2.0 * (energy + 0.2 * off)) for off in (start - 0.04, 0.0))
    for x, value in zip(table.x, values, strict=True):
        if x > 0.04:
            y = math.sqrt(2.0 * (energy + 0.2 * (x - 0.04)))
            left = (1.0 - share) * y + share * (y - folded)
            assert value == pytest.approx(left * 0.2 / y, rel=1e-6)
        else:
            y, root = math.sqrt(40.0) * x, math.sqrt(40.0)
            left = (1.0 - share) * y + share * (snap - folded + y - root * 0.04)
            assert value == pytest.approx(left * root, rel=1e-6)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.15, 0.45])
def test_the_angle_that_a_stored_tape_keeps(share: float, sense: float) -> None:
    """It snaps straight where the strain that is kept is below that of the folded tape at its end."""
    start, law = 1.5, {"prony": [(share, "1 day")]}
    rows = {key: sorted([sense * x, sense * T] for x, T in table) for key, table in CURVES.items()}
    tape = parts.Resistance(joint="hinge", type="tape-spring", viscoelastic=law, **rows)
    system = hinge(tape, sense * start, 9.0, sections={"store": {"time": "1 year"}})
    ((part, words, kept, unit),) = system.storage(motion=False).sets
    energy = 0.5 * 20.0 * 0.04**2 + 0.5 * (0.5 * (0.8 + 2.0) * 0.06 - 0.3 * 0.06)  # folded, at its snap-back
    folded, end = (math.sqrt(2.0 * (energy + 0.3 * (x - 0.04))) for x in (start, 0.04))
    straight, strain_kept = math.sqrt(20.0) * 0.04, share * folded
    if strain_kept > end:
        exact = 0.04 + (0.5 * strain_kept**2 - energy) / 0.3
    else:
        exact = (strain_kept + share * (straight - end)) / math.sqrt(20.0)
        assert exact < 0.1
    assert (strain_kept > end) == (share > 0.3)
    assert (part, words, unit) == ("it", "angle beyond that of no torque", "deg")
    assert kept == pytest.approx(sense * math.degrees(exact), rel=1e-9)


def test_the_angle_that_a_stored_harness_keeps() -> None:
    """That at which its strain is the share of that at which it was held, by the root of the curve's energy."""
    share, start = 0.4, 1.2
    system = hinge(
        harness(viscoelastic={"prony": [(share, "1 day")]}), start, 9.0, sections={"store": {"time": "1 year"}}
    )
    ((*_, kept, _),) = system.storage(motion=False).sets
    exact = scipy.optimize.brentq(lambda x: strain(x)[0] - share * strain(start)[0], 0.0, start, xtol=1e-13)
    assert kept == pytest.approx(math.degrees(exact), rel=1e-9)


def test_curves_that_cannot_relax_are_refused() -> None:
    for resistance, sentence in (
        (harness(torque=[(-1.0, -2.0), (0.0, 0.0), (1.0, 1.0)]), r"it\.torque has no torque at 0, where its slope"),
        (harness(torque=[(0.0, 1.0), (1.0, 1.0)]), r"it\.torque goes on straight below its rows"),
        (harness(torque=None, bristles=[(4.0, 0.02)]), r"it\.viscoelastic has no effect: its elastic curve is 0"),
    ):
        with pytest.raises(InputError, match=sentence):
            hinge(resistance, 0.2).assemble()
