"""Profiles: values of each kind against NumPy, jumps, breaks, round trips, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from evolvent import InputError, System, parts
from evolvent.kernels.loads import PROFILE
from evolvent.kernels.profile import profile

Array = np.ndarray
ROWS = [(0.5, 0.0), (1.0, 0.2), (2.5, 0.2), (4.0, -0.3)]
TIMES = np.linspace(-1.0, 6.0, 701)


def torque(given: Any) -> System:
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=2.0), "hub")
    system.add(parts.Load(at="hub", axis=(0, 0, 2.0), profile=given), "slew")
    return system


def values(given: Any, times: Array = TIMES) -> Array:
    """A profile's values as solvers see them."""
    model = torque(given).assemble().model
    at = int(model.loads["first"][0]) + PROFILE
    return np.array([profile(float(t), at, model) for t in times])


def smooth_step(s: Array) -> Array:
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def pulse(t: Array) -> Array:
    return np.where((t >= 1.0) & (t < 3.0), 0.4, 0.0)


def table(t: Array) -> Array:
    return np.interp(t, *np.array(ROWS).T)


def cubic(t: Array) -> Array:
    return PchipInterpolator(*np.array(ROWS).T)(np.clip(t, 0.5, 4.0))


#: Profiles, their values, and the times of their corners.
KINDS = {
    "table": (ROWS, table, [0.5, 1.0, 2.5, 4.0]),
    "array": (np.array(ROWS), table, [0.5, 1.0, 2.5, 4.0]),
    "smooth": ({"table": ROWS, "smooth": True}, cubic, [0.5, 1.0, 2.5, 4.0]),
    "jump": ([(0, 1), (2, 1), (2, -1), (3, 0)], lambda t: np.where(t < 2.0, 1.0, np.minimum(t - 3.0, 0.0)), [2.0, 3.0]),
    "ramp": (
        {"ramp": {"initial": 0.1, "final": -0.4, "start": "1 s", "duration": "2 s"}},
        lambda t: 0.1 - 0.5 * smooth_step((t - 1.0) / 2.0),
        [1.0, 3.0],
    ),
    "sine": (
        {
            "sine": {
                "amplitude": 0.2,
                "frequency": "0.25 Hz",
                "phase": "30 deg",
                "offset": 0.1,
                "start": 1.0,
                "until": 4.0,
            }
        },
        lambda t: np.where((t >= 1.0) & (t < 4.0), 0.1 + 0.2 * np.sin(0.5 * math.pi * (t - 1.0) + math.pi / 6.0), 0.0),
        [1.0, 4.0],
    ),
    "endless sine": (
        {"sine": {"amplitude": 0.2, "frequency": 0.25}},
        lambda t: np.where(t >= 0.0, 0.2 * np.sin(0.5 * math.pi * t), 0.0),
        [],
    ),
    "pulse": ({"pulse": {"value": 0.4, "start": 1.0, "duration": 2.0}}, pulse, [1.0, 3.0]),
    "smooth pulse": (
        {"pulse": {"value": 0.4, "start": 1.0, "duration": 2.0, "rise": 0.5}},
        lambda t: 0.4 * (smooth_step((t - 1.0) / 0.5) - smooth_step((t - 2.5) / 0.5)),
        [1.0, 1.5, 2.5, 3.0],
    ),
    "bump": (
        {"pulse": {"value": 0.4, "start": 1.0, "duration": 1.0, "rise": 0.5}},
        lambda t: 0.4 * (smooth_step((t - 1.0) / 0.5) - smooth_step((t - 1.5) / 0.5)),
        [1.0, 1.5, 2.0],
    ),
    "constant": ({"constant": "30 mN m"}, lambda t: np.full(t.shape, 0.03), []),
    "expression": (
        {"expression": "a*sin(2*pi*t/4) + where(t < 2, 0, 1)", "constants": {"a": 0.2}},
        lambda t: 0.2 * np.sin(0.5 * math.pi * t) + np.where(t < 2.0, 0.0, 1.0),
        [2.0],
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_values(kind: str) -> None:
    given, exact, _ = KINDS[kind]
    assert values(given) == pytest.approx(exact(TIMES), abs=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_corners_are_breaks(kind: str) -> None:
    given, _, corners = KINDS[kind]
    assert torque(given).assemble().model.breaks.tolist() == corners


@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(kind: str) -> None:
    part = parts.Load(at="hub", axis=(0, 0, 1), profile=KINDS[kind][0])
    written = part.model_dump(mode="json", exclude_defaults=True)
    assert parts.Load.model_validate(written) == part
    assert parts.Load(**part.model_dump(mode="json")) == part


def test_units_of_a_table_stand_in_its_last_row() -> None:
    part = parts.Load(at="hub", axis=(0, 0, 1), profile=[[0, 0], [1, 200], ["2 min", "100 mN m"]])
    assert part.profile is not None
    assert part.profile.table == ((0.0, 0.0), (60.0, pytest.approx(0.2)), (120.0, pytest.approx(0.1)))


REFUSED: dict[str, tuple[Any, str]] = {
    "nothing": ({}, r"slew\.profile is empty; it must have one of table, ramp, sine, pulse, constant, expression"),
    "two": ({"constant": 1, "table": ROWS}, "slew.profile has the keys table, constant; it must have one of"),
    "unknown": ({"rmap": {}}, "unknown key 'Load.profile.rmap'; did you mean 'Load.profile.ramp'"),
    "inner": (
        {"ramp": {"final": 1, "duraton": 1}},
        "unknown key 'Load.profile.ramp.duraton'; did you mean 'Load.profile.ramp.duration'",
    ),
    "missing": ({"ramp": {"final": 1}}, r"Load\.profile\.ramp\.duration is missing; it must be a time above 0"),
    "number": (3, "Load.profile is 3; it must be rows"),
    "text": ("sin(t)", "Load.profile is 'sin\\(t\\)'; it must be rows"),
    "unit": ([(0, 0), (1, "3 m")], "Load.profile.table.* must be a force or a torque or a force per length"),
    "unit of a force": ([(0, 0), (1, "3 N")], "slew.profile.table has the unit N; it must be in N m"),
    "one row": ([(0, 0)], "Load.profile.table is .* two or more rows"),
    "row": ([(0, 0), (1, 2, 3)], "Load.profile.table is .* every row of it must have two values"),
    "not finite": ([(0, 0), (1, math.nan)], r"Load\.profile\.table\.1\.1 is nan"),
    "order": ([(0, 0), (2, 1), (1, 0)], r"slew\.profile\.table: row 3 is at 1\.0 s, not after the row before"),
    "three times": ([(0, 0), (1, 1), (1, 2), (1, 3)], r"slew\.profile\.table: row 4 is at 1\.0 s"),
    "jump": ({"table": [(0, 0), (1, 1), (1, 2)], "smooth": True}, r"slew\.profile\.table: row 3 is at 1\.0 s"),
    "one time": ([(1, 0), (1, 1)], r"all its rows are at 1\.0 s"),
    "smooth": ({"constant": 1, "smooth": True}, "slew.profile.smooth goes with table, not with constant"),
    "constants": ({"constant": 1, "constants": {"a": 1}}, "slew.profile.constants goes with expression"),
    "names": ({"expression": "a*t", "constants": {"b": 1}}, "slew.profile.expression is .* did you mean 'b'|known: b"),
    "grammar": ({"expression": "t.x"}, "Load.profile.expression is 't.x'; 't.x' at character 1 is not allowed"),
    "constant": ({"expression": "t", "constants": {"a": "1 N"}}, "Load.profile.constants is .* plain numbers"),
    "rise": ({"pulse": {"value": 1, "duration": 1, "rise": 0.6}}, r"slew\.profile\.pulse\.rise is 0\.6 s; .* half"),
    "end": (
        {"sine": {"amplitude": 1, "frequency": 1, "start": 2, "until": 1}},
        r"slew\.profile\.sine\.until is 1\.0 s; it must be after slew\.profile\.sine\.start, 2\.0 s",
    ),
    "frequency": ({"sine": {"amplitude": 1, "frequency": 0}}, "Load.profile.sine.frequency is 0; .* above 0"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    given, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        torque(given).assemble()
