"""A compound pendulum: the closed form, its uncertainty, the correction of the amplitude, refusals."""

from __future__ import annotations

import os
import pathlib

import numpy as np
import pytest
import scipy.integrate
import yaml

import evolvent
from evolvent import InputError, parts
from evolvent_massprops import mass_properties
from massprops import rig

EXAMPLE = rig.EXAMPLES / "compound.yaml"
G, MASS, DISTANCE, OWN = 9.80665, 12.4, 0.412, 0.9


def described(**changes: object) -> dict[str, object]:
    """A description of a small swing without anything that swings along."""
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    del content["tare"]
    content["stand"] |= changes
    return content


def swing(path: pathlib.Path, w: float, *, noise: float = 1e-4) -> str:
    """A recording of the angle, rad, at 100 Hz, of a slowly decaying swing whose rate is w where it is small."""
    t = np.arange(2000) / 100.0
    motion = scipy.integrate.solve_ivp(
        lambda _, y: [y[1], -(w**2) * np.sin(y[0]) - 0.004 * y[1]],
        (0.0, t[-1]), [0.07, 0.0], t_eval=t, rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    x = motion.y[0] + noise * np.random.default_rng(4).standard_normal(t.size)
    path.write_text("angle\n" + "\n".join(f"{v:.8f}" for v in x))
    return str(path)


def small() -> float:
    """Frequency of a small swing, rad/s."""
    return float(np.sqrt(MASS * G * DISTANCE / (OWN + MASS * DISTANCE**2)))


def test_closed_form_and_uncertainty(tmp_path: pathlib.Path, book) -> None:
    """I = m g d T^2 / 4 pi^2 - m d^2; every input counts by its derivative (GUM)."""
    w = small()
    found = mass_properties(swing(tmp_path / "a.csv", w), described(), {"signals.clock": "1 +- 1e-4"})
    assert [o.key for o in found.outputs] == ["I", "I_own"]
    assert found["I_own"] == pytest.approx(OWN, abs=4.0 * found.std[1])
    assert found["I"] == pytest.approx(OWN + MASS * DISTANCE**2, abs=4.0 * found.std[0])
    share = {s.label: s.contribution for s in found.shares}
    pivot = OWN + MASS * DISTANCE**2
    assert share["stand.distance"][1] == pytest.approx((pivot / DISTANCE - 2.0 * MASS * DISTANCE) * 2e-4, rel=1e-3)
    assert share["body.mass"] == pytest.approx(np.array([pivot, OWN]) / MASS * 2e-3, rel=1e-3)
    assert share["signals.clock"] == pytest.approx(2e-4 * pivot, rel=1e-3)
    drawn = mass_properties(
        tmp_path / "a.csv", described(), {"uncertainty.method": "monte-carlo", "uncertainty.draws": 20000}
    )
    assert drawn.std[1] == pytest.approx(np.sqrt(found.std[1] ** 2 - share["signals.clock"][1] ** 2), rel=0.05)
    period = 2.0 * np.pi / w
    closed = MASS * G * DISTANCE * period**2 / (4.0 * np.pi**2) - MASS * DISTANCE**2
    book(
        "Inertia stand and identification", "Compound pendulum: moment about the centre of mass",
        reference="m g d T^2/4 pi^2 - m d^2", source="closed form",
        error=abs(found["I_own"] / closed - 1.0), allowed=float(f"{5.0 * found.std[1] / OWN:.2g}"),
    )  # fmt: skip


def test_what_swings_along_is_taken_off(tmp_path: pathlib.Path) -> None:
    clamp, radius, about = 0.35, 0.03, 4e-4
    moment = OWN + MASS * DISTANCE**2 + about + clamp * radius**2
    w = float(np.sqrt(G * (MASS * DISTANCE + clamp * radius) / moment))
    found = mass_properties(swing(tmp_path / "a.csv", w), EXAMPLE)
    assert found["I_own"] == pytest.approx(OWN, abs=4.0 * found.std[1])


def test_a_simulated_swing_of_60_degrees(tmp_path: pathlib.Path, book) -> None:
    """A rigid body on a hinge, released at 60 degrees: the moment follows without the amplitude."""
    angle = np.radians(60.0)
    system = evolvent.System(gravity=(0.0, -G, 0.0))
    turn = [np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]
    place = DISTANCE * np.array([np.sin(angle), -np.cos(angle), 0.0])
    system.add(parts.RigidBody(mass=MASS, inertia=(0.5, 1.0, OWN), position=place, orientation=turn), "lid")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="lid", type="revolute", axis=(0.0, 0.0, 1.0)), "edge")
    run = system.simulate(until=12.0, every=0.01, method="generalized-alpha", step=2e-3)
    q = run["lid"].attitude.values
    read = 2.0 * np.arctan2(q[:, 3], q[:, 0]) + 1e-5 * np.random.default_rng(4).standard_normal(len(q))
    path = tmp_path / "swing.csv"
    path.write_text("angle\n" + "\n".join(f"{v:.9f}" for v in read))
    found = mass_properties(path, described())
    assert found["I_own"] == pytest.approx(OWN, rel=1e-4)
    book(
        "Inertia stand and identification", "Compound pendulum, simulated swing of 60 degrees: moment",
        reference="put in", source="there and back", error=abs(found["I_own"] / OWN - 1.0), allowed=1e-4,
    )  # fmt: skip
    small = mass_properties(path, described(amplitude="0 deg"))
    assert small["I_own"] == found["I_own"]
    assert any("stand.amplitude is 0 deg, but the signals show" in text for text in small.warnings)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"stand.distance": None}, "stand.distance is missing"),
        ({"body": {}}, "body.mass is missing"),
        ({"stand.distance": "0.9 m"}, "stand.distance is 0.9 m, but the body swings at .* a point mass there has 3.3"),
        ({"stand.radius": "1 m"}, "unknown key 'stand.radius'"),
        ({"body.offset": "1 mm"}, "unknown key 'body.offset'"),
        ({"stand.amplitude": "200 deg"}, "stand.amplitude is "),
        ({"tare": [{"inertia": "5 kg m^2"}]}, "which no body has; check masses, stand.distance and the tare"),
        ({"stand.kind": "compund"}, "stand.kind is 'compund'; did you mean 'compound'"),
    ],
)
def test_refusals(tmp_path: pathlib.Path, changes: dict[str, object], said: str) -> None:
    path, content = swing(tmp_path / "a.csv", small()), described()
    if changes == {"stand.distance": None}:
        del content["stand"]["distance"]  # type: ignore[attr-defined]
        changes = {}
    with pytest.raises(InputError, match=said) as error:
        mass_properties(path, content, changes)
    assert os.linesep not in str(error.value)
