"""Three panels that cables hold together: against a plane chain of four bodies, and the guide's file and program."""

from __future__ import annotations

import math
import pathlib
import re
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent as ev
from book import Book
from evolvent import parts
from structures import test_solar_array as chain

PAGE = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "array-and-tether.md").read_text(encoding="utf-8")
(FILE,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
RATIOS, STIFFNESS, DAMPING = np.array([2.0, -1.0, 1.0]), 20.0, 2.0
LATCH = (200.0, 10.0)


def reference(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the hinges at the times (nt, 3), and when each of them latches (3,): the built-in array with cables.

    Hinge k of angle x_k turns against sum of the loops' torques, ratio times what the loops on both sides of it hold.
    """
    locked, caught = np.zeros(3, dtype=bool), np.full(3, np.nan)
    start = np.array([0.5, -1.0, 1.0]) * math.pi
    y = np.zeros(12)
    y[2:6] = 0.0, *np.cumsum(start)
    sides = np.sign(start)

    def f(_: float, y: np.ndarray) -> np.ndarray:
        angles, rates = np.diff(y[2:6]), np.diff(y[8:])
        torques = chain.STIFFNESS * (angles - chain.REST) + chain.DAMPING * rates
        torques += np.where(locked, LATCH[0] * angles + LATCH[1] * rates, 0.0)
        loops = STIFFNESS * np.diff(RATIOS * (angles - start)) + DAMPING * np.diff(RATIOS * rates)
        torques[1:] += RATIOS[1:] * loops
        torques[:-1] -= RATIOS[:-1] * loops
        return np.concatenate([y[6:], chain.acceleration(y[2:6], y[8:], torques)])

    def catch(k: int) -> object:
        def event(_: float, y: np.ndarray) -> float:
            return 1.0 if locked[k] else float(sides[k] * np.diff(y[2:6])[k])

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0  # type: ignore[attr-defined]
        return event

    t, found = 0.0, np.zeros((times.size, 3))
    while t < times[-1]:
        events = [catch(k) for k in range(3)]
        part = solve_ivp(f, (t, times[-1]), y, "DOP853", rtol=1e-9, atol=1e-11, events=events, dense_output=True)
        here = (times >= t) & (times <= part.t[-1])
        if np.any(here):
            found[here] = np.diff(part.sol(times[here])[2:6], axis=0).T
        t, y = part.t[-1], part.y[:, -1]
        for k, when in enumerate(part.t_events):
            if when.size:
                locked[k], caught[k] = True, when[-1]
    return found, caught


def synchronized() -> ev.System:
    """The built-in solar array with cables from hinge to hinge, and softer latches."""
    given, system = ev.load("solar-array"), ev.System()
    for name, part in given.parts.items():
        if isinstance(part, parts.JointSpring):
            part = part.replaced(latch_stiffness=LATCH[0], latch_damping=LATCH[1])
        system.add(part, name)
    hinges = ["hinge 1", "hinge 2", "hinge 3"]
    cables = parts.Joint(
        type="synchronization", joints=hinges, ratios=tuple(RATIOS), stiffness=STIFFNESS, damping=DAMPING
    )
    system.add(cables, "cables")
    return system


@pytest.mark.slow
def test_synchronized_array(book: Book) -> None:
    """Latches in their order, angles up to the first of them, momenta, and the energies of all parts."""
    run = synchronized().simulate(until=14.0, every=0.1)
    times = run.time.values
    wanted, caught = reference(times)
    assert np.all(np.isfinite(caught))
    found = np.stack([run[f"hinge {k}"].angle.values for k in (1, 2, 3)], axis=1)
    latched = np.array([run[f"hinge {k}"].latch_time.values[-1] for k in (1, 2, 3)])
    assert np.argsort(latched).tolist() == np.argsort(caught).tolist()
    names = re.findall(r"'(hinge \d)' at t", run.attrs["latches"])
    assert names == [f"hinge {k + 1}" for k in np.argsort(caught)]
    book(
        "Rigid bodies", "Three panels held together by cables: times of the latches",
        reference="a plane chain of four bodies", source="Kane's equations, SciPy DOP853",
        error=np.abs(latched / caught - 1.0).max(), allowed=1e-3,
    )  # fmt: skip
    opening = times < caught.min()
    book(
        "Rigid bodies", "Three panels held together by cables: hinges until the first latch",
        reference="a plane chain of four bodies", source="Kane's equations, SciPy DOP853",
        error=np.abs(found - wanted)[opening].max(), allowed=2e-3, unit="rad",
    )  # fmt: skip
    # the cables keep the hinges in step while they open
    assert np.abs(np.diff(RATIOS * (found - found[0]), axis=1))[opening].max() < 0.05
    assert np.abs(run.momentum.values).max() < 1e-9
    scale = float(run.energy.values[0])
    assert np.abs(run.energy_defect.values).max() < 2e-3 * scale
    taken = sum(float(run[f"hinge {k}"][key].values[-1]) for k in (1, 2, 3) for key in ("damper_work", "latch_work"))
    taken += float(run["cables"].damper_work.values[-1])
    assert taken == pytest.approx(float(run.energy_dissipated.values[-1]), rel=2e-3)


def test_the_guide(tmp_path: Any) -> None:
    """File and program are one system; its run latches in the order that the guide states, and its balance closes."""
    (tmp_path / "array.yaml").write_text(FILE)
    system = ev.load(tmp_path / "array.yaml")
    programs = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
    program = next(text for text in programs if "synchronization" in text).split("opening =")[0]
    names: dict[str, Any] = {}
    exec(programs[0].split("run =")[0] + program, names)
    assert system.parts == names["together"].parts
    run = ev.run(tmp_path / "array.yaml")
    assert re.findall(r"'(hinge \d)'", run.attrs["latches"]) == ["hinge 3", "hinge 2", "hinge 1"]
    angles = np.stack([run[f"hinge {k}"].angle.values for k in (1, 2, 3)], axis=1)
    np.testing.assert_allclose(angles[0], np.array([0.5, -1.0, 1.0]) * math.pi, atol=1e-12)
    assert np.abs(np.diff(angles, axis=0)).max() < 0.1  # no jump of a turn from half a turn on
    assert np.abs(angles[-1]).max() < 0.01
    assert np.abs(run.energy_defect.values).max() < 2e-3 * float(run.energy.values[0])
    assert float(run["brake"].work.values[-1]) < -0.1
