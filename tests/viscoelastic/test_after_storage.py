"""Decisions after storage: values, derivatives, dispersions, designs and fits by its time, temperature and law."""

from __future__ import annotations

import functools
import html
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import evolvent
from evolvent import cases
from evolvent.analysis import storage
from evolvent.commands.storage import storage as command
from evolvent.design import calibration, dispersions, studies
from evolvent.design.optimization import search
from evolvent.exports import report
from evolvent.solvers.static import storage as static
from evolvent_base.errors import InputError

DAY = 86_400.0
YEAR = 365.25 * DAY
PRONY = "parts.hinge.viscoelastic.prony"
#: Torque of the case at once (N m), and its series.
TORQUE, SHARES, TIMES = 0.2 * np.radians(150.0), np.array([0.08, 0.08, 0.12]), np.array([3600.0, 30 * DAY, 3 * YEAR])
ENERGY, GAS, COLD = 80e3, 8.314462618, 293.15


@functools.cache
def content() -> dict[str, Any]:
    """The case of a panel that was stored for ten years."""
    return cases.content_of("hinge-stored")


@pytest.fixture(scope="module")
def array() -> evolvent.System:
    """The panel."""
    return evolvent.load("hinge-stored")


@pytest.fixture
def storages(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Times of the storages that are computed from here on."""
    found: list[float] = []
    own = static.store

    def counted(assembly: Any, time: float, *args: Any, **keys: Any) -> Any:
        found.append(time)
        return own(assembly, time, *args, **keys)

    monkeypatch.setattr(storage, "store", counted)
    return found


def left(time: float, temperature: float) -> float:
    """The torque after a storage."""
    shift = np.exp(ENERGY / GAS * (1.0 / temperature - 1.0 / COLD))
    return float(TORQUE * (1.0 - SHARES @ (1.0 - np.exp(-time / (shift * TIMES)))))


@pytest.mark.parametrize(
    "values",
    [
        {"store.time": "1 year", "store.temperature": "10 degC"},
        {"store.temperature": [["0 s", "20 degC"], ["10 years", "30 degC"]], "parts.hinge.stiffness": 0.25},
        {f"{PRONY}.1.0": 0.1, f"{PRONY}.2.1": "4 years"},
    ],
)
def test_values_give_what_a_case_with_them_gives(array: evolvent.System, values: dict[str, Any]) -> None:
    found = array.with_values(values).margin(motion=False).least
    assert found == evolvent.load(cases.content_of(content(), values)).margin(motion=False).least
    assert found != array.margin(motion=False).least
    assert "after storage for 10 years at 20 °C" in str(array.margin(motion=False).notes())


def test_a_unit_in_a_row_is_that_of_its_column() -> None:
    other = cases.load({**content(), "store": {"time": "1 h"}}, {f"{PRONY}.0.0": 0.1, f"{PRONY}.1.1": "40 days"})
    assert other.parts["hinge"].viscoelastic.prony == ((0.1, 3600.0), (0.08, 40.0 * DAY), (0.12, 3.0 * YEAR))


def test_a_storage_is_computed_once(array: evolvent.System, storages: list[float]) -> None:
    own = array.with_values({"store.time": "2 years", "simulate.until": "0.2 s"})
    least = own.margin(motion=False).least
    run = own.simulate(fine=False)
    assert own.storage(motion=False).margins[1].least == own.margin(motion=False).least == least
    assert len(storages) == 2  # the results of `storage` show its course
    assert float(run["hinge"].torque[0]) == own.with_values({"simulate.until": "0.1 s"}).simulate()["hinge"].torque[0]
    assert len(storages) == 2
    own.with_values({"hinge.stiffness": 0.21}).margin(motion=False)
    own.settings["until"], own.sections["store"] = "0.1 s", {"time": "3 years"}
    own.simulate()
    assert storages[2:] == [2.0 * YEAR, 3.0 * YEAR]


def test_derivatives_by_storage_are_those_of_the_closed_form(array: evolvent.System) -> None:
    keys = ["store.time", "store.temperature", f"{PRONY}.2.0", f"{PRONY}.2.1"]
    own = array.with_values({"simulate.until": "0.1 s"})
    found = own.sensitivity(["hinge.torque.max"], keys, check=False).dataset
    time = 10.0 * YEAR
    assert float(found.result[0]) == pytest.approx(left(time, COLD), rel=1e-9)
    rates = SHARES / TIMES * np.exp(-time / TIMES)
    shift = -ENERGY / (GAS * COLD**2)  # derivative of ln a
    exact = [
        -TORQUE * rates.sum(),
        TORQUE * rates.sum() * time * shift,
        -TORQUE * (1.0 - np.exp(-time / TIMES[2])),
        TORQUE * rates[2] * time / TIMES[2],
    ]
    assert found.derivative.values[0] == pytest.approx(np.array(exact), rel=1e-5)
    assert list(found.key_unit.values) == ["s", "K", "1", "s"]


def test_dispersions_of_time_temperature_law_and_stiffness(
    array: evolvent.System, tmp_path: Path, storages: list[float]
) -> None:
    over = {
        "store.time": "uniform(8 years, 12 years)", "store.temperature": "uniform(10 degC, 30 degC)",
        "parts.hinge.stiffness": "5%", f"{PRONY}.2.0": "10%",
    }  # fmt: skip
    asked = studies.read(
        {"study": "s", "case": content(), "sample": "monte-carlo", "samples": 9, "over": over, "keep": ["hinge.margin"]}
    )
    before = len(storages)
    found = dispersions.disperse(asked, coverage=0.7, confidence=0.9, output=tmp_path / "d", workers=1)
    assert len(storages) - before <= 9 + 5  # and the case itself, and what is checked before
    margins = [array.with_values(asked.overrides(k)).margin(motion=False).least for k in range(9)]
    (one,) = found.outputs
    assert one.lower.value == min(margins)


def test_sweeps_over_time_and_temperature(array: evolvent.System, tmp_path: Path) -> None:
    over = {
        "store.time": {"from": "1 day", "to": "10000 days", "points": 3, "spacing": "log"},
        "store.temperature": ["0 degC", "20 degC"],
    }
    asked = {"study": "s", "case": content(), "sample": "grid", "over": over, "keep": ["hinge.margin"]}
    found = studies.sweep(asked, output=tmp_path / "s", workers=1)
    margins = found.hinge_margin.values
    assert found["store.time"].values == pytest.approx([DAY, 100 * DAY, 1e4 * DAY])
    assert np.all(np.diff(margins, axis=0) < 0.0)
    assert np.all(np.diff(margins, axis=1) < 0.0)
    values = {"store.time": "100 days", "store.temperature": "20 degC"}
    assert margins[1, 1] == pytest.approx(array.with_values(values).margin(motion=False).least, rel=1e-9)


def test_a_design_holds_its_margin_after_storage(array: evolvent.System) -> None:
    found = search.optimize(
        cases.content_of(content(), {"simulate.until": "0.1 s"}), vary={"parts.hinge.stiffness": "0.2 to 2 N m/rad"},
        minimize=["hinge.torque.max"], subject_to=["hinge.margin >= 0"], workers=1,
    )  # fmt: skip
    stiffness = found.values["parts.hinge.stiffness"]
    assert array.with_values({"hinge.stiffness": stiffness}).margin(motion=False).least == pytest.approx(0.0, abs=1e-5)
    fresh = array.with_values({"hinge.stiffness": stiffness, "store": None})
    assert fresh.margin(motion=False).least > 1.0


def test_a_fit_of_a_stored_case(tmp_path: Path) -> None:
    own = {name: value for name, value in content().items() if name != "margin"}
    own["simulate"] = {"until": "0.1 s", "every": "0.05 s"}
    rows = [f"{t},{left(10.0 * YEAR, 297.0)!r}" for t in (0.0, 0.05, 0.1)]
    (tmp_path / "torque.csv").write_text("\n".join(["t,torque", *rows]), encoding="utf-8")
    options: Any = {"observe": ["hinge.torque=torque"]}
    for key, exact in (("store.temperature", 297.0), (f"{PRONY}.2.1", 3.0 * YEAR * left_time(297.0))):
        found = calibration.calibrate(own, str(tmp_path / "torque.csv"), fit=[key], **options)
        assert found.values[0] == pytest.approx(exact, rel=1e-4)


def left_time(temperature: float) -> float:
    """Factor of the relaxation times at a temperature."""
    return float(np.exp(ENERGY / GAS * (1.0 / temperature - 1.0 / COLD)))


def test_the_report_says_how_long_and_shows_margins_before_and_after(tmp_path: Path, storages: list[float]) -> None:
    run = evolvent.run(cases.content_of(content(), {"simulate.until": "0.2 s"}))
    storages.clear()
    report.write(run, str(tmp_path / "report.html"))
    assert len(storages) == 1
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    words = html.unescape(" ".join(re.sub(r"<[^>]+>", " ", text).split()))
    assert "10 years at 20 °C" in words
    assert "hinge motorization +0.3963 -0.5662 NEGATIVE" in words
    assert "After storage for 10 years at 20 °C." in words
    assert "Margins before and after storage" in text


@pytest.mark.parametrize(
    ("store", "sentence"),
    [
        ({"time": "-1 h"}, "store.time is '-1 h'; it must be a time above 0"),
        ({}, "store.time is missing"),
        ({"time": "1 h", "temperature": "-300 degC"}, "store.temperature is '-300 degC'; it must be an absolute temp"),
        (
            {"time": "1 h", "temperature": [["1 h", "20 degC"], ["1 h", "40 degC"]]},
            "store.temperature is .*; its times must rise; row 2 is at 1 h, not after the row before",
        ),
        ({"time": "1 h", "temperature": "1 K"}, "store.temperature is '1 K'; .* of 100 K or above and up to 1000 K"),
        (
            {"time": "1 h", "temperature": [["0 h", "20 degC"], ["1 h", "warm"]]},
            "store.temperature.1.1 is 'warm'; it must be an absolute temperature",
        ),
        (
            {"time": "1 h", "temperature": [["0 h", "20 degC"], ["1 h", "-200 degC"]]},
            "store.temperature.1.1 is '-200 degC'; .* of 100 K or above",
        ),
        (
            {"time": "1 h", "temperature": [["0 h", "20 degC"], ["1 h"]]},
            r"every row of it must have two values, \[time, temperature\]; row 2 is \['1 h'\]",
        ),
        ({"time": "1 h", "warm": True}, "unknown key 'store.warm'"),
    ],
)
def test_a_storage_that_cannot_be_is_one_sentence(store: Any, sentence: str) -> None:
    parts = {name: cases.load(content()).parts[name] for name in content()["parts"]}
    system = evolvent.System(sections={"store": store})
    for name, part in parts.items():
        system.add(part, name)
    with pytest.raises(InputError, match=sentence):
        system.assemble()
    with pytest.raises(InputError, match=sentence):
        evolvent.load({**content(), "store": store}).margin(motion=False)


def test_systems_without_storage_are_named() -> None:
    with pytest.raises(InputError, match=r"there is no key 'store\.time': the system is not stored"):
        evolvent.load("solar-array").sensitivity(["hinge 1.latch_time"], ["store.time"])
    with pytest.raises(InputError, match="unknown key 'store'"):
        cases.load("heliogyro", {"store.time": "1 year"})
    found = CliRunner().invoke(command, ["heliogyro"])
    assert "the system 'heliogyro' has no key `store`" in str(found.exception)


def test_keys_of_a_choice_have_derivatives(array: evolvent.System) -> None:
    """By the activation energy, whose section has its name between the keys."""
    warm, time = 303.15, 10.0 * YEAR
    own = array.with_values({"simulate.until": "0.1 s", "store.temperature": warm})
    key = "parts.hinge.viscoelastic.shift.arrhenius.energy"
    found = own.sensitivity(["hinge.torque.max"], [key], check=False).dataset
    off = (1.0 / warm - 1.0 / COLD) / GAS  # derivative of ln a
    times = time / (TIMES * np.exp(ENERGY * off))
    assert float(found.derivative[0, 0]) == pytest.approx(TORQUE * off * (SHARES * times) @ np.exp(-times), rel=1e-5)
