"""Curved ribs with a net between them, wound on a hub, held, released and deployed; `rib-antenna-wound` in small."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import evolvent as ev
from book import Book
from evolvent import cases
from evolvent.analysis.margins.elastic import Elastic
from evolvent.analysis.reflector_after import last_swing
from evolvent_base.errors import InputError

CHAPTER = "Threads, reels, tethers"
#: m, N m2, kg/m: hub, ribs of 5 radii, bending stiffness of the strip to the hub, mass per length.
RADIUS, LENGTH, STIFFNESS = 0.3, 1.5, 147e9 * 0.03 * 0.0003**3 / 12.0
FOCAL, RELEASE, UNTIL = 2.4, 9.2, 22.0


def content() -> dict[str, Any]:
    """Three short ribs on a small hub; times and drags are those of their motion."""
    found: dict[str, Any] = cases.content_of("rib-antenna-wound")
    parts = found["parts"]
    for part in parts.values():
        if "repeat" in part:
            part["repeat"] = part["repeat"] | {"count": 3}
    slope, height = RADIUS / (2.0 * FOCAL), RADIUS**2 / (4.0 * FOCAL)
    cosine = 1.0 / math.hypot(1.0, slope)
    parts["hub"]["shape"] = {"cylinder": {"radius": RADIUS, "length": 1.0, "axis": [0.0, 0.0, 1.0]}}
    parts["turn"]["drive"] = {"expression": "4*pi*min(t/9, 1)**3*(10 - 15*min(t/9, 1) + 6*min(t/9, 1)**2)"}
    parts["rib"] |= {
        "length": LENGTH, "shape": {"parabola": {"focal_length": FOCAL, "offset": RADIUS}}, "elements": 6,
        "position": [RADIUS, 0.0, height], "stiffness_damping": 0.05,
        "direction": [0.0, -cosine, slope * cosine], "normal": [0.0, slope * cosine, cosine],
    }  # fmt: skip
    parts["hinge"]["a"] = ["hub", [RADIUS, 0.0, height]]
    parts["spring"] |= {"damping": 0.005, "stiffness": 0.006}
    parts["coil"] |= {"shape": {"cylinder": {"radius": RADIUS}}, "stiffness": "100 N/m"}
    angle = LENGTH / RADIUS
    parts["lanyard"] |= {
        "a": ["hub", [RADIUS * math.cos(angle), -RADIUS * math.sin(angle), 0.1]],
        "law": f"where(t > 5, where(t < {RELEASE}, min(max(20*(x - 0.3*max(7 - t, 0)), 0), 2), 0), 0)",
    }
    wound = f"where(t < {RELEASE}, 40, 1)"
    parts["drag"] = {"kind": "field", "law": [f"-{wound}*v{axis}" for axis in "xyz"]}
    parts["net"] |= {
        "surface": {"paraboloid": {"focal_length": FOCAL, "diameter": 3.4}},
        "topology": {"gores": {"ribs": 3, "stations": 2, "across": 2, "inner_radius": 0.75}},
        "force_density": 2e-3, "damping": 0.05,
    }  # fmt: skip
    found["simulate"] |= {"until": UNTIL, "every": 0.1}
    return found


@pytest.fixture(scope="module")
def run() -> Any:
    """The whole way, from the ribs along the tangents to the deployed antenna."""
    return ev.load(content()).simulate()


@pytest.fixture(scope="module")
def after(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The antenna as a reflector, with the surface at the end of the run."""
    path: pathlib.Path = tmp_path_factory.mktemp("run") / "run.nc"
    ev.save(run, path)
    return ev.load(content()).reflector(after=str(path))


def test_wound_and_held(run: Any, book: Book) -> None:
    """On the hub the ribs have the moment EI/R, and the energy of an arc but for their ends, which have no moment."""
    at = int(np.searchsorted(run.time.values, RELEASE - 0.1))
    moment = run["rib 1"].bending_moment_y.values[at][1:-1]
    book(
        CHAPTER, "Rib wound on a hub, mean moment away from its ends", reference="EI/R", source="closed form",
        error=abs(float(np.abs(moment).mean()) * RADIUS / STIFFNESS - 1.0), allowed=3e-2,
    )  # fmt: skip
    stored = float(run["rib 1"].energy_bending.values[at]) / (0.5 * STIFFNESS * LENGTH / RADIUS**2)
    assert 4.0 / 6.0 < stored < 1.0
    assert float(run["lanyard 1"].force.values[at]) > 0.0
    assert float(run["lanyard 1"].force.values[-1]) == 0.0


def test_slack_net_is_calm(run: Any) -> None:
    """Before the release few cords become taut at all, none while the ribs are held, and cords have no energy then."""
    net, t = run["net"], run.time.values
    slack = net.slack_cords.values
    assert slack[0] == len(net.cord)
    assert np.abs(np.diff(slack[t < RELEASE])).sum() <= len(net.cord)
    held = (t > 8.0) & (t < RELEASE)
    assert (slack[held] == len(net.cord)).all()
    assert float(net.energy_elastic.values[held].max()) == 0.0


def test_deployed(run: Any, after: Any, book: Book) -> None:
    """All ribs latch, the cords are taut, and the surface is that of the equilibrium."""
    assert len(run.attrs["latches"].split(";")) == 3
    assert int(run["net"].slack_cords.values[-1]) == 0
    found = after.after
    assert found.slack == 0
    assert found.moved < 2e-2
    book(
        CHAPTER, "Wound antenna after its deployment, rms of half the path", reference="reflector",
        source="equilibrium", error=abs(found.error.half_path / after.error.half_path - 1.0), allowed=1e-2,
    )  # fmt: skip
    assert run["net"].surface_error.values[-1] == pytest.approx(after.error.at_nodes, rel=2e-2)
    assert "Surface after the run" in str(after)


def test_latch(run: Any) -> None:
    """The spring's moment stays on the latch; its peak is below that of a rigid rib of the same rate."""
    spring = run["spring 1"]
    rigid = float(spring.latch_rate.values[-1]) * math.sqrt(2.0 * 1600.0 * 0.03 * 0.0003 * LENGTH**3 / 3.0)
    peak = abs(float(spring.latch_torque_peak.values[-1]))
    assert 0.0 < peak < abs(rigid)
    held = 0.006 * (math.radians(120.0) - float(spring.angle.values[-1]))
    assert abs(float(spring.latch_torque.values[-1])) == pytest.approx(held, rel=0.1)


def test_energy(run: Any, book: Book) -> None:
    """All that the hub puts in is stored, or taken by drag, dampers and friction."""
    moved, defect = float(run["energy_moved"].values[-1]), float(np.abs(run["energy_defect"].values).max())
    book(
        CHAPTER, "Ribs and net wound, released and deployed, energy balance", reference="closed", source="invariant",
        error=defect / moved, allowed=1e-4,
    )  # fmt: skip


def test_last_swing() -> None:
    """A swing is averaged over its period; what does not swing is taken at its end."""
    t = np.linspace(0.0, 40.0, 401)
    first = last_swing(t, 1.0 + np.exp(-0.01 * t) * np.cos(2.0 * np.pi * t / 4.0))
    assert t[-1] - t[first] == pytest.approx(4.0, abs=0.15)
    assert last_swing(t, np.exp(-t)) == len(t) - 1


def test_after_is_refused(run: Any, tmp_path: pathlib.Path) -> None:
    """A run of another system is refused by one sentence."""
    path = tmp_path / "other.nc"
    ev.save(ev.run("boom-slew", {"simulate.until": 0.1}), path)
    with pytest.raises(InputError, match="a run without positions of the net 'net'"):
        ev.load(content()).reflector(after=str(path))


def test_margin_of_the_hinge() -> None:
    """A rib that has left the hub is opened by its spring against friction alone: least where it latches."""
    found = content()
    parts = found["parts"]
    for part in parts.values():
        if "repeat" in part:
            part["repeat"] = {"count": 1}
    parts["rib"]["elements"] = 2
    del parts["net"]
    zero = ["hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
    with pytest.raises(InputError, match=r"no equilibrium that is found beyond -1\.5708 rad"):
        ev.load(content()).margin(motion=False)
    margins = ev.load(found).margin(motion=False, zero=zero, stations=5)
    spring, friction = 0.006 * math.radians(120.0), 5e-4
    assert margins.least == pytest.approx(0.8 * spring / (2.0 * 3.0 * friction) - 1.0, rel=1e-6)


def test_hinges_together_stretch_the_net_and_bend_the_ribs(monkeypatch: pytest.MonkeyPatch) -> None:
    """What all hinges do to net and ribs, by Simpson's rule from where cords are slack, is their elastic energy."""
    own, energies = Elastic.energy, dict[float, float]()

    def energy(elastic: Elastic, at: Any) -> float:
        return energies.setdefault(round(float(at.x[0]), 9), own(elastic, at))

    monkeypatch.setattr(Elastic, "energy", energy)
    case = content()
    case["parts"]["rib"]["elements"] = 3
    lines = {f"spring {n}": {"travel": ["-20 deg", "0 deg"]} for n in (1, 2, 3)}
    zero = ["hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
    found = ev.load(case).margin(motion=False, others="together", stations=13, lines=lines, zero=zero)
    tables = [found[name] for name in lines]
    x, (last,) = tables[0].x, tables[0].slack
    elastic = np.array([share.part == "net" or share.part.startswith("rib") for share in tables[0].shares])
    given = sum(table.values[elastic].sum(axis=0) for table in tables)
    work = -integrate.cumulative_simpson(given[last:], x=x[last:], initial=0.0)
    stored = np.array([energies[round(float(one), 9)] for one in x[last:]])
    assert stored.max() > 2.0 * stored[-1] > 0.0  # ribs are bent on the way
    assert work == pytest.approx(stored, abs=0.01 * float(stored.max()))
