"""Factors of margins: the standards' tables against vectors by hand, and refusals of tables."""

import math

import numpy as np
import pytest

from evolvent.analysis.margins import factors
from evolvent.analysis.margins.keys import Margin, MarginLine, MarginPart
from evolvent_base.errors import InputError

ECSS = {"spring": 0.05, "friction": 0.10, "hysteresis": 0.02, "harness": 0.08, "acceleration": 0.2}


@pytest.mark.parametrize(("evidence", "least", "spring"), [("theoretical", 1.57, 1.9625), ("measured", 0.97, 1.2125)])
def test_ecss_by_hand(evidence, least, spring):
    name, one = factors.standard("ECSS-E-ST-33-01C")
    resists = {(category, evidence): value for category, value in ECSS.items()}
    assert one.required("motorization", resists) == pytest.approx(least, abs=1e-12)
    assert least / one.driving["spring"] == pytest.approx(spring, abs=1e-12)
    assert one.margin("motorization", {"spring": spring}, resists) == pytest.approx(0.0, abs=1e-12)
    assert one.margin("motorization", {"motor": 2.0 * least}, resists) == pytest.approx(1.0, abs=1e-12)
    assert "2009" in one.revision
    assert name == "ECSS-E-ST-33-01C"


def test_ecss_every_factor():
    _, one = factors.standard("ECSS-E-ST-33-01C")
    words = (
        "inertia",
        "spring",
        "motor losses",
        "friction",
        "hysteresis",
        "harness",
        "adhesion",
        "acceleration",
        "load",
    )
    found = {word: [one.required("motorization", {(word, e): 1.0}) for e in one.evidence] for word in words}
    assert found == {
        "inertia": [2.2, 2.2], "spring": [2.4, 2.4], "motor losses": [3.0, 2.4], "friction": [6.0, 3.0],
        "hysteresis": [6.0, 3.0], "harness": [6.0, 3.0], "adhesion": [6.0, 6.0], "acceleration": [1.25, 1.25],
        "load": [1.0, 1.0],
    }  # fmt: skip
    assert one.driving == {"motor": 1.0, "spring": 0.8, "inertia": 0.9, "load": 1.0}


@pytest.mark.parametrize(
    ("evidence", "fixed", "variable", "acceleration"),
    [
        ("analysis", 1.50, 3.00, 1.25),
        ("ambient test", 1.35, 2.50, 1.15),
        ("environmental extremes", 1.25, 2.00, 1.10),
        ("spring out", 1.00, 1.00, 1.00),
    ],
)
def test_nasa_by_hand(evidence, fixed, variable, acceleration):
    _, one = factors.standard("NASA-STD-5017B")
    resists = {("spring", evidence): 0.05, ("friction", evidence): 0.20, ("acceleration", evidence): 0.20}
    still = fixed * 0.05 + variable * 0.20
    drives = {"motor": 1.0}
    assert one.margin("static", drives, resists) == pytest.approx(1.0 / still - 1.0, abs=1e-12)
    moving = still + acceleration * 0.20
    assert one.margin("dynamic", drives, resists) == pytest.approx(1.0 / moving - 1.0, abs=1e-12)


def test_nasa_numbers():
    _, one = factors.standard("NASA-STD-5017B")
    found = [
        [
            one.margin(name, {"motor": 1.0}, {("spring", e): 0.05, ("friction", e): 0.2, ("acceleration", e): 0.2})
            for e in one.evidence[:3]
        ]
        for name in ("static", "dynamic")
    ]
    assert np.round(found, 4).tolist() == [[0.4815, 0.7621, 1.1622], [0.0811, 0.2539, 0.4652]]


def test_aiaa():
    _, one = factors.standard("AIAA S-114")
    resists = {("friction", "any"): 0.3, ("acceleration", "any"): 0.2}
    assert one.margin("static", {"spring": 0.6}, resists) == pytest.approx(0.0, abs=1e-12)  # 100 %
    assert one.margin("dynamic", {"spring": 0.3 + 1.25 * 0.2}, resists) == pytest.approx(0.0, abs=1e-12)  # 25 %


def test_margin_without_resistance_or_drive():
    assert factors.ratio(1.0, 0.0) == math.inf
    assert factors.ratio(0.0, 1.0) == -1.0
    assert factors.ratio(0.0, 0.0) == -1.0
    assert factors.ratio(np.array([3.0, 0.0]), 1.5).tolist() == [1.0, -1.0]


def test_own_table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = (
        "revision: draft\nevidence: [guess]\ndriving: {spring: 0.5}\nrequirements: {all: {resisting: {friction: 4}}}\n"
    )
    (tmp_path / "own.yaml").write_text(table)
    name, one = factors.standard("own.yaml")
    assert (name, one.required("all", {("friction", "guess"): 0.5})) == ("own.yaml", 2.0)
    (tmp_path / "own.yaml").write_text("Ours:\n" + "".join(f"  {line}\n" for line in table.splitlines()))
    assert factors.standard("own.yaml")[0] == "Ours"
    (tmp_path / "own.yaml").write_text(table.replace("friction", "fricton"))
    with pytest.raises(
        InputError, match=r"own.yaml: requirements.all.resisting has 'fricton'; did you mean 'friction'"
    ):
        factors.standard("own.yaml")
    (tmp_path / "own.yaml").write_text(table.replace("4", "{measured: 4}"))
    with pytest.raises(InputError, match="one number for each of guess"):
        factors.standard("own.yaml")
    (tmp_path / "own.yaml").write_text(table.replace("4", "-1"))
    with pytest.raises(InputError, match="a factor is a number from 0"):
        factors.standard("own.yaml")


def test_refused_keys():
    with pytest.raises(InputError, match=r"factors is 'ECSS'.*ECSS-E-ST-33-01C"):
        factors.standard("ECSS")
    with pytest.raises(InputError, match=r"Margin.zero.0 is 'frictoin'; did you mean 'friction'"):
        Margin(zero=("frictoin",))
    with pytest.raises(InputError, match=r"MarginPart.category is 'cable'"):
        MarginPart(category="cable")
    with pytest.raises(InputError, match="acceleration and duration of a coordinate are both given"):
        MarginLine(acceleration="1 rad/s^2", duration="2 s")
    with pytest.raises(InputError, match=r"unknown key 'Margin.station'; did you mean 'Margin.stations'"):
        Margin(station=3)
