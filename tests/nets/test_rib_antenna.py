"""A net on ribs that unfold: form, cut lengths, balance of a rib, deployment; the case `rib-antenna` in small."""

from __future__ import annotations

import functools
import math
import pathlib
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import evolvent as ev
from book import Book
from evolvent import System, cases
from evolvent.analysis.margins.results import least_of
from evolvent.nets import form
from evolvent_base.errors import InputError
from margin_cases import NONE

CHAPTER = "Threads, reels, tethers"
FOLD = math.radians(70.0)
RIBS = 6
#: Angle of the root's tangent where the ribs are unfolded.
ROOT = math.atan(0.6 / (2.0 * 9.6))


def content(**net: Any) -> dict[str, Any]:
    """The case with six ribs and two stations; keys of the net in place of its own."""
    found: dict[str, Any] = cases.content_of("rib-antenna")
    parts = found["parts"]
    for part in parts.values():
        if "repeat" in part:
            part["repeat"] = part["repeat"] | {"count": RIBS}
    parts["rib"] |= {"elements": 3, "stiffness_damping": 0.3}
    parts["spring"] |= {"stiffness": 40.0, "damping": 600.0, "latch_damping": 5000.0}
    topology = {"gores": {"ribs": RIBS, "stations": 2, "across": 2, "inner_radius": 4.5}}
    parts["net"] |= {"topology": topology, "damping": 0.05} | net
    return found


def deployed(**net: Any) -> System:
    """The same antenna whose ribs are written where they are unfolded."""
    found = content(**net)
    parts = found["parts"]
    parts["rib"] |= {
        "direction": [math.cos(ROOT), 0.0, math.sin(ROOT)], "normal": [-math.sin(ROOT), 0.0, math.cos(ROOT)],
    }  # fmt: skip
    parts["spring"]["start"] = 0.0
    del parts["net"]["unfold"]
    return ev.load(found)


@functools.cache
def folded() -> Any:
    """The antenna as a reflector, from where it is folded."""
    return ev.load(content()).reflector()


@pytest.fixture(scope="module")
def cut(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A file of the lengths to which its cords are cut."""
    path: pathlib.Path = tmp_path_factory.mktemp("cut") / "cut.json"
    folded().save(path)
    return str(path)


def test_unfolded_or_written_so() -> None:
    """The same net on ribs that unfold, and on ribs that are written where they are then."""
    other = deployed().reflector()
    np.testing.assert_allclose(folded().x, other.x, atol=1e-8)
    np.testing.assert_allclose(folded().cut_lengths, other.cut_lengths, rtol=1e-9)
    assert folded().tension.min() > 0.0


def test_moment_at_the_hinge(cut: str, book: Book) -> None:
    """The latch and the spring hold the moment of all cords on a rib about its hinge."""
    run = deployed(cut=cut).equilibrium()
    net, x = run["net"], run["net"].position.values[-1]
    a, b = net.cord_nodes.values.T
    pull = (net.tension.values / net.length.values)[-1][:, None] * (x[b] - x[a])
    own = [2 * RIBS * k for k in range(3)]
    force = np.array([pull[a == k].sum(axis=0) - pull[b == k].sum(axis=0) for k in own])
    moment = np.cross(x[own] - [0.6, 0.0, 0.009375], force).sum(axis=0) @ [0.0, -1.0, 0.0]
    torque = float(run["spring 1"].torque.values[-1])
    book(
        CHAPTER, "Moment of the cords on a rib about its hinge", reference="torque of the latch and the spring",
        source="equilibrium", error=abs(abs(torque / moment) - 1.0), allowed=1e-6,
    )  # fmt: skip
    tip = run["rib 1"].position.values[-1][-1]
    assert 1e-3 < 11.8805 - tip[0] + tip[2] - 3.6757 < 0.5  # it is bent inwards and up


def test_deployment(cut: str, book: Book) -> None:
    """Slack at the start; after the deployment the nodes swing about the places that the reflector has."""
    run = ev.load(content(cut=cut)).simulate(until=40.0, every=0.25)
    net, found = run["net"], folded()
    assert int(net.slack_cords.values[0]) == len(found.tension)
    assert float(net.largest_tension.values[0]) == 0.0
    assert int(net.slack_cords.values[-1]) == 0
    assert len(run.attrs["latches"].split(";")) == RIBS
    mean = net.position.values[run.time.values > 16.0].mean(axis=0)
    off = np.linalg.norm(mean - found.x, axis=1)
    bent = float(np.linalg.norm(found.x[found.topology.rim] - deployed_rim(), axis=1).max())
    book(
        CHAPTER, "Rib antenna after its deployment, nodes on the ribs", reference="reflector", source="equilibrium",
        error=float(off[found.topology.rim].max()) / bent, allowed=2e-2,
    )  # fmt: skip
    assert off.max() < 0.1 * bent  # nodes between the ribs still swing
    assert found.error_of(mean).fit.rms == pytest.approx(found.error.fit.rms, rel=1e-2)
    moved, defect = float(run["energy_moved"].values[-1]), float(np.abs(run["energy_defect"].values).max())
    book(
        CHAPTER, "Rib antenna that deploys its net, energy balance", reference="closed", source="invariant",
        error=defect / moved, allowed=1e-4,
    )  # fmt: skip


def test_margins_with_the_net(tmp_path: pathlib.Path, book: Book) -> None:
    """The net resists where it is taut: all hinges together do its work, and it is that of the reflector at the end."""
    still = content()
    still["parts"]["spring"]["latch_stiffness"] = 1e9  # the reflector stands at the end of the travel
    reflector = ev.load(still).reflector()
    reflector.save(tmp_path / "cut.json")
    still["parts"]["net"]["cut"] = str(tmp_path / "cut.json")
    still["margin"] = {"others": "together", "stations": 3, "zero": NONE}
    found = ev.load(still).margin(motion=False)
    table = found["spring 1"]
    (last,) = table.slack
    own = table.values[[one.label for one in table.shares].index("net")]
    assert np.all(own[: last + 1] == 0.0)
    assert np.all(own[last + 1 :] < 0.0)
    assert least_of(table)[1] == table.x.size - 1  # at the latch
    for n in range(2, RIBS + 1):
        other = found[f"spring {n}"]
        assert other.values[[one.label for one in other.shares].index("net")] == pytest.approx(own, rel=1e-6, abs=1e-9)
    natural, tension = reflector.cut_lengths, reflector.tension
    energy = float(0.5 * np.sum(tension**2 * natural) / 5e3)
    work = RIBS * abs(float(integrate.simpson(own[last:], x=table.x[last:])))
    book(
        CHAPTER, "Work of the hinges on a net from where it is taut", reference="energy of the net as a reflector",
        source="equilibrium", error=abs(work / energy - 1.0), allowed=5e-3,
    )  # fmt: skip


def deployed_rim() -> Any:
    """Nodes of the rim on ribs that nothing bends."""
    part = deployed().parts["rib 1"]
    x, turn = part.start_nodes()[0][1:], 2.0 * math.pi / RIBS
    rows = []
    for at in x:
        for s in range(RIBS):
            c, n = math.cos(turn * s), math.sin(turn * s)
            rows.append([c * at[0] - n * at[1], n * at[0] + c * at[1], at[2]])
    return np.array(rows)


def test_rear_net_hung_between_the_ribs(book: Book) -> None:
    """Its ties pull the nodes of the gores onto the surface, and all nodes between ribs are in equilibrium."""
    ties = {"hung": {"drop": 3.0, "stiffness": 5e3}}
    found, plain = ev.load(content(ties=ties)).reflector(), folded()
    n, topology = len(found.topology.plan), found.topology
    free, x = topology.free, found.x
    off = x[free, 2] - found.net.surface.height(*x[free, :2].T)
    assert np.abs(plain.x[free, 2] - plain.net.surface.height(*plain.x[free, :2].T)).max() > 0.3
    assert np.abs(off).max() < 1e-6
    assert found.tension.min() > 0.0
    assert found.error.fit.rms < 0.5 * plain.error.fit.rms
    a, b = np.array(found.to_dict()["cords"]).T
    pull = (found.tension / found.length)[:, None] * (x[b] - x[a])
    force = np.zeros((len(x), 3))
    np.add.at(force, a, pull)
    np.add.at(force, b, -pull)
    book(
        CHAPTER, "Nodes of a net and of a rear net hung between ribs, sum of the tensions", reference="0",
        source="equilibrium", error=float(np.abs(force[np.concatenate([free, free + n])]).max() / found.tension.max()),
        allowed=1e-8,
    )  # fmt: skip


def test_a_rear_net_above_the_net() -> None:
    """Standoffs that are too short are refused, and a rim of its own."""
    with pytest.raises(InputError, match="the rear net comes above the net at node"):
        ev.load(content(ties={"hung": {"drop": 0.3, "stiffness": 5e3}})).assemble()
    with pytest.raises(InputError, match=r"rear_rim is given, but net\.ties are not of the kind 'rear'"):
        ev.load(content(ties={"hung": {"drop": 3.0, "stiffness": 5e3}}, rear_rim=["rib"])).assemble()


def test_slack_nodes() -> None:
    """A chain that is longer than the distance of its ends has nodes between them, with slack cords."""
    x = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    cords = np.array([[0, 1], [1, 2], [2, 3]])
    length = np.array([0.2, 0.6, 0.25])
    found = form.slack_form(x, np.array([1, 2]), cords, length)
    assert (np.linalg.norm(np.diff(found, axis=0), axis=1) < length).all()


@pytest.mark.parametrize(
    ("net", "sentence"),
    [
        ({"unfold": ["hinge"]}, "unfold names 'hinge 1'; it must be a joint spring"),
        ({"unfold": ["sprung"]}, "unfold names 'sprung'"),
        ({"unfold": []}, "the nearest node to rim node"),
        ({"topology": {"gores": {"ribs": 6, "stations": 9, "inner_radius": 4.5}}}, "nearest to one node"),
    ],
)
def test_refusals(net: dict[str, Any], sentence: str) -> None:
    """What cannot unfold is refused by one sentence."""
    with pytest.raises(InputError, match=sentence):
        ev.load(content(**net)).assemble()


def test_a_closed_loop_does_not_unfold() -> None:
    """Ribs that are joined with one another cannot turn alone."""
    found = content()
    net = found["parts"].pop("net")
    found["parts"] |= {"bar": {"kind": "joint", "type": "clamp", "a": "rib 1.tip", "b": "hub"}, "net": net}
    with pytest.raises(InputError, match="cannot all be at 0: other joints stop them after 0 %"):
        ev.load(found).assemble()


def test_error_of_other_positions() -> None:
    """Of the nodes that it has it is the reflector's own; other shapes are refused."""
    found = folded()
    assert found.error_of(found.net.in_place(found.x)).fit.rms == pytest.approx(found.error.fit.rms, rel=1e-12)
    with pytest.raises(InputError, match=r"position has the shape \(3,\)"):
        found.error_of([0.0, 0.0, 0.0])
